"""The answers of the conformance suite, and runs of Carom's own methods in this process."""

import dataclasses
import re
from contextlib import closing
from pathlib import Path

import pytest
from tests.cases import each, release_after

from carom import compare, solve_pic
from carom.catalogue import all_scenes
from carom.comparator import Grade
from carom.conformance.known_answers import CATALOGUE_SCENES, build_known_trace
from carom.conformance.suite import make_suite
from carom.conformance.violation import NotApplicable
from carom.errors import InputError
from carom.execution.shared_options import LimitOptions


def test_known_answers_and_pic_give_the_same_trace() -> None:
    """In every fourth scene of the suite the known answer and PIC agree to rounding, also in normals and spins."""
    for name in list(CATALOGUE_SCENES)[::4]:
        entry = all_scenes()[name]
        reference, pic = build_known_trace(entry.scene, entry.known), solve_pic(entry.scene)
        score = compare(reference, pic, sampling=pic)
        assert score.grade is Grade.EXACT, name
        # A graze turns its normal by 1 / sqrt(1 - .999^2), 22 times the rounding of its positions.
        assert max((error.normal_rad for error in score.errors), default=0.0) < 1e-11, name
        assert score.total.final_position < 1e-11, name
        assert not score.total.final_spin > 1e-11, name  # NaN where nothing turns


def test_known_answer_without_impacts_or_spins_is_refused() -> None:
    """No trace is built from an answer of conserved quantities only, or one that lacks a spin after an impact."""
    gas = all_scenes()["classics/gas"]
    with pytest.raises(InputError, match="classics/gas"):
        build_known_trace(gas.scene, gas.known)
    entry = all_scenes()["spin/english-stick"]
    (impact,) = entry.known.impacts
    silent = dataclasses.replace(entry.known, impacts=(dataclasses.replace(impact, spin_second_after=None),))
    with pytest.raises(InputError, match=r"lacks the spins after 0\.42 s"):
        build_known_trace(entry.scene, silent)


@each("profiles, scenes, least", release_after(1, [(["tuned"], "classics/box|spin/gearing", 50), ([], "", 200)]))
def test_pic_passes_every_conformance_case(profiles: list[str], scenes: str, least: int, tmp_path: Path) -> None:
    """PIC passes every case of the suite that applies to it, and a minimum number applies."""
    (engine,) = make_suite(["pic"], profiles, None, [tmp_path], LimitOptions()).engines
    assert engine.subject is not None
    held = 0
    with closing(engine.subject) as subject:
        for case in engine.cases:
            if not case.skip and ("/" not in case.name or re.search(scenes, case.name)):
                try:
                    case.run(subject)
                except NotApplicable:
                    continue
                held += 1
    assert held > least
