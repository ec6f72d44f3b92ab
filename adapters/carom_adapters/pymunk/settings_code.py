"""Writes a scene and settings as a program for pymunk, which users can copy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import chain

from carom.engines.api import Chain, Ring, Scene, Setting, Wall
from carom_adapters.pymunk.limits import NEIGHBORS, SPACE_SETTINGS, check_inputs
from carom_adapters.pymunk.walls import Post, WallShape, build_wall_shapes, compute_surface_velocity
from carom_adapters.shared.legs import find_first_velocity, format_program_end, group_legs_by_step, has_legs
from carom_adapters.shared.settings_code import count_steps, format_assignments, format_comment, format_disc
from carom_adapters.shared.walls import factor_walls

_ADD_WALL = """def add_wall(corners, elasticity, friction, velocity=None):  # a half-plane as a deep polygon
    body = held_body(velocity)
    add(body, pymunk.Poly(body, corners), elasticity, friction)


"""

_ADD_BELT = """def add_belt(corners, surface_velocity, elasticity, friction, velocity=None):
    body = held_body(velocity)
    face = pymunk.Poly(body, corners)
    face.surface_velocity = surface_velocity
    add(body, face, elasticity, friction)


"""

_ADD_CIRCLE = """def add_circle(centre, radius, elasticity, friction, velocity=None):
    body = held_body(velocity)
    add(body, pymunk.Circle(body, radius, centre), elasticity, friction)


"""

_ADD_SEGMENT = """def add_segment(a, b, radius, elasticity, friction, neighbors=None, velocity=None):
    body = held_body(velocity)
    segment = pymunk.Segment(body, a, b, radius)
    if neighbors:  # so that no disc catches on the joint of two segments
        segment.set_neighbors(*neighbors)
    add(body, segment, elasticity, friction)


"""


def _write_wall(
    wall: Wall | Chain | Ring, shape: WallShape, material: tuple[float, float], settings: Mapping[str, Setting]
) -> list[str]:
    """Return the lines that add a wall."""
    properties = f"elasticity={material[0]!r}, friction={material[1]!r}"
    properties += f", velocity={find_first_velocity(wall)!r}" if wall.driven else ""
    if isinstance(wall, Wall) and wall.surface_speed_m_s:
        return [f"add_belt({shape!r}, {compute_surface_velocity(wall)!r}, {properties})"]
    if isinstance(shape, list):
        return [f"add_wall({shape!r}, {properties})"]
    if isinstance(shape, Post):
        return [f"add_circle({shape.centre!r}, {shape.radius!r}, {properties})"]
    has_neighbors = bool(settings.get(NEIGHBORS, 0))
    return [
        f"add_segment({s.a!r}, {s.b!r}, {shape[1]!r}, {properties}"
        + (f", neighbors=({s.before!r}, {s.after!r}))" if has_neighbors else ")")
        for s in shape[0]
    ]


def _write_table(scene: Scene) -> str:
    """Return the program's lines that make a table slow down a disc; empty in a scene without a table."""
    if not scene.table_deceleration_m_s2:
        return ""
    return f"""        # The table slows the disc down: a joint holds it back with a limited force.
        joint = pymunk.PivotJoint(space.static_body, body, position, (0.0, 0.0))
        joint.max_bias, joint.max_force = 0.0, {scene.table_deceleration_m_s2!r} * mass
        space.add(joint)
"""


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same space as `PymunkWorld`."""
    dt_s, turns = check_inputs(scene, settings), scene.arrays.turns
    elasticity, friction, wall_materials = factor_walls(scene)
    lines = []
    for disc in scene.discs:
        moment = (disc.inertia_factor if turns else math.inf) * disc.mass_kg * disc.radius_m**2
        options: dict[str, object] = {} if disc.immovable else {"mass": disc.mass_kg, "moment": moment}
        if not disc.immovable or disc.driven:
            options |= {"velocity": find_first_velocity(disc), "spin": disc.spin_rad_s}
        lines.append(format_disc(disc, options))
    shapes = build_wall_shapes(scene, dt_s)
    walls = list(zip(scene.walls, shapes, strict=True))
    lines += [
        line
        for wall_and_shape, material in zip(walls, wall_materials, strict=True)
        for line in _write_wall(*wall_and_shape, material, settings)
    ]
    set_up = format_assignments("space", settings, SPACE_SETTINGS)
    if scene.damping_per_s:
        set_up += f"space.damping = {math.exp(-scene.damping_per_s)!r}  # the fraction of a speed left after a second\n"
    state = "*body.position, *body.velocity, body.angular_velocity"
    pieces = [[wall] * (1 if isinstance(shape, list | Post) else len(shape[0])) for wall, shape in walls]
    driven = [body for body in (*scene.discs, *chain.from_iterable(pieces)) if body.driven]
    end = format_program_end(
        scene, "space.step(dt)", state, group_legs_by_step(driven, dt_s), "driven[k].velocity = velocity"
    )
    bodies = "\n".join(lines)
    belts = [bool(wall.surface_speed_m_s) for wall in scene.walls]
    plain = (isinstance(shape, list) and not belt for shape, belt in zip(shapes, belts, strict=True))
    functions = (_ADD_WALL if any(plain) else "") + (_ADD_BELT if any(belts) else "")
    functions += _ADD_CIRCLE if any(isinstance(shape, Post) for shape in shapes) else ""
    functions += _ADD_SEGMENT if any(type(shape) is tuple for shape in shapes) else ""
    return f"""{format_comment(heading)}
from math import inf

import pymunk

dt, steps = {dt_s!r}, {count_steps(scene, settings)}
space = pymunk.Space()
space.gravity = {scene.gravity_m_s2!r}
{set_up}discs = []
{"driven = []" + chr(10) if has_legs(scene) else ""}

def add(body, shape, elasticity, friction):
    # pymunk multiplies the two coefficients of a pair.
    shape.elasticity, shape.friction = elasticity, friction
    space.add(body, shape)


def held_body(velocity, spin=0.0):  # a body that impacts do not move: at rest or driven
    body = pymunk.Body(body_type=pymunk.Body.STATIC if velocity is None else pymunk.Body.KINEMATIC)
    if velocity is not None:
        body.velocity, body.angular_velocity = velocity, spin
{"        driven.append(body)" + chr(10) if has_legs(scene) else ""}    return body


def add_disc(position, radius, mass=None, moment=0.0, velocity=None, spin=0.0):
    body = held_body(velocity, spin) if mass is None else pymunk.Body(mass, moment)
    body.position = position
    if mass is not None:
        body.velocity, body.angular_velocity = velocity, spin
{_write_table(scene)}    add(body, pymunk.Circle(body, radius), elasticity={elasticity!r}, friction={friction!r})
    discs.append(body)


{functions}{bodies}
{end}"""
