"""Broad phase: finds the pairs of discs that are near each other, for any radii, in linear time and memory.

A tree halves the discs again and again, along the longer side of the box around their centres. Each part has its box,
largest reach and lowest number. A disc walks down the tree, past every part that is out of reach or has higher numbers.
So no arrangement is slow: columns, lines, far outliers, radii of all sizes. Immovable discs may also overlap each
other: a movable disc that none of them is near visits only the root of their part.

Whether two discs are near is one comparison of floats. Rounding is monotone, so a part that fails the comparison
contains no disc that passes it. The pairs are exactly those that comparing all pairs gives.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Pairs = tuple[NDArray[np.intp], NDArray[np.intp]]

#: Number of distances between discs and walls that are computed at once; a few arrays of this size are tens of
#: megabytes.
_DISTANCES = 2**20


def near_pairs(position_m: Floats, reach_m: Floats, movable: Flags) -> Iterator[Pairs]:
    """Yield the pairs of discs, not both immovable, whose centres are no farther apart than the sum of their reaches.

    They come in blocks of up to some ten thousand more than there are discs. No pair of a later block has a lower
    second disc than a pair of an earlier one, so a caller that wants the first of them can stop. Where the sum of the
    reaches is below 0 the pair is not near; ``dx * dx + dy * dy <= reach * reach`` decides, in floats.

    Args:
        position_m: Centres, metres, shape ``(n, 2)``.
        reach_m: What each disc puts in, metres, shape ``(n,)``: its radius, and half of the gap that still counts.
        movable: Whether an impact moves a disc, shape ``(n,)``.

    Yields:
        The lower number of each pair, and the higher one, in no order within a block.
    """
    from carom.model.broad_phase import tree

    search = tree.Search(np.ascontiguousarray(position_m), np.ascontiguousarray(reach_m), np.ascontiguousarray(movable))
    begin = 0
    while begin < len(reach_m):
        first, second, begin = search.pairs(begin)
        yield first, second


def near_walls(position_m: Floats, reach_m: Floats, movable: Flags, walls: Floats) -> Iterator[Pairs]:
    """Yield the movable discs and walls that are no farther apart than the disc's reach, behind the wall included.

    Args:
        position_m: Centres, metres, shape ``(n, 2)``.
        reach_m: Reach of each disc, metres, shape ``(n,)``.
        movable: Whether an impact moves a disc, shape ``(n,)``.
        walls: A point and the unit normal of each wall, shape ``(w, 4)``.

    Yields:
        Number of the disc and of the wall of each pair, in the order of the discs, then of the walls.
    """
    if not len(walls):
        return
    x, y, nx, ny = walls.T[:, :, None]
    block = max(1, _DISTANCES // len(walls))
    for begin in range(0, len(reach_m), block):
        some = slice(begin, begin + block)
        distance = (position_m[some, 0] - x) * nx + (position_m[some, 1] - y) * ny
        disc, wall = np.nonzero(((distance <= reach_m[some]) & movable[some]).T)
        yield begin + disc, wall
