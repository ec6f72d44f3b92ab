"""Writes a scene and settings as a program for Bullet, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Chain, Ring, Scene, Setting, Wall, is_fast
from carom_adapters.pybullet.limits import WORLD_SETTINGS, require_usable
from carom_adapters.pybullet.model import build_dynamics, compute_capsule, compute_moments, compute_resistance
from carom_adapters.shared.legs import Driven, find_first_velocity, format_program_end, group_legs_by_step
from carom_adapters.shared.settings_code import count_steps, format_arguments, format_comment, format_disc
from carom_adapters.shared.walls import compute_thickness, cut_chain, factor_walls

#: Line that sets a wall's rolling friction, which Bullet multiplies by the disc's friction.
ROLLING = (
    "    pybullet.changeDynamics(body, -1, rollingFriction=rolling)  # Bullet multiplies it by the disc's friction\n"
)


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same client as `PybulletWorld`."""
    require_usable(scene, settings)
    dt_s, turns = float(settings["dt_s"]), scene.arrays.turns
    restitution, friction, of_walls = factor_walls(scene)
    ccd_fraction = float(settings.get("ccd_radius_fraction", 0.0))
    maximal = bool(settings.get("useMaximalCoordinates", False))
    world = {"fixedTimeStep": dt_s} | {name: settings[name] for name in WORLD_SETTINGS if name in settings}
    dynamics = build_dynamics(scene, settings)
    lines = []
    starts: list[Driven] = []  # the bodies in the order in which the program creates them
    for disc in scene.discs:
        arguments: dict[str, object] = {}
        if disc.driven:
            arguments = {"velocity": find_first_velocity(disc), "spin": disc.spin_rad_s, "driven": True}
        if not disc.immovable:
            arguments = {"mass": disc.mass_kg, "velocity": disc.velocity_m_s, "spin": disc.spin_rad_s}
            if (moments := compute_moments(scene, settings, disc)) is not None:
                arguments["inertia"] = moments
            if ccd_fraction > 0 and is_fast(disc, dt_s):  # the disc moves by more than its radius in a step
                arguments["swept_radius"] = ccd_fraction * disc.radius_m
        lines.append(format_disc(disc, arguments))
        starts += [disc] if disc.driven or not disc.immovable else []
    for wall, material in zip(scene.walls, of_walls, strict=True):
        wall_lines = _format_wall_lines(scene, wall, material, compute_resistance(scene, friction))
        lines += wall_lines
        starts += [wall] * len(wall_lines) if wall.driven else []
    if turns and maximal:
        lines.append("pybullet.stepSimulation()  # applies the changed inertia; all bodies are at rest in this step")
    if scene.gravity_m_s2 != (0.0, 0.0):
        lines.append(f"pybullet.setGravity({scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0)")
    resists = scene.wall_rolling_resistance > 0.0
    shape = "CYLINDER" if settings.get("shape", "sphere") == "cylinder" else "SPHERE"
    state = "*place(body), *pybullet.getBaseVelocity(body)[0][:2], pybullet.getBaseVelocity(body)[1][2]"
    change = "pybullet.resetBaseVelocity(starts[k][0], [*velocity, 0.0], [0.0, 0.0, starts[k][4]])"
    end = format_program_end(scene, "pybullet.stepSimulation()", state, group_legs_by_step(starts, dt_s), change)
    bodies = "\n".join(lines)
    return f"""{format_comment(heading)}
import pybullet

dt, steps = {dt_s!r}, {count_steps(scene, settings)}
pybullet.connect(pybullet.DIRECT)  # GUI shows a window
pybullet.setPhysicsEngineParameter({format_arguments(world)})
discs, starts = [], []


def add(mass, shape, position, restitution, friction, turn=(0, 0, 0, 1), driven=False):
    # With maximal coordinates a body without a mass does not move.
    maximal = {maximal} and not driven
    body = pybullet.createMultiBody(mass, shape, -1, [*position, 0.0], turn, useMaximalCoordinates=maximal)
    # Bullet multiplies the two coefficients of a pair.
    pybullet.changeDynamics(body, -1, restitution=restitution, lateralFriction=friction)
    pybullet.changeDynamics(body, -1, {format_arguments(dynamics)})
    return body


def add_disc(position, radius, mass=0.0, velocity=(0.0, 0.0), spin=0.0, inertia=None, swept_radius=None, driven=False):
    shape = pybullet.createCollisionShape(pybullet.GEOM_{shape}, radius=radius, height=2 * radius)
    body = add(mass, shape, position, restitution={restitution!r}, friction={friction!r}, driven=driven)
    if inertia is not None:
        pybullet.changeDynamics(body, -1, mass=mass, localInertiaDiagonal=inertia)
    if swept_radius is not None:  # continuous detection
        pybullet.changeDynamics(body, -1, ccdSweptSphereRadius=swept_radius)
    discs.append(body)
    if mass or driven:
        starts.append((body, position, (0, 0, 0, 1), velocity, spin))


def add_wall(shape, place, restitution, friction, turn=(0, 0, 0, 1), velocity=None{", rolling=0.0" * resists}):
    body = add(0.0, shape, place, restitution, friction, turn, velocity is not None)
{ROLLING * resists}    if velocity is not None:
        starts.append((body, place, turn, velocity, 0.0))


def place(body):
    return pybullet.getBasePositionAndOrientation(body)[0][:2]


{bodies}
for body, position, turn, velocity, spin in starts:
    pybullet.resetBasePositionAndOrientation(body, [*position, 0.0], turn)
    pybullet.resetBaseVelocity(body, [*velocity, 0.0], [0.0, 0.0, spin])
{end}"""


def _format_wall_lines(
    scene: Scene, wall: Wall | Chain | Ring, material: tuple[float, float], rolling: float
) -> list[str]:
    """Return a line for each body of a wall."""
    driven = f", velocity={find_first_velocity(wall)!r}" if wall.driven else ""
    coefficients = f"restitution={material[0]!r}, friction={material[1]!r}"
    coefficients += f", rolling={rolling!r}" if rolling else ""

    def format_line(kind: str, shape: dict[str, object], place: tuple[float, float], turn: str = "") -> str:
        shape_call = f"pybullet.createCollisionShape(pybullet.GEOM_{kind}, {format_arguments(shape)})"
        return f"add_wall({shape_call}, {place!r}, {coefficients}{turn}{driven})"

    if isinstance(wall, Wall):
        return [format_line("PLANE", {"planeNormal": [*wall.normal, 0.0]}, wall.point_m)]
    radius = compute_thickness(scene, wall)
    if isinstance(wall, Ring):
        return [format_line("SPHERE", {"radius": radius}, wall.centre_m)]
    capsules = (compute_capsule(a, b) for a, b in cut_chain(wall))
    return [
        format_line("CAPSULE", {"radius": radius, "height": h}, middle, f", turn={turn!r}")
        for h, middle, turn in capsules
    ]
