"""Writes a scene and settings as a program for Rapier, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import AdapterError, Chain, Ring, Scene, Setting, Wall
from carom_adapters.rapier.limits import PARAMETERS, SOFTNESSES, check_inputs
from carom_adapters.shared.legs import Driven, find_first_velocity, format_program_end, group_legs_by_step, has_legs
from carom_adapters.shared.settings_code import count_steps, format_assignments, format_comment, format_disc
from carom_adapters.shared.walls import compute_thickness, cut_chain


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same world as `RapierWorld`.

    Raises:
        AdapterError: Rapier does not support the scene or a setting, or the steps are taken in two parts.
    """
    check_inputs(scene, settings)
    if "first_part" in settings:
        raise AdapterError("Rapier: Carom takes these steps in two parts (first_part), which code for Rapier can't do")
    lines = []
    driven: list[Driven] = [disc for disc in scene.discs if disc.driven]
    for disc in scene.discs:
        arguments: dict[str, object] = {} if disc.immovable else {"mass": disc.mass_kg}
        if disc.driven or not disc.immovable:
            arguments["velocity"] = find_first_velocity(disc)
        lines.append(format_disc(disc, arguments))
    for wall, material in zip(scene.walls, scene.arrays.materials, strict=True):
        wins = "MIN" if material.restitution < scene.restitution else "MAX"
        moves = f", velocity={find_first_velocity(wall)!r}" if wall.driven else ""
        properties, shapes = f"{material.restitution!r}, {wins!r}{moves}", _format_shapes(scene, wall)
        lines += [f"add_wall(rapier3d.Collider.{shape}, {properties})" for shape in shapes]
        driven += [wall] * len(shapes) if wall.driven else []
    soft = "".join(
        f"softness = parameters.{attribute}  # a copy\nsoftness.natural_frequency = {settings[name]!r}\n"
        f"parameters.{attribute} = softness\n"
        for name, attribute in SOFTNESSES.items()
        if name in settings
    )
    swept = ""
    if "soft_ccd_prediction" in settings:
        swept = f"    body = body.soft_ccd_prediction({settings['soft_ccd_prediction']!r})  # continuous detection\n"
    state = "*body.translation.to_tuple()[:2], *body.linvel.to_tuple()[:2], 0.0"
    legs = group_legs_by_step(driven, float(settings["dt_s"]))
    end = format_program_end(
        scene, "world.step()", state, legs, "world.rigid_bodies[driven[k]].linvel = (*velocity, 0.0)"
    )
    record_line = "    if {}velocity is not None:\n        driven.append({})\n" if has_legs(scene) else ""
    record_disc, record_wall = record_line.format("mass is None and ", "handles[-1]"), record_line.format("", "body")
    bodies = "\n".join(lines)
    return f"""{format_comment(heading)}
import rapier3d

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
world = rapier3d.PhysicsWorld(gravity=({scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0))
parameters = world.integration_parameters
parameters.dt = dt
{format_assignments("parameters", settings, PARAMETERS)}{soft}handles = []
{"driven = []" + chr(10) if record_line else ""}

def held(velocity):  # a body that no impact moves: it is at rest or driven
    if velocity is None:
        return rapier3d.RigidBody.fixed()
    return rapier3d.RigidBody.kinematic_velocity_based().linvel((*velocity, 0.0))


def add_disc(position, radius, mass=None, velocity=None):  # a ball that stays in the plane and does not turn
    body = held(velocity) if mass is None else rapier3d.RigidBody.dynamic().linvel((*velocity, 0.0))
    body = body.translation((*position, 0.0))
    body = body.can_sleep({bool(settings["can_sleep"])}).enabled_rotations((False, False, False))
    body = body.enabled_translations((True, True, False))
{swept}    ball = rapier3d.Collider.ball(radius).restitution({scene.restitution!r}).friction(0.0)
    handles.append(world.add_body(body))
{record_disc}    world.add_collider(ball if mass is None else ball.mass(mass), handles[-1])


def add_wall(shape, restitution, wins, velocity=None):
    # By default Rapier averages two coefficients; any other rule has precedence.
    shape = shape.friction(0.0).restitution(restitution)
    shape = shape.restitution_combine_rule(getattr(rapier3d.CoefficientCombineRule, wins))
    body = world.add_body(held(velocity))
{record_wall}    world.add_collider(shape, body)


{bodies}
discs = [world.rigid_bodies[handle] for handle in handles]
{end}"""


def _format_shapes(scene: Scene, wall: Wall | Chain | Ring) -> list[str]:
    """Return the calls that create the colliders of a wall."""
    if isinstance(wall, Wall):
        return [f"halfspace({(*wall.normal, 0.0)!r}).translation({(*wall.point_m, 0.0)!r})"]
    radius = compute_thickness(scene, wall)
    if isinstance(wall, Ring):
        return [f"ball({radius!r}).translation({(*wall.centre_m, 0.0)!r})"]
    ends = ((*a, 0.0, *b, 0.0) for a, b in cut_chain(wall))
    return [f"capsule_from_endpoints({end[:3]!r}, {end[3:]!r}, {radius!r})" for end in ends]
