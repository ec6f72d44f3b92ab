"""Accuracy of tuned engines, compared with PIT at the same step."""

import math

import numpy as np
import pytest
from tests.adapters.engine_scenes import build_oblique_scene, round_to_engine, scale_tolerance
from tests.cases import each, release_after
from tests.scene_builders import Finish, disc_at, staged, wall_at

from carom import Disc, Scene, solve_pit
from carom.engines.api import Adapter, Observation, unsupported_reason

#: The promise of every tuned profile: PIT at the same step, to 1e-12 of speeds of a few m/s and lengths of a few m.
#: Rounding alone, half an ulp of such a position (2.2e-16 m) at every one of 1500 steps, may be 3.3e-13.
AGREEMENT = 1e-12

#: The longest lets discs sink 0.2 m into each other: twice what pymunk ships as not to be pushed apart.
STEPS_S = (1 / 16, 1 / 60, 1 / 240, 1 / 1000)


MOVING = disc_at(0, 0, 3, 1, m=1.7)
SLANTED = wall_at(1.9, 0, -1, 0.5)
SCENES = {
    "two discs, then a slanted wall": build_oblique_scene(),
    "an immovable disc": staged("oblique", MOVING, disc_at(1.72, 0.9, m=math.inf), duration_s=1.0),
    "masses 1:1000": staged("oblique", MOVING, disc_at(1.72, 0.9, m=1700), duration_s=1.0),
    "an upright wall, its point far along it": staged("oblique", MOVING, wall_at(1.93, 77, -1, 0), duration_s=1.0),
    "a slanted wall": staged("oblique", MOVING, SLANTED, duration_s=1.0),
    "a corner": staged("oblique", MOVING, SLANTED, wall_at(0, 1.03, 0.1, -1), duration_s=1.0),
}


def _largest_difference(scene: Scene, dt_s: float, end: Observation) -> tuple[float, float]:
    """Differences of velocity and position from PIT with a frame at every step."""
    pit = solve_pit(scene, frame_rate_hz=1 / dt_s)
    # An impact seen at the very last boundary is answered there by pymunk and after it by the rest: no test of either.
    assert len(pit.impacts) > 0
    assert pit.impacts["time_s"].max() < scene.duration_s - 2 * dt_s
    return (
        float(np.abs(end.velocity_m_s - pit.final_velocity_m_s).max()),
        float(np.abs(end.position_m - pit.final_position_m).max()),
    )


def _skip_unsupported(engine: Adapter, scene: Scene, dt_s: float) -> None:
    if reason := unsupported_reason(scene, engine.capabilities, dt_s):
        pytest.skip(reason)


@each("dt_s", release_after(1, STEPS_S))
@each("scene", SCENES.values())
def test_tuned_engines_equal_pit_at_the_same_step(engine: Adapter, finish: Finish, scene: Scene, dt_s: float) -> None:
    """Every tuned engine ends where PIT with one frame a step ends, to 1e-12 or roundings of 32-bit floats."""
    velocity, position = _largest_difference(scene, dt_s, finish(engine, scene, dt_s))
    assert velocity < scale_tolerance(engine, AGREEMENT)
    assert position < scale_tolerance(engine, AGREEMENT)


@each("scale", [{"length": 1e-6}, {"length": 1e5}, {"mass": 1e-14}, {"mass": 1e10}, {"time": 1e-9}, {"time": 1e4}])
def test_tuned_engines_equal_pit_in_any_units(engine: Adapter, finish: Finish, scale: dict[str, float]) -> None:
    """Within declared limits the tuned engine equals PIT for tiny, huge, light, heavy, fast and slow scenes."""
    length, time = scale.get("length", 1.0), scale.get("time", 1.0)
    scene, dt_s = build_oblique_scene(**scale), time / 240
    _skip_unsupported(engine, scene, dt_s)
    velocity, position = _largest_difference(scene, dt_s, finish(engine, scene, dt_s))
    # MuJoCo's solver works to an absolute precision: at accelerations of 1e-3 m/s^2 and less, 5e-12 is what is left.
    tolerance = 1e-11 if engine.name == "mujoco" else scale_tolerance(engine, AGREEMENT)
    assert velocity * time / length < tolerance
    assert position / length < tolerance


def test_tuned_engines_equal_pit_far_from_the_origin(engine: Adapter, finish: Finish) -> None:
    """At 1e6 m (64 m with 32-bit floats) an engine equals PIT except for the rounding of such coordinates."""
    x_m, dt_s = 1e6 if engine.capabilities.float_bits == 64 else 64.0, 1 / 240
    scene = build_oblique_scene(x_m=x_m)
    velocity, position = _largest_difference(scene, dt_s, finish(engine, scene, dt_s))
    # A position is rounded by half an ulp of 1e6 m at every one of 360 steps, in both methods, and turns the normal.
    rounding = 360 * scale_tolerance(engine, float(np.spacing(x_m)))
    assert position < rounding
    assert velocity < 3 * rounding


@each("x_m", [0.0, 1e6])
def test_fast_discs_bounce_off_half_planes(engine: Adapter, finish: Finish, x_m: float) -> None:
    """A wall is a half-plane: a disc that is up to 60 radii deep in it after one step still bounces exactly."""
    rng = np.random.default_rng(7)
    for _ in range(8):
        angle = rng.uniform(0, 2 * math.pi)
        normal, along = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        velocity = -200 * normal + rng.normal(scale=50) * along
        point = -rng.uniform(3, 9) * normal + rng.normal(scale=30) * along
        disc, wall = disc_at(x_m, 0, *velocity, r=0.05), wall_at(point[0] + x_m, point[1], *normal)
        scene = staged("fast", disc, wall, duration_s=0.2)
        _skip_unsupported(engine, scene, 1 / 60)
        end = finish(engine, scene, 1 / 60)
        expected = velocity - 2 * (velocity @ normal) * normal
        # The closed form, each component of which is a dozen roundings at 400 m/s.
        np.testing.assert_allclose(end.velocity_m_s[0], expected, rtol=0, atol=12 * float(np.spacing(400.0)))


def test_slow_disc_does_not_fall_asleep(engine: Adapter, finish: Finish) -> None:
    """A disc at 3 mm/s has the same velocity after 10 s, with the default and the tuned profile."""
    scene = Scene(name="slow", discs=[Disc(position_m=(0, 0), velocity_m_s=(0.003, 0), radius_m=1)], duration_s=10)
    for profile in ("default", "tuned"):
        end = finish(engine, scene, 1 / 60, profile)
        assert end.velocity_m_s.tolist() == round_to_engine(engine, [[0.003, 0]])
