"""The queue of the event-driven kernel: an 8-ary tournament tree of the earliest time of every disc.

Each group of eight times is one cache line; its least time stands in the level above. Level 0 holds the discs' own
times. `levels` holds the offset of each level in `tree`; the last level is the single least time of all.
Compared with a binary heap there is nothing to move and nothing to delete: a disc's time is overwritten.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.solvers.layout import DISCS, OFFSET, TOP, index

if TYPE_CHECKING:
    from carom.solvers.layout import Column

__all__ = ["earliest", "least_other", "lesser", "level_offsets", "next_at", "set_time"]


def level_offsets(discs: int) -> tuple[list[int], int]:
    """Return the offset of each level, and the length of the whole tree, for `discs` times."""
    offsets, total, size = [], 0, discs
    while True:
        offsets.append(total)
        if size == 1 and len(offsets) > 1:
            return offsets, total + 8
        total += -(-size // 8) * 8
        size = -(-size // 8)


def lesser(a: float, b: float) -> float:
    """Return the lesser of two times, neither of them NaN."""
    return a if a < b else b


def least_of_eight(tree: Column, group: int) -> float:
    """Return the least of the eight times from `group` on; in three rounds, so that a processor can overlap them."""
    a, b = lesser(tree[group], tree[group + 1]), lesser(tree[group + 2], tree[group + 3])
    c, d = lesser(tree[group + 4], tree[group + 5]), lesser(tree[group + 6], tree[group + 7])
    return lesser(lesser(a, b), lesser(c, d))


def set_time(tree: Column, winner: Column, size: Column, i: int, time: float) -> None:
    """Give disc `i` its earliest time, and bring the levels above up to date as far as they change."""
    tree[i] = time
    place = i
    for level in range(size[TOP]):
        group = size[OFFSET + level] + (place >> 3 << 3)
        least = least_of_eight(tree, group)
        place >>= 3
        above = size[OFFSET + level + 1] + place
        if tree[above] == least and winner[above] != i:
            return
        holder, holders = 0, 0
        for k in range(8):  # without branches: a processor could not foresee them
            holder += k * (tree[group + k] <= least)
            holders += tree[group + k] <= least
        if holders > 1:
            holder = 0
            while tree[group + holder] > least:
                holder += 1
        tree[above] = least
        winner[above] = group + holder if level == 0 else winner[group + holder]


def earliest(winner: Column, size: Column) -> int:
    """Return the disc of the least time, or one of those that share it."""
    return index(winner[size[OFFSET + size[TOP]]])


def least_other(tree: Column, size: Column, i: int) -> float:
    """Return the least time of all discs but disc `i`."""
    least = math.inf
    for level in range(size[TOP]):
        place = size[OFFSET + level] + i
        group = place >> 3 << 3
        for k in range(group, group + 8):
            least = lesser(least, tree[k] if k != place else math.inf)
        i >>= 3
    return least


def next_at(tree: Column, size: Column, i: int, time: float) -> int:
    """Return the first disc from `i` on whose time is `time` or less, or the number of discs if there is none."""
    top = size[TOP]
    while i < size[DISCS]:
        if tree[i] <= time:
            return i
        # Step over the largest subtree that begins at i and holds nothing early enough.
        level = 0
        while (
            level < top
            and i & ((8 << 3 * level) - 1) == 0
            and tree[size[OFFSET + level + 1] + (i >> 3 * (level + 1))] > time
        ):
            level += 1
        i += 1 << 3 * level
    return int(size[DISCS])
