"""The queue of the event-driven kernel: an 8-ary tournament tree of the earliest time of every disc.

Each group of eight times is one cache line; its least time stands in the level above, and beside it (`winner`) the disc
that it belongs to. Level 0 holds the discs' own times; the last level is the single least time of all. Compared with a
binary heap there is nothing to move and nothing to delete: a disc's time is overwritten.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.solvers.layout import DISCS, OFFSET, TOP, index

if TYPE_CHECKING:
    from carom.solvers.layout import Column, Columns

__all__ = ["INLINE", "earliest", "least_other", "lesser", "level_offsets", "next_at", "set_time"]


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


def least_sibling(tree: Column, level: int, place: int) -> tuple[float, int]:
    """Return the least time of the other seven of a group, and its place.

    Args:
        tree: The times.
        level: Offset of the level.
        place: Place in the level of the one that is left out.
    """
    # In three rounds, so that a processor can overlap them.
    a, b, c = tree[level + (place ^ 1)], tree[level + (place ^ 2)], tree[level + (place ^ 3)]
    d, e, f, g = (
        tree[level + (place ^ 4)],
        tree[level + (place ^ 5)],
        tree[level + (place ^ 6)],
        tree[level + (place ^ 7)],
    )
    bc, de, fg = lesser(b, c), lesser(d, e), lesser(f, g)
    abc, defg = lesser(a, bc), lesser(de, fg)
    at_bc = 2 if b < c else 3
    at_abc = 1 if a < bc else at_bc
    at_de, at_fg = 4 if d < e else 5, 6 if f < g else 7
    at_defg = at_de if de < fg else at_fg
    return lesser(abc, defg), place ^ (at_abc if abc < defg else at_defg)


def set_time(s: Columns, i: int, time: float) -> None:
    """Give disc `i` its earliest time, and bring the levels above up to date as far as they change."""
    tree, winner, size = s.tree, s.winner, s.size
    tree[i] = time
    place, holder = i, i
    for level in range(size[TOP]):
        own, above = size[OFFSET + level], size[OFFSET + level + 1] + (place >> 3)
        if time > tree[above]:
            if index(winner[above]) >> 3 * level != place:
                return
            least, sibling = least_sibling(tree, own, place)
            if least < time:
                time, holder = least, index(winner[own + sibling]) if level > 0 else sibling
        elif time == tree[above] and index(winner[above]) >> 3 * level != place:
            return
        tree[above] = time
        winner[above] = holder
        place >>= 3


def earliest(s: Columns) -> int:
    """Return the disc of the least time, or one of those that share it."""
    return index(s.winner[s.size[OFFSET + s.size[TOP]]])


def least_other(s: Columns, i: int, j: int) -> float:
    """Return the least time of all discs but discs `i` and `j`, which may be the same."""
    tree, size = s.tree, s.size
    least = math.inf
    for level in range(size[TOP]):
        own = size[OFFSET + level]
        if i >> 3 == j >> 3 and i != j:
            for k in range(1, 8):
                if i ^ k != j:
                    least = lesser(least, tree[own + (i ^ k)])
        else:
            time, _ = least_sibling(tree, own, i)
            least = lesser(least, time)
            if i != j:
                time, _ = least_sibling(tree, own, j)
                least = lesser(least, time)
        i >>= 3
        j >>= 3
    return least


def next_at(s: Columns, i: int, time: float) -> int:
    """Return the first disc from `i` on whose time is `time` or less, or the number of discs if there is none."""
    tree, size = s.tree, s.size
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


#: Called at one place, or so short that it costs less than a call.
INLINE = (lesser, least_sibling, set_time, least_other, earliest)
