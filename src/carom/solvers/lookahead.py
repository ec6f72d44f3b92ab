"""What the event-driven kernel will need soon: asked for while it is still busy with something else.

With many discs nearly all that an event needs is far away in memory, and each piece says only where the next one is:
the disc, then its partner and its cells, then the discs in these. While one event is dealt with, what the next one will
need is fetched, as far as it can be known. No result depends on it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.physics.compilation import prefetch
from carom.solvers.layout import (
    CELL,
    COLUMN_BITS,
    COLUMN_MASK,
    LAST,
    NOBODY,
    OFFSET,
    PARTNER,
    ROW,
    SLOTS,
    STRIDE,
    TOP,
    index,
)
from carom.solvers.tournament import least_sibling

if TYPE_CHECKING:
    from carom.solvers.layout import Columns

__all__ = ["INLINE", "fetch_disc", "fetch_neighbours", "fetch_surroundings", "runner_up"]


def runner_up(s: Columns, i: int) -> int:
    """Return the disc that most likely comes next after disc `i`, the earliest: two levels of the tree tell."""
    tree, winner, size = s.tree, s.winner, s.size
    last = size[TOP] - 1
    upper, lower = size[OFFSET + last], size[OFFSET + last - 1]
    time, place = least_sibling(tree, upper, i >> 3 * last)
    other_time, other_place = least_sibling(tree, lower, i >> 3 * (last - 1))
    return index(winner[upper + place] if time < other_time else winner[lower + other_place])


def fetch_disc(s: Columns, i: int) -> None:
    """Fetch the rows of disc `i`."""
    prefetch(s.body, i * ROW)
    prefetch(s.link, i * ROW)
    prefetch(s.tree, i)
    prefetch(s.tree, s.size[OFFSET + 1] + (i >> 3))
    prefetch(s.winner, s.size[OFFSET + 1] + (i >> 3))


def fetch_surroundings(s: Columns, i: int) -> None:
    """Fetch the rows of the partner of disc `i`, and the cells around."""
    partner = index(s.link[i * ROW + PARTNER])
    if partner != NOBODY:
        prefetch(s.body, partner * ROW)
        prefetch(s.link, partner * ROW)
        prefetch(s.tree, partner)
        prefetch(s.inverse_mass, partner)
    prefetch(s.inverse_mass, i)
    prefetch(s.link, index(s.link[i * ROW + LAST]) * ROW)
    fetch_cells(s, i)


def fetch_cells(s: Columns, i: int) -> None:
    """Fetch the cells around disc `i`."""
    place, stride = index(s.link[i * ROW + CELL]), s.size[STRIDE]
    row, column = place >> COLUMN_BITS, place & COLUMN_MASK
    for k in range(3):
        line = ((row + k - 1) * stride + column) * SLOTS
        prefetch(s.cells, line - SLOTS)
        prefetch(s.cells, line + 2 * SLOTS - 1)


def fetch_neighbours(s: Columns, i: int) -> None:
    """Fetch the rows of the discs in the cells around disc `i`."""
    place, stride = index(s.link[i * ROW + CELL]), s.size[STRIDE]
    corner = ((place >> COLUMN_BITS) - 1) * stride + (place & COLUMN_MASK) - 1
    for line in range(3):
        base = (corner + line * stride) * SLOTS
        for k in range(3 * SLOTS):
            j = index(s.cells[base + k])
            prefetch(s.body, (j if j > 0 else 0) * ROW)
    partner = index(s.link[i * ROW + PARTNER])
    if partner != NOBODY:
        fetch_cells(s, partner)


#: Called at one place.
INLINE = (fetch_cells, runner_up, fetch_disc, fetch_neighbours, fetch_surroundings)
