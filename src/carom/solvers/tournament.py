"""The queue of the event-driven kernel: an 8-ary tournament tree of the earliest time of every disc.

Each group of eight times is one cache line; its least time stands in the level above. Level 0 holds the discs' own
times. `levels` holds the offset of each level in `tree`; the last level is the single least time of all.
Compared with a binary heap there is nothing to move and nothing to delete: a disc's time is overwritten.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.solvers.layout import Column

__all__ = ["INLINE", "KERNEL", "earliest", "lesser", "level_offsets", "next_at", "set_time"]


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


def set_time(tree: Column, levels: Column, i: int, time: float) -> None:
    """Give disc `i` its earliest time, and bring the levels above up to date as far as they change."""
    tree[i] = time
    for level in range(len(levels) - 1):
        group = levels[level] + (i >> 3 << 3)
        least = tree[group]
        for k in range(1, 8):
            least = lesser(least, tree[group + k])
        i >>= 3
        above = levels[level + 1] + i
        if tree[above] == least:
            return
        tree[above] = least


def earliest(tree: Column, levels: Column) -> tuple[int, float, bool]:
    """Return the disc of the least time (the lowest such disc), that time, and whether another disc has it too."""
    level = len(levels) - 1
    least = tree[levels[level]]
    i = 0
    holders = 0
    while level > 0:
        level -= 1
        holders -= 1
        i <<= 3
        group = levels[level] + i
        chosen = 0
        for k in range(7, -1, -1):
            if tree[group + k] == least:
                chosen = k
                holders += 1
        i += chosen
    return i, least, holders > 0


def next_at(tree: Column, levels: Column, i: int, time: float, discs: int) -> int:
    """Return the first disc from `i` on whose time is `time` or less, or `discs` if there is none."""
    top = len(levels) - 1
    while i < discs:
        if tree[i] <= time:
            return i
        # Step over the largest subtree that begins at i and holds nothing early enough.
        level = 0
        while (
            level < top and i & ((8 << 3 * level) - 1) == 0 and tree[levels[level + 1] + (i >> 3 * (level + 1))] > time
        ):
            level += 1
        i += 1 << 3 * level
    return discs


#: What a compiler must compile.
KERNEL = (lesser, set_time, earliest, next_at)
INLINE = (lesser, earliest)
