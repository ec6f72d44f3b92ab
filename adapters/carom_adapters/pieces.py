"""What engines are given of walls: pieces of chains, how thick the thinnest are, materials, and pushes told as one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from carom.engines.api import Chain, Contact, Ring, Scene, factored_frictions, factored_restitutions, wall_body

Point = tuple[float, float]

#: Half the width of a solid that stands for a wall of none, over the smallest radius: no more than positions are
#: rounded by in an engine of 64 bits.
THINNEST = 1e-12


def points_of(chain: Chain) -> list[Point]:
    """Return the ends of all pieces in order; the first point of a closed chain is not told again at its end."""
    points = [point for edge in chain.outline.edges for point in _cut(edge.a, edge.b, chain.pieces)]
    return points if chain.closed else [*points, chain.points_m[-1]]


def cut_chain(chain: Chain) -> list[tuple[Point, Point]]:
    """Return where each piece of a chain begins and ends."""
    points = points_of(chain)
    return list(zip(points, [*points[1:], *points[:1]] if chain.closed else points[1:], strict=False))


def thickness_of(scene: Scene, wall: Chain | Ring) -> float:
    """Return the radius with which a solid stands for a wall: a chain's half width, or a circle's outer radius.

    An engine of solids has none without a width; for that one stands which no disc can tell from it.
    """
    outer = wall.half_width_m if isinstance(wall, Chain) else wall.radius_m + wall.half_width_m
    return outer or THINNEST * min(disc.radius_m for disc in scene.discs)


def factored_walls(scene: Scene) -> tuple[float, float, list[tuple[float, float]]]:
    """Return restitution and friction of every disc, and of each wall, for an engine that multiplies those of a pair.

    In a scene that turns nothing friction is 0.
    """
    turns = scene.arrays.turns
    restitution, friction = factored_restitutions(scene)[0], factored_frictions(scene)[0] if turns else 0.0
    walls = [
        (wall.restitution / restitution, wall.friction / friction if turns else 0.0) for wall in scene.arrays.materials
    ]
    return restitution, friction, walls


def pieced(scene: Scene) -> frozenset[int]:
    """Return the numbers of the walls that are several pieces."""
    chains = ((k, wall) for k, wall in enumerate(scene.walls) if isinstance(wall, Chain))
    return frozenset(wall_body(k) for k, wall in chains if len(cut_chain(wall)) > 1)


def summed(contacts: Iterable[Contact], walls: frozenset[int]) -> tuple[Contact, ...]:
    """Return contacts of one time, with what several pieces of one of these walls gave a disc told as one, their sum.

    Pieces that face one another and push as hard have no sum, and stay as they are.
    """
    groups: dict[object, list[Contact]] = {}
    for number, contact in enumerate(contacts):
        pair = (contact.first, contact.second)
        groups.setdefault(pair if contact.second in walls else number, []).append(contact)
    return tuple(one for group in groups.values() for one in _sum(group))


def _sum(group: list[Contact]) -> list[Contact]:
    impulses = [(one.normal, one.impulse_n_s or 0.0, one.tangential_impulse_n_s) for one in group]
    along = [math.fsum(normal[axis] * impulse for normal, impulse, _ in impulses) for axis in (0, 1)]
    size = math.hypot(*along)
    if len(group) == 1 or size == 0.0:
        return group
    nx, ny = along[0] / size, along[1] / size
    x = along[0] - math.fsum(normal[1] * (tangential or 0.0) for normal, _, tangential in impulses)
    y = along[1] + math.fsum(normal[0] * (tangential or 0.0) for normal, _, tangential in impulses)
    tangential = None if impulses[0][2] is None else y * nx - x * ny
    return [replace(group[0], normal=(nx, ny), impulse_n_s=x * nx + y * ny, tangential_impulse_n_s=tangential)]


def _cut(a: Point, b: Point, pieces: int) -> list[Point]:
    """Return where the pieces of an edge begin."""
    parts = [k / pieces for k in range(pieces)]
    return [(a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])) for part in parts]
