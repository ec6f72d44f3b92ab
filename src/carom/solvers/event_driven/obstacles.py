"""Obstacles of a run in the form that the core reads: half-planes, and the features of finite walls."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from carom.core.input_rows import FEATURE_NUMBERS, driven_rows, feature_row
from carom.core.wall_features import WallFeature, are_decidable, features_of
from carom.model.chain_geometry import Outline
from carom.model.trace import EDGE_DTYPE, NO_EDGE
from carom.solvers.event_driven.grounds import Grounds, grounds_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.model.disc_arrays import DiscArrays

#: `MOST_OBSTACLES` of pic/state.h.
MOST_OBSTACLES = 67_108_863


class Obstacles:
    """Obstacles of a scene in which a wall is finite, driven or a belt, or has its own coefficients.

    Attributes:
        rows: Data of each obstacle, as returned by `carom.core.input_rows.feature_row`.
        driven: A row for each driven body and each conveyor wall: see `driven_rows`.
        legs: A row for each leg of a driven path.
    """

    def __init__(self, start: DiscArrays) -> None:
        self._start = start
        self._finite: dict[int, tuple[Outline, WallFeature]] = {}  # by the number of the obstacle
        rows: list[tuple[float, ...]] = []
        widest = start.radius_m.max(initial=0.0)
        for number, wall in enumerate(start.walls):
            if isinstance(wall, tuple):
                rows.append(feature_row(wall, number))
                continue
            for part in features_of(wall, widest):
                self._finite[len(rows)] = wall, part
                rows.append(feature_row(part.feature, number))
        self.rows = np.array(rows, np.float64).reshape(-1, FEATURE_NUMBERS)
        self.driven, self.legs = driven_rows(start)

    @cached_property
    def grounds(self) -> Grounds:
        """The half-planes and straight faces with which a disc can be in lasting contact."""
        return grounds_of(self._start, self._finite, self.rows[:, 1].astype(int).tolist())

    def names(self, one: int, other: int) -> str:
        """Return the names of two obstacles: walls, or edges of finite walls."""
        walls = [f"wall {int(self.rows[number, 1])}" for number in (one, other)]
        edges = [self._finite[number][1].edges[0] if number in self._finite else None for number in (one, other)]
        if walls[0] == walls[1] and None not in edges:
            low, high = sorted(edge for edge in edges if edge is not None)
            return f"edges {low} and {high} of {walls[0]}"
        return " and ".join(
            wall if edge is None else f"edge {edge} of {wall}" for wall, edge in zip(walls, edges, strict=True)
        )

    def decides(self, one: int, other: int, elastic: bool) -> bool:
        """Return whether a disc that meets two features at one instant has the same result in either order."""
        first, second = self._finite[one][1], self._finite[other][1]
        return are_decidable(first.feature, second.feature, elastic=elastic)

    def edges(self, contacts: NDArray[np.void]) -> NDArray[np.void]:
        """Convert contacts (`CONTACT_DTYPE`) to the edges of impacts (`carom.model.trace.EDGE_DTYPE`)."""
        lowest, is_joined = self._lowest_edges
        edges: NDArray[np.void] = lowest[contacts["feature"]]
        for row in np.flatnonzero(is_joined[contacts["feature"]]):
            x, y, obstacle = contacts[row].item()
            wall, part = self._finite[obstacle]
            edges["edge"][row] = wall.edge_at(x, y, part.edges)
        return edges

    @cached_property
    def _lowest_edges(self) -> tuple[NDArray[np.void], NDArray[np.bool_]]:
        """The lowest edge of each obstacle, and whether the obstacle has several. The last row is for no obstacle."""
        lowest = np.full(len(self.rows) + 1, np.array(NO_EDGE, EDGE_DTYPE))
        is_joined = np.zeros(len(lowest), bool)
        for obstacle, (_, part) in self._finite.items():
            lowest[obstacle] = part.edges[0], part.kind
            is_joined[obstacle] = len(part.edges) > 1
        return lowest, is_joined
