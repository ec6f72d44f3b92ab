"""Damping, and tables that slow discs down, in each engine from several starts."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from tests.adapters.engine_scenes import scale_tolerance
from tests.cases import each
from tests.scene_builders import Finish, Named, disc_at, require_value, staged, wall_at

from carom import Disc, Scene
from carom.engines.api import Adapter, AdapterError

DT_S, STEPS = 1 / 64, 64

#: Rates, velocities and spins.
STARTS = [(0.04, 1.25, 0.75), (0.5, 3.5, -0.75), (4.0, 5.75, -2.25)]


def _iterate_damped_speeds(profile: str, engine: str, rate: float, speed: float) -> Iterator[float]:
    """Yield the speed at each boundary, by what the engine's sources or documents say it does in a step."""
    step = rate * DT_S
    for _ in range(STEPS + 1):
        yield speed
        if engine == "box2d":  # b2Island::Solve of pybox2d's Box2D: v *= clamp(1 - h c, 0, 1)
            speed *= 1.0 - step
        elif engine == "mujoco":  # Euler, implicit in the damping of joints
            speed /= 1.0 + step
        elif engine == "pybullet" and profile == "default":  # btMultiBody: linear and quadratic, of one number
            speed -= step * speed * (1.0 + abs(speed))
        else:  # Chipmunk's damping^h, and btRigidBody::applyDamping's (1 - damping)^h
            speed *= math.exp(-step)


@each("profile", ["default", "tuned", "located"])
@each("rate, speed, spin", STARTS)
def test_damping_follows_the_documented_integrator(
    engine: Adapter, finish: Finish, profile: str, rate: float, speed: float, spin: float
) -> None:
    """After 64 steps velocity, spin and position are those of the engine's documented damping, to rounding."""
    assert engine.capabilities.damping
    disc = disc_at(0.25, 0.5, speed, m=3.0, spin_rad_s=spin)
    end = finish(engine, staged("slows", disc, damping_per_s=rate, duration_s=STEPS * DT_S), DT_S, profile)
    speeds, spins = (list(_iterate_damped_speeds(profile, engine.name, rate, begin)) for begin in (speed, spin))
    moving = speeds[:-1] if engine.name == "pymunk" else speeds[1:]  # Chipmunk moves discs before it slows them down
    # 64 steps, each rounded at no more than 8 m or 8 m/s.
    rounding = scale_tolerance(engine, STEPS * float(np.spacing(8.0)))
    assert end.velocity_m_s[0] == pytest.approx([speeds[-1], 0.0], abs=rounding)
    assert end.position_m[0] == pytest.approx([0.25 + DT_S * math.fsum(moving), 0.5], abs=rounding)
    assert require_value(end.spin_rad_s)[0] == pytest.approx(spins[-1], abs=rounding)


@each("phase", range(8))
def test_bounce_step_is_damped_as_documented(engine: Adapter, finish: Finish, phase: int) -> None:
    """In the step of a bounce pymunk keeps e of the speed, MuJoCo (e - c h)/(1 + c h), others e times damping."""
    rate, speed, e = 1.0, 2.0, 0.75
    bodies = disc_at(1.0 + phase / 8 * speed * DT_S, 0.0, -speed), wall_at(0.0, 0.0, 1.0, 0.0)
    scene = staged("bounces", *bodies, wall_restitution=e, damping_per_s=rate, duration_s=STEPS * DT_S)
    kept = list(_iterate_damped_speeds("tuned", engine.name, rate, 1.0))
    step = rate * DT_S
    bounce = {"pymunk": e, "mujoco": (e - step) / (1.0 + step)}.get(engine.name, e * kept[1])
    found = finish(engine, scene, DT_S, "tuned").velocity_m_s[0, 0]
    assert found == pytest.approx(speed * bounce * kept[STEPS - 1], rel=1e-4)


RATE_HZ, SLOWER = 240.0, 0.8

#: Speeds, and directions in degrees off the x axis.
TABLE_STARTS = [(0.5 + 0.3 * k, 11.0 * k + 3.0) for k in range(8)]


def _build_table_scene(speed: float, degrees: float, **fields: Any) -> Scene:
    angle = math.radians(degrees)
    velocity = (speed * math.cos(angle), speed * math.sin(angle))
    disc = Disc(position_m=(0, 0), velocity_m_s=velocity, radius_m=0.25, **fields)
    return staged("thrown", disc, table_deceleration_m_s2=SLOWER, duration_s=math.ceil(speed / SLOWER + 1.0))


@each("profile", ["default", "tuned"])
@each("name, side", [("pymunk", 1.0), ("box2d", -1.0)])
def test_table_stops_a_disc_half_a_step_off_on_its_line(
    named: Named, finish: Finish, name: str, side: float, profile: str
) -> None:
    """Chipmunk stops a disc v dt/2 too far, Box2D as much too early, and both keep its line."""
    for k, (speed, degrees) in enumerate(TABLE_STARTS):
        end = finish(named(name), _build_table_scene(speed, degrees, mass_kg=0.5 + k), 1 / RATE_HZ, profile)
        along = complex(*end.position_m[0]) / complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
        beyond = along.real - speed * speed / (2.0 * SLOWER)
        assert beyond == pytest.approx(side * 0.5 * speed / RATE_HZ, rel=0.01)
        assert abs(along.imag) < 1e-5
        assert np.abs(end.velocity_m_s).max() == 0.0


def test_table_force_beyond_32_bits_is_refused(named: Named) -> None:
    """Box2D's adapter refuses a table force that overflows 32-bit floats; pymunk's adapter accepts it."""
    scene = _build_table_scene(1.0, 0.0, mass_kg=1e20).model_copy(update={"table_deceleration_m_s2": 1e10})
    settings = {name: named(name).profiles["tuned"].settings(1 / RATE_HZ) for name in ("box2d", "pymunk")}
    with pytest.raises(AdapterError, match="the table slows a disc of 1e\\+20 kg"):
        named("box2d").prepare(scene, settings["box2d"])
    named("pymunk").prepare(scene, settings["pymunk"]).close()
