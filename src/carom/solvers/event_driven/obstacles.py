"""Walls of a run as arrays for the compiled core. An obstacle is one side or one vertex of a wall."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carom.core.input_rows import FEATURE_NUMBERS, build_driven_rows, build_feature_row
from carom.core.wall_features import build_features
from carom.core.wall_parts import WallPart, are_decidable
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import DiscArrays
from carom.model.trace import EDGE_DTYPE, NO_EDGE, EdgeKind

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
        self._finite: dict[int, tuple[Outline, WallPart]] = {}  # obstacles of finite walls, by number
        self._begins: list[int] = []  # number of each wall's first obstacle
        rows: list[tuple[float, ...]] = []
        widest = start.radius_m.max(initial=0.0)
        for number, wall in enumerate(start.walls):
            self._begins.append(len(rows))
            if isinstance(wall, tuple):
                rows.append(build_feature_row(wall, number))
                continue
            for feature, part in build_features(wall, widest):
                self._finite[len(rows)] = wall, part
                rows.append(build_feature_row(feature, number))
        self.rows = np.array(rows, np.float64).reshape(-1, FEATURE_NUMBERS)
        self.driven, self.legs = build_driven_rows(start)

    @cached_property
    def grounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The surfaces of walls (grounds) on which a disc can slide, roll or rest under gravity.

        Grounds are half-planes and straight sides of finite walls, except for moving walls and conveyor belts. The
        first array has a row for each obstacle: whether it is a ground, the numbers of the vertices at its two ends,
        and the number of its entries in the second array. The second array contains, for each ground in order, the
        numbers of the obstacles that a disc on it never meets.
        """
        rows = np.tile(np.array([0, NO_OBSTACLE, NO_OBSTACLE, 0], np.float64), (len(self.rows), 1))
        never_met: list[int] = []
        for number, wall in enumerate(self.rows[:, 1].astype(int).tolist()):
            if self._start.belt_of_wall(wall) or not self._start.drive_of_wall(wall).is_stationary:
                continue
            if number not in self._finite:
                rows[number, 0] = 1
                continue
            part, begin = self._finite[number][1], self._begins[wall]
            if part.kind is not EdgeKind.FACE:
                continue
            vertices, arcs = [], []
            for other in part.neighbours:
                is_vertex = self._finite[begin + other][1].kind is EdgeKind.VERTEX
                vertices.append(begin + other if is_vertex else NO_OBSTACLE)
                # Rounding would decide whether a disc meets the straight side or an arc that continues it.
                arcs += [] if is_vertex else [other, other ^ 1]
            rows[number] = (1, *vertices, len(part.never_met) + len(arcs))
            never_met += (begin + other for other in (*part.never_met, *arcs))
        return rows, np.array(never_met, np.float64)

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
        return are_decidable(first.shape, second.shape, elastic=elastic)

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
