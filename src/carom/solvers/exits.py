"""When a disc of the event-driven kernel leaves its cell, or meets a wall while it is in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.pair_time import ERROR, approach
from carom.physics.wall_time import wall_time
from carom.solvers.layout import (
    CELL,
    COLUMN_BITS,
    COLUMN_MASK,
    COLUMNS,
    CORNER_X,
    CORNER_Y,
    DISCS,
    DOWN,
    EXIT,
    LAST,
    LAST_BIT,
    LEAVE,
    LEFT,
    MOVES,
    NORMAL_X,
    NORMAL_Y,
    OWN_TIME,
    POINT_X,
    POINT_Y,
    RADIUS,
    ROW,
    ROWS,
    STRIDE,
    VX,
    VY,
    WALL,
    WALL_ROW,
    WALLS,
    WIDTH,
    X,
    Y,
)

if TYPE_CHECKING:
    from carom.solvers.layout import Columns

__all__ = ["INLINE", "next_exit"]

#: Two waits that differ by more than this part of the later time never round to one time.
TIME_ERROR = 2.0**-51


def next_exit(s: Columns, i: int) -> None:
    """Store when disc `i` next leaves its cell or meets a wall, and which.

    The outermost cells reach to infinity: a disc beyond the grid belongs to the nearest cell, and never leaves it
    outwards. Of walls met at the same time the last one comes first: impacts are in the order of (time, first, second),
    and the k-th wall is body ``-1 - k``.
    """
    body, link, walls, law, size = s.body, s.link, s.walls, s.law, s.size
    a = i * ROW
    place = int(link[a + CELL])
    row, column = (place >> COLUMN_BITS) - 1, (place & COLUMN_MASK) - 1
    own, x, y, vx, vy, width = body[a + OWN_TIME], body[a + X], body[a + Y], body[a + VX], body[a + VY], law[WIDTH]
    right, up = 1 if vx > 0.0 else 0, 1 if vy > 0.0 else 0
    across = ((law[CORNER_X] + (column + right) * width) - x) / vx if vx != 0.0 else math.inf
    along = ((law[CORNER_Y] + (row + up) * width) - y) / vy if vy != 0.0 else math.inf
    if column == (size[COLUMNS] - 1 if right else 0):
        across = math.inf
    if row == (size[ROWS] - 1 if up else 0):
        along = math.inf
    wait, kind = (along, DOWN + up) if along < across else (across, LEFT + right)
    near = int(s.near_wall[(row + 1) * size[STRIDE] + column + 1])
    if near != 0 and link[a + MOVES] != 0:
        radius = body[a + RADIUS]
        for k in range(size[WALLS]):
            if near >> (k if k < LAST_BIT else LAST_BIT) & 1 == 0:
                continue
            w = k * WALL_ROW
            mx, my = walls[w + NORMAL_X], walls[w + NORMAL_Y]
            toward, error = approach(vx, vy, mx, my)
            rim, rim_error = approach(x - walls[w + POINT_X], y - walls[w + POINT_Y], mx, my)
            # Not at the wall by then, nor at the same time once rounded, even if all roundings are against it: no need
            # to solve.
            if (
                link[a + LAST] == size[DISCS] + k
                or toward > error
                or rim - radius - rim_error - ERROR * radius > (error - toward) * (wait + TIME_ERROR * (own + wait))
            ):
                continue
            meet = wall_time(x, y, vx, vy, radius, walls[w + POINT_X], walls[w + POINT_Y], mx, my)
            # Times decide which of two walls comes first, as in Algorithm 2: unequal waits can round to one time.
            if meet < wait or (own + meet == own + wait and kind >= WALL):
                wait, kind = meet, WALL + k
    s.body[i * ROW + LEAVE] = own + wait
    link[a + EXIT] = kind


#: Called at one place.
INLINE = (next_exit,)
