"""Known answers as traces: what the suite holds runs against."""

from __future__ import annotations

import dataclasses

import pytest

from carom import compare, solve_pic
from carom.comparator import Grade
from carom.conformance.suite_scenes import CATALOGUE_SCENES, known_trace
from carom.errors import InputError
from carom.scenes import all_scenes


def test_a_known_answer_and_pic_are_the_same_trace() -> None:
    """Of every scene of the suite, the trace from the closed form and PIC's agree to rounding, normals included."""
    for name in CATALOGUE_SCENES:
        entry = all_scenes()[name]
        reference, pic = known_trace(entry.scene, entry.known), solve_pic(entry.scene)
        score = compare(reference, pic, sampling=pic)
        assert score.grade is Grade.EXACT, name
        # A graze turns its normal by 1 / sqrt(1 - .999^2), 22 times the rounding of its positions.
        assert max((error.normal_rad for error in score.errors), default=0.0) < 1e-11, name
        assert score.total.final_position < 1e-11, name
        assert not score.total.final_spin > 1e-11, name  # NaN where nothing turns


def test_an_answer_that_does_not_tell_every_spin_makes_no_trace() -> None:
    """Where something turns, a known impact without the spins after it is not enough, nor is what is conserved."""
    gas = all_scenes()["classics/gas"]
    with pytest.raises(InputError, match="classics/gas"):
        known_trace(gas.scene, gas.known)
    entry = all_scenes()["spin/english-stick"]
    (impact,) = entry.known.impacts
    silent = dataclasses.replace(entry.known, impacts=(dataclasses.replace(impact, spin_second_after=None),))
    with pytest.raises(InputError, match=r"lacks the spins after 0\.42 s"):
        known_trace(entry.scene, silent)
