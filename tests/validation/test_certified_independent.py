"""Certified runs against brute force at 400 digits, which shares no code with them and is a longer campaign, too."""

from __future__ import annotations

import pytest
from mpmath import mp
from tests.validation.mpmath_runs import DIGITS, brute_force, contradictions, mixed_scene

import carom

IMPACTS = 40


@pytest.mark.parametrize("seed", range(24))
def test_a_certified_run_never_contradicts_one_of_400_digits(seed: int) -> None:
    """Masses of 1e-3 to infinity, e from .2 to 1, turned boxes: same impacts, all numbers within their radii."""
    scene = mixed_scene(seed)
    certified = carom.certify(scene, max_impacts=IMPACTS)
    with mp.workdps(DIGITS):
        happened = brute_force(scene, IMPACTS)
        assert contradictions(certified, happened) == []
    assert len(certified) == len(happened)


def test_the_oracle_notices_a_wrong_digit() -> None:
    """A time off by ten of its radii is a contradiction: the comparison can fail."""
    scene = mixed_scene(0)
    certified = carom.certify(scene, max_impacts=5)
    certified.trace.impacts.flags.writeable = True
    certified.trace.impacts["time_s"][0] += 10 * certified.radii["time_s"][0]
    with mp.workdps(DIGITS):
        assert len(contradictions(certified, brute_force(scene, 5))) == 1
