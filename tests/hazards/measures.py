"""What is measured: the scenes of the group `engines`, bounces by speed, a gas, and findings of `docs/engines`.

Each figure has an answer by mechanics, and is measured at `STARTS` phases. Engines are run also beyond what a profile
declares: it is there that they do in silence what its limits are declared for.
"""

import importlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np
from tests.hazards.spread import Spread, build_starts, energy_change, run_to_end, velocities_after
from tests.scene_builders import disc_at, staged

from carom import Chain, Scene
from carom.catalogue.entry import CatalogueScene
from carom.catalogue.find_scenes import find_scenes
from carom.engines.api import Adapter, AdapterError, Setting
from carom.engines.registry import explain_unavailable_adapter, load_adapter
from carom.execution.job import Method

DT_S = 1 / 60

#: Number of phases of each measurement, evenly spread over a step and beginning with 0; and of a gas.
STARTS, GAS_STARTS = 32, 16

#: Engines in the order of the page; Carom's own PIT, what checking once per step costs by itself, first.
ENGINES = (
    "pit", "pymunk", "pybullet", "mujoco", "box2d", "planck", "matter", "box2d3", "jolt", "rapier2d", "cannon", "p2",
    "havok", "physx", "rapier", "dart", "drake", "ode", "newton",
)  # fmt: skip

#: Speeds at which two discs close, m/s: below, about and above where engines stop to bounce.
SPEEDS = (0.01, 0.08, 0.15, 0.5, 0.9, 1.1, 5.0)

GAS = "engines/gas-of-25"
#: Findings of chaotic runs, and their seconds.
CHAOTIC = {
    f"largest distance of 25 free spheres from the plane after {seconds} s, m": float(seconds) for seconds in (4, 8, 20)
}
#: Drake's tuned gas takes minutes a start, and a located one asks for some 48 steps an impact.
NO_GAS = {("drake", "tuned")}


@dataclass(frozen=True)
class Figure:
    """One figure of one method.

    Attributes:
        table: Table of the page.
        of: Row or column of the table: a scene, a speed, a sentence.
        engine: Name of the adapter.
        profile: Name of the profile, with the settings that were changed.
        spread: Its spread over phases; None if the engine refuses the scene.
        refused: Why, empty where it does not.
    """

    table: str
    of: str
    engine: str
    profile: str
    spread: Spread | None
    refused: str = ""


def build_head_on_scene(
    speed_m_s: float, radius_m: float = 0.5, *, at_m: float = 0.0, both: bool = False, mass_kg: float = 1.0
) -> Scene:
    """Build two equal discs that meet after 8 to 9 steps; the second is at `at_m`, at rest unless both move."""
    half, steps = (speed_m_s / 2 if both else 0.0), 8
    gap = speed_m_s * (steps + 0.37) * DT_S
    starts = ((at_m - 2 * radius_m - gap, speed_m_s - half), (at_m, -half))
    return staged(
        "head-on", *[disc_at(x, 0, speed, r=radius_m, m=mass_kg) for x, speed in starts], duration_s=12 * steps * DT_S
    )


def build_passing_scene(gap_m: float, speed_m_s: float = 3.0, dt_s: float = DT_S) -> Scene:
    """Build a disc that passes a resting disc of the same size at a distance."""
    return staged(
        "passing",
        disc_at(-0.6 * speed_m_s, 0, speed_m_s, r=0.25),
        disc_at(0, 0.5 + gap_m, r=0.25),
        duration_s=1.25,
        frame_rate_hz=1 / dt_s,
    )


def build_paddle_scene(speed_m_s: float, *, disc_m_s: float = 0.0, radius_m: float = 0.5) -> Scene:
    """Build a driven edge that strikes a disc head-on after 8 to 9 steps."""
    gap = (speed_m_s + disc_m_s) * 8.37 * DT_S
    return staged(
        "paddled",
        disc_at(radius_m + gap, 0, -disc_m_s, r=radius_m),
        Chain(points_m=[(0, -4), (0, 4)], velocity_m_s=(speed_m_s, 0)),
        duration_s=16 * DT_S,
    )


def measure_paddle_restitution(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return separation speed over closing speed of a disc and a paddle; the correct value is 1."""
    velocity = float(run_to_end(adapter, scene, DT_S, profile).velocity_m_s[0, 0])
    drive = scene.walls[0].velocity_m_s[0]
    return (velocity - drive) / (drive - scene.discs[0].velocity_m_s[0])


def measure_largest_crushed_speed(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return the largest speed of a disc that a piston crushes, in m/s; the correct speed has no bound."""
    world = adapter.prepare(scene, adapter.profiles[profile].settings(DT_S))
    fastest = 0.0
    for _ in range(scene.step_count(DT_S)):
        world.advance(1)
        fastest = max(fastest, math.hypot(*world.observe().velocity_m_s[0]))
    world.close()
    return fastest


def measure_crushed_overshoot(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return how far a crushed disc's centre ends beyond the wall or the piston, in metres; 0 is correct."""
    (x, _) = run_to_end(adapter, scene, DT_S, profile).position_m[0]
    faces = [
        (wall.point_m[0] + wall.velocity_m_s[0] * scene.duration_s, wall.normal[0]) for wall in scene.half_planes()
    ]
    return max(0.0, *(float((face - x) * normal) for face, normal in faces))


def measure_mocap_restitution(_adapter: Adapter, scene: Scene, _profile: str) -> float:
    """Return the same as `measure_paddle_restitution` for a `mocap` box of MuJoCo that is placed at each step."""
    mujoco: Any = importlib.import_module("mujoco")
    (disc,), (drive, _) = scene.discs, scene.walls[0].velocity_m_s
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{DT_S}" gravity="0 0 0"/>
        <default><geom condim="1" solref="0 {-2 / DT_S}" solimp="0.9999 0.9999 0.001"/></default>
        <worldbody><body mocap="true"><geom type="box" size="0.01 4 1" pos="-0.01 0 0"/></body>
        <body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="{disc.radius_m}" mass="1"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = disc.position_m[0], disc.velocity_m_s[0]
    for step in range(scene.step_count(DT_S)):
        data.mocap_pos[0] = (drive * step * DT_S, 0, 0)
        mujoco.mj_step(model, data)
    return float(data.qvel[0] - drive) / (drive - disc.velocity_m_s[0])


def measure_box_restitution(_adapter: Adapter, scene: Scene, _profile: str) -> float:
    """Return the same as `measure_paddle_restitution` for a massless box of PyBullet that has a velocity."""
    p: Any = importlib.import_module("pybullet")
    (disc,), (drive, _) = scene.discs, scene.walls[0].velocity_m_s
    client = p.connect(p.DIRECT)
    p.setTimeStep(DT_S, physicsClientId=client)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.01, 4, 1], physicsClientId=client)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=disc.radius_m, physicsClientId=client)
    at = (0.0, box, -0.01, drive), (1.0, ball, disc.position_m[0], disc.velocity_m_s[0])
    for mass, shape, x, speed in at:
        body = p.createMultiBody(mass, shape, -1, [x, 0, 0], physicsClientId=client)
        smooth = {"restitution": 1, "lateralFriction": 0, "linearDamping": 0, "angularDamping": 0}
        p.changeDynamics(body, -1, **smooth, physicsClientId=client)
        p.resetBaseVelocity(body, [speed, 0, 0], [0, 0, 0], physicsClientId=client)
    for _step in range(scene.step_count(DT_S)):
        p.stepSimulation(physicsClientId=client)
    left = p.getBaseVelocity(body, physicsClientId=client)[0][0]
    p.disconnect(client)
    return float(left - drive) / (drive - disc.velocity_m_s[0])


def measure_restitution(adapter: Adapter, scene: Scene, profile: str, **changes: Setting) -> float:
    """Return separation speed over closing speed of two discs on the x axis; the correct value is 1."""
    velocity = run_to_end(adapter, scene, 1 / scene.frame_rate_hz, profile, **changes).velocity_m_s[:, 0]
    first, second = scene.discs
    return float(velocity[1] - velocity[0]) / (first.velocity_m_s[0] - second.velocity_m_s[0])


def measure_velocity_change(adapter: Adapter, scene: Scene, profile: str, **changes: Setting) -> float:
    """Return the velocity change of discs that do not touch, over the largest speed; 0 is correct."""
    start = np.array([disc.velocity_m_s for disc in scene.discs])
    end = run_to_end(adapter, scene, 1 / scene.frame_rate_hz, profile, **changes).velocity_m_s
    return float(np.abs(end - start).max() / np.abs(start).max())


def _measure_velocity_error(entry: CatalogueScene, adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return the velocity error at the end of a scene at some phase, divided by its greatest speed."""
    error = run_to_end(adapter, scene, 1 / scene.frame_rate_hz, profile).velocity_m_s - velocities_after(entry)
    return float(np.hypot(*error.T).max()) / max(math.hypot(*disc.velocity_m_s) for disc in entry.scene.discs)


def measure_energy_ratio(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return the kinetic energy at the end over that at the start; 1 is correct for elastic impacts."""
    return 1 + energy_change(scene, run_to_end(adapter, scene, DT_S, profile))


@dataclass(frozen=True)
class Finding:
    """A measurement: a sentence of `docs/engines`, or a cell of another table.

    Attributes:
        says: What the figure is.
        engine: Name of the adapter.
        profile: Name of the profile.
        scene: The scene; it runs at many phases.
        figure: What is read of a run.
        right: The correct value.
        changes: Settings that replace the profile's.
        count: Number of phases.
        table: Table of the page.
    """

    says: str
    engine: str
    profile: str
    scene: Scene
    figure: Callable[..., float]
    right: float
    changes: Mapping[str, Setting] = field(default_factory=dict)
    count: int = STARTS
    table: str = "findings"


def _restitution(told: str, engine: str, profile: str, scene: Scene, right: float = 1.0, **changes: Setting) -> Finding:
    """Return the finding for separation speed over closing speed of two discs."""
    says = f"separation speed / closing speed, {told}"
    return Finding(says, engine, profile, scene, measure_restitution, right, changes)


def _pass(engine: str, profile: str, gap_m: float, rate_hz: int = 60) -> Finding:
    """Return the finding for discs that pass each other without contact."""
    says = f"velocity change / speed when discs pass at {1000 * gap_m:g} mm, {rate_hz} Hz"
    scene = build_passing_scene(gap_m, dt_s=1 / rate_hz)
    return Finding(says, engine, profile, scene, measure_velocity_change, 0.0)


def _findings() -> Iterator[Finding]:
    for profile, speeds in {"default": (5.0, 1.0, 0.5, 0.1), "tuned": (1.0, 0.1, 0.01)}.items():
        for speed in speeds:
            yield _restitution(f"{speed:g} m/s", "drake", profile, build_head_on_scene(speed))
    for mass in (1.0, 100.0, 10000.0):
        heavy = build_head_on_scene(5.0, mass_kg=mass)
        yield _restitution(f"5 m/s, discs of {mass:g} kg", "ode", "default", heavy)
    plastic = build_head_on_scene(5.0).model_copy(update={"restitution": 0.0})
    yield _restitution("5 m/s, restitution 0", "ode", "default", plastic, 0.0)
    for pixels in (60, 110, 130, 300, 1200):
        scene, told = build_head_on_scene(pixels / 128), f"{pixels} pixels per second"
        yield _restitution(f"{told}, discs can turn", "matter", "default", scene)
        yield _restitution(f"{told}, discs cannot turn", "matter", "default", scene, locked=True)
    told, scene = "110 pixels per second, discs cannot turn, 5 velocity iterations", build_head_on_scene(110 / 128)
    yield _restitution(told, "matter", "default", scene, locked=True, velocityIterations=5)
    for name in ("rapier", "rapier2d"):
        for gap in (0.001, 0.002, 0.005):
            for rate in (60, 240, 960) if gap == 0.001 else (60,):
                yield _pass(name, "default", gap, rate)
    for name in ("box2d3", "jolt", "physx"):
        for gap in (0.001, 0.005):
            yield _pass(name, "default", gap)
    for closing in (100.0, 160.0, 199.0):
        yield _restitution(f"{closing:g} m/s, discs of 5 m", "dart", "default", build_large_discs(closing))
    says, film = "velocity error / speed in engines/film", _load_entry("engines/film")
    swept = (("planck", "swept"), ("planck", "event-driven"), *((n, "swept") for n in ("jolt", "rapier2d", "rapier")))
    for name, profile in swept:
        yield Finding(says, name, profile, film.scene, partial(_measure_velocity_error, film), 0.0)
    for says, seconds in CHAOTIC.items():
        scene = _load_entry(GAS).scene.model_copy(update={"duration_s": seconds})
        yield Finding(says, "mujoco", "default", scene, measure_distance_from_plane, 0.0, count=GAS_STARTS)
    says = "separation speed / closing speed at a paddle of {:g} m/s ({})"
    scene = build_paddle_scene(1.0, disc_m_s=1.0)
    yield Finding(says.format(1, "a mocap body"), "mujoco", "default", scene, measure_mocap_restitution, 1.0)
    for drive in (1.0, 5.0):
        scene = build_paddle_scene(drive, disc_m_s=drive)
        yield Finding(says.format(drive, "a box"), "pybullet", "default", scene, measure_box_restitution, 1.0)
    yield from _swept_findings()
    yield from _far_out_findings()
    yield from _heavy_findings()
    yield from _lost_bounce_findings()


def _load_entry(name: str) -> CatalogueScene:
    (entry,) = find_scenes([name])
    return entry


def _build_crush_scene() -> Scene:
    """Return the catalogue's crush scene, half a second longer than the disc has space."""
    return _load_entry("driven/crush").scene.model_copy(update={"duration_s": 3.5, "frame_rate_hz": 1 / DT_S})


def build_large_discs(closing_m_s: float) -> Scene:
    """Build two discs of 5 m that meet after 0.1 s, each at half the closing speed."""
    gap = 0.1 * closing_m_s
    return staged(
        "large",
        disc_at(-5 - gap / 2, 0, closing_m_s / 2, r=5),
        disc_at(5 + gap / 2, 0, -closing_m_s / 2, r=5),
        duration_s=0.2,
        frame_rate_hz=256.0,
    )


def measure_distance_from_plane(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return the largest distance of MuJoCo's free spheres from the plane at the end, in metres; 0 is correct."""
    world: Any = adapter.prepare(scene, adapter.profiles[profile].settings(DT_S))
    world.advance(scene.step_count(DT_S))
    farthest = float(np.abs(world._data.qpos[world._height_at]).max())  # noqa: SLF001 - an observation is of the plane
    world.close()
    return farthest


def _swept_findings() -> Iterator[Finding]:
    says = "discs of radius 5 cm, {} m/s, {}"
    for engine, profiles in {
        "planck": ("tuned", "swept", "event-driven"),
        "box2d3": ("swept",),
        "jolt": ("tuned", "swept"),
        "p2": ("tuned", "swept"),
        "havok": ("default", "tuned"),
        "physx": ("tuned", "swept"),
        "rapier2d": ("ccd", "swept"),
        "rapier": ("tuned", "swept"),
        "pybullet": ("no-ccd", "tuned"),
        "mujoco": ("no-ccd", "tuned"),
    }.items():
        for profile in profiles:
            for both in (False, True):
                target, scene = "both move" if both else "one at rest", build_head_on_scene(100.0, 0.05, both=both)
                yield _restitution(says.format(100, target), engine, profile, scene)
            if engine == "planck":
                yield _restitution(says.format(1000, "one at rest"), engine, profile, build_head_on_scene(1000.0, 0.05))


def _far_out_findings() -> Iterator[Finding]:
    small, rows = "discs of radius 5 cm", [(x, v) for x in (10.0, 17.0, 30.0, 60.0, 100.0) for v in (10.0, 100.0)]
    for (x, speed), profile in [*((row, "event-driven") for row in rows), (rows[-1], "swept")]:
        told = f"{small}, {speed:g} m/s, one at rest, {x:g} m from the origin"
        yield _restitution(told, "planck", profile, build_head_on_scene(speed, 0.05, at_m=x))


def _heavy_findings() -> Iterator[Finding]:
    for profile in ("default", "tuned"):
        for mass_kg in (1e2, 1e4, 1e6):
            for name in ("cannon", "p2"):
                heavy = build_head_on_scene(5.0, mass_kg=mass_kg)
                yield _restitution(f"5 m/s, discs of {mass_kg:g} kg", name, profile, heavy)
        for rate in (60, 240, 960):
            scene = build_head_on_scene(5.0).model_copy(update={"frame_rate_hz": float(rate)})
            yield _restitution(f"5 m/s, {rate} Hz", "p2", profile, scene)


def _lost_bounce_findings() -> Iterator[Finding]:
    for speed in (1.99, 2.01):
        yield _restitution(f"{speed:g} m/s", "physx", "default", build_head_on_scene(speed))
    for profile in ("default", "tuned"):
        for rate in (30, 60, 120, 240, 960):
            scene = build_head_on_scene(5.0).model_copy(update={"frame_rate_hz": float(rate)})
            yield _restitution(f"5 m/s, {rate} Hz", "havok", profile, scene)
        says = "energy after / before an oblique impact at 5 m/s, 60 Hz"
        yield Finding(says, "havok", profile, _load_entry("classics/oblique-3-4-5").scene, measure_energy_ratio, 1.0)
        for gap in (0.001, 0.005):
            yield _pass("havok", profile, gap)


FINDINGS: tuple[Finding, ...] = tuple(_findings())


@cache
def list_starts(scene: Scene, count: int = STARTS) -> tuple[Scene, ...]:
    """Return a scene at each phase; the scenes are the same for every engine."""
    return tuple(build_starts(scene, count))


def list_profiles(adapter: Adapter, *names: str) -> list[str]:
    """Return the named profiles that an adapter has; the only profile of PIT is returned once."""
    known = dict.fromkeys(Method(adapter.name, name).profile for name in names)
    return [name for name in known if name in adapter.profiles]


def measure_energy_change(adapter: Adapter, scene: Scene, profile: str) -> float:
    """Return the relative change of the kinetic energy; 0 is correct."""
    return energy_change(scene, run_to_end(adapter, scene, DT_S, profile))


#: What is driven, by columns of the page: a scene, what is read of it, what mechanics says.
DRIVEN: dict[str, tuple[Scene, Callable[..., float], float]] = {
    "separation / closing speed, paddle of 1 m/s": (
        build_paddle_scene(1.0, disc_m_s=2.0),
        measure_paddle_restitution,
        1.0,
    ),
    "separation / closing speed, paddle of 65 m/s": (
        build_paddle_scene(65.0, radius_m=2.0),
        measure_paddle_restitution,
        1.0,
    ),
    "crushed disc: largest speed, m/s": (_build_crush_scene(), measure_largest_crushed_speed, math.inf),
    "crushed disc: distance beyond a wall, m": (_build_crush_scene(), measure_crushed_overshoot, 0.0),
}


def _list_measurements(adapter: Adapter) -> Iterator[Finding]:
    """Yield the measurements of every engine: a group of scenes, bounces, driven walls, a gas."""
    name = adapter.name
    for entry in find_scenes(["engines"]):
        if entry.name != GAS:
            figure = partial(_measure_velocity_error, entry)
            yield Finding(entry.name, name, "default", entry.scene, figure, 0.0, table="group")
    for profile in list_profiles(adapter, "default", "tuned"):
        for speed in SPEEDS:
            scene = build_head_on_scene(speed)
            yield Finding(f"{speed:g} m/s", name, profile, scene, measure_restitution, 1.0, table="bounces")
    for profile in list_profiles(adapter, "default", "tuned") if adapter.capabilities.driven_walls else ():
        for of, (scene, read, right) in DRIVEN.items():
            yield Finding(of, name, profile, scene, read, right, table="driven")
    for profile in list_profiles(adapter, "default", "tuned", "swept"):
        if (name, profile) not in NO_GAS:
            scene = _load_entry(GAS).scene
            yield Finding(GAS, name, profile, scene, measure_energy_change, 0.0, count=GAS_STARTS, table="gas")


def measure_finding(finding: Finding, adapter: Adapter) -> Figure:
    """Return the figure of a finding, or why the engine refuses the scene."""
    names = (finding.table, finding.says, finding.engine, finding.profile)
    starts = list_starts(finding.scene, finding.count)
    try:
        values = tuple(finding.figure(adapter, scene, finding.profile, **finding.changes) for scene in starts)
    except AdapterError as error:
        return Figure(*names, None, str(error))
    if any(map(math.isnan, values)):
        return Figure(*names, None, "not a number")
    return Figure(*names, Spread(values, finding.right))


def measure_engines(
    names: tuple[str, ...] = ENGINES, tables: tuple[str, ...] = (), *, chaotic: bool = True
) -> Iterator[Figure]:
    """Measure all engines that are installed."""
    for name in names:
        adapter = load_adapter(name)
        if explain_unavailable_adapter(adapter):
            continue
        own = (one for one in FINDINGS if one.engine == name and (chaotic or one.says not in CHAOTIC))
        for finding in (*_list_measurements(adapter), *own):
            if not tables or finding.table in tables:
                yield measure_finding(finding, adapter)
