"""Writes a scene and settings as a program for Box2D, which users can copy."""

from __future__ import annotations

import math
from collections.abc import Mapping

from carom.engines.api import Chain, Scene, Setting, Wall, is_fast, reach, scaled
from carom_adapters.box2d.limits import WORLD_SETTINGS, require_usable
from carom_adapters.box2d.walls import build_wall_rectangle, list_shape_points
from carom_adapters.box2d.world import BEFORE_WALLS, does_sweep, list_disc_shapes
from carom_adapters.shared.legs import Driven, find_first_velocity, format_program_end, group_legs_by_step, has_legs
from carom_adapters.shared.settings_code import count_steps, format_assignments, format_comment, format_disc
from carom_adapters.shared.walls import compute_thickness

#: Comment in the program that explains the scale of velocities.
SCALED = (
    "This program multiplies all velocities by `scale` and divides all times by it, because in Box2D bodies do not "
    "bounce below 1 m/s (b2_velocityThreshold, compiled in). The scale is a power of two, which avoids rounding."
)
NOT_SCALED = "By default, bodies that meet below 1 m/s do not bounce (b2_velocityThreshold, compiled in)."


ADD_SHAPE = """def add_shape(shape, position=(0.0, 0.0), half_width=0.0, velocity=None{takes}):
    wall = held_body(position, velocity)
    fixture = wall.CreateFixture(shape=shape, {of_wall}, categoryBits={bits}, maskBits={bits})
    fixture.shape.radius = {skin} + half_width
{runs}

"""
ADD_CIRCLE = """def add_circle(position, radius, velocity=None{takes}):
    wall, shape = held_body(position, velocity), Box2D.b2CircleShape(radius=radius)
    wall.CreateFixture(shape=shape, {of_wall}, categoryBits={bits}, maskBits={bits})
{runs}

"""
ADD_WALL = """def add_wall(position, corners, **moves):  # a half-plane as a deep polygon
    add_shape(Box2D.b2PolygonShape(vertices=corners), position=position, **moves)


"""
ADD_EDGE = """def add_edge(points, half_width, **moves):
    add_shape(Box2D.b2EdgeShape(vertices=points), half_width=half_width, **moves)


"""
ADD_CHAIN = """def add_chain(half_width, velocity=None{takes}, **points):  # so that no disc catches on joints
    add_shape(Box2D.b2ChainShape(**points), half_width=half_width, velocity=velocity{gives})


"""
#: Pieces of the program for conveyors: additional parameters and lines of the functions, and a contact listener.
BELTS = {"takes": ", belt=0.0", "runs": "    wall.userData = -belt * scale\n", "gives": ", belt=belt"}
LISTENER = """class Belts(Box2D.b2ContactListener):
    def PreSolve(self, contact, _old):  # Box2D's tangent is to the right of the normal
        contact.tangentSpeed = sum(fixture.body.userData or 0.0 for fixture in (contact.fixtureA, contact.fixtureB))


world.contactListener = belts = Belts()


"""

TABLE = """        force = {slower} * mass * scale * scale  # friction of the table, which slows the disc down
        world.CreateFrictionJoint(bodyA=table, bodyB=body, localAnchorA=position, maxForce=force)
"""
#: Code that creates a driven body, without and with later changes of velocity.
_MADE = "return world.CreateKinematicBody(position=position, linearVelocity=velocity, angularVelocity=spin * scale)"
_KEPT = f"driven.append({_MADE.removeprefix('return ')})\n    return driven[-1]"


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same world as `Box2dWorld`."""
    require_usable(scene, settings)
    scale = float(settings.get("velocity_scale", 1.0))
    dt_s, fast_clock, turns = float(settings["dt_s"]) / scale, scaled(scene, time=1.0 / scale), scene.arrays.turns
    lines = []
    for disc in scene.discs:
        arguments: dict[str, object] = {}
        if not disc.immovable:
            fixed = not (turns and math.isfinite(disc.inertia_factor))
            # Box2D sets the inverse inertia of a body that does not turn to 0.
            inertia = 1.0 if fixed else disc.inertia_factor * disc.mass_kg * disc.radius_m**2
            arguments = {
                "mass": disc.mass_kg,
                "inertia": inertia,
                "velocity": disc.velocity_m_s,
                "spin": disc.spin_rad_s,
            }
            if scene.damping_per_s:  # Box2D's damping is a rate per unit of Box2D's own time
                arguments |= dict.fromkeys(("linearDamping", "angularDamping"), fast_clock.damping_per_s)
            arguments |= {"fixedRotation": fixed, "allowSleep": bool(settings.get("sleepingAllowed", True))}
            # A disc that moves by more than its radius in a step is swept against all other bodies.
            arguments["bullet"] = settings.get("sweep") == "fast" and is_fast(disc, float(settings["dt_s"]))
        elif disc.driven:
            arguments = {"velocity": find_first_velocity(disc), "spin": disc.spin_rad_s}
        lines.append(format_disc(disc, arguments))
    centre, radius = reach(fast_clock, dt_s)
    functions = {}
    runs = any(wall.surface_speed_m_s for wall in scene.walls)
    belts = {name: text * runs for name, text in BELTS.items()}
    driven: list[Driven] = [disc for disc in scene.discs if disc.driven]
    of_wall = f"friction={scene.wall_friction!r}, restitution={scene.wall_restitution!r}"
    for scene_wall, wall in zip(scene.walls, fast_clock.walls, strict=True):
        moves = f", velocity={find_first_velocity(scene_wall)!r}" if scene_wall.driven else ""
        moves += f", belt={scene_wall.surface_speed_m_s!r}" if scene_wall.surface_speed_m_s else ""
        before = len(lines)
        if isinstance(wall, Wall):
            place, corners = build_wall_rectangle(fast_clock, wall, centre, radius)
            lines.append(f"add_wall({place!r}, {corners!r}{moves})")
            functions["wall"] = ADD_WALL
        elif isinstance(wall, Chain):
            pieces = list_shape_points(wall, settings)
            if not settings.get("chains", False):
                lines += [f"add_edge({points!r}, {wall.half_width_m!r}{moves})" for points in pieces]
                functions["edge"] = ADD_EDGE
            else:
                points, kind = (pieces[0][:-1], "loop") if wall.closed else (pieces[0], "chain")
                lines.append(f"add_chain({wall.half_width_m!r}, vertices_{kind}={points!r}{moves})")
                functions["chain"] = ADD_CHAIN.format(**belts)
        else:
            lines.append(f"add_circle({wall.centre_m!r}, {compute_thickness(fast_clock, wall)!r}{moves})")
            functions["circle"] = ADD_CIRCLE.format(of_wall=of_wall, bits=BEFORE_WALLS, **belts)
        driven += [scene_wall] * (len(lines) - before) if scene_wall.driven else []
    circles = ", ".join(
        f"dict(friction={friction!r}, restitution={restitution!r}, categoryBits={bits}, maskBits={bits})"
        for bits, restitution, friction in list_disc_shapes(scene)
    )
    skin = repr(float(settings["polygon_radius_m"])) if "polygon_radius_m" in settings else "fixture.shape.radius"
    add_walls = ""
    if functions:
        add_walls = ADD_SHAPE.format(of_wall=of_wall, bits=BEFORE_WALLS, skin=skin, **belts)
        add_walls += "".join(functions.values()) + (LISTENER if any(belts.values()) else "")
    slower = scene.table_deceleration_m_s2
    iterations = f"{int(settings['velocityIterations'])}, {int(settings['positionIterations'])}"
    state = "*body.position, *(v / scale for v in body.linearVelocity), body.angularVelocity / scale"
    legs = group_legs_by_step(driven, float(settings["dt_s"]))
    change = "driven[k].linearVelocity = tuple(v * scale for v in velocity)"
    end = format_program_end(scene, f"world.Step(dt / scale, {iterations})", state, legs, change)
    bodies = "\n".join(lines)
    sweeps = does_sweep(fast_clock, settings, dt_s)
    return f"""{format_comment(heading)}
import Box2D

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
{format_comment(SCALED if scale != 1.0 else NOT_SCALED)}
scale = {scale!r}
world = Box2D.b2World(gravity=({scene.gravity_m_s2[0]!r} * scale * scale, {scene.gravity_m_s2[1]!r} * scale * scale))
{format_assignments("world", settings, WORLD_SETTINGS)}world.continuousPhysics = {sweeps}
circles = [{circles}]
discs = []
{"driven = []" + chr(10) if has_legs(scene) else ""}{"table = world.CreateStaticBody()" + chr(10) if slower else ""}

def held_body(position, velocity, spin=0.0):  # a body that impacts do not move: at rest or driven
    if velocity is None:
        return world.CreateStaticBody(position=position)
    velocity = tuple(v * scale for v in velocity)
    {_KEPT if has_legs(scene) else _MADE}


def add_disc(position, radius, mass=None, inertia=0.0, velocity=None, spin=0.0, **of_body):
    if mass is None:
        body = held_body(position, velocity, spin)
    else:
        velocity = tuple(v * scale for v in velocity)
        body = world.CreateDynamicBody(
            position=position, linearVelocity=velocity, angularVelocity=spin * scale, **of_body
        )
    for circle in circles:
        body.CreateFixture(shape=Box2D.b2CircleShape(radius=radius), density=1.0, **circle)
    if mass is not None:
        body.massData = Box2D.b2MassData(mass=mass, center=(0, 0), I=inertia)
{TABLE.format(slower=repr(slower)) if slower else ""}    discs.append(body)


{add_walls}{bodies}
{end}"""
