"""Free flight ends a run early, but only if no later impact is possible."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged

from carom import Chain, Scene, Wall, solve_pic, time_of_impact
from carom.catalogue import find_scenes
from carom.engines.api import Observation
from carom.engines.registry import load_adapter
from carom.execution.observation.approach import compute_pair_time
from carom.execution.observation.engine_run import observe_run
from carom.execution.observation.free_flight import FreeFlight

DT = 1 / 60

Array = NDArray[np.float64]


def build_pair(gap: float, velocity: float, *, aside: float = 0.0, walls: tuple[Wall, ...] = ()) -> Scene:
    return staged("pair", disc_at(0, 0), disc_at(1 + gap, aside, velocity, 0), *walls, duration_s=10.0)


def find_free_flight_step(scene: Scene, states: Iterable[tuple[Array, Array]], bits: int = 64) -> int:
    """Return after which step, from 1, free flight is found; 0 for after none."""
    flight = FreeFlight(scene, DT, bits)
    found = (flight.has_begun(k * DT, Observation(p, v)) for k, (p, v) in enumerate(states, start=1))
    return next((k for k, begun in enumerate(found, start=1) if begun), 0)


def build_straight_states(scene: Scene, steps: int = 5) -> list[tuple[Array, Array]]:
    """Return the states of discs that move straight on."""
    start = scene.arrays
    return [(start.position_m + start.velocity_m_s * (k * DT), start.velocity_m_s) for k in range(1, steps + 1)]


def compute_near_time(place: Any, speed: Any, reach: float) -> float:
    """Return when a disc that starts at `place` comes near a disc at rest at the origin."""
    discs = (np.array([(0.0, 0.0), place]), np.array([(0.0, 0.0), speed]), np.array([reach / 2, reach / 2]))
    return compute_pair_time(*discs, np.array([0]), np.array([1]))


PARTING = build_pair(0.5, 1.0)
APART, SPEED = np.array([(0.0, 0.0), (1.5, 0.0)]), np.array([(0.0, 0.0), (1.0, 0.0)])


def build_rounded_states() -> Iterator[tuple[Array, Array]]:
    """Yield states of which each place is the last one, moved on, in 32 bits."""
    place = APART.astype(np.float32)
    for _ in range(20):
        place = place + (SPEED * DT).astype(np.float32)
        yield place.astype(np.float64), SPEED


def build_moving_states(steps: int, *, slowing: float = 0.0, drift_m: float = 0.0) -> list[tuple[Array, Array]]:
    """Return the states of `PARTING`, whose velocity falls, or whose first disc drifts aside, a step."""
    aside = np.array([(0.0, drift_m), (0.0, 0.0)])
    return [(APART + k * (DT * SPEED + aside), SPEED * (1 - slowing) ** k) for k in range(1, steps)]


NEARING = [
    build_pair(5.0, -1.0),
    build_pair(5.0, -1.0, aside=1.5),
    build_pair(0.5, 1.0, walls=(Wall(point_m=(8, 0), normal=(-1, 0)),)),
    staged("slow", disc_at(0, 0, 0.5), Chain(points_m=[(4, -1), (4, 1)]), duration_s=10.0),
]
TOUCHING = staged("touching", disc_at(0, 0), disc_at(0.6, 0.8), duration_s=10.0)


@each(
    "scene, states, bits, begins",
    [
        (PARTING, build_straight_states(PARTING), 64, True),
        *((scene, build_straight_states(scene), 64, False) for scene in NEARING),
        (PARTING, [(APART / 2, 0.0 * SPEED)] * 10, 64, False),  # they overlap, and may be pushed apart
        (TOUCHING, build_straight_states(TOUCHING), 64, False),
        (PARTING, build_moving_states(50, slowing=1e-12), 64, False),
        *((PARTING, build_moving_states(50, drift_m=drift_m), 64, False) for drift_m in (1e-12, 1e-3, 0.01)),
        (PARTING, [*build_rounded_states()], 32, True),
        (PARTING, [*build_rounded_states()], 64, False),
    ],
)
def test_free_flight_requires_straight_motion_without_contacts(
    scene: Scene, states: Iterable[tuple[Array, Array]], bits: int, begins: bool
) -> None:
    """Free flight begins only if discs move straight within rounding and will not overlap, meet or pass near."""
    assert (find_free_flight_step(scene, states, bits=bits) > 0) is begins


@given(st.tuples(*[st.integers(-1000, 1000)] * 4), st.integers(-120, 120), st.integers(-120, 120), st.floats(1e-6, 1.0))
def test_two_discs_are_near_before_they_touch(state: tuple[int, ...], length: int, pace: int, radius: float) -> None:
    """In any units and at any distance, discs come within twice the sum of their radii before they touch."""
    x, y, vx, vy = (0.01 * value for value in state)
    place, speed = np.array([[x, y]]) * 10.0**length, np.array([[vx, vy]]) * 10.0**pace
    r = radius * 10.0**length
    touches = time_of_impact([0.0, 0.0], [0.0, 0.0], r, place[0], speed[0], r)
    assert compute_near_time(place[0], speed[0], 4.0 * r) <= float(touches)


@given(
    st.lists(st.tuples(*[st.integers(-20, 20)] * 4), min_size=2, max_size=6),
    st.sampled_from([0, 40]),
    st.floats(1e-3, 20.0),
)
def test_earliest_near_pair_is_found_within_the_time_left(
    states: list[tuple[int, int, int, int]], far_discs: int, left_s: float
) -> None:
    """The time until any pair is near is the minimum over all pairs, unless it is after the end."""
    rows = np.array([*states, *((10_000 * (1 + k), 0, 0, 0) for k in range(far_discs))], float)
    scene = staged("apart", *(disc_at(100 * k, 0) for k in range(len(rows))), duration_s=20.0)
    place, velocity, (first, second) = 3.0 * rows[:, :2], rows[:, 2:], np.triu_indices(len(rows), 1)
    every = compute_pair_time(place, velocity, 2.0 * scene.arrays.radius_m, first, second)
    found = FreeFlight(scene, DT).compute_pair_wait(place, velocity, left_s)
    assert found == every if every <= left_s else found > left_s


@each("steps_after_the_end, begins", [(1, False), (1.5, False), (2.5, True)])
def test_pair_near_within_two_steps_of_the_end_is_followed(steps_after_the_end: float, begins: bool) -> None:
    """Discs that come near up to two steps after the end are not in free flight, since engines may look ahead."""
    near_s = 10.0 + steps_after_the_end * DT
    gap = near_s + 1.0  # at 1 m/s they are near when the centres are 2 m apart: twice the sum of the radii
    scene = build_pair(gap, -1.0)
    assert (find_free_flight_step(scene, build_straight_states(scene, 600)) > 0) is begins


@each(
    "name", ["paper/late", "paper/multiple", "classics/deflection", "classics/inelastic-oblique", "issues/nimble-143"]
)
def test_shortened_run_equals_the_whole_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run shortened by free flight has the whole run's impacts to the bit, and positions to rounding."""
    scene = find_scenes([name])[0].scene
    short = observe_run(load_adapter("pit"), scene, "tuned", DT, samples=True)
    monkeypatch.setattr(FreeFlight, "has_begun", lambda *_: False)
    whole = observe_run(load_adapter("pit"), scene, "tuned", DT, samples=True)
    assert short.counts["steps_skipped"] > 0
    assert short.counts["steps"] + short.counts["steps_skipped"] == whole.counts["steps"]
    assert short.impacts.tobytes() == whole.impacts.tobytes()
    # The whole run adds a step at a time, each to half an ulp.
    np.testing.assert_allclose(short.final_position_m, whole.final_position_m, rtol=0, atol=100 * math.ulp(8.0))
    np.testing.assert_array_equal(short.final_velocity_m_s, whole.final_velocity_m_s)
    cut, full = require_value(short.samples), require_value(whole.samples)
    np.testing.assert_array_equal(cut.time_s, full.time_s)
    np.testing.assert_allclose(cut.position_m, full.position_m, rtol=0, atol=100 * math.ulp(8.0))
    assert solve_pic(scene).outcome is short.outcome
