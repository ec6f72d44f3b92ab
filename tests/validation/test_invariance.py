"""Symmetries of mechanics, and invariances: what changes a scene in a known way does so to its answer.

The results of catalogue scenes agree if the scene is rotated, moves uniformly, is renumbered, split, measured in other
units, or gets a far disc. Mirrors and powers of two, which change no bit, are in ``test_equivalences.py``. Last come
the invariances that `carom stress` measures for engines.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.cases import each
from tests.transformed_scenes import Map, identity, transform_scene, turn_by

from carom import Scene, Trace, solve_pic, solve_pit
from carom.catalogue import CatalogueScene, Tag, catalogue
from carom.model.trace import Vector, rim_speeds, velocities
from carom.studies.stress.invariances import DEVIATION_LIMIT, build_rough_scene, build_superball_scene, list_invariances

ROUNDING = 1e-12

UNIQUE = [entry for entry in catalogue().values() if not entry.tags & {Tag.CONVENTION, Tag.GRAVITY}]
#: A scene at rest in its own frame only: walls and immovable discs single that frame out.
FREE = [entry for entry in UNIQUE if not entry.tags & {Tag.WALLS, Tag.IMMOVABLE}]
STABLE = [entry for entry in UNIQUE if Tag.UNSTABLE not in entry.tags]

#: Each property is tried on each of some twenty scenes, so a few examples make hundreds.
FEWER = settings(max_examples=settings().max_examples // 5)


def largest_speed(scene: Scene) -> float:
    return max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)


def assert_transformed_answer(
    entry: CatalogueScene, *traces: Trace, velocity: Map = identity, position: Map = identity
) -> None:
    """Assert that runs, one after the other, have the impacts of PIC's, and end where it ends, seen otherwise.

    The gas makes an error grow by some thousands in its forty impacts, other scenes hardly.
    """
    scene, whole = entry.scene, solve_pic(entry.scene)
    bound = (1e4 if Tag.CONSERVED in entry.tags else 10.0) * ROUNDING
    greatest, drive, end = largest_speed(scene) or 1.0, math.hypot(*velocity((0.0, 0.0))), traces[-1]
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m)
    extent += (greatest + drive) * scene.duration_s
    bodies = [row for trace in traces for row in trace.impacts[["first", "second"]].tolist()]
    assert bodies == whole.impacts[["first", "second"]].tolist(), entry.name
    places, velocities = ([*map(tuple, rows.tolist())] for rows in (whole.final_position_m, whole.final_velocity_m_s))
    assert np.max(np.abs(end.final_velocity_m_s - [*map(velocity, velocities)])) <= bound * (greatest + drive)
    assert np.max(np.abs(end.final_position_m - [*map(position, places)])) <= bound * extent, entry.name


@FEWER
@given(angle=st.floats(0, math.tau))
def test_rotated_scene_has_the_rotated_answer(angle: float) -> None:
    """Rotating a scene by any angle rotates its answer, and no impact is added or lost."""
    # Unstable scenes along a line are left out. On an axis, no error across the line arises, but in other directions
    # rounding causes an error that grows.
    turn = turn_by(angle)
    for entry in STABLE:
        assert_transformed_answer(
            entry, solve_pic(transform_scene(entry.scene, turn, turn, turn)), velocity=turn, position=turn
        )


@FEWER
@given(boost=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_boosted_scene_has_the_same_impacts(boost: tuple[float, float]) -> None:
    """Galilean relativity: a velocity added to every disc shifts the answer and changes nothing else."""
    for entry in FREE:
        bx, by = (part * largest_speed(entry.scene) for part in boost)

        def moved(v: Vector, time: float = 1.0, bx: float = bx, by: float = by) -> Vector:
            return (v[0] + bx * time, v[1] + by * time)

        carried = partial(moved, time=entry.scene.duration_s)
        assert_transformed_answer(
            entry, solve_pic(transform_scene(entry.scene, identity, moved)), velocity=moved, position=carried
        )


# The invariances of `carom stress` ------------------------------------------------------------------------------------


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
