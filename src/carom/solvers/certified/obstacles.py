"""Obstacles with exact coordinates. An obstacle is a half-plane, or a side or vertex of a finite wall.

Each end of a side of a finite wall is a vertex, or a smooth joint with the next side. At a smooth joint, a disc touches
both sides at the same time.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from carom.core.wall_parts import Plane, Round, build_parts, to_exact
from carom.model.chain_geometry import Outline
from carom.model.scene import Scene
from carom.model.trace import EdgeKind, wall_body


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A part of a wall that a disc can meet: a half-plane, a side of an edge or arc, or a vertex.

    Attributes:
        wall: Number of the wall.
        shape: Shape of the part.
        half_width: The wall consists of all points within this distance of the line in its middle, in metres.
        kind: Kind of the part; None for a half-plane.
        edges: Numbers of the edges to which the part belongs. For a vertex, only the lower number of its two edges.
        neighbours: Body numbers of the obstacles that adjoin the beginning and the end of a side; empty for other parts
            and for whole circles.
        never_met: Body numbers of the obstacles that a disc never meets while it is in contact with this obstacle.
            Empty if this obstacle is not straight.
    """

    wall: int
    shape: Plane | Round
    half_width: Fraction = Fraction(0)
    kind: EdgeKind | None = None
    edges: tuple[int, ...] = ()
    neighbours: tuple[int, ...] = ()
    never_met: frozenset[int] = frozenset()


def obstacles_of(scene: Scene) -> tuple[Obstacle, ...]:
    """Return all obstacles of a scene, wall by wall. Each half-plane is one obstacle."""
    found: list[Obstacle] = []
    widest = scene.arrays.radius_m.max(initial=0.0)
    for k, wall in enumerate(scene.arrays.walls):
        if not isinstance(wall, Outline):
            plane = Plane(to_exact(wall[:2]), to_exact(wall[2:]))
            found.append(Obstacle(k, plane, never_met=frozenset({wall_body(len(found))})))
            continue
        begin, half_width = len(found), Fraction(wall.half_width)
        for shape, kind, edges, *related in build_parts(wall, widest):
            neighbours, never_met = (tuple(wall_body(begin + n) for n in numbers) for numbers in related)
            found.append(Obstacle(k, shape, half_width, kind, edges, neighbours, frozenset(never_met)))
    return tuple(found)
