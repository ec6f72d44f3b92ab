"""What engines make of damping and of tables that slow discs down: mapped, and bare; from several starts each."""

import importlib
import math
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from tests.adapters.engine_scenes import scale_tolerance
from tests.cases import each, release_after
from tests.scene_builders import Finish, Named, disc_at, require_value, staged, wall_at

from carom import Disc, Scene
from carom.engines.api import Adapter, AdapterError
from carom.execution.observation.engine_run import observe_run

DT_S, STEPS = 1 / 64, 64

#: Rate, velocity and spin of eight starts.
STARTS = [(rate, 0.5 + 0.75 * k, 1.25 - 0.5 * k) for k, rate in enumerate((0.01, 0.04, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0))]


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
@each("rate, speed, spin", [*STARTS[1::3], *release_after(0, STARTS)])
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


def _measure_stop_error(place: tuple[float, float], speed: float, degrees: float) -> tuple[float, float]:
    """Return the distance of a disc from the stop of the law, along its way and across."""
    found = complex(*place) / complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
    return found.real - speed * speed / (2.0 * SLOWER), found.imag


@each("profile", ["default", "tuned"])
@each("name, side", [("pymunk", 1.0), ("box2d", -1.0)])
def test_table_stops_a_disc_half_a_step_off_on_its_line(
    named: Named, finish: Finish, name: str, side: float, profile: str
) -> None:
    """Chipmunk stops a disc v dt/2 too far, Box2D as much too early, and both keep its line."""
    for k, (speed, degrees) in enumerate(TABLE_STARTS):
        end = finish(named(name), _build_table_scene(speed, degrees, mass_kg=0.5 + k), 1 / RATE_HZ, profile)
        beyond, aside = _measure_stop_error(tuple(end.position_m[0]), speed, degrees)
        assert beyond == pytest.approx(side * 0.5 * speed / RATE_HZ, rel=0.01)
        assert abs(aside) < 1e-5
        assert np.abs(end.velocity_m_s).max() == 0.0


@pytest.mark.long
@each("name", ["pymunk", "box2d"])
def test_impact_on_a_table_has_the_reduced_speed(named: Named, name: str) -> None:
    """Two discs on a table have one impact, at most 1.5 steps late, with the remaining speed to 2 a dt."""
    for start, _ in TABLE_STARTS:
        speed, way = 1.5 + start, 0.5
        discs = [disc_at(0, 0, speed, r=0.25), disc_at(2 * 0.25 + way, 0, r=0.25, m=2.0)]
        scene = staged("pair", *discs, table_deceleration_m_s2=SLOWER, duration_s=2.0)
        (found,) = observe_run(named(name), scene, "tuned", 1 / RATE_HZ).impacts
        left = math.sqrt(speed * speed - 2.0 * SLOWER * way)
        assert -1e-6 <= found["time_s"] - (speed - left) / SLOWER <= 1.5 / RATE_HZ
        after = (found["velocity_first_after"][0], found["velocity_second_after"][0])
        assert after == pytest.approx((-left / 3.0, 2.0 * left / 3.0), abs=2.0 * SLOWER / RATE_HZ)


def test_table_force_beyond_32_bits_is_refused(named: Named) -> None:
    """Box2D's adapter refuses a table force that overflows 32-bit floats; pymunk's adapter accepts it."""
    scene = _build_table_scene(1.0, 0.0, mass_kg=1e20).model_copy(update={"table_deceleration_m_s2": 1e10})
    settings = {name: named(name).profiles["tuned"].settings(1 / RATE_HZ) for name in ("box2d", "pymunk")}
    with pytest.raises(AdapterError, match="the table slows a disc of 1e\\+20 kg"):
        named("box2d").prepare(scene, settings["box2d"])
    named("pymunk").prepare(scene, settings["pymunk"]).close()


# Bare engines, without Carom; see docs/theory/contact.md. ----------------------------------------------------


def _run_bare_pymunk(speed: float, degrees: float) -> tuple[float, float]:
    """Stop by a `velocity_func`, as others build it, and not by a joint."""
    import pymunk as engine

    def slows(body: Any, _gravity: Any, _damping: float, dt: float) -> None:
        left = max(0.0, body.velocity.length - SLOWER * dt)
        body.velocity = body.velocity.normalized() * left

    space = engine.Space()
    body = engine.Body(1.0, 0.03)
    body.velocity = engine.Vec2d(speed, 0).rotated_degrees(degrees)
    body.velocity_func = slows
    space.add(body, engine.Circle(body, 0.25))
    for _ in range(round((speed / SLOWER + 1.0) * RATE_HZ)):
        space.step(1 / RATE_HZ)
    return body.position.x, body.position.y


def _run_bare_box2d(speed: float, degrees: float) -> tuple[float, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine: Any = importlib.import_module("Box2D")
    world, angle = engine.b2World(gravity=(0, 0)), math.radians(degrees)
    body = world.CreateDynamicBody(linearVelocity=(speed * math.cos(angle), speed * math.sin(angle)))
    body.CreateCircleFixture(radius=0.25, density=1.0)
    world.CreateFrictionJoint(bodyA=world.CreateStaticBody(), bodyB=body, maxForce=SLOWER * body.mass)
    for _ in range(round((speed / SLOWER + 1.0) * RATE_HZ)):
        world.Step(1 / RATE_HZ, 8, 3)
    return tuple(body.position)


def _run_bare_mujoco(speed: float, degrees: float) -> tuple[float, float]:
    engine: Any = importlib.import_module("mujoco")
    model = engine.MjModel.from_xml_string(f"""
<mujoco><option timestep="{1 / RATE_HZ}" gravity="0 0 0"/><worldbody><body>
  <joint type="slide" axis="1 0 0" frictionloss="{SLOWER}"/><joint type="slide" axis="0 1 0" frictionloss="{SLOWER}"/>
  <geom type="sphere" size=".25" mass="1"/></body></worldbody></mujoco>""")
    data, angle = engine.MjData(model), math.radians(degrees)
    data.qvel[:] = speed * math.cos(angle), speed * math.sin(angle)
    engine.mj_step(model, data, nstep=round((speed / SLOWER + 1.0) * RATE_HZ))
    return tuple(data.qpos)


@pytest.mark.long
@each("alone, side", [(_run_bare_pymunk, 1.0), (_run_bare_box2d, -1.0)])
def test_bare_engines_stop_like_their_adapters(
    alone: Callable[[float, float], tuple[float, float]], side: float
) -> None:
    """Bare pymunk with a `velocity_func` and bare Box2D with a friction joint stop half a step off, on the line."""
    for speed, degrees in TABLE_STARTS:
        beyond, aside = _measure_stop_error(alone(speed, degrees), speed, degrees)
        assert beyond == pytest.approx(side * 0.5 * speed / RATE_HZ, rel=0.01)
        assert abs(aside) < 1e-5


@pytest.mark.long
def test_bare_mujoco_brakes_each_axis_separately() -> None:
    """MuJoCo's `frictionloss` decelerates each component: a disc leaves its line and stops at (u^2, v^2)/(2 a)."""
    worst = 0.0
    for speed, degrees in TABLE_STARTS:
        place, angle = _run_bare_mujoco(speed, degrees), math.radians(degrees)
        axes = [part * abs(part) / (2.0 * SLOWER) for part in (speed * math.cos(angle), speed * math.sin(angle))]
        assert place == pytest.approx(axes, abs=0.02)
        worst = max(worst, math.hypot(*_measure_stop_error(place, speed, degrees)))
    assert worst > 0.3


@pytest.mark.long
def test_bare_pybullet_keeps_a_rolling_ball_on_its_line() -> None:
    """A ball with rolling friction keeps its direction to 1e-6 degrees: bullet3 #2117 is not reproduced."""
    engine: Any = importlib.import_module("pybullet")
    radius, friction, slower = 0.028575, 0.5, 0.02 * 9.81 / 1.4
    for degrees in (10.0, 20.0, 30.0, 36.87, 45.0, 60.0, 75.0, 80.0):
        client, angle = engine.connect(engine.DIRECT), math.radians(degrees)
        x, y = math.cos(angle), math.sin(angle)
        try:
            engine.setGravity(0, 0, -9.81, physicsClientId=client)
            plane = engine.createCollisionShape(engine.GEOM_PLANE, physicsClientId=client)
            ball = engine.createCollisionShape(engine.GEOM_SPHERE, radius=radius, physicsClientId=client)
            floor = engine.createMultiBody(0, plane, physicsClientId=client)
            body = engine.createMultiBody(0.17, ball, basePosition=[0, 0, radius], physicsClientId=client)
            engine.changeDynamics(
                floor, -1, lateralFriction=1, rollingFriction=0.02 * radius / friction, physicsClientId=client
            )
            engine.changeDynamics(
                body, -1, lateralFriction=friction, linearDamping=0, angularDamping=0,
                localInertiaDiagonal=[0.4 * 0.17 * radius**2] * 3, physicsClientId=client,
            )  # fmt: skip
            engine.setPhysicsEngineParameter(fixedTimeStep=1 / RATE_HZ, physicsClientId=client)
            spin = [-0.5 * y / radius, 0.5 * x / radius, 0]
            engine.resetBaseVelocity(body, [0.5 * x, 0.5 * y, 0], spin, physicsClientId=client)
            for _ in range(round(2.5 * RATE_HZ)):
                engine.stepSimulation(physicsClientId=client)
            (u, v, _), _ = engine.getBaseVelocity(body, physicsClientId=client)
        finally:
            engine.disconnect(client)
        assert math.degrees(math.atan2(v, u)) == pytest.approx(degrees, abs=1e-6)
        assert 0.0 < math.hypot(u, v) < 0.5 - 0.9 * slower * 2.5
