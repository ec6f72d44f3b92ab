"""The moving state of the definition of PIT: clocks, and the tests for approach and overlap."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.drawn import drawn
from tests.stage import disc_at, line, staged, wall_at

from carom.physics.impact_law import resolve_impact
from carom.physics.time_of_impact import time_of_impact
from carom.scene import Disc, Scene
from carom.solvers.pic import solve_pic
from carom.solvers.plain.bodies import Bodies


def test_discs_move_on_straight_lines_from_their_own_clocks() -> None:
    """Bringing one disc forward leaves the others where they are, and positions at any time follow for all."""
    bodies = Bodies(line(0.0, 5.0, velocities=(1.0, -2.0)))
    bodies.move_to(0, 1.5)
    assert (bodies.x, bodies.time) == ([1.5, 5.0], [1.5, 0.0])
    np.testing.assert_array_equal(bodies.positions_at(2.0), [[2.0, 0.0], [1.0, 0.0]])
    np.testing.assert_array_equal(bodies.velocities_at(0.0), [[1.0, 0.0], [-2.0, 0.0]])


def test_two_immovable_discs_never_meet() -> None:
    """A pair of immovable discs is not tested, even where it overlaps."""
    discs = [Disc(position_m=(x, 0), radius_m=0.5, mass_kg=math.inf) for x in (0.0, 0.5)]
    bodies = Bodies(Scene(name="pegs", duration_s=1, discs=discs))
    assert not bodies.pair_approaches_and_overlaps(0, 1)


@pytest.mark.parametrize(
    ("x", "velocity", "found"),
    [
        pytest.param(1.5, -1.0, False, id="approaching, apart"),
        pytest.param(1.0, -1.0, True, id="approaching, touching"),
        pytest.param(0.5, -1.0, True, id="approaching, overlapping"),
        pytest.param(0.5, 1.0, False, id="separating, overlapping"),
        pytest.param(0.5, 0.0, False, id="at rest, overlapping"),
    ],
)
def test_pit_asks_whether_approaching_and_then_whether_overlapping(x: float, velocity: float, found: bool) -> None:
    """The test of PIT holds for touching or overlapping discs that approach, and alike for walls."""
    bodies = Bodies(line(0.0, 9.0, velocities=(0.0, velocity)))
    bodies.x[1] = x
    assert bodies.pair_approaches_and_overlaps(0, 1) is found
    walled = Bodies(staged("wall", disc_at(9, 0, velocity, 0), wall_at(0, 0, 1, 0), duration_s=1))
    walled.x[0] = x - 0.5
    assert walled.wall_approaches_and_overlaps(0, 0) is found


@given(st.integers(0, 10**6))
def test_the_solvers_use_the_public_physics(number: int) -> None:
    """The first impact, if of two discs, is the one that `time_of_impact` and `resolve_impact` give.

    Times: both start from the same numbers, and their hypotenuses differ by one unit in the last place at most, so
    unless the impact is a near graze they differ by its relative effect on the gap. Velocities: 40 units of relative
    rounding times the speeds, as derived in the tests of the impact law, for each of the two computations.
    """
    scene = drawn("anywhere", number)
    trace = solve_pic(scene, max_impacts=1)
    if not len(trace.impacts) or trace.impacts[0]["second"] < 0:
        return
    one, two = (scene.discs[trace.impacts[0][body]] for body in ("first", "second"))
    u = 2.0**-53
    time = time_of_impact(
        one.position_m, one.velocity_m_s, one.radius_m, two.position_m, two.velocity_m_s, two.radius_m
    )
    impact = trace.impacts[0]
    distance = math.dist(one.position_m, two.position_m)
    gap = distance - one.radius_m - two.radius_m
    assert abs(impact["time_s"] - time) <= impact["time_s"] * (2 * u * distance / gap + 8 * u)
    after = resolve_impact(
        impact["velocity_first_before"],
        one.mass_kg,
        impact["velocity_second_before"],
        two.mass_kg,
        impact["normal"],
        scene.restitution,
    )
    speeds = math.hypot(*impact["velocity_first_before"]) + math.hypot(*impact["velocity_second_before"])
    for name, velocity in zip(("velocity_first_after", "velocity_second_after"), after, strict=True):
        assert np.max(np.abs(impact[name] - velocity)) <= 2 * 40 * u * speeds
