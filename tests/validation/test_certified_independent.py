"""Certified runs against brute force at 400 digits, which shares no code with them."""

from typing import Any

import pytest
from mpmath import mp
from tests.cases import each
from tests.scene_builders import require_value
from tests.validation.mpmath_runs import DIGITS, draw_lossy_scene, find_contradictions, run_brute_force

import carom

IMPACTS = 40

#: Features of the scenes in addition to masses of 1e-3 to infinity, losses and oblique walls, how many impacts are
#: followed, and how many scenes are drawn. Discs that fall are movable: certified runs support no impact on an
#: immovable one under gravity.
KINDS: dict[str, tuple[dict[str, Any], int, int]] = {
    "smooth": ({}, IMPACTS, 24),
    "falling": ({"gravity": (0.25, -1.0), "immovable": False}, 20, 12),
    "rough": ({"rough": True}, IMPACTS, 60),
    "damped": ({"rough": True}, 12, 24),
}


@each(
    "kind, seed",
    [
        pytest.param(kind, seed, marks=[pytest.mark.release] * (seed >= 1))
        for kind, (*_, seeds) in KINDS.items()
        for seed in range(seeds)
    ],
)
def test_certified_runs_match_400_digit_brute_force(kind: str, seed: int) -> None:
    """Certified runs have the impacts of 400-digit brute force, with all numbers within their radii."""
    more, impacts, _ = KINDS[kind]
    scene = draw_lossy_scene(seed, **more).model_copy(update={"damping_per_s": 0.3 if kind == "damped" else 0.0})
    certified = carom.certify(scene, max_impacts=impacts)
    with mp.workdps(DIGITS):
        happened = run_brute_force(scene, impacts)
        assert find_contradictions(certified, happened) == []
    if certified.degeneracy is None:
        assert len(certified) == len(happened)


@each("field, rough", [("time_s", False), ("first_after", True)])
def test_number_off_by_ten_radii_contradicts_brute_force(field: str, rough: bool) -> None:
    """A time or spin that is off by ten of its radii gives exactly one contradiction to brute force."""
    scene = draw_lossy_scene(0, rough=rough)
    certified = carom.certify(scene, max_impacts=5)
    spins = (certified.trace.spins, certified.spin_radii)
    rows, radii = map(require_value, spins if rough else (certified.trace.impacts, certified.radii))
    rows.flags.writeable = True
    k = int(radii[field].argmax()) if rough else 0
    rows[field][k] += 10 * radii[field][k]
    with mp.workdps(DIGITS):
        assert len(find_contradictions(certified, run_brute_force(scene, 5))) == 1
