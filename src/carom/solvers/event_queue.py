"""The queue of predicted impacts, earliest first, with those that a later impact has made void left out."""

from __future__ import annotations

import heapq
import math

__all__ = ["EventQueue"]


class EventQueue:
    """A binary heap with lazy deletion.

    Each disc counts its impacts. A prediction carries the counts at which it was made, and is void once either has
    moved on; void predictions are dropped when they surface. Ties in time go to the lower body numbers, so the order of
    simultaneous impacts is the same in every run.
    """

    def __init__(self, discs: int) -> None:
        self._heap: list[tuple[float, int, int, int, int]] = []
        self._count = [0] * discs

    def predict(self, time_s: float, first: int, second: int) -> None:
        """Add the predicted impact of disc `first` with `second` (a wall is negative); an infinite time is dropped."""
        if time_s < math.inf:
            heapq.heappush(self._heap, (time_s, first, second, self._count[first], self._count_of(second)))

    def void(self, body: int) -> None:
        """Void every prediction of this disc: its path has changed."""
        if body >= 0:
            self._count[body] += 1

    def peek(self) -> tuple[float, int, int] | None:
        """Return the earliest valid impact as (time, first, second) and leave it there; None when none is left."""
        heap = self._heap
        while heap:
            time_s, first, second, count_first, count_second = heap[0]
            if count_first == self._count[first] and count_second == self._count_of(second):
                return time_s, first, second
            heapq.heappop(heap)
        return None

    def _count_of(self, body: int) -> int:
        return self._count[body] if body >= 0 else 0
