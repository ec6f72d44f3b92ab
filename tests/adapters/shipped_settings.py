"""What engines ship, read from the engines themselves, and two discs that meet in an engine that is left as shipped.

The adapters take no part. `Shipped.values` are by the names that the profile `default` uses, those of its settings and
those of `Profile.changed`; None where an engine has no such value. `Shipped.run` makes two elastic discs meet with
nothing but what `changed` lists set otherwise, save that no disc is kept from turning.
"""

import importlib
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.scene_builders import disc_at, staged

from carom import Disc, Scene
from carom.engines.api import Adapter, Setting

#: Steps before two discs touch, and in all: some are left for an engine's afterthoughts.
STEPS_BEFORE, STEPS = 12, 40
DT_S = 1 / 60

#: Closing speeds, m/s: below every threshold, below those of 1 m/s, above all.
SPEEDS = (0.08, 0.9, 5.0)
PHASES = tuple(k / 4 for k in range(4))

#: Of a setting that the engine does not tell: that it is as shipped is seen in its runs alone.
NOT_TOLD = "not told"

#: Positions and velocities at the end, one row a disc.
End = NDArray[np.float64]


@dataclass(frozen=True)
class Shipped:
    """What an engine ships.

    Attributes:
        values: The shipped value of each name; None where the engine has none.
        run: Takes two discs, steps `STEPS` times and gives x, y, vx and vy of each, shape (2, 4).
        roundings: By how many roundings a disc that is free to turn may differ from one that the adapter keeps from
            it: 0 where the adapter leaves it free.
    """

    values: Mapping[str, object]
    run: Callable[[Sequence[Disc]], End]
    roundings: int = 0


def build_meeting_scene(speed_m_s: float, phase: float) -> Scene:
    """Two discs of 1 and 2 kg that meet off their line of centres, `phase` of a step later than at a step."""
    radius, offset = 0.25, 0.3
    apart = math.sqrt((2 * radius) ** 2 - offset**2) + speed_m_s * (STEPS_BEFORE + phase) * DT_S
    discs = disc_at(-apart, 0, speed_m_s, r=radius), disc_at(0, offset, r=radius, m=2)
    return staged("meeting", *discs, duration_s=STEPS * DT_S)


def assert_default_is_shipped(adapter: Adapter, shipped: Shipped) -> None:
    """What `default` uses are the engine's defaults, except for those that the profile lists, all of which differ."""
    profile = adapter.profiles["default"]
    changed = set(profile.changed)
    world = adapter.prepare(build_meeting_scene(SPEEDS[0], 0.0), profile.settings(DT_S))
    used = {name: value for name, value in world.settings.items() if name != "dt_s"}
    world.close()
    assert used.keys() | changed == shipped.values.keys()
    for name, value in used.items():
        if name in changed:
            assert not _same(value, shipped.values[name]), f"{name} is listed as changed, and is as shipped: {value}"
        elif shipped.values[name] != NOT_TOLD:
            assert _same(value, shipped.values[name]), f"{name} is {value}, and shipped is {shipped.values[name]}"


def _same(used: Setting, shipped: object) -> bool:
    """Whether two values are one; numbers to the rounding of 32 bits, in which some engines keep theirs."""
    if isinstance(used, bool | str) or shipped is None or isinstance(shipped, bool | str):
        return used == shipped
    assert isinstance(shipped, int | float)
    return math.isclose(float(used), shipped, rel_tol=2.0**-23)


def measure_largest_difference(adapter: Adapter, shipped: Shipped) -> float:
    """How far `default` ends from the engine as shipped: the largest, in roundings of the largest number there is."""
    rounding = 2.0 ** (-23 if adapter.capabilities.float_bits == 32 else -52)
    found = []
    for speed in SPEEDS:
        for phase in PHASES:
            scene = build_meeting_scene(speed, phase)
            world = adapter.prepare(scene, adapter.profiles["default"].settings(DT_S))
            world.advance(STEPS)
            end = world.observe()
            world.close()
            bare = shipped.run(scene.discs)
            difference = np.abs(np.hstack([end.position_m, end.velocity_m_s]) - bare)
            found.append(float(difference.max() / (rounding * np.abs(bare).max())))
    assert not np.isnan(found).any()
    return max(found)


def run_bare_pymunk(discs: Sequence[Disc]) -> End:
    """Run discs in pymunk, each free to turn."""
    import pymunk

    space, bodies = pymunk.Space(), []
    for disc in discs:
        body = pymunk.Body(disc.mass_kg, pymunk.moment_for_circle(disc.mass_kg, 0, disc.radius_m))
        body.position, body.velocity = disc.position_m, disc.velocity_m_s
        circle = pymunk.Circle(body, disc.radius_m)
        circle.elasticity = 1.0
        space.add(body, circle)
        bodies.append(body)
    for _ in range(STEPS):
        space.step(DT_S)
    return np.array([[*body.position, *body.velocity] for body in bodies])


def run_bare_pybullet(discs: Sequence[Disc]) -> End:
    """Run discs in PyBullet as spheres, without its damping and friction."""
    bullet: Any = importlib.import_module("pybullet")
    client = bullet.connect(bullet.DIRECT)
    bullet.setPhysicsEngineParameter(fixedTimeStep=DT_S, physicsClientId=client)
    bodies = []
    for disc in discs:
        ball = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=disc.radius_m, physicsClientId=client)
        body = bullet.createMultiBody(disc.mass_kg, ball, basePosition=[*disc.position_m, 0], physicsClientId=client)
        smooth = {"restitution": 1, "lateralFriction": 0, "linearDamping": 0, "angularDamping": 0}
        bullet.changeDynamics(body, -1, **smooth, physicsClientId=client)
        bullet.resetBaseVelocity(body, [*disc.velocity_m_s, 0], [0, 0, 0], client)
        bodies.append(body)
    for _ in range(STEPS):
        bullet.stepSimulation(client)
    places = [bullet.getBasePositionAndOrientation(body, client)[0][:2] for body in bodies]
    speeds = [bullet.getBaseVelocity(body, client)[0][:2] for body in bodies]
    bullet.disconnect(client)
    return np.hstack([places, speeds])


def run_bare_mujoco(discs: Sequence[Disc]) -> End:
    """Run discs in MuJoCo as free spheres, with the contact spring that its users recommend."""
    mujoco: Any = importlib.import_module("mujoco")
    bodies = "".join(
        f'<body><freejoint/><geom type="sphere" size="{disc.radius_m!r}" mass="{disc.mass_kg!r}" condim="1" '
        'solref="-1000 0"/></body>'
        for disc in discs
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{DT_S!r}" gravity="0 0 0"/><worldbody>{bodies}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    for k, disc in enumerate(discs):
        data.qpos[7 * k : 7 * k + 2] = disc.position_m
        data.qvel[6 * k : 6 * k + 2] = disc.velocity_m_s
    mujoco.mj_step(model, data, nstep=STEPS)
    return np.hstack([data.qpos.reshape(-1, 7)[:, :2], data.qvel.reshape(-1, 6)[:, :2]])


def run_bare_box2d(discs: Sequence[Disc]) -> End:
    """Run discs in Box2D, each free to turn and kept awake, with the iterations that its manual recommends."""
    box2d = _import_box2d()
    world, bodies = box2d.b2World(gravity=(0, 0)), []
    for disc in discs:
        body = world.CreateDynamicBody(position=disc.position_m, linearVelocity=disc.velocity_m_s, allowSleep=False)
        body.CreateFixture(shape=box2d.b2CircleShape(radius=disc.radius_m), density=1, friction=0, restitution=1)
        body.massData = box2d.b2MassData(mass=disc.mass_kg, center=(0, 0), I=0.5 * disc.mass_kg * disc.radius_m**2)
        bodies.append(body)
    for _ in range(STEPS):
        world.Step(DT_S, 8, 3)
    return np.array([[*body.position, *body.linearVelocity] for body in bodies], dtype=np.float64)


def _import_box2d() -> Any:
    """Import Box2D without the warnings of its types, which have no `__module__`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("Box2D")


def read_pymunk_defaults() -> Shipped:
    """Pymunk's own: the attributes of a space and of a shape."""
    import pymunk

    space, names = pymunk.Space(), ["iterations", "damping", "collision_slop", "collision_bias"]
    names += ["collision_persistence", "idle_speed_threshold", "sleep_time_threshold"]
    shape = pymunk.Circle(pymunk.Body(1, 1), 1)
    values: dict[str, object] = {name: getattr(space, name) for name in names}
    values |= {"elasticity": shape.elasticity, "friction": shape.friction, "moment": None, "set_neighbors": NOT_TOLD}
    return Shipped(values, run_bare_pymunk)


def read_pybullet_defaults() -> Shipped:
    """PyBullet's own; damping, which it does not tell, is the part of its speed that a free body loses a second."""
    bullet: Any = importlib.import_module("pybullet")
    client = bullet.connect(bullet.DIRECT)
    bullet.setPhysicsEngineParameter(fixedTimeStep=DT_S, physicsClientId=client)
    body = bullet.createMultiBody(
        1, bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=1, physicsClientId=client), physicsClientId=client
    )
    world, told = bullet.getPhysicsEngineParameters(client), bullet.getDynamicsInfo(body, -1, client)
    bullet.resetBaseVelocity(body, [1, 0, 0], [0, 0, 1], client)
    bullet.stepSimulation(client)
    (left, _, _), (_, _, spin) = bullet.getBaseVelocity(body, client)
    bullet.disconnect(client)
    values = {
        "numSolverIterations": world["numSolverIterations"],
        "useMaximalCoordinates": told[10] == 1,
        "lateralFriction": told[1],
        "restitution": told[5],
        "linearDamping": (1 - left) / DT_S,
        "angularDamping": (1 - spin) / DT_S,
    }
    return Shipped(values, run_bare_pybullet)


def read_mujoco_defaults() -> Shipped:
    """MuJoCo's own: the options of a model that sets none, and its geoms."""
    mujoco: Any = importlib.import_module("mujoco")
    ball = '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(ball)
    option, geom = model.opt, model.geom(0)
    values = {
        "integrator": {0: "Euler", 1: "RK4", 2: "implicit", 3: "implicitfast"}[int(option.integrator)],
        "jacobian": {0: "dense", 1: "sparse", 2: "auto"}[int(option.jacobian)],
        "tolerance": float(option.tolerance),
        "iterations": int(option.iterations),
        "ccd_tolerance": float(option.ccd_tolerance),
        "ccd_iterations": int(option.ccd_iterations),
        "warmstart": not option.disableflags & int(mujoco.mjtDisableBit.mjDSBL_WARMSTART),
        "autoreset": not option.disableflags & int(mujoco.mjtDisableBit.mjDSBL_AUTORESET),
        "speculative": bool(option.enableflags & int(mujoco.mjtEnableBit.mjENBL_SPECULATIVE)),
        "solimp": " ".join(f"{value:g}" for value in geom.solimp),
        "friction": float(geom.friction[0]),
        "condim": int(geom.condim[0]),
        # Words of the adapter's own: a free body of a ball, no pair listed, friction as MuJoCo answers it.
        "joints": "free",
        "shape": "sphere",
        "listed_pairs": False,
        "in_turn": False,
        # Both are of a solref in its other form, of negative numbers.
        "stiffness": None,
        "damping": None,
    }
    return Shipped(values, run_bare_mujoco)


def read_box2d_defaults() -> Shipped:
    """Box2D's own: the attributes of a world and of a body."""
    box2d = _import_box2d()
    world = box2d.b2World()
    body = world.CreateDynamicBody()
    fixture = body.CreateFixture(shape=box2d.b2CircleShape(radius=1), density=1)
    values = {
        "warmStarting": bool(world.warmStarting),
        "continuousPhysics": bool(world.continuousPhysics),
        "restitution": float(fixture.restitution),
        "friction": float(fixture.friction),
        "sleepingAllowed": bool(body.sleepingAllowed),
        "fixedRotation": bool(body.fixedRotation),
        "velocityIterations": None,
        "positionIterations": None,
        # Words of the adapter's own: time as it is, swept against what can't move, no wall that had a skin, and each
        # edge of a wall a shape of its own.
        "velocity_scale": 1.0,
        "sweep": "shipped",
        "polygon_radius_m": 0.0,
        "chains": False,
    }
    return Shipped(values, run_bare_box2d, roundings=1)


OF_ALL: dict[str, Callable[[], Shipped]] = {
    "pymunk": read_pymunk_defaults,
    "pybullet": read_pybullet_defaults,
    "mujoco": read_mujoco_defaults,
    "box2d": read_box2d_defaults,
}
