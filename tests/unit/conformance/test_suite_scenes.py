"""Known answers as traces: what the suite holds runs against."""

from __future__ import annotations

import pytest

from carom import compare, solve_pic
from carom.comparator import Grade
from carom.conformance.suite_scenes import CATALOGUE_SCENES, known_trace
from carom.errors import InputError
from carom.scenes import catalogue


@pytest.mark.parametrize("name", CATALOGUE_SCENES)
def test_a_known_answer_and_pic_are_the_same_trace(name: str) -> None:
    """Of every scene of the suite, the trace from the closed form and PIC's agree to rounding, normals included."""
    entry = catalogue()[name]
    reference, pic = known_trace(entry.scene, entry.known), solve_pic(entry.scene)
    score = compare(reference, pic, sampling=pic)
    assert score.grade is Grade.EXACT
    # A graze turns its normal by 1 / sqrt(1 - .999^2), 22 times the rounding of its positions.
    assert max((error.normal_rad for error in score.errors), default=0.0) < 1e-11
    assert score.total.final_position < 1e-11


def test_an_answer_that_does_not_tell_every_impact_makes_no_trace() -> None:
    """A scene of which only conserved quantities are known has no trace."""
    entry = catalogue()["classics/gas"]
    with pytest.raises(InputError, match="classics/gas"):
        known_trace(entry.scene, entry.known)
