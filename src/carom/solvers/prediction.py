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
    COLUMN_BITS,
    COLUMN_MASK,
    DOWN,
    EXACT,
    EXIT,
    INVERSE_MASS,
    LAST,
    LEAVE,
    LEFT,
    NEXT,
    NOBODY,
    OWN_TIME,
    PAIR,
    PARTNER,
    PARTNER_VERSION,
    RADIUS,
    RIGHT,
    ROW,
    TIMES,
    UP,
    VERSION,
    VX,
    VY,
    WALL,
    X,
    Y,
)

if TYPE_CHECKING:
    from carom.physics.pair_time import ErrorFree
    from carom.solvers.layout import Column

    Grid = tuple[float, float, float, int, int]
    Bounds = tuple[float, float]
    Candidate = tuple[float, float, int]

__all__ = ["INLINE", "KERNEL", "next_exit", "pair_bounds", "pair_event_time", "predict", "scan_cell", "scan_edge"]

#: Relative error that a root of the plain form may have (2^-22), and how much smaller than its terms the error of each
#: must be (2^-24, three terms) for that to be certain.
_ROOT_ERROR = 2.0**-22
_TERM_ERROR = 2.0**24


def pair_bounds(body: Column, i: int, j: int, limit: float) -> Bounds:
    """Return bounds on the time at which discs `i` and `j` meet; infinity for never and for certainly after `limit`."""
    a, o = i * ROW, j * ROW
    start = body[a + OWN_TIME] if body[a + OWN_TIME] > body[o + OWN_TIME] else body[o + OWN_TIME]
    wait, other_wait = start - body[a + OWN_TIME], start - body[o + OWN_TIME]
    dx = (body[o + X] + body[o + VX] * other_wait) - (body[a + X] + body[a + VX] * wait)
    dy = (body[o + Y] + body[o + VY] * other_wait) - (body[a + Y] + body[a + VY] * wait)
    ux, uy = body[o + VX] - body[a + VX], body[o + VY] - body[a + VY]
    b, b_error = approach(dx, dy, ux, uy)
    if b > b_error or (ux == 0.0 and uy == 0.0):
        return math.inf, math.inf
    reach = body[a + RADIUS] + body[o + RADIUS]
    c, c_error = separation(dx, dy, reach)
    # c + 2 b h > 0: not closed by then even at the present rate. 2^-50 limit and 2^-20 h cover all roundings.
    if c - c_error > -2.0 * (b - b_error) * ((limit - start) * (1.0 + 2.0**-20) + 2.0**-50 * limit):
        return math.inf, math.inf
    d, d_error = encounter(dx, dy, ux, uy, reach)
    if d < -d_error:
        return math.inf, math.inf
    if c > _TERM_ERROR * c_error and d > _TERM_ERROR * d_error and -b > _TERM_ERROR * b_error:
        wait = c / (math.sqrt(d) - b)
        return start + wait * (1.0 - _ROOT_ERROR), start + wait * (1.0 + _ROOT_ERROR)
    return -math.inf, limit


def pair_event_time(body: Column, i: int, j: int, error_free: ErrorFree) -> float:
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
    wait = contact_time(b, d, ax, ay, avx, avy, body[a + RADIUS], ox, oy, ovx, ovy, body[o + RADIUS], error_free)
    return float(start + wait)


def has_just_met(body: Column, link: Column, i: int, j: int) -> bool:
    """Whether discs `i` and `j` are on the paths that their impact with each other gave them.

    Such a pair never meets again on these paths: what rounding leaves of their approach (all that there is, where
    the restitution is 0) must not become an impact, and another, without end. An immovable disc is always on its path.
    """
    if body[i * ROW + INVERSE_MASS] > 0.0 and link[i * ROW + LAST] != j:
        return False
    return bool(body[j * ROW + INVERSE_MASS] == 0.0 or link[j * ROW + LAST] == i)


def scan_cell(
    body: Column,
    link: Column,
    heads: Column,
    cell: int,
    i: int,
    low: float,
    high: float,
    partner: int,
    error_free: ErrorFree,
) -> Candidate:
    """Return the earlier of a candidate (bounds on its time, and its partner) and the first of disc `i` in `cell`.

    Simultaneous candidates are decided for the partner of the lower number.
    """
    j = int(heads[cell])
    while j != NOBODY:
        if j != i and not has_just_met(body, link, i, j):
            other_low, other_high = pair_bounds(body, i, j, high)
            if other_high < low:
                low, high, partner = other_low, other_high, j
            elif other_low <= high and other_low < math.inf:
                if low < high:
                    low = high = pair_event_time(body, i, partner, error_free)
                other_low = pair_event_time(body, i, j, error_free)
                if other_low < low or (other_low == low and j < partner):
                    low, high, partner = other_low, other_low, j
        j = int(body[j * ROW + NEXT])
    return low, high, partner


def predict(
    body: Column, link: Column, heads: Column, times: Column, i: int, stride: int, error_free: ErrorFree
) -> None:
    """Predict the next impact of disc `i` with any other, and store it."""
    place = int(link[i * ROW + CELL])
    corner = ((place >> COLUMN_BITS) - 1) * stride + (place & COLUMN_MASK) - 1
    low = high = math.inf
    partner = NOBODY
    for row in range(3):
        for cell in range(corner + row * stride, corner + row * stride + 3):
            if heads[cell] != NOBODY:
                low, high, partner = scan_cell(body, link, heads, cell, i, low, high, partner, error_free)
    store(link, times, i, low, high, partner)


def scan_edge(
    body: Column, link: Column, heads: Column, times: Column, i: int, first: int, step: int, error_free: ErrorFree
) -> None:
    """Take into account the three cells that have become neighbours of disc `i`: `first`, and two more `step` apart."""
    low = high = times[i * TIMES + PAIR]
    partner = int(link[i * ROW + PARTNER])
    if partner != NOBODY and link[i * ROW + EXACT] == 0:
        low, high = pair_bounds(body, i, partner, math.inf)
    found = partner
    for k in range(3):
        cell = first + k * step
        if heads[cell] != NOBODY:
            low, high, found = scan_cell(body, link, heads, cell, i, low, high, found, error_free)
    if found != partner:
        store(link, times, i, low, high, found)


def store(link: Column, times: Column, i: int, low: float, high: float, partner: int) -> None:
    """Store the next impact of disc `i` under the lower bound of its time, which is exact where both are the same."""
    times[i * TIMES + PAIR] = low
    link[i * ROW + PARTNER] = partner
    link[i * ROW + EXACT] = 1 if low == high else 0
    if partner != NOBODY:
        link[i * ROW + PARTNER_VERSION] = link[partner * ROW + VERSION]


def next_exit(body: Column, link: Column, walls: Column, near_wall: Column, times: Column, i: int, grid: Grid) -> None:
    """Store when disc `i` next leaves its cell or meets a wall, and which.

    The outermost cells reach to infinity: a disc beyond the grid belongs to the nearest cell, and never leaves it
    outwards. Of walls met at the same time the last one comes first: impacts are in the order of (time, first, second),
    and the k-th wall is body ``-1 - k``.
    """
    x0, y0, width, nx, ny = grid
    a = i * ROW
    place = int(link[a + CELL])
    row, column = (place >> COLUMN_BITS) - 1, (place & COLUMN_MASK) - 1
    vx, vy = body[a + VX], body[a + VY]
    wait, kind = math.inf, LEFT
    if vx > 0.0 and column < nx - 1:
        wait, kind = ((x0 + (column + 1) * width) - body[a + X]) / vx, RIGHT
    elif vx < 0.0 and column > 0:
        wait, kind = ((x0 + column * width) - body[a + X]) / vx, LEFT
    if vy > 0.0 and row < ny - 1:
        up = ((y0 + (row + 1) * width) - body[a + Y]) / vy
        if up < wait:
            wait, kind = up, UP
    elif vy < 0.0 and row > 0:
        down = ((y0 + row * width) - body[a + Y]) / vy
        if down < wait:
            wait, kind = down, DOWN
    if near_wall[(row + 1) * (nx + 2) + column + 1] and body[a + INVERSE_MASS] > 0.0:
        discs = len(times) // TIMES
        for k in range(len(walls) // 4):
            qx, qy, mx, my = walls[4 * k], walls[4 * k + 1], walls[4 * k + 2], walls[4 * k + 3]
            toward, error = approach(vx, vy, mx, my)
            dx, dy, radius = body[a + X] - qx, body[a + Y] - qy, body[a + RADIUS]
            rim, rim_error = approach(dx, dy, mx, my)
            # Not at the wall by then even if all roundings are against it: no need to solve.
            if (
                link[a + LAST] == discs + k
                or toward > error
                or rim - radius - rim_error - ERROR * radius > (error - toward) * wait
            ):
                continue
            meet = wall_time(body[a + X], body[a + Y], vx, vy, radius, qx, qy, mx, my)
            if meet < wait or (meet == wait and kind >= WALL):
                wait, kind = meet, WALL + k
    times[i * TIMES + LEAVE] = body[a + OWN_TIME] + wait
    link[a + EXIT] = kind


#: What a compiler must compile, callees first.
KERNEL = (pair_event_time, pair_bounds, has_just_met, scan_cell, store, predict, scan_edge, next_exit)
#: Those of them that are cheaper than a call.
INLINE = (pair_bounds, has_just_met, store)
