"""Pairs of discs that are near each other: a broad phase by sweeping along one axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["Neighbours", "near_pairs"]

#: Candidate pairs looked at in one go: a few arrays of so many numbers are tens of megabytes.
_MOST_CANDIDATES = 2**20


@dataclass(frozen=True)
class Neighbours:
    """Pairs of discs, in the order of their numbers.

    Attributes:
        first: Lower number of each pair.
        second: Higher number of each pair.
        of_disc: Indices of the pairs that a disc is in, those of one disc after those of another, each in order.
        start: Where the pairs of each disc begin in `of_disc`; one more entry than discs.
    """

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    of_disc: NDArray[np.intp]
    start: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.first)

    def pairs_of(self, disc: int) -> NDArray[np.intp]:
        """Return the indices of the pairs that a disc is in, ascending."""
        return self.of_disc[self.start[disc] : self.start[disc + 1]]


def near_pairs(
    position_m: tuple[NDArray[np.float64], NDArray[np.float64]],
    radius_m: NDArray[np.float64],
    movable: NDArray[np.bool_],
    gap_m: float,
) -> Neighbours:
    """Return every pair of discs, at least one of them movable, whose rims are at most so far apart.

    Args:
        position_m: x and y of the centres, metres, each of shape ``(n,)``.
        radius_m: Radii, metres, shape ``(n,)``.
        movable: Whether an impact moves a disc, shape ``(n,)``.
        gap_m: Largest distance of two rims, metres.
    """
    n = len(radius_m)
    parts = list(_sweep(position_m, radius_m, movable, gap_m))
    first = np.concatenate([part[0] for part in parts]) if parts else np.zeros(0, np.intp)
    second = np.concatenate([part[1] for part in parts]) if parts else np.zeros(0, np.intp)
    order = np.lexsort((second, first))
    first, second = first[order], second[order]
    ends = np.concatenate([first, second])
    by_disc = np.argsort(ends, kind="stable")
    pair = np.concatenate([np.arange(len(first)), np.arange(len(first))])[by_disc]
    start = np.searchsorted(ends[by_disc], np.arange(n + 1))
    # Ascending within a disc: it is the second of all pairs in which it is not the first, and those come before.
    pair = pair[np.lexsort((pair, ends[by_disc]))]
    return Neighbours(first, second, pair, start)


def _sweep(
    position_m: tuple[NDArray[np.float64], NDArray[np.float64]],
    radius_m: NDArray[np.float64],
    movable: NDArray[np.bool_],
    gap_m: float,
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    x, y = position_m
    order = np.argsort(x - radius_m, kind="stable")
    left, right = (x - radius_m)[order], (x + radius_m)[order] + gap_m
    count = np.searchsorted(left, right, side="right") - np.arange(len(x)) - 1
    ends = np.cumsum(count)
    begin = 0
    while begin < len(x):
        done = int(ends[begin - 1]) if begin else 0
        end = max(begin + 1, int(np.searchsorted(ends, done + _MOST_CANDIDATES, side="right")))
        some = count[begin:end]
        a = np.repeat(np.arange(begin, end), some)
        b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(some) - some, some)
        i, j = order[a], order[b]
        reach = radius_m[i] + radius_m[j] + gap_m
        near = np.abs(y[j] - y[i]) <= reach
        i, j, reach = i[near], j[near], reach[near]
        near = (np.hypot(x[j] - x[i], y[j] - y[i]) <= reach) & (movable[i] | movable[j])
        i, j = i[near], j[near]
        yield np.minimum(i, j), np.maximum(i, j)
        begin = end
