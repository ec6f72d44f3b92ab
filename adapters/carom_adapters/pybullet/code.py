"""Bullet's settings as a program to paste."""

from __future__ import annotations

from collections.abc import Mapping

from carom.adapter import Scene, Setting, factored_frictions, factored_restitutions, is_fast
from carom_adapters.code import PYTHON_END, arguments, comment, steps_of
from carom_adapters.pybullet.limits import WORLD_SETTINGS
from carom_adapters.pybullet.world import dynamics_of, moments_of, require_usable

__all__ = ["code"]


def code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return the client that `PybulletWorld` sets up as a program."""
    require_usable(scene, settings)
    dt_s, turns = float(settings["dt_s"]), scene.arrays.turns
    restitution, wall_restitution = factored_restitutions(scene)
    friction, wall_friction = factored_frictions(scene) if turns else (0.0, 0.0)
    ccd_fraction = float(settings.get("ccd_radius_fraction", 0.0))
    maximal = bool(settings.get("useMaximalCoordinates", False))
    world = {"fixedTimeStep": dt_s} | {name: settings[name] for name in WORLD_SETTINGS if name in settings}
    dynamics = dynamics_of(scene, settings)
    lines = []
    for disc in scene.discs:
        given: dict[str, object] = {}
        if not disc.immovable:
            given = {"mass": disc.mass_kg, "velocity": disc.velocity_m_s, "spin": disc.spin_rad_s}
            if (moments := moments_of(scene, settings, disc)) is not None:
                given["inertia"] = moments
            if ccd_fraction > 0 and is_fast(disc, dt_s):  # moves by more than its radius in a step
                given["swept_radius"] = ccd_fraction * disc.radius_m
        lines.append(f"add_disc({disc.position_m!r}, {disc.radius_m!r}{', ' * bool(given)}{arguments(given)})")
    lines += [f"add_wall({wall.point_m!r}, {wall.normal!r})" for wall in scene.half_planes()]
    if turns and maximal:
        lines.append(
            "pybullet.stepSimulation()  # a changed inertia counts from the next step on: all are at rest in this one"
        )
    if scene.gravity_m_s2 != (0.0, 0.0):
        lines.append(f"pybullet.setGravity({scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0)")
    shape = "CYLINDER" if settings.get("shape", "sphere") == "cylinder" else "SPHERE"
    state = "*place(body), *pybullet.getBaseVelocity(body)[0][:2], pybullet.getBaseVelocity(body)[1][2]"
    end = PYTHON_END.format(step="pybullet.stepSimulation()", state=state)
    bodies = "\n".join(lines)
    return f"""{comment(heading)}
import pybullet

dt, steps = {dt_s!r}, {steps_of(scene, settings)}
pybullet.connect(pybullet.DIRECT)  # GUI shows a window
pybullet.setPhysicsEngineParameter({arguments(world)})
discs, starts = [], []


def add(mass, shape, position, restitution, friction):
    body = pybullet.createMultiBody(mass, shape, basePosition=[*position, 0.0], useMaximalCoordinates={maximal})
    # Bullet multiplies the two coefficients of a pair.
    pybullet.changeDynamics(body, -1, restitution=restitution, lateralFriction=friction)
    pybullet.changeDynamics(body, -1, {arguments(dynamics)})
    return body


def add_disc(position, radius, mass=0.0, velocity=(0.0, 0.0), spin=0.0, inertia=None, swept_radius=None):
    shape = pybullet.createCollisionShape(pybullet.GEOM_{shape}, radius=radius, height=2 * radius)
    body = add(mass, shape, position, restitution={restitution!r}, friction={friction!r})
    if inertia is not None:
        pybullet.changeDynamics(body, -1, mass=mass, localInertiaDiagonal=inertia)
    if swept_radius is not None:  # continuous detection
        pybullet.changeDynamics(body, -1, ccdSweptSphereRadius=swept_radius)
    discs.append(body)
    if mass:
        starts.append((body, position, velocity, spin))


def add_wall(point, normal):
    shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=[*normal, 0.0])
    add(0.0, shape, point, restitution={wall_restitution!r}, friction={wall_friction!r})


def place(body):
    return pybullet.getBasePositionAndOrientation(body)[0][:2]


{bodies}
for body, position, velocity, spin in starts:
    pybullet.resetBasePositionAndOrientation(body, [*position, 0.0], [0, 0, 0, 1])
    pybullet.resetBaseVelocity(body, [*velocity, 0.0], [0.0, 0.0, spin])
{end}"""
