"""An engine is not driven through free flight; nothing that can still happen is skipped for that."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.stage import disc_at, staged

from carom import Scene, Wall, solve_pic, time_of_impact
from carom.adapter import Observation
from carom.registry import load_adapter
from carom.runs.free_flight import FreeFlight, near_after
from carom.runs.observe import observe_run
from carom.scenes import find_scenes

DT = 1 / 60

Array = NDArray[np.float64]


def pair(gap: float, velocity: float, *, aside: float = 0.0, walls: tuple[Wall, ...] = ()) -> Scene:
    return staged("pair", disc_at(0, 0), disc_at(1 + gap, aside, velocity, 0), *walls, duration_s=10.0)


def begins_after(scene: Scene, steps: int = 5) -> bool:
    """Whether free flight is found in the first steps of a run that moves straight on."""
    position = np.array([disc.position_m for disc in scene.discs])
    velocity = np.array([disc.velocity_m_s for disc in scene.discs])
    flight = FreeFlight(scene, DT)
    return any(
        flight.begins(k * DT, Observation(position + velocity * (k * DT), velocity)) for k in range(1, steps + 1)
    )


def test_discs_that_part_are_in_free_flight() -> None:
    """Two discs that move apart, with nothing else about, need no more steps."""
    assert begins_after(pair(0.5, 1.0))


@pytest.mark.parametrize(
    "scene",
    [pair(5.0, -1.0), pair(5.0, -1.0, aside=1.5), pair(0.5, 1.0, walls=(Wall(point_m=(8, 0), normal=(-1, 0)),))],
)
def test_what_meets_or_passes_near_before_the_end_is_not(scene: Scene) -> None:
    """Bodies that will meet, or pass within a contact distance of each other, or reach a wall, are followed."""
    assert not begins_after(scene)


@given(st.tuples(*[st.integers(-1000, 1000)] * 4), st.integers(-120, 120), st.integers(-120, 120), st.floats(1e-6, 1.0))
def test_no_pair_touches_before_it_is_near(state: tuple[int, ...], length: int, pace: int, radius: float) -> None:
    """In whatever unit, from whatever distance: two discs come within twice their radii before they touch."""
    x, y, vx, vy = (0.01 * value for value in state)
    place, speed = np.array([[x, y]]) * 10.0**length, np.array([[vx, vy]]) * 10.0**pace
    r = radius * 10.0**length
    touches = time_of_impact([0.0, 0.0], [0.0, 0.0], r, place[0], speed[0], r)
    assert float(near_after(place, speed, np.array([4.0 * r]))[0]) <= float(touches)


def test_a_distant_hit_is_not_rounded_away() -> None:
    """A hit from a million million radii away, by half a radius aside, is still seen to come."""
    far = near_after(np.array([[1e12, 0.5]]), np.array([[-1e3, 0.0]]), np.array([4.0]))
    assert far[0] == pytest.approx(1e9, rel=1e-9)


def test_what_floats_can_not_hold_may_happen_at_once() -> None:
    """Where a distance or a speed is beyond the largest float, no time is given away."""
    far, fast = np.array([[math.inf, 0.0]]), np.array([[-1.7e308, 1.7e308]])
    assert near_after(far, np.array([[1.0, 0.0]]), np.array([1.0]))[0] == 0.0
    assert near_after(np.array([[3.0, 0.0]]), fast, np.array([1.0]))[0] == 0.0


def test_an_engine_that_damps_is_followed_to_the_end() -> None:
    """Velocities that change from step to step, however little, are no free flight."""
    scene = pair(0.5, 1.0)
    flight = FreeFlight(scene, DT)
    for k in range(1, 50):
        velocity = np.array([(0.0, 0.0), (1.0 * (1 - 1e-12) ** k, 0.0)])
        assert not flight.begins(k * DT, Observation(np.array([(0.0, 0.0), (1.5 + k * DT, 0.0)]), velocity))


@pytest.mark.parametrize("off", [1e-12, 1e-3, 0.01])
def test_an_engine_whose_discs_move_otherwise_than_their_velocities_is_followed_to_the_end(off: float) -> None:
    """Positions that drift from step to step by more than rounding are no free flight, whatever the velocities are."""
    scene = pair(0.5, 1.0)
    flight, velocity = FreeFlight(scene, DT), np.array([(0.0, 0.0), (1.0, 0.0)])
    for k in range(1, 50):
        position = np.array([(0.0, off * k), (1.5 + k * DT, 0.0)])
        assert not flight.begins(k * DT, Observation(position, velocity))


def test_positions_are_held_to_the_floats_that_a_method_declares() -> None:
    """What 32-bit floats round a position by is free flight to who declares them, and a drift to who declares 64."""
    scene = pair(0.5, 1.0)
    begun = {}
    for bits in (32, 64):
        flight, place = FreeFlight(scene, DT, bits), np.array([(0.0, 0.0), (1.5, 0.0)], np.float32)
        velocity = np.array([(0.0, 0.0), (1.0, 0.0)])
        begun[bits] = False
        for k in range(1, 20):
            place = place + (velocity * DT).astype(np.float32)
            begun[bits] = begun[bits] or flight.begins(k * DT, Observation(place.astype(np.float64), velocity))
    assert begun == {32: True, 64: False}


def begun_at(scene: Scene, states: Iterable[tuple[Array, Array]], dt_s: float = DT) -> int:
    """Return after which step, from 1, free flight is found; 0 for after none."""
    flight = FreeFlight(scene, dt_s)
    found = (flight.begins(k * dt_s, Observation(p, v)) for k, (p, v) in enumerate(states, start=1))
    return next((k for k, begun in enumerate(found, start=1) if begun), 0)


def test_two_steps_must_leave_every_velocity_as_it_was() -> None:
    """The first look has nothing to compare with, and two quiet steps follow; a kick at every other leaves no two."""
    scene, apart, speed = pair(0.5, 1.0), np.array([(0.0, 0.0), (1.5, 0.0)]), np.array([(0.0, 0.0), (1.0, 0.0)])
    assert begun_at(scene, [(apart + speed * (k * DT), speed) for k in range(1, 20)]) == 3
    place, states = apart, []
    for k in range(40):
        kicked = speed * (1.0 + 1e-9 * (k // 2))
        place = place + kicked * DT
        states.append((place, kicked))
    assert begun_at(scene, states) == 0


@pytest.mark.parametrize(("units", "begins"), [(0, True), (4, True), (5, False), (-5, False)])
def test_a_position_may_be_off_by_what_rounding_makes_of_it(units: int, begins: bool) -> None:
    """Just above 4 m a step may be off by four units in the last place, each 2^-50 m, and not by five."""
    scene, speed = pair(3.5, 1.0), np.array([(0.0, 0.0), (1.0, 0.0)])
    dt_s = 2.0**-6  # every number below is exact
    drift = np.array([(0.0, 0.0), (units * 2.0**-50, 0.0)])
    states = [(np.array([(0.0, 0.0), (4.0, 0.0)]) + (speed * dt_s + drift) * k, speed) for k in range(1, 9)]
    assert (begun_at(scene, states, dt_s) > 0) is begins


@pytest.mark.parametrize(("steps_after_the_end", "begins"), [(1, False), (1.5, False), (2.5, True)])
def test_what_comes_near_within_two_steps_of_the_end_is_followed(steps_after_the_end: float, begins: bool) -> None:
    """An engine that looks two steps ahead may act on a contact that comes after the end of the scene."""
    near_s = 10.0 + steps_after_the_end * DT
    gap = near_s + 1.0  # at 1 m/s they are near when the centres are 2 m apart: twice the sum of the radii
    scene = pair(gap, -1.0)
    start, speed = np.array([(0.0, 0.0), (1.0 + gap, 0.0)]), np.array([(0.0, 0.0), (-1.0, 0.0)])
    states = [(start + speed * (k * DT), speed) for k in range(1, 600)]
    assert (begun_at(scene, states) > 0) is begins


def test_discs_that_overlap_are_followed() -> None:
    """Overlapping discs that part may still be pushed apart by their engine."""
    scene = pair(0.5, 1.0)
    flight = FreeFlight(scene, DT)
    state = Observation(np.array([(0.0, 0.0), (0.75, 0.0)]), np.array([(0.0, 0.0), (0.0, 0.0)]))
    assert not any(flight.begins(k * DT, state) for k in range(1, 10))


@pytest.mark.parametrize(
    "name", ["paper/late", "paper/multiple", "classics/deflection", "classics/inelastic-oblique", "issues/nimble-143"]
)
def test_a_run_that_ends_early_ends_where_the_whole_run_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Impacts are the same; the final state and the samples are those of the whole run, to its own rounding."""
    (entry,) = find_scenes([name])
    scene = entry.scene
    short = observe_run(load_adapter("pit"), scene, "tuned", DT, samples=True)
    monkeypatch.setattr(FreeFlight, "begins", lambda *_: False)
    whole = observe_run(load_adapter("pit"), scene, "tuned", DT, samples=True)
    assert short.counts["steps_skipped"] > 0
    assert short.counts["steps"] + short.counts["steps_skipped"] == whole.counts["steps"]
    assert short.impacts.tobytes() == whole.impacts.tobytes()
    # The whole run adds a step at a time, each to half an ulp.
    np.testing.assert_allclose(short.final_position_m, whole.final_position_m, rtol=0, atol=100 * math.ulp(8.0))
    np.testing.assert_array_equal(short.final_velocity_m_s, whole.final_velocity_m_s)
    assert short.samples is not None
    assert whole.samples is not None
    np.testing.assert_array_equal(short.samples.time_s, whole.samples.time_s)
    np.testing.assert_allclose(short.samples.position_m, whole.samples.position_m, rtol=0, atol=100 * math.ulp(8.0))
    assert dataclasses.replace(solve_pic(scene)).outcome is short.outcome


def test_a_run_that_is_not_watched_is_the_same_run_without_local_truth() -> None:
    """Who asks for no comparison step by step gets none, and the same impacts and final state."""
    adapter, scene = load_adapter("pit"), find_scenes(["paper/late"])[0].scene
    watched, alone = (observe_run(adapter, scene, "tuned", 1 / 60, watched=one) for one in (True, False))
    assert watched.local_truth is not None
    assert alone.local_truth is None
    assert np.array_equal(watched.impacts, alone.impacts)
    assert np.array_equal(watched.final_position_m, alone.final_position_m)
