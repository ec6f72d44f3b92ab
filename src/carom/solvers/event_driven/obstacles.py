"""Walls of a run as arrays for the compiled core. An obstacle is one side or one vertex of a wall."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.core.input_rows import FEATURE_NUMBERS, build_driven_rows, build_feature_row
from carom.core.wall_features import Arc, Face, Point, WallFeature, are_decidable, build_features
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import DiscArrays
from carom.model.trace import EDGE_DTYPE, NO_EDGE

#: Largest number of sides and vertices of walls. The number equals `MOST_OBSTACLES` of pic/state.h.
MOST_OBSTACLES = 67_108_863
#: Value for an end of a straight side that has no vertex, because the wall continues smoothly. The value equals
#: `NO_OBSTACLE` of pic/state.h.
NO_OBSTACLE = -1


class Obstacles:
    """Sides and vertices of walls, for runs that need more than the points and normals of half-planes.

    Attributes:
        rows: Data of each side or vertex, as returned by `carom.core.input_rows.build_feature_row`.
        driven: One row for each body with a prescribed motion and for each conveyor, see `build_driven_rows`.
        legs: One row for each part of a prescribed motion with constant velocity.
    """

    def __init__(self, start: DiscArrays) -> None:
        self._start = start
        self._finite: dict[int, tuple[Outline, WallFeature]] = {}  # by the number of the obstacle
        rows: list[tuple[float, ...]] = []
        widest = start.radius_m.max(initial=0.0)
        for number, wall in enumerate(start.walls):
            if isinstance(wall, tuple):
                rows.append(build_feature_row(wall, number))
                continue
            for part in build_features(wall, widest):
                self._finite[len(rows)] = wall, part
                rows.append(build_feature_row(part.feature, number))
        self.rows = np.array(rows, np.float64).reshape(-1, FEATURE_NUMBERS)
        self.driven, self.legs = build_driven_rows(start)

    @cached_property
    def grounds(self) -> Grounds:
        """The half-planes and straight faces with which a disc can be in lasting contact."""
        return build_grounds(self._start, self._finite, self.rows[:, 1].astype(int).tolist())

    def format_names(self, one: int, other: int) -> str:
        """Return the names of two obstacles, joined by "and"."""
        walls = [f"wall {int(self.rows[number, 1])}" for number in (one, other)]
        edges = [self._finite[number][1].edges[0] if number in self._finite else None for number in (one, other)]
        if walls[0] == walls[1] and None not in edges:
            low, high = sorted(edge for edge in edges if edge is not None)
            return f"edges {low} and {high} of {walls[0]}"
        return f"{self.format_name(one)} and {self.format_name(other)}"

    def format_name(self, number: int) -> str:
        """Return the name of an obstacle: "wall 1", or "edge 2 of wall 1" if the wall is finite."""
        wall = f"wall {int(self.rows[number, 1])}"
        return f"edge {self._finite[number][1].edges[0]} of {wall}" if number in self._finite else wall

    def is_order_free(self, one: int, other: int, elastic: bool) -> bool:
        """Return whether simultaneous impacts of a disc on two parts of a wall have the same result in both orders."""
        first, second = self._finite[one][1], self._finite[other][1]
        return are_decidable(first.feature, second.feature, elastic=elastic)

    def to_edges(self, contacts: NDArray[np.void]) -> NDArray[np.void]:
        """Convert contacts (`CONTACT_DTYPE`) to the wall edges that were hit (`carom.model.trace.EDGE_DTYPE`)."""
        lowest, is_joined = self._lowest_edges
        edges: NDArray[np.void] = lowest[contacts["feature"]]
        for row in np.flatnonzero(is_joined[contacts["feature"]]):
            x, y, obstacle = contacts[row].item()
            wall, part = self._finite[obstacle]
            edges["edge"][row] = wall.find_edge(x, y, part.edges)
        return edges

    @cached_property
    def _lowest_edges(self) -> tuple[NDArray[np.void], NDArray[np.bool_]]:
        """The lowest edge number of each obstacle, and whether the obstacle consists of several edges.

        The last row is for contacts without a finite wall.
        """
        lowest = np.full(len(self.rows) + 1, np.array(NO_EDGE, EDGE_DTYPE))
        is_joined = np.zeros(len(lowest), bool)
        for obstacle, (_, part) in self._finite.items():
            lowest[obstacle] = part.edges[0], part.kind
            is_joined[obstacle] = len(part.edges) > 1
        return lowest, is_joined


class Grounds(NamedTuple):
    """For each side and vertex of a wall, whether discs can slide, roll or rest on it.

    A *ground* is a half-plane or straight side of a finite wall on which a disc can slide, roll or rest under gravity.

    Attributes:
        rows: Shape ``(features, 4)``, one row for each side or vertex: whether it is a ground, the numbers of the
            vertices at its two ends, and the number of its entries in `never_met`.
        never_met: For each ground in order, the numbers of the sides and vertices that a disc on it never meets.
    """

    rows: NDArray[np.float64]
    never_met: NDArray[np.float64]


def build_grounds(start: DiscArrays, features: dict[int, tuple[Outline, WallFeature]], walls: list[int]) -> Grounds:
    """Find the grounds of a scene: surfaces of walls on which a disc can slide, roll or rest.

    Half-planes and straight sides of finite walls are grounds, unless the wall moves or is a conveyor belt.

    Args:
        start: The discs and walls.
        features: The sides and vertices of finite walls, by number.
        walls: The wall of each side or vertex, by number.
    """
    rows = np.tile(np.array([0, NO_OBSTACLE, NO_OBSTACLE, 0], np.float64), (len(walls), 1))
    never_met: list[int] = []
    of_wall: defaultdict[int, dict[int, WallFeature]] = defaultdict(dict)
    for number, (_, part) in features.items():
        of_wall[walls[number]][number] = part
    surroundings = {
        wall: _Surroundings(outline, parts)
        for wall, parts in of_wall.items()
        if isinstance(outline := start.walls[wall], Outline) and outline.edges  # a circle has no edges
    }
    for number, wall in enumerate(walls):
        belt = 0.0 if start.belts_m_s is None else start.belts_m_s[wall]
        if belt or not start.drive_of_wall(wall).is_stationary:
            continue
        if number not in features:  # a half-plane
            rows[number, 0] = 1
        elif isinstance(feature := features[number][1].feature, Face):
            end_vertices, never = surroundings[wall].find_face_surroundings(feature)
            rows[number] = (1, *end_vertices, len(never))
            never_met += never
    return Grounds(rows, np.array(never_met, np.float64))


class _Surroundings:
    """Sides and vertices of a finite wall, indexed by position."""

    def __init__(self, outline: Outline, parts: dict[int, WallFeature]) -> None:
        self._vertices: dict[tuple[Point, float], int] = {}
        self._faces: defaultdict[frozenset[Point], list[int]] = defaultdict(list)
        self._arcs: defaultdict[Point, list[int]] = defaultdict(list)
        for number, part in parts.items():
            feature = part.feature
            if isinstance(feature, Face):
                self._faces[frozenset((feature.a, feature.b))].append(number)
                continue
            centre = (feature.centre[0][0], feature.centre[1][0])
            if feature == Arc.vertex(centre, feature.half_width):
                self._vertices.setdefault((centre, feature.half_width), number)
            elif feature.sector is not None:
                ends = {outline.edges[part.edges[0]].a, outline.edges[part.edges[-1]].b}
                for end in {centre} if feature.is_vertex else ends:
                    self._arcs[end].append(number)

    def find_face_surroundings(self, face: Face) -> tuple[tuple[int, int], list[int]]:
        """Return the vertices at the ends of a straight side, and the parts of the wall that a disc there never meets.

        The parts never met are both sides of the edge, the vertices, and arcs that continue the wall smoothly. Rounding
        would decide whether a disc meets such an arc or the straight side first.
        """
        first, last = (self._vertices.get((end, face.half_width), NO_OBSTACLE) for end in (face.a, face.b))
        never = [*self._faces[frozenset((face.a, face.b))]]
        for end, vertex in ((face.a, first), (face.b, last)):
            never += self._arcs[end] if vertex == NO_OBSTACLE else [vertex]
        return (first, last), never
