"""Certified runs against brute force at 400 digits, which shares no code with them and is a longer campaign, too."""

from __future__ import annotations

import pytest
from mpmath import mp
from tests.validation.mpmath_runs import DIGITS, brute_force, contradictions, falling_scene, mixed_scene, rough_scene

import carom

IMPACTS = 40

#: Makers of scenes, how many impacts are followed, and how many scenes are made: masses of 1e-3 to infinity, e from .2
#: to 1, turned boxes; and discs of many masses that fall, in such boxes or by a wall.
KINDS = {"mixed": (mixed_scene, IMPACTS, 24), "falling": (falling_scene, 20, 12)}


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        pytest.param(kind, seed, marks=[pytest.mark.long] * (seed >= 8))
        for kind, (*_, seeds) in KINDS.items()
        for seed in range(seeds)
    ],
)
def test_a_certified_run_never_contradicts_one_of_400_digits(kind: str, seed: int) -> None:
    """The impacts are the same, and all numbers within their radii."""
    make, impacts, _ = KINDS[kind]
    scene = make(seed)
    certified = carom.certify(scene, max_impacts=impacts)
    with mp.workdps(DIGITS):
        happened = brute_force(scene, impacts)
        assert contradictions(certified, happened) == []
    assert len(certified) == len(happened)


@pytest.mark.parametrize("seed", [*range(8), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(8, 60))])
def test_nor_does_one_with_friction_and_spin(seed: int) -> None:
    """The same discs spin, rub, slide, grip and give their slip back: all velocities and spins within their radii."""
    scene = rough_scene(seed)
    certified = carom.certify(scene, max_impacts=IMPACTS)
    assert certified.trace.spins is not None
    with mp.workdps(DIGITS):
        happened = brute_force(scene, IMPACTS)
        assert contradictions(certified, happened) == []
    if certified.degeneracy is None:
        assert len(certified) == len(happened)


def test_the_oracle_notices_a_wrong_spin() -> None:
    """A spin off by ten of its radii is a contradiction, too."""
    scene = rough_scene(0)
    certified = carom.certify(scene, max_impacts=5)
    assert certified.trace.spins is not None
    assert certified.spin_radii is not None
    certified.trace.spins.flags.writeable = True
    k = int(certified.spin_radii["first_after"].argmax())
    certified.trace.spins["first_after"][k] += 10 * certified.spin_radii["first_after"][k]
    with mp.workdps(DIGITS):
        assert len(contradictions(certified, brute_force(scene, 5))) == 1


def test_the_oracle_notices_a_wrong_digit() -> None:
    """A time off by ten of its radii is a contradiction: the comparison can fail."""
    scene = mixed_scene(0)
    certified = carom.certify(scene, max_impacts=5)
    certified.trace.impacts.flags.writeable = True
    certified.trace.impacts["time_s"][0] += 10 * certified.radii["time_s"][0]
    with mp.workdps(DIGITS):
        assert len(contradictions(certified, brute_force(scene, 5))) == 1
