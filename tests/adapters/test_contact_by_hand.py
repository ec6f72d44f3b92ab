"""What the report says of engines in contact, beside the engine alone and the law by hand: six cases, nothing of Carom.

Each script has the disc on the line y = 0, and a slope by turning gravity.
"""

from __future__ import annotations

import importlib
import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import carom
from carom import compare, solve_pic, solve_pit
from carom.adapter import Adapter
from carom.comparator.grades import Grade
from carom.runs.observe import observe_run

pytestmark = pytest.mark.long

Array = NDArray[np.float64]
Named = Callable[[str], Adapter]

DT_S, RADIUS_M, G = 1 / 240, 0.5, 10.0

#: Of one instant: how far along the floor and off it, how fast along and off it, and how fast the rim is.
State = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Start:
    """A disc of 1 kg on a floor: how fast it and its rim are, its friction, the slope's tangent, its inertia factor."""

    along: float
    rim: float
    friction: float
    fall: float = 0.0
    inertia: float = 0.5

    @property
    def pull(self) -> tuple[float, float]:
        """Gravity along the floor and off it."""
        long = math.hypot(1.0, self.fall)
        return G * self.fall / long, -G / long

    @property
    def moment(self) -> float:
        """Moment of inertia, infinite where it does not turn."""
        return self.inertia * RADIUS_M**2


def pymunk(start: Start, *, tuned: bool) -> Iterator[State]:
    """Yield states after each step."""
    import pymunk as engine

    space = engine.Space()
    space.gravity = start.pull
    if tuned:
        space.iterations, space.collision_bias = 20, 1.0
    body = engine.Body(1.0, start.moment)
    body.position, body.velocity, body.angular_velocity = (0, RADIUS_M), (start.along, 0), start.rim / RADIUS_M
    floor = engine.Body(body_type=engine.Body.STATIC)
    shapes = (engine.Circle(body, RADIUS_M), engine.Poly(floor, [(-99, -99), (99, -99), (99, 0), (-99, 0)]))
    shapes[0].friction, shapes[1].friction = start.friction, 1.0
    space.add(body, floor, *shapes)
    while True:
        space.step(DT_S)
        yield body.position.x, body.position.y - RADIUS_M, *body.velocity, body.angular_velocity * RADIUS_M


def box2d(start: Start) -> Iterator[State]:
    """Yield states after each step, all as shipped but awake."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine: Any = importlib.import_module("Box2D")
    world = engine.b2World(gravity=start.pull)
    body = world.CreateDynamicBody(
        position=(0, RADIUS_M),
        linearVelocity=(start.along, 0),
        angularVelocity=start.rim / RADIUS_M,
        allowSleep=False,
    )
    body.CreateCircleFixture(radius=RADIUS_M, density=1.0, friction=start.friction, restitution=0.0)
    body.massData = engine.b2MassData(mass=1.0, center=(0, 0), I=start.moment)
    floor = world.CreateStaticBody()
    floor.CreatePolygonFixture(vertices=[(-99, -99), (99, -99), (99, 0), (-99, 0)], friction=start.friction)
    while True:
        world.Step(DT_S, 8, 3)
        yield body.position[0], body.position[1] - RADIUS_M, *body.linearVelocity, body.angularVelocity * RADIUS_M


def pybullet(start: Start) -> Iterator[State]:
    """Yield states after each step, all as shipped but undamped."""
    engine: Any = importlib.import_module("pybullet")
    client = engine.connect(engine.DIRECT)
    try:
        engine.setGravity(*start.pull, 0, physicsClientId=client)
        plane = engine.createCollisionShape(engine.GEOM_PLANE, planeNormal=[0, 1, 0], physicsClientId=client)
        ball = engine.createCollisionShape(engine.GEOM_SPHERE, radius=RADIUS_M, physicsClientId=client)
        floor = engine.createMultiBody(0, plane, physicsClientId=client)
        body = engine.createMultiBody(1, ball, basePosition=[0, RADIUS_M, 0], physicsClientId=client)
        engine.changeDynamics(floor, -1, lateralFriction=1.0, physicsClientId=client)
        engine.changeDynamics(
            body, -1, mass=1.0, lateralFriction=start.friction, localInertiaDiagonal=[start.moment] * 3,
            linearDamping=0, angularDamping=0, physicsClientId=client,
        )  # fmt: skip
        engine.setPhysicsEngineParameter(fixedTimeStep=DT_S, physicsClientId=client)
        engine.resetBaseVelocity(body, [start.along, 0, 0], [0, 0, start.rim / RADIUS_M], physicsClientId=client)
        while True:
            engine.stepSimulation(physicsClientId=client)
            (x, y, _), _ = engine.getBasePositionAndOrientation(body, physicsClientId=client)
            (u, v, _), (_, _, spin) = engine.getBaseVelocity(body, physicsClientId=client)
            yield x, y - RADIUS_M, u, v, spin * RADIUS_M
    finally:
        engine.disconnect(client)


def mujoco(start: Start) -> Iterator[State]:
    """Yield states after each step, as shipped but with the spring of those who want a bounce, critically damped."""
    engine: Any = importlib.import_module("mujoco")

    solref = f'solref="-1000 {-2 * math.sqrt(1000)}"'
    turns = math.isfinite(start.moment)
    slides = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    moment = start.moment if turns else 0.25
    model = engine.MjModel.from_xml_string(f"""
<mujoco><option timestep="{DT_S}" gravity="{start.pull[0]} {start.pull[1]} 0"/><worldbody>
  <geom type="plane" size="0 0 1" zaxis="0 1 0" friction="{start.friction} 0 0" priority="1" {solref}/>
  <body pos="0 {RADIUS_M} 0"><inertial pos="0 0 0" mass="1" diaginertia="{moment} {moment} {moment}"/>
    {"<freejoint/>" if turns else slides}
    <geom type="sphere" size="{RADIUS_M}"/></body></worldbody></mujoco>""")
    data = engine.MjData(model)
    data.qvel[0] = start.along
    if turns:
        data.qvel[5] = start.rim / RADIUS_M
    off = RADIUS_M if turns else 0.0  # of slides, places are counted from the start
    while True:
        engine.mj_step(model, data)
        yield data.qpos[0], data.qpos[1] - off, *data.qvel[:2], data.qvel[5] * RADIUS_M if turns else 0.0


def slides_to_roll(time_s: float) -> State:
    """By hand: friction takes 2 m/s^2 of the disc and gives 4 to its rim, until both are 2 m/s."""
    slid = min(time_s, 0.5)
    return 3 * slid - slid**2 + 2 * (time_s - slid), 0.0, 3 - 2 * slid, 0.0, -4 * slid


def comes_back(time_s: float) -> State:
    """By hand: 1 m/s and a rim of 5 the other way round, until both are 1 m/s backwards."""
    slid = min(time_s, 1.0)
    return slid - slid**2 - (time_s - slid), 0.0, 1 - 2 * slid, 0.0, 5 - 4 * slid


def stops(time_s: float) -> State:
    """By hand: 3 m/s, of which friction takes 3 in a second."""
    slid = min(time_s, 1.0)
    return 3 * slid - 1.5 * slid**2, 0.0, 3 - 3 * slid, 0.0, 0.0


def holds(_time_s: float) -> State:
    """By hand: nothing happens."""
    return 0.0, 0.0, 0.0, 0.0, 0.0


def slips(time_s: float) -> State:
    """By hand: of 6 m/s^2 friction leaves 4.4, and turns the rim by 3.2."""
    return 2.2 * time_s**2, 0.0, 4.4 * time_s, 0.0, -3.2 * time_s


@dataclass(frozen=True)
class Case:
    """A scene, an engine's profile, the engine alone, the law by hand, and the grade."""

    scene: str
    engine: str
    profile: str
    alone: Callable[[], Iterator[State]]
    law: Callable[[float], State]
    grade: Grade


CASES = [
    Case(
        "stops", "pymunk", "tuned", lambda: pymunk(Start(3, 0, 0.3, inertia=math.inf), tuned=True), stops, Grade.SAMPLED
    ),
    Case(
        "slide-to-roll",
        "pymunk",
        "default",
        lambda: pymunk(Start(3, 0, 0.2), tuned=False),
        slides_to_roll,
        Grade.SAMPLED,
    ),
    Case("slide-to-roll", "box2d", "default", lambda: box2d(Start(3, 0, 0.2)), slides_to_roll, Grade.SAMPLED),
    Case("comes-back", "pybullet", "default", lambda: pybullet(Start(1, 5, 0.2)), comes_back, Grade.SAMPLED),
    Case("incline-slips", "mujoco", "default", lambda: mujoco(Start(0, 0, 0.2, fall=0.75)), slips, Grade.INACCURATE),
    Case("holds", "mujoco", "default", lambda: mujoco(Start(0, 0, 0.8, 0.75, math.inf)), holds, Grade.INACCURATE),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.scene}-{case.engine}-{case.profile}")
def test_the_engine_alone_is_off_by_as_much_as_the_report_says(named: Named, case: Case) -> None:
    """Place, velocity, rim and angular momentum, at the instants that were looked at, to 32-bit roundings."""
    scene = carom.scene(f"contact/{case.scene}")
    trace = observe_run(named(case.engine), scene, case.profile, DT_S)
    score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=240.0))
    assert score.contact is not None
    assert trace.looks is not None
    steps = {round(time_s / DT_S) for time_s in trace.looks.time_s.tolist()} - {0}
    alone = case.alone()
    states = [next(alone) for _ in range(max(steps))]
    off: Array = np.array([np.subtract(states[k - 1], case.law(k * DT_S)) for k in sorted(steps)])
    assert score.contact.own.place_m == pytest.approx(np.hypot(off[:, 0], off[:, 1]).max(), rel=1e-3, abs=1e-6)
    assert score.contact.own.rim_m_s == pytest.approx(np.abs(off[:, 4]).max(), rel=1e-3, abs=1e-5)
    assert score.contact.own.velocity_m_s == pytest.approx(np.hypot(off[:, 2], off[:, 3]).max(), rel=1e-3, abs=1e-5)
    if not math.isnan(score.contact.momentum_m_s):
        momentum = np.abs(off[:, 2] - 0.5 * off[:, 4]).max()
        assert score.contact.momentum_m_s == pytest.approx(momentum, rel=1e-3, abs=1e-5)
    assert score.contact.grade is case.grade
