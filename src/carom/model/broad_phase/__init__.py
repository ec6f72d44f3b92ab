"""Broad phase: finds the pairs of discs that are near each other, for any radii, in linear time and memory.

The discs are split into halves again and again, along the longer side of the box around their centres. The halves form
a tree. Each node stores the box of its discs, their largest reach and their lowest number. The search for one disc goes
down the tree and skips every node that is out of reach or contains only higher numbers. So the search is fast for every
arrangement of discs, also for columns, lines, far outliers and radii of all sizes. Immovable discs may overlap each
other without cost: a movable disc that is near none of them visits only the root of their tree.

A single comparison of floats decides whether two discs are near. Rounding is monotone, so if a node fails the
comparison, all of its discs fail it. So the result is exactly the pairs that a comparison of all pairs finds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Pairs = tuple[NDArray[np.intp], NDArray[np.intp]]

#: Number of distances between discs and walls that are computed at once. A few arrays of this size take tens of
#: megabytes.
_DISTANCES = 2**20


def find_near_pairs(position_m: Floats, reach_m: Floats, movable: Flags) -> Iterator[Pairs]:
    """Yield pairs of discs whose distance is at most the sum of their reaches, and of which at least one is movable.

    The pairs come in blocks. The number of pairs in a block exceeds the number of discs by at most 65,536. Blocks are
    ordered by the second disc, so a caller that needs only the first pairs can stop early. A pair whose sum of reaches
    is negative is never near. The test is ``dx * dx + dy * dy <= reach * reach``, in floats.

    Args:
        position_m: Centres, in metres, shape ``(n, 2)``.
        reach_m: Reach of each disc, in metres, shape ``(n,)``: its radius plus half of the gap at which discs are still
            near.
        movable: Whether an impact moves a disc, shape ``(n,)``.

    Yields:
        Lower and higher disc number of each pair. Within a block, pairs have no order.
    """
    from carom.model.broad_phase import tree

    search = tree.Search(np.ascontiguousarray(position_m), np.ascontiguousarray(reach_m), np.ascontiguousarray(movable))
    begin = 0
    while begin < len(reach_m):
        first, second, begin = search.pairs(begin)
        yield first, second


def find_near_walls(position_m: Floats, reach_m: Floats, movable: Flags, walls: Floats) -> Iterator[Pairs]:
    """Yield the pairs of a movable disc and a wall within the disc's reach. Discs behind a wall count as near.

    Args:
        position_m: Centres, in metres, shape ``(n, 2)``.
        reach_m: Reach of each disc, in metres, shape ``(n,)``.
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
        block_rows = slice(begin, begin + block)
        distance = (position_m[block_rows, 0] - x) * nx + (position_m[block_rows, 1] - y) * ny
        disc, wall = np.nonzero(((distance <= reach_m[block_rows]) & movable[block_rows]).T)
        yield begin + disc, wall
