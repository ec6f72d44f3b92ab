"""Rapier's settings as a program to paste."""

from __future__ import annotations

from collections.abc import Mapping

from carom.adapter import AdapterError, Scene, Setting, require_sound, require_supported
from carom_adapters.code import PYTHON_END, arguments, assignments, comment, steps_of
from carom_adapters.rapier.limits import CAPABILITIES, LEAST, MOST, OTHER_SETTINGS, PARAMETERS, SOFTNESSES

__all__ = ["code"]


def code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return the world that `RapierWorld` sets up as a program.

    Raises:
        AdapterError: The scene or a setting is outside what Rapier can do, or the steps are taken in two parts.
    """
    require_sound("Rapier", scene, settings, (*PARAMETERS, *OTHER_SETTINGS), LEAST, MOST)
    require_supported("Rapier", scene, CAPABILITIES, float(settings["dt_s"]))
    if "first_part" in settings:
        raise AdapterError("Rapier: steps that are taken in two parts (first_part) are Carom's, and can't be pasted")
    lines = []
    for disc in scene.discs:
        given = {} if disc.immovable else {"mass": disc.mass_kg, "velocity": disc.velocity_m_s}
        lines.append(f"add_disc({disc.position_m!r}, {disc.radius_m!r}{', ' * bool(given)}{arguments(given)})")
    lines += [f"add_wall({wall.point_m!r}, {wall.normal!r})" for wall in scene.half_planes()]
    soft = "".join(
        f"softness = parameters.{of}  # a copy\nsoftness.natural_frequency = {settings[name]!r}\n"
        f"parameters.{of} = softness\n"
        for name, of in SOFTNESSES.items()
        if name in settings
    )
    swept = ""
    if "soft_ccd_prediction" in settings:
        swept = f"    body = body.soft_ccd_prediction({settings['soft_ccd_prediction']!r})  # continuous detection\n"
    state = "*body.translation.to_tuple()[:2], *body.linvel.to_tuple()[:2], 0.0"
    end = PYTHON_END.format(step="world.step()", state=state)
    wins = "MIN" if scene.wall_restitution < scene.restitution else "MAX"
    bodies = "\n".join(lines)
    return f"""{comment(heading)}
import rapier3d

dt, steps = {float(settings["dt_s"])!r}, {steps_of(scene, settings)}
world = rapier3d.PhysicsWorld(gravity=({scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0))
parameters = world.integration_parameters
parameters.dt = dt
{assignments("parameters", settings, PARAMETERS)}{soft}handles = []


def add_disc(position, radius, mass=None, velocity=(0.0, 0.0)):  # a ball that stays in the plane and does not turn
    body = rapier3d.RigidBody.fixed() if mass is None else rapier3d.RigidBody.dynamic()
    body = body.translation((*position, 0.0)).linvel((*velocity, 0.0))
    body = body.can_sleep({bool(settings["can_sleep"])}).enabled_rotations((False, False, False))
    body = body.enabled_translations((True, True, False))
{swept}    ball = rapier3d.Collider.ball(radius).restitution({scene.restitution!r}).friction(0.0)
    handles.append(world.add_body(body))
    world.add_collider(ball if mass is None else ball.mass(mass), handles[-1])


def add_wall(point, normal):
    body = world.add_body(rapier3d.RigidBody.fixed().translation((*point, 0.0)))
    half = rapier3d.Collider.halfspace((*normal, 0.0)).friction(0.0).restitution({scene.wall_restitution!r})
    # As shipped two coefficients are averaged; another rule wins over that.
    world.add_collider(half.restitution_combine_rule(rapier3d.CoefficientCombineRule.{wins}), body)


{bodies}
discs = [world.rigid_bodies[handle] for handle in handles]
{end}"""
