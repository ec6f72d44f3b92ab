"""What the lower bounds are compared with: the start of both paths, until balls know better."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from carom.solvers.certified.disc_states import BallBodies


class StartBounds:
    """The table of `carom.solvers.certified.bounds.LowerBounds`, in which each new bound says nothing."""

    def __init__(self, bodies: BallBodies) -> None:
        self._bodies = bodies
        self._bounds: dict[tuple[int, int], float] = {}
        self._queue: list[tuple[float, int, int]] = []  # all earlier bounds, with the present ones among them
        for i in range(len(bodies)):
            self._fill(i, range(i + 1, len(bodies)))

    def changed(self, *discs: int) -> None:
        """Forget the bounds of one movable disc, or of two that have met."""
        self._bounds = {pair: at for pair, at in self._bounds.items() if pair[0] not in discs and pair[1] not in discs}
        for k, i in enumerate(discs):
            self._fill(i, (j for j in range(len(self._bodies)) if j != i and j not in discs[:k]))

    def earliest(self) -> tuple[float, int, int]:
        """Return the least bound of all, its row, and the other body."""
        while self._queue and self._bounds.get(self._queue[0][1:]) != self._queue[0][0]:
            heapq.heappop(self._queue)
        return self._queue[0] if self._queue else (math.inf, 0, 0)

    def raise_to(self, disc: int, body: int, bound: float) -> None:
        """Replace a bound by a better one."""
        self._bounds[disc, body] = bound
        heapq.heappush(self._queue, (bound, disc, body))

    def up_to(self, time: float) -> list[tuple[float, int, int]]:
        """Return all bounds that are not above a time, row by row, each with its row and the other body."""
        found = [(bound, *pair) for pair, bound in self._bounds.items() if not bound > time]
        return sorted(found, key=lambda entry: (entry[1], entry[2] < 0, abs(entry[2])))

    def _fill(self, i: int, others: Iterable[int]) -> None:
        bodies = self._bodies
        walls = range(-len(bodies.scene.walls), 0) if bodies.movable[i] else ()
        for j in (*others, *walls):
            movable = bodies.movable[i] or (j >= 0 and bodies.movable[j])
            met = bodies.have_just_met(i, j) if j >= 0 else not bodies.falls and bodies.partner[i] == j
            if movable and not met:
                self.raise_to(i, j, bodies.path_start(i, j))
