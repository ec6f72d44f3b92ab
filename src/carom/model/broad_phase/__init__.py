"""Broad phase: finds the pairs of discs that are near each other, for any radii, in linear time and memory.

The discs are split into halves repeatedly, along the longer side of the box around their centres. The halves form a
tree. Each node stores the box of its discs, their largest reach and their lowest number. The search for one disc starts
at the root. The search for a disc's neighbours skips every node that is out of reach or contains only discs with higher
numbers. So the search is fast for radii of all sizes and for all arrangements, such as discs on a line, or a few discs
far from the others. Immovable discs are stored in a second tree. The search starts only from movable discs, so overlaps
among immovable discs cost no time.

A comparison of floats decides whether two discs are near. A node of the tree is skipped if the comparison is false for
the node's box. Rounding is monotone, so the comparison is then false for all discs of the node. The search therefore
finds exactly those pairs that a comparison of all pairs finds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Pairs = tuple[NDArray[np.intp], NDArray[np.intp]]

#: Number of distances between discs and walls that are computed at once. A larger number would take too much memory.
_DISTANCES = 2**20


def find_near_pairs(position_m: Floats, reach_m: Floats, movable: Flags) -> Iterator[Pairs]:
    """Yield all pairs of near discs, except pairs of two immovable discs.

    Two discs are near if the distance of their centres is at most the sum of their reaches:
    ``dx * dx + dy * dy <= reach * reach``, in floats. If the sum of their reaches is negative, two discs are not near.

    The pairs are yielded in blocks. With n discs, a block has at most n + 65,536 pairs. Blocks are ordered by the
    second disc, so a caller that needs only the first pairs can stop early.

    Args:
        position_m: Centres, in metres, shape ``(n, 2)``.
        reach_m: Reach of each disc, in metres, shape ``(n,)``: its radius plus half of the greatest gap between two
            near discs.
        movable: Whether impacts move each disc, shape ``(n,)``.

    Yields:
        Lower and higher disc number of each pair. The pairs of a block are in no particular order.
    """
    from carom.model.broad_phase import tree

    search = tree.Search(np.ascontiguousarray(position_m), np.ascontiguousarray(reach_m), np.ascontiguousarray(movable))
    begin = 0
    while begin < len(reach_m):
        first, second, begin = search.pairs(begin)
        yield first, second


def find_near_walls(position_m: Floats, reach_m: Floats, movable: Flags, walls: Floats) -> Iterator[Pairs]:
    """Yield each movable disc with each half-plane within its reach. A disc behind the surface is always within reach.

    Args:
        position_m: Centres, in metres, shape ``(n, 2)``.
        reach_m: Reach of each disc, in metres, shape ``(n,)``.
        movable: Whether impacts move each disc, shape ``(n,)``.
        walls: A point and the unit normal of each wall, shape ``(w, 4)``.

    Yields:
        Disc numbers and wall numbers of the pairs, sorted by disc and then by wall.
    """
    if not len(walls):
        return
    x, y, nx, ny = walls.T[:, :, None]
    block = max(1, _DISTANCES // len(walls))
    for begin in range(0, len(reach_m), block):
        block_rows = slice(begin, begin + block)
        distance = (position_m[block_rows, 0] - x) * nx + (position_m[block_rows, 1] - y) * ny
        disc, wall = np.nonzero(((distance <= reach_m[block_rows]) & movable[block_rows]).T)
        yield begin + disc, wall
