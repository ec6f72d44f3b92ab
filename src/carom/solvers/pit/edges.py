"""Which edges the impacts of the compiled frame loop were on: found when they are asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.plain.finite_walls import FiniteWall
from carom.trace import EDGE_DTYPE, NO_EDGE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from carom.disc_arrays import HalfPlane
    from carom.outline import Outline


class NearestEdges:
    """Finds the edges of rows of `carom.solvers.rows.CONTACT_DTYPE` whose features are numbers of walls."""

    def __init__(self, walls: Sequence[HalfPlane | Outline]) -> None:
        self._walls = walls
        self._finite: dict[int, FiniteWall] = {}

    def __call__(self, contacts: NDArray[np.void]) -> NDArray[np.void]:
        """Return the edges that are nearest, of `carom.trace.EDGE_DTYPE`; none of a half-plane or another disc."""
        return np.array([self._edge(*contact) for contact in contacts.tolist()], dtype=EDGE_DTYPE)

    def _edge(self, x: float, y: float, number: int) -> tuple[int, int]:
        wall = self._walls[number] if number >= 0 else ()
        if isinstance(wall, tuple):
            return NO_EDGE
        if number not in self._finite:
            self._finite[number] = FiniteWall(wall)
        hit = self._finite[number].hit_from(x, y)
        return NO_EDGE if hit is None else hit.edge
