"""Event-driven PIC: known answers, pausing, limits and inelastic impacts."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import build_line_scene, disc_at, staged, wall_at

from carom.errors import InputError
from carom.model.scene import Disc
from carom.model.trace import Outcome
from carom.solvers.event_driven.run import compute_standstill_limit
from carom.solvers.pic import solve_pic
from carom.solvers.reference.algorithm_2 import solve_pic_framewise


def test_impact_at_the_end_of_the_scene_is_included() -> None:
    """An impact exactly at the scene's duration is recorded, and its velocities are the final ones."""
    trace = solve_pic(build_line_scene(0.0, 3.0, velocities=(1.0, 0.0), duration_s=2.0))
    assert trace.impacts["time_s"].tolist() == [2.0]
    np.testing.assert_array_equal(trace.final_velocity_m_s, [[0, 0], [1, 0]])


@each("offset", [0.0, 1e6, 1e9, 16592279964.34414, 1e12])
@each("depth", [2.0**-51, 2.0**-40, 2.0**-30])
def test_graze_far_from_the_origin_never_pulls(offset: float, depth: float) -> None:
    """A graze up to 1e12 m from the origin is one unambiguous impact that does not pull the discs together."""
    scene = staged(
        "graze", disc_at(offset, 0, r=1), disc_at(offset + 12.1875, 2.0 - depth, -10.4, 0, r=1), duration_s=100
    )
    trace = solve_pic(scene)
    assert (trace.outcome, len(trace.impacts), trace.ambiguous) == (Outcome.COMPLETED, 1, ())
    change = trace.impacts["velocity_first_after"][0] - trace.impacts["velocity_first_before"][0]
    assert change @ trace.impacts["normal"][0] <= 0.0
    assert solve_pic_framewise(scene, frame_rate_hz=1.0).impacts.tobytes() == trace.impacts.tobytes()


@each("limit, seen, end", [(0, 0, 0.0), (1, 1, 1.0), (2, 2, 2.0), (3, 3, 10.0), (99, 3, 10.0)])
def test_max_impacts_ends_the_run_at_the_last_impact(limit: int, seen: int, end: float) -> None:
    """A limit below the number of impacts ends the run at the last one allowed; a sufficient limit has no effect."""
    trace = solve_pic(build_line_scene(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0)), max_impacts=limit)
    assert len(trace.impacts) == seen
    assert trace.end_time_s == end
    assert trace.outcome is (Outcome.COMPLETED if end == 10.0 else Outcome.MAX_IMPACTS)


def test_until_s_is_limited_by_the_distance_that_discs_fly() -> None:
    """`until_s` can take a disc of 0.5 m as far as 2^395 m; 2^396 m raises an InputError."""
    scene = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0))
    assert solve_pic(scene, until_s=2.0**395).end_time_s == 2.0**395
    with pytest.raises(InputError, match="until_s must be so short that no disc flies further than"):
        solve_pic(scene, until_s=2.0**396)


@given(st.integers(0, 10**6), st.integers(-314, 314), st.integers(-80, 80), st.integers(-300, 300))
def test_perfectly_inelastic_impact_happens_once(offset: int, bearing: int, aside: int, speed: int) -> None:
    """Discs collide once at e = 0: what rounding leaves of their approach causes no further impact."""
    x, y = math.cos(bearing / 100), math.sin(bearing / 100)
    drift = (speed / 7, speed / 11)
    scene = staged(
        "inelastic",
        Disc(position_m=(offset / 7, 0), velocity_m_s=drift, radius_m=0.5, mass_kg=0.7),
        disc_at(offset / 7 + 3 * x - y * aside / 100, 3 * y + x * aside / 100, drift[0] - x, drift[1] - y),
        duration_s=20,
        restitution=0.0,
    )
    trace = solve_pic(scene)
    assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 1)


@given(st.integers(0, 10**6), st.integers(-314, 314), st.integers(-300, 300))
def test_perfectly_inelastic_wall_is_hit_once(offset: int, bearing: int, speed: int) -> None:
    """A disc that slides along an oblique wall after an impact with e = 0 does not hit it again."""
    x, y = math.cos(bearing / 100), math.sin(bearing / 100)
    scene = staged(
        "inelastic",
        disc_at(offset / 7 + 3 * x, 3 * y, -x - y * speed / 7, -y + x * speed / 7),
        wall_at(offset / 7, 0, x, y),
        duration_s=20,
        wall_restitution=0.0,
    )
    trace = solve_pic(scene)
    assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 1)


@each("solve", [solve_pic, solve_pic_framewise])
def test_inelastic_collapse_at_one_instant_ends_in_standstill(solve: Any) -> None:
    """A disc that presses another against a wall at e = 0 ends in STANDSTILL at 1 s, at the limit of impacts."""
    scene = staged(
        "squeeze",
        disc_at(1, 0, r=1),
        disc_at(4, 0, -1, 0, r=1),
        wall_at(0, 0, 1, 0),
        duration_s=10,
        restitution=0.0,
        wall_restitution=0.0,
    )
    trace = solve(scene)
    assert (trace.outcome, trace.end_time_s) == (Outcome.STANDSTILL, 1.0)
    assert trace.impacts["time_s"].tolist() == [1.0] * (compute_standstill_limit(3) + 1)
