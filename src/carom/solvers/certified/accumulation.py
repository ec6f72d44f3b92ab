"""Detection of infinitely many impacts in a finite time: inelastic collapse, and discs that moving walls crush.

A collapse or crush is inferred from many past impacts, without a proof. Moving walls can crush a single disc or a row
of discs, in any direction. By symmetry, discs stay on a line if their centres and velocities are exactly on this line,
and no force or friction acts sideways. Discs in a row are crushed when the gap between the bodies at both ends of the
row equals the sum of the discs' diameters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple

from flint import arb

from carom.core.wall_parts import Exact, Plane, Round, dot, subtract, to_exact
from carom.model.trace import EdgeKind, ImpactRecord, wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import ball, float_above
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.obstacles import Obstacle
from carom.solvers.certified.recording import Recording
from carom.solvers.certified.result import Degeneracy, Degenerate

#: Many impacts whose times differ by at most one unit in the last place count as a collapse. The number of these
#: impacts must be at least `_COLLAPSE` times the squared number of their bodies. Three equal discs without collapse
#: have at most about 600 impacts.
_COLLAPSE = 20
#: A disc between two approaching bodies counts as crushed after this many impacts.
_CRUSH = 256


def find_accumulation(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the collapse or crush that the last impacts indicate; None if there is none."""
    return _find_collapse(log, bodies) or _find_crush(log, bodies)


def _find_collapse(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the collapse that the last impacts indicate; None if there is none."""
    scene = bodies.scene
    if not log.rows or not (scene.restitution < 1 or any(material.restitution < 1 for material in bodies.materials)):
        return None
    latest = log.rows[-1].values.time_s
    earliest = math.nextafter(math.nextafter(latest, 0.0), 0.0)
    involved: set[int] = set()
    count = 0
    for row in reversed(log.rows):
        if row.values.time_s < earliest:
            break
        involved |= {row.values.first, row.values.second}
        count += 1
    if count < _COLLAPSE * len(involved) ** 2:
        return None
    known = min(bodies.state_bits(body) for body in involved if body >= 0)
    first = log.rows[-count].values.time_s
    return Degeneracy(Degenerate.COLLAPSE, tuple(sorted(involved)), first, latest, proven=False, bits=known)


class _Facing(NamedTuple):
    """Last contact between the body at one end of a row of discs and the disc next to this body.

    Attributes:
        body: Number of the body.
        disc: Number of the disc.
        normal: Unit vector from the body to the disc, with rounding errors.
        edge: Number and kind of the edge that the disc has touched, if the body is a finite wall.
    """

    body: int
    disc: int
    normal: tuple[float, float]
    edge: tuple[int, int]


def _find_crush(log: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the crush of a row of discs between two bodies, if the last impacts were all in this row.

    The time of the crush is exact. A crush is found under three conditions: centres, velocities and normals are along
    one line; the discs have had no impacts with other bodies; no other body moves. If both end bodies move, the scene
    must not have other bodies. The three conditions are not checked for a single disc between two half-planes whose
    normals are exactly opposite. The time of the crush of a single disc between such half-planes does not depend on the
    disc's position.
    """
    last = [row.values for row in log.rows[-_CRUSH:]]
    if not bodies.fastest_drive or len(last) < _CRUSH:
        return None
    pairs = {(row.first, row.second) for row in last}
    row = _order_row(pairs, bodies)
    if row is None:
        return None
    ends = [_find_facing(last, row[0], row[1]), _find_facing(last, row[-1], row[-2])]
    obstacles, line = _find_parallel_planes(row, bodies)
    if line is None or last[-1].second == last[-2].second:
        if not _is_separate(row, log, bodies):
            return None
        obstacles = [_find_obstacle(bodies, end) for end in ends]
        line = _find_line(row, obstacles, bodies)
    if line is None:
        return None
    room = rate = arb(0)
    last_impact_s, until = last[-1].time_s, math.inf
    for end, obstacle in zip(ends, obstacles, strict=True):
        place, speed, ends_s = _compute_surface_motion(end, obstacle, line, bodies, last_impact_s)
        sign = 1 if dot(to_exact(end.normal), line) > 0 else -1  # 1 if the line points from the end body to the discs
        room, rate, until = room - sign * place, rate - sign * speed, min(until, ends_s)
    for disc in row[1:-1]:
        room = room - 2 * arb(bodies.scene.discs[disc].radius_m)
    if not rate < 0:
        return None
    crushed = room / (arb(0) - rate)
    if not crushed < until or crushed > bodies.scene.duration_s:
        return None
    known = min(bodies.state_bits(disc) for disc in row[1:-1])
    return Degeneracy(
        Degenerate.CRUSH, tuple(sorted(row)), last_impact_s, float_above(crushed), proven=False, bits=known
    )


def _find_parallel_planes(row: list[int], bodies: BallBodies) -> tuple[list[Obstacle | None], Exact | None]:
    """Return the half-planes at both ends of a row, and the normal of one of them.

    Return an empty list and None unless the row is one disc between two half-planes with exactly opposite normals.
    """
    planes = [
        obstacle
        for body in (row[0], row[-1])
        for obstacle in bodies.obstacles
        if obstacle.wall == wall_index(body) and obstacle.kind is None
    ]
    normals = [plane.shape.normal for plane in planes if isinstance(plane.shape, Plane)]
    if len(row) != 3 or len(normals) != 2 or normals[0] != (-normals[1][0], -normals[1][1]):
        return [], None
    return [*planes], normals[0]


def _is_separate(row: list[int], log: Recording, bodies: BallBodies) -> bool:
    """Return whether a row's discs have hit only their neighbours, and nothing else can disturb their motion."""
    pairs = {frozenset(pair) for pair in pairwise(row)}
    impacts = [frozenset((one.values.first, one.values.second)) for one in log.rows]
    struck = {pair for pair in impacts if not pair.isdisjoint(row[1:-1])}
    is_long = len(impacts) >= _CRUSH * (len(pairs) - 1)
    return is_long and struck == pairs and _is_alone(row, bodies) and not _has_loss_or_slip(row, bodies)


def _order_row(pairs: set[tuple[int, int]], bodies: BallBodies) -> list[int] | None:
    """Return the pairs' bodies as a row of movable discs between two immovable bodies; None if they form no row."""
    neighbours: dict[int, list[int]] = {}
    for first, second in pairs:
        neighbours.setdefault(first, []).append(second)
        neighbours.setdefault(second, []).append(first)
    ends = [body for body, adjacent in neighbours.items() if len(adjacent) == 1]
    if len(ends) != 2 or len(pairs) < 2 or len(neighbours) != len(pairs) + 1:
        return None
    row = [min(ends)]
    while len(row) < len(neighbours):
        onwards = [body for body in neighbours[row[-1]] if body not in row]
        if len(onwards) != 1:
            return None
        row += onwards
    is_movable = [body >= 0 and bodies.movable[body] for body in row]
    return row if not is_movable[0] and not is_movable[-1] and all(is_movable[1:-1]) else None


def _is_alone(row: list[int], bodies: BallBodies) -> bool:
    """Return whether there are no other bodies, or the other bodies and one end of the row never move."""
    scene = bodies.scene
    other_bodies = [*map(wall_body, range(len(scene.walls))), *range(len(scene.discs))]
    other_bodies = [body for body in other_bodies if body not in row]
    moves = any(
        bodies.legs(_obstacle_body(body, bodies)) or (body >= 0 and bodies.movable[body]) for body in other_bodies
    )
    return not other_bodies or (
        not moves and not all(bodies.legs(_obstacle_body(body, bodies)) for body in (row[0], row[-1]))
    )


def _obstacle_body(body: int, bodies: BallBodies) -> int:
    """Convert a body number of traces to the body number of `BallBodies`. A wall gets the number of its first part."""
    if body >= 0:
        return body
    return wall_body(next(k for k, obstacle in enumerate(bodies.obstacles) if obstacle.wall == wall_index(body)))


def _has_loss_or_slip(row: list[int], bodies: BallBodies) -> bool:
    """Return whether a row of several discs loses energy in impacts, or whether friction can change a disc's spin."""
    scene, arrays = bodies.scene, bodies.scene.arrays
    walls = [wall_index(body) for body in row if body < 0]
    pairs = len(row) - 1 - len(walls)
    if len(row) > 3 and min(scene.restitution, *(bodies.materials[k].restitution for k in walls)) < 1:
        return True
    if not (pairs and scene.friction) and not any(bodies.materials[k].friction for k in walls):
        return False
    runs = arrays.belts_m_s is not None and any(arrays.belts_m_s[k] for k in walls)
    return runs or any(scene.discs[body].spin_rad_s for body in row if body >= 0)


def _find_facing(rows: Iterable[ImpactRecord], body: int, disc: int) -> _Facing:
    """Return the last contact of a disc at an end of the row with the body at this end."""
    contact = next(row for row in reversed(list(rows)) if {row.first, row.second} == {body, disc})
    nx, ny = contact.normal
    return _Facing(body, disc, (-nx, -ny) if contact.first == disc else (nx, ny), contact.edge)


def _find_obstacle(bodies: BallBodies, end: _Facing) -> Obstacle | None:
    """Return the part of the end wall that a row's last disc meets, at time 0; None if the end body is a disc."""
    if end.body >= 0:
        return None
    of_wall = [obstacle for obstacle in bodies.obstacles if obstacle.wall == wall_index(end.body)]
    edge, kind = end.edge
    fits = [part for part in of_wall if part.kind is None or (part.kind == EdgeKind(kind) and edge in part.edges)]
    start = _compute_exact_centre(bodies, end.disc)

    def away2(shape: Round) -> Fraction:
        away = subtract(start, shape.centre)
        return dot(away, away)

    facing = [
        part for part in fits if isinstance(part.shape, Plane) and dot(to_exact(end.normal), part.shape.normal) > 0
    ]
    # A disc never passes through a wall. So if two vertices are on the line of the row, the disc meets the nearer
    # vertex.
    rounds = [
        (away2(shape), part)
        for part in fits
        if isinstance(shape := part.shape, Round) and shape.inside is (away2(shape) < shape.radius2)
    ]
    return facing[0] if facing else min(rounds, key=itemgetter(0))[1]


def _find_line(row: list[int], obstacles: list[Obstacle | None], bodies: BallBodies) -> Exact | None:
    """Return the exact direction of the line on which a row of discs stays; None if there is no such line."""
    scene, start = bodies.scene, _compute_exact_centre(bodies, row[1])
    if obstacles[0] is None:
        line = subtract(start, _compute_exact_centre(bodies, row[0]))
    else:
        shape = obstacles[0].shape
        line = shape.normal if isinstance(shape, Plane) else subtract(start, shape.centre)
        if not any(line):
            return None
    vectors: list[Exact] = [to_exact(scene.gravity_m_s2)]
    for body in row:
        if body >= 0:
            vectors += [subtract(_compute_exact_centre(bodies, body), start), to_exact(scene.discs[body].velocity_m_s)]
        moving = scene.discs[body] if body >= 0 else scene.walls[wall_index(body)]
        vectors += [to_exact(leg.velocity_m_s) for leg in moving.legs or ()] + [to_exact(moving.velocity_m_s)]
    for obstacle in obstacles:
        if obstacle is None:
            continue
        shape = obstacle.shape
        if not isinstance(shape, Plane):
            vectors.append(subtract(shape.centre, start))
            continue
        vectors.append(shape.normal)
        if shape.stretch is not None:
            begin, end = shape.stretch
            along = subtract(end, begin)
            if not 0 < dot(subtract(start, begin), along) < dot(along, along):
                return None
    return None if any(x * line[1] != y * line[0] for x, y in vectors) else line


def _compute_surface_motion(
    end: _Facing, obstacle: Obstacle | None, line: Exact, bodies: BallBodies, now_s: float
) -> tuple[arb, arb, float]:
    """Return the position and speed, along the line, of the surface at an end, and the time when the speed changes.

    The position is the present position, extended back to time 0 with the present speed.
    """
    dx, dy = map(ball, line)
    length = (dx * dx + dy * dy).sqrt()
    sign = 1 if dot(to_exact(end.normal), line) > 0 else -1
    if obstacle is None:
        (x, y), depth = _compute_exact_centre(bodies, end.body), arb(bodies.scene.discs[end.body].radius_m)
    elif isinstance(obstacle.shape, Plane):
        (x, y), depth = obstacle.shape.point, ball(obstacle.half_width)
    else:
        (x, y), depth = obstacle.shape.centre, ball(obstacle.shape.radius2).sqrt()
        depth = ball(obstacle.half_width) + (arb(0) - depth if obstacle.shape.inside else depth)
    place = (ball(x) * dx + ball(y) * dy) / length + sign * depth
    leg = bodies.legs_after(_obstacle_body(end.body, bodies), now_s)[0]
    if leg is None:
        return place, arb(0), math.inf
    return place + (leg.x * dx + leg.y * dy) / length, (leg.vx * dx + leg.vy * dy) / length, leg.end_s


def _compute_exact_centre(bodies: BallBodies, disc: int) -> Exact:
    return to_exact(bodies.scene.discs[disc].position_m)
