"""The cells of the event-driven kernel: which discs are near each other, kept as linked lists.

A cell is wider than the largest sum of two radii, so two discs whose cells are not neighbours are apart. The outermost
cells reach to infinity, so a disc is always in some cell, wherever it goes; around them lies a ring of cells that stay
empty, which spares the scans all edge cases. Cells speed a run up and never change its result: a pair is first looked
at when its cells become neighbours, which is before it can touch by the margin between cell width and contact distance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.solvers.layout import (
    CELL,
    COLUMN_BITS,
    COLUMN_MASK,
    DOWN,
    EXIT,
    LEFT,
    MOST_COLUMNS,
    NEXT,
    NOBODY,
    OWN_TIME,
    PREVIOUS,
    RIGHT,
    ROW,
    UP,
    VX,
    VY,
    X,
    Y,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from carom.solvers.layout import Column
    from carom.solvers.prediction import Grid

__all__ = ["INLINE", "KERNEL", "change_cell", "choose_grid", "insert_all", "near_walls"]

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


def near_walls(grid: Grid, walls: Sequence[tuple[float, float, float, float]], largest_radius: float) -> list[int]:
    """Return for each cell, row by row with the ring around, whether a disc in it may meet a wall: 1 or 0.

    A disc meets a wall only where its centre is within a radius of it. Cells at the rim, which have no end, are always
    near a wall.
    """
    x0, y0, width, nx, ny = grid
    near = []
    for row in range(-1, ny + 1):
        for column in range(-1, nx + 1):
            if not (0 < column < nx - 1 and 0 < row < ny - 1):
                near.append(1 if walls else 0)
                continue
            x, y = x0 + (column + 0.5) * width, y0 + (row + 0.5) * width
            # Half a diagonal is .71 of a width: a whole width leaves .29 of it for roundings.
            near.append(int(any((x - qx) * mx + (y - qy) * my < largest_radius + width for qx, qy, mx, my in walls)))
    return near


def insert(body: Column, link: Column, heads: Column, i: int, row: int, column: int, stride: int) -> None:
    """Put disc `i` at the head of the list of a cell; the ring around the grid is row 0 and column 0."""
    cell = row * stride + column
    head = int(heads[cell])
    body[i * ROW + NEXT] = head
    link[i * ROW + PREVIOUS] = NOBODY
    link[i * ROW + CELL] = (row << COLUMN_BITS) | column
    if head != NOBODY:
        link[head * ROW + PREVIOUS] = i
    heads[cell] = i


def insert_all(body: Column, link: Column, heads: Column, grid: Grid, discs: int, now: float) -> None:
    """Sort all discs into their cells by where they stand at the time `now`."""
    x0, y0, width, nx, ny = grid
    for cell in range(len(heads)):
        heads[cell] = NOBODY
    for i in range(discs):
        a = i * ROW
        wait = now - body[a + OWN_TIME]
        column = int(min(max((body[a + X] + body[a + VX] * wait - x0) / width, 0.0), nx - 1.0))
        row = int(min(max((body[a + Y] + body[a + VY] * wait - y0) / width, 0.0), ny - 1.0))
        insert(body, link, heads, i, row + 1, column + 1, nx + 2)


def change_cell(body: Column, link: Column, heads: Column, i: int, stride: int) -> tuple[int, int]:
    """Move disc `i` over the edge of its cell; return its first new neighbour cell, and the step to the others."""
    a = i * ROW
    row, column = int(link[a + CELL]) >> COLUMN_BITS, int(link[a + CELL]) & COLUMN_MASK
    before, after = int(link[a + PREVIOUS]), int(body[a + NEXT])
    if before != NOBODY:
        body[before * ROW + NEXT] = after
    else:
        heads[row * stride + column] = after
    if after != NOBODY:
        link[after * ROW + PREVIOUS] = before
    edge = int(link[a + EXIT])
    across = 1 if edge == RIGHT else -1 if edge == LEFT else 0
    along = 1 if edge == UP else -1 if edge == DOWN else 0
    insert(body, link, heads, i, row + along, column + across, stride)
    # The new neighbours lie two cells on from the old cell, in a line across the way taken.
    first = (row + 2 * along - abs(across)) * stride + column + 2 * across - abs(along)
    return first, stride if along == 0 else 1


#: What a compiler must compile.
KERNEL = (insert, insert_all, change_cell)
#: Those of them that are cheaper than a call.
INLINE = (insert,)
