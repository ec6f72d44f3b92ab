"""The plain form of the search for near pairs: all discs of a block walk down the tree together, as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Search"]

#: Discs that are looked at one by one.
_LEAF = 8
#: Discs that walk together at first, and at most; and places that they may stand at together, or fewer walk.
_FEWEST, _MOST = 64, 2**14
_MOST_PLACES = 2**20


class _Discs(NamedTuple):
    """Some of the discs, or what is known of parts of them: the span of their centres, reaches and lowest numbers."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    reach: NDArray[np.float64]
    number: NDArray[np.intp]


def _near(dx: NDArray[np.float64], dy: NDArray[np.float64], reach: NDArray[np.float64]) -> NDArray[np.bool_]:
    near: NDArray[np.bool_] = (reach >= 0.0) & (dx * dx + dy * dy <= reach * reach)
    return near


def _tree(position: NDArray[np.float64], reach: NDArray[np.float64], number: NDArray[np.intp]) -> list[_Discs]:
    """Return the levels of the tree over some discs, the root first, the discs themselves last.

    Every part of a level is of the same size, so that a level is a table with a row a part: copies of the last disc
    that reach nothing fill it up.
    """
    count = _LEAF
    while count < len(number):
        count *= 2
    fill = count - len(number)
    order = np.concatenate([np.arange(len(number)), np.full(fill, len(number) - 1)])
    position, number = position[order], number[order]
    reach = np.concatenate([reach, np.full(fill, -np.inf)])
    part = count
    while part > _LEAF:
        rows = position.reshape(-1, part, 2)
        wide = np.argmax(rows.max(axis=1) - rows.min(axis=1), axis=1)
        along = np.take_along_axis(rows, wide[:, None, None], axis=2)[:, :, 0]
        order = (np.argpartition(along, part // 2, axis=1) + part * np.arange(len(rows))[:, None]).ravel()
        position, reach, number = position[order], reach[order], number[order]
        part //= 2
    levels = [_Discs(position, position, reach, number)]
    below, size = levels[0], _LEAF
    while True:
        below = _Discs(
            below.low.reshape(-1, size, 2).min(axis=1),
            below.high.reshape(-1, size, 2).max(axis=1),
            below.reach.reshape(-1, size).max(axis=1),
            below.number.reshape(-1, size).min(axis=1),
        )
        levels.append(below)
        if len(below.number) == 1:
            return levels[::-1]
        size = 2


class Search:
    """The near pairs of some discs, as `carom.broad_phase.tree.Search` finds them."""

    def __init__(self, position: NDArray[np.float64], reach: NDArray[np.float64], movable: NDArray[np.bool_]) -> None:
        self._position, self._reach, self._movable = position, reach, movable
        kinds = [np.flatnonzero(movable), np.flatnonzero(~movable)]
        self._trees = [_tree(position[which], reach[which], which) if len(which) else [] for which in kinds]
        self._together = _FEWEST

    def pairs(self, begin: int) -> tuple[NDArray[np.intp], NDArray[np.intp], int]:
        """Return the pairs whose higher number is `begin` or above: of as many discs as walk together.

        Returns:
            The lower and the higher number of each pair, in no order, and the number of the disc to go on with.
        """
        while True:
            discs = np.arange(begin, min(begin + self._together, len(self._reach)))
            walks = [self._walk(self._trees[0], discs), self._walk(self._trees[1], discs[self._movable[discs]])]
            found = [walk for walk in walks if walk is not None]
            if len(found) == len(walks):
                self._together = min(2 * self._together, _MOST)
                first, second = (np.concatenate(numbers) for numbers in zip(*found, strict=True))
                return first, second, int(discs[-1]) + 1
            self._together = len(discs) // 2

    def _walk(self, tree: list[_Discs], discs: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
        """Return the pairs of discs with those of lower numbers in a tree; None where too many walk together."""
        place = np.zeros(len(discs) if tree else 0, np.intp)
        disc = discs[: len(place)]
        for depth, level in enumerate(tree):
            if depth:
                children = len(level.number) // len(tree[depth - 1].number)
                disc = np.repeat(disc, children)
                place = (children * place[:, None] + np.arange(children)).ravel()
            if len(place) > _MOST_PLACES and len(discs) > 1:
                return None
            position = self._position[disc]
            away = np.maximum(np.maximum(level.low[place] - position, position - level.high[place]), 0.0)
            near = _near(away[:, 0], away[:, 1], level.reach[place] + self._reach[disc])
            near &= level.number[place] < disc
            disc, place = disc[near], place[near]
        return (tree[-1].number[place] if tree else place), disc
