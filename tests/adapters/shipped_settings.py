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
from tests.adapters.bare_runs import ENGINES, Body, Stage
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


def bare_run_of(engine: str) -> Callable[[Sequence[Disc]], End]:
    """Return how discs run in the bare engine as shipped, each free to turn."""

    def run(discs: Sequence[Disc]) -> End:
        bodies = [Body(disc.position_m, disc.velocity_m_s, disc.radius_m, disc.mass_kg, inertia=None) for disc in discs]
        return ENGINES[engine](Stage(tuple(bodies), (), 1.0, 1.0, (0.0, 0.0)), "default", DT_S, STEPS)[-1, :, :4]

    return run


def read_pymunk_defaults() -> Shipped:
    """Pymunk's own: the attributes of a space and of a shape."""
    import pymunk

    space, names = pymunk.Space(), ["iterations", "damping", "collision_slop", "collision_bias"]
    names += ["collision_persistence", "idle_speed_threshold", "sleep_time_threshold"]
    shape = pymunk.Circle(pymunk.Body(1, 1), 1)
    values: dict[str, object] = {name: getattr(space, name) for name in names}
    values |= {"elasticity": shape.elasticity, "friction": shape.friction, "moment": None, "set_neighbors": NOT_TOLD}
    return Shipped(values, bare_run_of("pymunk"))


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
    return Shipped(values, bare_run_of("pybullet"))


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
    return Shipped(values, bare_run_of("mujoco"))


def read_box2d_defaults() -> Shipped:
    """Box2D's own: the attributes of a world and of a body."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        box2d: Any = importlib.import_module("Box2D")
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
    return Shipped(values, bare_run_of("box2d"), roundings=1)


OF_ALL: dict[str, Callable[[], Shipped]] = {
    "pymunk": read_pymunk_defaults,
    "pybullet": read_pybullet_defaults,
    "mujoco": read_mujoco_defaults,
    "box2d": read_box2d_defaults,
}
