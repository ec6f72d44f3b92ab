"""Helpers of adapters for walls: pieces of chains, thickness, coefficients, and sums of the contacts of pieces."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from carom.engines.api import Chain, Contact, Ring, Scene, Wall, factored_frictions, factored_restitutions, wall_body

Point = tuple[float, float]

#: In engines that need solids, a wall without width becomes a very thin solid. Half of the solid's width, as a fraction
#: of the smallest radius. The half width is not larger than rounding errors of positions.
THINNEST = 1e-12


def find_foot(wall: Wall, centre: Point) -> tuple[Point, float]:
    """Return the point of a half-plane's face that is nearest to `centre`, and the distance of the two points."""
    (px, py), (nx, ny) = wall.point_m, wall.normal
    along = (px - centre[0]) * ny - (py - centre[1]) * nx
    return (px - along * ny, py + along * nx), abs((px - centre[0]) * nx + (py - centre[1]) * ny)


def build_rectangle(normal: Point, size: float) -> list[Point]:
    """Return the corners of a rectangle, ``2 size`` wide and `size` deep. The middle of its face is the origin."""
    nx, ny = normal
    return [((a * ny - b * nx) * size, (-a * nx - b * ny) * size) for a, b in ((1, 0), (-1, 0), (-1, 1), (1, 1))]


def list_points(chain: Chain) -> list[Point]:
    """Return the ends of a chain's pieces in order. The first point of a closed chain is not repeated at the end."""
    parts = [k / chain.pieces for k in range(chain.pieces)]
    points = [
        (edge.a[0] + part * (edge.b[0] - edge.a[0]), edge.a[1] + part * (edge.b[1] - edge.a[1]))
        for edge in chain.outline.edges
        for part in parts
    ]
    return points if chain.closed else [*points, chain.points_m[-1]]


def cut_chain(chain: Chain) -> list[tuple[Point, Point]]:
    """Cut a chain into its pieces, and return the start and the end of each piece."""
    points = list_points(chain)
    return list(zip(points, [*points[1:], *points[:1]] if chain.closed else points[1:], strict=False))


def compute_thickness(scene: Scene, wall: Chain | Ring) -> float:
    """Return the radius of the solid that represents a wall: a chain's half width, or a circle's outer radius.

    In an engine that has only solids, a wall without width gets a width that is too small to affect a disc.
    """
    outer = wall.half_width_m if isinstance(wall, Chain) else wall.radius_m + wall.half_width_m
    return outer or THINNEST * min(disc.radius_m for disc in scene.discs)


def factor_walls(scene: Scene) -> tuple[float, float, list[tuple[float, float]]]:
    """Return restitution and friction of the discs, and of each wall, for engines that multiply coefficients.

    In a scene in which no disc turns, friction is 0.
    """
    turns = scene.arrays.turns
    restitution, friction = factored_restitutions(scene)[0], factored_frictions(scene)[0] if turns else 0.0
    walls = [
        (wall.restitution / restitution, wall.friction / friction if turns else 0.0) for wall in scene.arrays.materials
    ]
    return restitution, friction, walls


def find_walls_in_pieces(scene: Scene) -> frozenset[int]:
    """Return the body numbers (`wall_body`) of the walls that consist of several pieces."""
    chains = ((k, wall) for k, wall in enumerate(scene.walls) if isinstance(wall, Chain))
    return frozenset(wall_body(k) for k, wall in chains if len(cut_chain(wall)) > 1)


def sum_contacts(contacts: Iterable[Contact], walls: frozenset[int]) -> tuple[Contact, ...]:
    """If a disc touches several pieces of a wall in `walls`, replace these contacts by their sum.

    If impulses cancel, their sum has no direction, and the contacts are returned unchanged.
    """
    groups: dict[object, list[Contact]] = {}
    for number, contact in enumerate(contacts):
        groups.setdefault((contact.first, contact.second) if contact.second in walls else number, []).append(contact)
    return tuple(contact for group in groups.values() for contact in _sum_group(group))


def _sum_group(group: list[Contact]) -> list[Contact]:
    impulses = [(contact.normal, contact.impulse_n_s or 0.0, contact.tangential_impulse_n_s) for contact in group]
    along = [math.fsum(normal[axis] * impulse for normal, impulse, _ in impulses) for axis in (0, 1)]
    size = math.hypot(*along)
    if len(group) == 1 or size == 0.0:
        return group
    nx, ny = along[0] / size, along[1] / size
    x = along[0] - math.fsum(normal[1] * (tangential or 0.0) for normal, _, tangential in impulses)
    y = along[1] + math.fsum(normal[0] * (tangential or 0.0) for normal, _, tangential in impulses)
    tangential = None if impulses[0][2] is None else y * nx - x * ny
    return [replace(group[0], normal=(nx, ny), impulse_n_s=x * nx + y * ny, tangential_impulse_n_s=tangential)]
