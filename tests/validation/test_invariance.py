"""The invariances that `carom stress` measures for engines hold for PIC and PIT.

Mirrors and powers of two, which change no bit, are in ``test_equivalences.py``.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.cases import each

from carom import Scene, Trace, solve_pic, solve_pit
from carom.model.trace import rim_speeds, velocities
from carom.studies.stress.invariances import DEVIATION_LIMIT, build_rough_scene, build_superball_scene, list_invariances


def test_pic_satisfies_every_invariance() -> None:
    """PIC satisfies each invariance of `carom stress` to 1e-13, and those that change no digit to the bit."""
    for invariance in list_invariances():
        off = invariance.deviation(invariance.base(), solve_pic)
        assert off <= 1e-13, invariance.name
        if invariance.name.removeprefix("rough-") in {"mirror", "relabelling", "units-of-two", "far-disc"}:
            assert off == 0.0, invariance.name


def test_pit_satisfies_every_invariance() -> None:
    """PIT satisfies each invariance of `carom stress`: units, frames of reference and numbering do not matter."""
    for invariance in list_invariances():
        assert invariance.deviation(invariance.base(), solve_pit) <= DEVIATION_LIMIT, invariance.name


@each("change", [abs, lambda spins: 0.999 * spins])
def test_invariances_detect_wrong_spins(change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
    """A method with wrong spins violates exactly the invariances that depend on spins."""

    def run(scene: Scene) -> Trace:
        trace = solve_pic(scene)
        if trace.final_spin_rad_s is None:
            return trace
        return replace(trace, final_spin_rad_s=change(trace.final_spin_rad_s))

    failed = {
        invariance.name
        for invariance in list_invariances()
        if invariance.deviation(invariance.base(), run) > DEVIATION_LIMIT
    }
    assert failed == {"rough-split", "superball-reversal"} | ({"rough-mirror"} if change is abs else set())


def test_rough_invariance_scenes_slide_and_grip() -> None:
    """In the rough scene two impacts slide and one grips; in the superball scene each impact reverses the slip."""
    assert compute_slip_ratios(solve_pic(build_rough_scene())) == pytest.approx([0.4, 0.0, 0.06], abs=0.01)
    assert compute_slip_ratios(solve_pic(build_superball_scene())) == pytest.approx([-1.0, -1.0], abs=1e-12)


def compute_slip_ratios(trace: Trace) -> list[float]:
    """Return the slip after each impact over the one before."""
    tangent = trace.impacts["normal"][:, ::-1] * [-1.0, 1.0]
    before, after = (
        np.sum((moving[0] - moving[1]) * tangent, axis=1) + rims[0] + rims[1]
        for moving, rims in ((velocities(trace.impacts, when), rim_speeds(trace, when)) for when in ("before", "after"))
    )
    return list(after / before)
