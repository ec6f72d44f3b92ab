"""Predictions of the event-driven kernel: when a disc meets its neighbours, a wall, or the edge of its cell.

The time of a pair is predicted from the later of the two discs' own times, so it depends on the pair's paths alone: not
on when the prediction is made, nor on the cell size, nor on where a run was interrupted. A scan works with cheap bounds
on these times and solves a pair exactly only where the bounds do not tell two candidates apart; the winner is solved
exactly when it comes to be the next event of all.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.pair_time import ERROR, approach, contact_time, encounter, separation
from carom.physics.wall_time import wall_time
from carom.solvers.layout import (
    CELL,
    CELLS,
    COLUMN_BITS,
    COLUMN_MASK,
    COLUMNS,
    CORNER_X,
    CORNER_Y,
    DISCS,
    DOWN,
    EXACT,
    EXIT,
    INVERSE_MASS,
    LAST,
    LAST_BIT,
    LEAVE,
    LEFT,
    NOBODY,
    NORMAL_X,
    NORMAL_Y,
    OWN_TIME,
    PAIR,
    PARTNER,
    PARTNER_VERSION,
    POINT_X,
    POINT_Y,
    RADIUS,
    ROW,
    ROWS,
    STRIDE,
    TIMES,
    VERSION,
    VX,
    VY,
    WALL,
    WALL_ROW,
    WALLS,
    WIDTH,
    X,
    Y,
    index,
)

if TYPE_CHECKING:
    from carom.solvers.layout import Column

    Bounds = tuple[float, float]
    Candidate = tuple[float, float, int]

__all__ = ["INLINE", "next_exit", "pair_bounds", "pair_event_time", "predict", "scan", "scan_edge"]

#: Relative error that a root of the plain form may have (2^-22), and how much smaller than its terms the error of each
#: must be (2^-24, three terms) for that to be certain.
_ROOT_ERROR = 2.0**-22
_TERM_ERROR = 2.0**24


def pair_bounds(
    body: Column, j: int, own: float, x: float, y: float, vx: float, vy: float, radius: float, limit: float
) -> Bounds:
    """Return bounds on the time at which a disc meets disc `j`; infinity for never and for certainly after `limit`.

    The disc was at `x`, `y` at its `own` time, and moves with `vx`, `vy`.
    """
    o = j * ROW
    start = own if own > body[o + OWN_TIME] else body[o + OWN_TIME]
    wait, other_wait = start - own, start - body[o + OWN_TIME]
    dx = (body[o + X] + body[o + VX] * other_wait) - (x + vx * wait)
    dy = (body[o + Y] + body[o + VY] * other_wait) - (y + vy * wait)
    ux, uy = body[o + VX] - vx, body[o + VY] - vy
    b, b_error = approach(dx, dy, ux, uy)
    if b > b_error:
        return math.inf, math.inf
    reach = radius + body[o + RADIUS]
    c, c_error = separation(dx, dy, reach)
    # c + 2 b h > 0: not closed by then even at the present rate. 2^-50 limit and 2^-20 h cover all roundings.
    if c - c_error > -2.0 * (b - b_error) * ((limit - start) * (1.0 + 2.0**-20) + 2.0**-50 * limit):
        return math.inf, math.inf
    d, d_error = encounter(dx, dy, ux, uy, reach)
    if d < -d_error or (ux == 0.0 and uy == 0.0):
        return math.inf, math.inf
    if c > _TERM_ERROR * c_error and d > _TERM_ERROR * d_error and -b > _TERM_ERROR * b_error:
        wait = c / (math.sqrt(d) - b)
        return start + wait * (1.0 - _ROOT_ERROR), start + wait * (1.0 + _ROOT_ERROR)
    return -math.inf, limit


def pair_event_time(body: Column, i: int, j: int) -> float:
    """Return the time at which discs `i` and `j` meet on their present paths, infinity for never."""
    a, o = (i * ROW, j * ROW) if i < j else (j * ROW, i * ROW)
    start = body[a + OWN_TIME] if body[a + OWN_TIME] > body[o + OWN_TIME] else body[o + OWN_TIME]
    wait, other_wait = start - body[a + OWN_TIME], start - body[o + OWN_TIME]
    ax, ay = body[a + X] + body[a + VX] * wait, body[a + Y] + body[a + VY] * wait
    ox, oy = body[o + X] + body[o + VX] * other_wait, body[o + Y] + body[o + VY] * other_wait
    avx, avy, ovx, ovy = body[a + VX], body[a + VY], body[o + VX], body[o + VY]
    if body[a + INVERSE_MASS] == 0.0 and body[o + INVERSE_MASS] == 0.0:
        return math.inf
    b, b_error = approach(ox - ax, oy - ay, ovx - avx, ovy - avy)
    if b > b_error:
        return math.inf
    d, d_error = encounter(ox - ax, oy - ay, ovx - avx, ovy - avy, body[a + RADIUS] + body[o + RADIUS])
    if d < -d_error:
        return math.inf
    wait = contact_time(b, d, ax, ay, avx, avy, body[a + RADIUS], ox, oy, ovx, ovy, body[o + RADIUS])
    return float(start + wait)


def has_just_met(body: Column, link: Column, size: Column, i: int) -> int:
    """Return the disc that movable disc `i` has met last if both are still on the paths that this gave them.

    Such a pair never meets again on these paths: what rounding leaves of their approach (all that there is, where
    the restitution is 0) must not become an impact, and another, without end. An immovable disc is always on its path.
    """
    last = index(link[i * ROW + LAST])
    if last == NOBODY or last >= size[DISCS]:
        return NOBODY
    return last if body[last * ROW + INVERSE_MASS] == 0.0 or link[last * ROW + LAST] == i else NOBODY


def scan(
    body: Column,
    link: Column,
    heads: Column,
    size: Column,
    i: int,
    first: int,
    lines: int,
    stride: int,
    step: int,
    low: float,
    high: float,
    partner: int,
) -> Candidate:
    """Return the earlier of a candidate (bounds on its time, and its partner) and the first of disc `i` in a block.

    Simultaneous candidates are decided for the partner of the lower number.

    Args:
        body: Paths.
        link: Cells and predictions.
        heads: First disc of each cell, and the next one after each disc.
        size: How much there is of everything.
        i: The disc, a movable one.
        first: First cell of the block.
        lines: Number of lines of three cells.
        stride: From a line to the next.
        step: From a cell of a line to the next.
        low: Bound on the candidate's time, infinity for none; so is `high`.
        high: See `low`.
        partner: The candidate's partner.
    """
    a = i * ROW
    own, x, y, vx, vy = body[a + OWN_TIME], body[a + X], body[a + Y], body[a + VX], body[a + VY]
    radius, met, cells = body[a + RADIUS], has_just_met(body, link, size, i), size[CELLS]
    for line in range(lines):
        for k in range(3):
            j = int(heads[first + line * stride + k * step])
            while j != NOBODY:
                if j != i and j != met:
                    other_low, other_high = pair_bounds(body, j, own, x, y, vx, vy, radius, high)
                    if other_high < low:
                        low, high, partner = other_low, other_high, j
                    elif other_low <= high and other_low < math.inf:
                        if low < high:
                            low = high = pair_event_time(body, i, partner)
                        other_low = pair_event_time(body, i, j)
                        if other_low < low or (other_low == low and j < partner):
                            low, high, partner = other_low, other_low, j
                j = int(heads[cells + j])
    return low, high, partner


def predict(body: Column, link: Column, heads: Column, times: Column, size: Column, i: int) -> None:
    """Predict the next impact of disc `i` with any other, and store it."""
    place, stride = int(link[i * ROW + CELL]), int(size[STRIDE])
    corner = ((place >> COLUMN_BITS) - 1) * stride + (place & COLUMN_MASK) - 1
    low, high, partner = scan(body, link, heads, size, i, corner, 3, stride, 1, math.inf, math.inf, NOBODY)
    store(link, times, i, low, high, partner)


def scan_edge(
    body: Column, link: Column, heads: Column, times: Column, size: Column, i: int, first: int, step: int
) -> None:
    """Take into account the three cells that have become neighbours of disc `i`: `first`, and two more `step` apart."""
    low = high = times[i * TIMES + PAIR]
    partner = index(link[i * ROW + PARTNER])
    if link[i * ROW + EXACT] == 0:
        # A lower bound is stored, which is `_ROOT_ERROR` of the wait too low at most, or tells nothing.
        high = low * (1.0 + 4.0 * _ROOT_ERROR) if low >= 0.0 else math.inf
    low, high, found = scan(body, link, heads, size, i, first, 1, 0, step, low, high, partner)
    if found != partner:
        store(link, times, i, low, high, found)


def store(link: Column, times: Column, i: int, low: float, high: float, partner: int) -> None:
    """Store the next impact of disc `i` under the lower bound of its time, which is exact where both are the same."""
    times[i * TIMES + PAIR] = low
    link[i * ROW + PARTNER] = partner
    link[i * ROW + EXACT] = 1 if low == high else 0
    if partner != NOBODY:
        link[i * ROW + PARTNER_VERSION] = link[partner * ROW + VERSION]


def next_exit(
    body: Column, link: Column, walls: Column, near_wall: Column, times: Column, law: Column, size: Column, i: int
) -> None:
    """Store when disc `i` next leaves its cell or meets a wall, and which.

    The outermost cells reach to infinity: a disc beyond the grid belongs to the nearest cell, and never leaves it
    outwards. Of walls met at the same time the last one comes first: impacts are in the order of (time, first, second),
    and the k-th wall is body ``-1 - k``.
    """
    a = i * ROW
    place = int(link[a + CELL])
    row, column = (place >> COLUMN_BITS) - 1, (place & COLUMN_MASK) - 1
    x, y, vx, vy, width = body[a + X], body[a + Y], body[a + VX], body[a + VY], law[WIDTH]
    right, up = 1 if vx > 0.0 else 0, 1 if vy > 0.0 else 0
    across = ((law[CORNER_X] + (column + right) * width) - x) / vx if vx != 0.0 else math.inf
    along = ((law[CORNER_Y] + (row + up) * width) - y) / vy if vy != 0.0 else math.inf
    if column == (size[COLUMNS] - 1 if right else 0):
        across = math.inf
    if row == (size[ROWS] - 1 if up else 0):
        along = math.inf
    wait, kind = (along, DOWN + up) if along < across else (across, LEFT + right)
    near = int(near_wall[(row + 1) * size[STRIDE] + column + 1])
    if near != 0 and body[a + INVERSE_MASS] > 0.0:
        radius = body[a + RADIUS]
        for k in range(size[WALLS]):
            if near >> (k if k < LAST_BIT else LAST_BIT) & 1 == 0:
                continue
            w = k * WALL_ROW
            mx, my = walls[w + NORMAL_X], walls[w + NORMAL_Y]
            toward, error = approach(vx, vy, mx, my)
            rim, rim_error = approach(x - walls[w + POINT_X], y - walls[w + POINT_Y], mx, my)
            # Not at the wall by then even if all roundings are against it: no need to solve.
            if (
                link[a + LAST] == size[DISCS] + k
                or toward > error
                or rim - radius - rim_error - ERROR * radius > (error - toward) * wait
            ):
                continue
            meet = wall_time(x, y, vx, vy, radius, walls[w + POINT_X], walls[w + POINT_Y], mx, my)
            if meet < wait or (meet == wait and kind >= WALL):
                wait, kind = meet, WALL + k
    times[i * TIMES + LEAVE] = body[a + OWN_TIME] + wait
    link[a + EXIT] = kind


#: What costs less than a call.
INLINE = (pair_bounds, has_just_met, store)
