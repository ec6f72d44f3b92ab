"""The cells of the event-driven kernel: which discs are near each other.

A cell is wider than the largest sum of two radii, so two discs whose cells are not neighbours are apart. The outermost
cells reach to infinity, so a disc is always in some cell, wherever it goes; around them lies a ring of cells that stay
empty, which spares the scans all edge cases. Cells speed a run up and never change its result: a pair is first looked
at when its cells become neighbours, which is before it can touch by the margin between cell width and contact distance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.layout import (
    CELL,
    CHAINED,
    CHAINS,
    COLUMN_BITS,
    COLUMN_MASK,
    COLUMNS,
    CORNER_X,
    CORNER_Y,
    DISCS,
    DOWN,
    EXIT,
    LAST_BIT,
    LEFT,
    MOST_COLUMNS,
    NOBODY,
    NOW,
    OWN_TIME,
    RIGHT,
    ROW,
    ROWS,
    SLOTS,
    STRIDE,
    UP,
    VX,
    VY,
    WIDTH,
    X,
    Y,
)

#: Corner, width of a cell, number of columns and rows.
Grid = tuple[float, float, float, int, int]

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from carom.solvers.layout import Columns

__all__ = ["INLINE", "Grid", "change_cell", "choose_grid", "insert_all", "near_walls"]

#: How much wider than the largest contact distance a cell must be: any amount well above the rounding of a position in
#: units of a cell, which is 2^-53 of the number of columns.
_MARGIN = 1.0 + 2.0**-10

#: Cells a disc at most: beyond that cells hold too little to be worth crossing. Chosen, not tuned: it bounds memory.
_CELLS_PER_DISC = 4


def choose_grid(
    low: tuple[float, float], high: tuple[float, float], largest_reach: float, discs: int, wider: float = 1.0
) -> Grid:
    """Return corner, width of a cell, and numbers of columns and rows.

    Args:
        low: Least x and y of any centre, metres.
        high: Greatest x and y of any centre.
        largest_reach: Largest contact distance of two discs, metres.
        discs: Number of discs.
        wider: Factor on the cell width, at least 1; infinity for a single cell.
    """
    extent_x, extent_y = high[0] - low[0], high[1] - low[1]
    width = max(largest_reach * _MARGIN * wider, math.sqrt(extent_x / discs * extent_y / _CELLS_PER_DISC))
    most = min(_CELLS_PER_DISC * discs, MOST_COLUMNS)
    width = max(width, extent_x / most, extent_y / most)
    if not width < math.inf:
        return (low[0], low[1], largest_reach, 1, 1)
    return (low[0], low[1], width, max(1, int(extent_x / width)), max(1, int(extent_y / width)))


def near_walls(
    grid: Grid, walls: Sequence[tuple[float, float, float, float]], largest_radius: float
) -> NDArray[np.uint8]:
    """Return for each cell, row by row with the ring around, which walls a disc in it may meet.

    A disc meets a wall only where its centre is within a radius of it. A cell at the rim has no end outwards, so each
    wall is near it that comes nearer in that direction.

    Returns:
        One bit a wall, the last of the eight for the eighth and all that follow.
    """
    x0, y0, width, nx, ny = grid
    column, row = np.arange(-1, nx + 1), np.arange(-1, ny + 1)
    x, y = x0 + (column + 0.5) * width, (y0 + (row + 0.5) * width)[:, None]
    near = np.zeros((len(row), len(column)), np.uint8)
    for k, (qx, qy, mx, my) in enumerate(walls):
        # Half a diagonal is .71 of a width: a whole width leaves .29 of it for roundings.
        touches = (x - qx) * mx + (y - qy) * my < largest_radius + width
        touches[:, :2] |= mx > 0.0
        touches[:, -2:] |= mx < 0.0
        touches[:2] |= my > 0.0
        touches[-2:] |= my < 0.0
        near |= np.where(touches, np.uint8(1 << min(k, LAST_BIT)), np.uint8(0))
    return near.ravel()


def put(s: Columns, i: int, row: int, column: int) -> None:
    """Put disc `i` into a cell; the ring around the grid is row 0 and column 0."""
    cells, base = s.cells, (row * s.size[STRIDE] + column) * SLOTS
    s.link[i * ROW + CELL] = (row << COLUMN_BITS) | column
    count = 0
    for k in range(SLOTS):
        count += cells[base + k] != NOBODY
    if count < SLOTS:
        cells[base + count] = i
        return
    last = int(cells[base + SLOTS - 1])
    if last > NOBODY:  # the chain begins with the disc that has the last place
        s.cells[s.size[CHAINS] + last] = NOBODY
    else:
        last = CHAINED - last
    cells[s.size[CHAINS] + i] = last
    cells[base + SLOTS - 1] = CHAINED - i


def take(s: Columns, i: int, row: int, column: int) -> None:
    """Take disc `i` out of a cell."""
    cells, base, chains = s.cells, (row * s.size[STRIDE] + column) * SLOTS, s.size[CHAINS]
    place, count = 0, 0
    for k in range(SLOTS):
        place += k * (cells[base + k] == i)
        count += cells[base + k] != NOBODY
    last = int(cells[base + SLOTS - 1])
    if last >= NOBODY:
        cells[base + place] = cells[base + count - 1]
        cells[base + count - 1] = NOBODY
        return
    head = CHAINED - last
    if cells[base + place] == i:  # the first of the chain takes its place
        cells[base + place] = head
        head = int(cells[chains + head])
    elif head == i:
        head = int(cells[chains + i])
    else:
        before = head
        while cells[chains + before] != i:
            before = int(cells[chains + before])
        cells[chains + before] = cells[chains + i]
    cells[base + SLOTS - 1] = CHAINED - head if head != NOBODY else NOBODY


def clamped(place: float, count: int) -> int:
    """Return the number, of `count` from 0 on, of the row or column that a place is in; the outermost have no end."""
    if not place > 0.0:
        return 0
    return int(place) if place < count else count - 1


def insert_all(s: Columns) -> None:
    """Sort all discs into their cells by where they stand now."""
    body, law, size = s.body, s.law, s.size
    now, width = s.clock[NOW], law[WIDTH]
    for place in range(size[CHAINS]):
        s.cells[place] = NOBODY
    for i in range(size[DISCS]):
        a = i * ROW
        wait = now - body[a + OWN_TIME]
        column = (body[a + X] + body[a + VX] * wait - law[CORNER_X]) / width
        row = (body[a + Y] + body[a + VY] * wait - law[CORNER_Y]) / width
        put(s, i, clamped(row, size[ROWS]) + 1, clamped(column, size[COLUMNS]) + 1)


def change_cell(s: Columns, i: int) -> tuple[int, int]:
    """Move disc `i` over the edge of its cell; return its first new neighbour cell, and the step to the others."""
    place, edge, stride = int(s.link[i * ROW + CELL]), int(s.link[i * ROW + EXIT]), s.size[STRIDE]
    row, column = place >> COLUMN_BITS, place & COLUMN_MASK
    across = (edge == RIGHT) - (edge == LEFT)
    along = (edge == UP) - (edge == DOWN)
    take(s, i, row, column)
    put(s, i, row + along, column + across)
    # The new neighbours lie two cells on from the old cell, in a line across the way taken.
    first = (row + 2 * along - abs(across)) * stride + column + 2 * across - abs(along)
    return first, stride if along == 0 else 1


#: What costs less than a call.
INLINE = (take, change_cell)
