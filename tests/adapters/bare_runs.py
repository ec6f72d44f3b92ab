"""Whole scenes in each engine by its own interface, without adapters and Carom.

Statements of a report about an engine are compared with these runs. `default` is the engine as shipped, elastic and
undamped; `tuned` is what the pages of `docs/engines` say of the profile, written down once more.
"""

import importlib
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Place, velocity and spin of each disc at each boundary of a step: shape (steps + 1, n, 5), in metres, seconds,
#: radians.
States = NDArray[np.float64]
Vector = tuple[float, float]

#: Longer and deeper than any of the scenes: no disc reaches the edge of the box that replaces a half-plane.
WALL_M = 64.0


@dataclass(frozen=True)
class Body:
    """A disc: mass is infinite of one that can't move, inertia of one that can't turn; None is what its shape has."""

    place: Vector
    velocity: Vector
    radius: float
    mass: float
    spin: float = 0.0
    inertia: float | None = math.inf

    def is_fast(self, dt_s: float) -> bool:
        """Whether it moves by more than its radius in a step."""
        return math.hypot(*self.velocity) * dt_s > self.radius


@dataclass(frozen=True)
class Stage:
    """What is to be run: discs, half-planes as point and normal, restitutions of discs and of walls, and gravity.

    Discs rub walls alone.
    """

    discs: tuple[Body, ...]
    walls: tuple[tuple[Vector, Vector], ...]
    restitution: float
    wall_restitution: float
    gravity: Vector
    wall_friction: float = 0.0


def _corners(normal: Vector, size: float) -> list[Vector]:
    """Return the corners of a block below the origin whose face is the wall's."""
    nx, ny = normal
    return [((a * ny - b * nx) * size, (-a * nx - b * ny) * size) for a, b in ((1, 0), (-1, 0), (-1, 1), (1, 1))]


def pymunk(stage: Stage, profile: str, dt_s: float, steps: int) -> States:
    """Run pymunk; restitutions are multiplied, so a disc has the root of the pairs' and a wall the quotient."""
    engine: Any = importlib.import_module("pymunk")
    space = engine.Space()
    space.gravity = stage.gravity
    if profile == "tuned":
        space.iterations, space.collision_bias = 20, 1.0
    of_disc = math.sqrt(stage.restitution)
    bodies = []
    for disc in stage.discs:
        fixed = math.isinf(disc.mass)
        moment = engine.moment_for_circle(disc.mass, 0, disc.radius) if disc.inertia is None else disc.inertia
        body = engine.Body(body_type=engine.Body.STATIC) if fixed else engine.Body(disc.mass, moment)
        body.position, body.velocity, body.angular_velocity = disc.place, disc.velocity, disc.spin
        circle = engine.Circle(body, disc.radius)
        circle.elasticity, circle.friction = of_disc, stage.wall_friction
        space.add(body, circle)
        bodies.append(body)
    for point, normal in stage.walls:
        body = engine.Body(body_type=engine.Body.STATIC)
        block = engine.Poly(body, [(point[0] + x, point[1] + y) for x, y in _corners(normal, WALL_M)])
        block.elasticity, block.friction = stage.wall_restitution / of_disc, 1.0  # frictions are multiplied, too
        space.add(body, block)

    def read() -> list[list[float]]:
        return [[*body.position, *body.velocity, body.angular_velocity] for body in bodies]

    return _run_steps(lambda: space.step(dt_s), read, steps)


def pybullet(stage: Stage, profile: str, dt_s: float, steps: int) -> States:
    """Run PyBullet with spheres and planes; restitutions and frictions are multiplied."""
    engine: Any = importlib.import_module("pybullet")
    client = engine.connect(engine.DIRECT)
    tuned = profile == "tuned"
    exact = {
        "contactERP": 0.0,
        "contactSlop": 0.0,
        "restitutionVelocityThreshold": 0.0,
        "deterministicOverlappingPairs": 1,
        "solverResidualThreshold": 0.0,
        "numSolverIterations": 50,
    }
    engine.setPhysicsEngineParameter(fixedTimeStep=dt_s, physicsClientId=client, **(exact if tuned else {}))
    of_disc = math.sqrt(stage.restitution)
    undamped = {"linearDamping": 0.0} if tuned else {"linearDamping": 0.0, "angularDamping": 0.0}

    def added(shape: int, mass: float, place: Vector, restitution: float, friction: float) -> int:
        body: int = engine.createMultiBody(
            mass, shape, basePosition=[*place, 0.0], useMaximalCoordinates=tuned, physicsClientId=client
        )
        said = dict(undamped, restitution=restitution, lateralFriction=friction)
        if tuned:
            said["contactProcessingThreshold"] = 0.0
        engine.changeDynamics(body, -1, physicsClientId=client, **said)
        return body

    bodies = []
    for disc in stage.discs:
        ball = engine.createCollisionShape(engine.GEOM_SPHERE, radius=disc.radius, physicsClientId=client)
        fixed = math.isinf(disc.mass)
        body = added(ball, 0.0 if fixed else disc.mass, disc.place, of_disc, stage.wall_friction)
        if not fixed:
            if disc.inertia is not None and math.isfinite(disc.inertia):
                inertia = [disc.inertia] * 3
                engine.changeDynamics(body, -1, mass=disc.mass, localInertiaDiagonal=inertia, physicsClientId=client)
            engine.resetBaseVelocity(body, [*disc.velocity, 0.0], [0, 0, disc.spin], client)
            if tuned and disc.is_fast(dt_s):
                swept = 0.95 * disc.radius
                engine.changeDynamics(body, -1, ccdSweptSphereRadius=swept, physicsClientId=client)
        bodies.append(body)
    for point, normal in stage.walls:
        plane = engine.createCollisionShape(engine.GEOM_PLANE, planeNormal=[*normal, 0.0], physicsClientId=client)
        added(plane, 0.0, point, stage.wall_restitution / of_disc, 1.0)
    engine.setGravity(*stage.gravity, 0.0, physicsClientId=client)

    def read() -> list[list[float]]:
        places = [engine.getBasePositionAndOrientation(body, client)[0][:2] for body in bodies]
        speeds = [(*v[:2], w[2]) for v, w in (engine.getBaseVelocity(body, client) for body in bodies)]
        return np.hstack([places, speeds]).tolist()  # type: ignore[no-any-return] # of two axes

    states = _run_steps(lambda: engine.stepSimulation(client), read, steps)
    engine.disconnect(client)
    return states


def mujoco(stage: Stage, profile: str, dt_s: float, steps: int) -> States:
    """Run MuJoCo with spheres and planes: a contact spring as shipped, or a damper that bounces in one step."""
    engine: Any = importlib.import_module("mujoco")
    tuned = profile == "tuned"

    def solref(restitution: float) -> str:
        if tuned:
            return f"0 {-(1.0 + restitution) / dt_s!r}"
        loss = -math.log(restitution) if restitution else math.inf
        damped = loss / math.hypot(math.pi, loss) if restitution else 1.0
        return f"-1000 {-2.0 * damped * math.sqrt(1000.0)!r}"

    shared = f'condim="{3 if stage.wall_friction else 1}"' + (' solimp="0.9999 0.9999 0.001 0.5 2"' if tuned else "")
    slides = tuned or (stage.wall_friction > 0 and all(disc.inertia == math.inf for disc in stage.discs))
    joint = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>' if slides else "<freejoint/>"
    parts = []
    for disc in stage.discs:
        size = f'type="sphere" size="{disc.radius!r}" solref="{solref(stage.restitution)}" {shared}'
        if math.isinf(disc.mass):
            parts.append(f'<geom pos="{disc.place[0]!r} {disc.place[1]!r} 0" {size}/>')
        elif slides or (disc.inertia is not None and math.isfinite(disc.inertia)):
            moment = 1.0 if slides else disc.inertia
            inertial = f'<inertial pos="0 0 0" mass="{disc.mass!r}" diaginertia="{moment} {moment} {moment}"/>'
            parts.append(f"<body>{inertial}{joint}<geom {size}/></body>")
        else:
            parts.append(f'<body>{joint}<geom mass="{disc.mass!r}" {size}/></body>')
    for (px, py), (nx, ny) in stage.walls:
        plane = f'type="plane" size="0 0 1" pos="{px!r} {py!r} 0" zaxis="{nx!r} {ny!r} 0" priority="1"'
        plane += f' friction="{stage.wall_friction!r} 0 0"'
        parts.append(f'<geom {plane} solref="{solref(stage.wall_restitution)}" {shared}/>')
    gravity = f"{stage.gravity[0]!r} {stage.gravity[1]!r} 0"
    flags = '<flag autoreset="disable" speculative="enable"/>' if tuned else ""
    exact = 'jacobian="dense" tolerance="0"' if tuned else ""
    option = f'<option timestep="{dt_s!r}" gravity="{gravity}" {exact}>{flags}</option>'
    model = engine.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{''.join(parts)}</worldbody></mujoco>")
    data = engine.MjData(model)
    per_place, per_speed = (2, 2) if slides else (7, 6)
    movable = [k for k, disc in enumerate(stage.discs) if not math.isinf(disc.mass)]
    for at, k in enumerate(movable):
        data.qpos[per_place * at : per_place * at + 2] = stage.discs[k].place
        data.qvel[per_speed * at : per_speed * at + 2] = stage.discs[k].velocity
        if not slides:
            data.qvel[per_speed * at + 5] = stage.discs[k].spin

    def read() -> list[list[float]]:
        rows = [[*disc.place, 0.0, 0.0, 0.0] for disc in stage.discs]
        for at, k in enumerate(movable):
            place, speed = data.qpos[per_place * at :], data.qvel[per_speed * at :]
            rows[k] = [*place[:2], *speed[:2], 0.0 if slides else speed[5]]
        return rows

    return _run_steps(lambda: engine.mj_step(model, data), read, steps)


def box2d(stage: Stage, profile: str, dt_s: float, steps: int) -> States:
    """Run Box2D; of two restitutions the larger counts. `tuned` counts time in units of 2^20 s."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its SWIG types have no __module__
        engine: Any = importlib.import_module("Box2D")
    tuned = profile == "tuned"
    unit = 2.0**-20 if tuned else 1.0
    world = engine.b2World(gravity=tuple(g / unit**2 for g in stage.gravity))
    world.continuousPhysics = not tuned or any(disc.is_fast(dt_s) for disc in stage.discs)
    # Category 1 is of discs with each other, 2 of discs and walls.
    apart = bool(stage.walls) and stage.wall_restitution < stage.restitution
    shapes = [(1, stage.restitution), (2, 0.0)] if apart else [(3, stage.restitution)]
    bodies = []
    for disc in stage.discs:
        if math.isinf(disc.mass):
            body = world.CreateStaticBody(position=disc.place)
        else:
            velocity, spin = tuple(v / unit for v in disc.velocity), disc.spin / unit
            body = world.CreateDynamicBody(position=disc.place, linearVelocity=velocity, angularVelocity=spin)
            body.fixedRotation = disc.inertia == math.inf
            body.bullet, body.sleepingAllowed = tuned and disc.is_fast(dt_s), tuned
        for bits, restitution in shapes:
            circle = engine.b2CircleShape(radius=disc.radius)
            laws = {"friction": stage.wall_friction, "restitution": restitution}
            body.CreateFixture(shape=circle, density=1, categoryBits=bits, maskBits=bits, **laws)
        if not math.isinf(disc.mass):
            inertia = 0.5 * disc.mass * disc.radius**2 if disc.inertia is None else disc.inertia
            inertia = inertia if math.isfinite(inertia) else 1.0  # of what can't turn it is not asked
            body.massData = engine.b2MassData(mass=disc.mass, center=(0, 0), I=inertia)
        bodies.append(body)
    for point, normal in stage.walls:
        block = engine.b2PolygonShape(vertices=_corners(normal, WALL_M))
        if tuned:
            block.radius = 0.0  # a skin of 1 cm is shipped
        body = world.CreateStaticBody(position=point)
        bits = 2 if apart else 3
        laws = {"friction": stage.wall_friction, "restitution": stage.wall_restitution}
        body.CreateFixture(shape=block, categoryBits=bits, maskBits=bits, **laws)

    def read() -> list[list[float]]:
        return [[*body.position, *(v * unit for v in (*body.linearVelocity, body.angularVelocity))] for body in bodies]

    velocity_iterations, position_iterations = (50, 0) if tuned else (8, 3)
    return _run_steps(lambda: world.Step(dt_s * unit, velocity_iterations, position_iterations), read, steps)


def _run_steps(step: Callable[[], object], read: Callable[[], list[list[float]]], steps: int) -> States:
    seen = [read()]
    for _ in range(steps):
        step()
        seen.append(read())
    return np.array(seen, dtype=np.float64)


ENGINES: Mapping[str, Callable[[Stage, str, float, int], States]] = {
    "pymunk": pymunk,
    "pybullet": pybullet,
    "mujoco": mujoco,
    "box2d": box2d,
}
