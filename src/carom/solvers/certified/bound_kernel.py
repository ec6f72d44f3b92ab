"""Lower bounds of times of impact one by one: plain Python on lists for few discs, compiled for many.

See `carom.solvers.certified.lower_bounds` for what is bounded and why it holds. Step by step this does what the NumPy
form there does, with the same roundings. The containers, with n discs and w walls:

- state: `DISC_COLUMNS` columns of n floats: reference, x, y, vx, vy, errors of position and velocity, radius, the
  radius rounded up, and 1 where immovable;
- walls: 7 columns of w floats: point, normal, its length rounded up, greatest coordinate of the point, and
  sum of the normal's components;
- skip: for each disc, the column that it cannot meet on its present path, or -1;
- table: n rows of n + w bounds; least and column: the least of each row, and where it stands;
- found: the row with the least bound of all, and how many bounds a raised one had to be told from.
"""

from __future__ import annotations

import math
from typing import Any

__all__ = ["DISC_COLUMNS", "FLOOR", "TINY", "UNIT", "begin", "raise_bound", "renew"]

Column = Any  # a list, an array, or what a compiled unit has for one

DISC_COLUMNS = 10
#: Half a unit in the last place of 1.
UNIT = 2.0**-53
#: Far above what underflow takes from a product, some 2^-1075; far below any time that matters.
FLOOR = 2.0**-1060
#: Least float64 error that is ever granted: far below it, products underflow.
TINY = 2.0**-500


def pair_bound(state: Column, i: int, j: int, n: int) -> float:
    """Return a lower bound of the time at which discs `i` and `j` meet."""
    time_i, time_j = state[i], state[j]
    start = max(time_i, time_j)
    wait_i, wait_j = start - time_i, start - time_j
    vx_i, vy_i, vx_j, vy_j = state[3 * n + i], state[4 * n + i], state[3 * n + j], state[4 * n + j]
    dx = (state[n + j] + vx_j * wait_j) - (state[n + i] + vx_i * wait_i)
    dy = (state[2 * n + j] + vy_j * wait_j) - (state[2 * n + i] + vy_i * wait_i)
    ux, uy = vx_j - vx_i, vy_j - vy_i
    error_i, error_j = state[6 * n + i], state[6 * n + j]
    e = (state[5 * n + j] + error_j * wait_j) + (state[5 * n + i] + error_i * wait_i)
    f = error_j + error_i
    d1, u1 = abs(dx) + abs(dy), abs(ux) + abs(uy)
    b = e * u1 + f * (d1 + 2.0 * e) - (dx * ux + dy * uy)
    if b <= 0.0:
        return math.inf if b > -math.inf else float(start)
    reach = state[7 * n + j] + state[7 * n + i]
    c = dx * dx + dy * dy - reach * reach - 2.0 * e * (d1 + e)
    a = ux * ux + uy * uy - 2.0 * f * (u1 + f)
    if a <= 0.0:
        a = 0.0
    ac, bb = a * c, b * b
    size = bb + abs(ac)
    if not size < math.inf:  # overflow, or no number
        return float(start)
    root = bb - ac + (8.0 * UNIT * size + FLOOR)
    if root < 0.0:
        return math.inf
    if c <= 0.0:  # at the start already
        c = 0.0
    wait = c / (b + math.sqrt(root)) * (1.0 - 16.0 * UNIT) - FLOOR
    if wait <= 0.0:
        wait = 0.0
    return float((start + wait) * (1.0 - 4.0 * UNIT))


def wall_bound(state: Column, walls: Column, i: int, k: int, n: int, w: int) -> float:
    """Return a lower bound of the time at which disc `i` meets wall `k`."""
    nx, ny, span = walls[2 * w + k], walls[3 * w + k], walls[6 * w + k]
    toward = state[6 * n + i] * span - (state[3 * n + i] * nx + state[4 * n + i] * ny)
    if toward <= 0.0:
        return math.inf if toward > -math.inf else float(state[i])
    along = (state[n + i] - walls[k]) * nx + (state[2 * n + i] - walls[w + k]) * ny
    error = state[5 * n + i] + 16.0 * UNIT * walls[5 * w + k]
    gap = along - state[8 * n + i] * walls[4 * w + k] - error * span
    if not (gap < math.inf and toward < math.inf):  # overflow, or no number
        return float(state[i])
    if gap <= 0.0:
        gap = 0.0
    wait = gap / toward * (1.0 - 16.0 * UNIT) - FLOOR
    if wait <= 0.0:
        wait = 0.0
    return float((state[i] + wait) * (1.0 - 4.0 * UNIT))


def find_least(table: Column, least: Column, column: Column, i: int, width: int) -> None:
    """Find the least bound of a row."""
    best, where = math.inf, 0
    for k in range(width):
        bound = table[i * width + k]
        if bound < best:
            best, where = bound, k
    least[i], column[i] = best, where


def fill_row(
    state: Column, walls: Column, skip: Column, table: Column, least: Column, column: Column, i: int, n: int, w: int
) -> None:
    """Bound the future of disc `i` with each disc and each wall."""
    row = i * (n + w)
    fixed = state[9 * n + i]
    for j in range(n):
        never = j == i or j == skip[i] or (fixed != 0.0 and state[9 * n + j] != 0.0)
        table[row + j] = math.inf if never else pair_bound(state, i, j, n)
    for k in range(w):
        never = fixed != 0.0 or n + k == skip[i]
        table[row + n + k] = math.inf if never else wall_bound(state, walls, i, k, n, w)
    find_least(table, least, column, i, n + w)


def begin(
    state: Column,
    walls: Column,
    skip: Column,
    table: Column,
    least: Column,
    column: Column,
    found: Column,
    n: int,
    w: int,
) -> int:
    """Bound the future of all discs."""
    for i in range(n):
        fill_row(state, walls, skip, table, least, column, i, n, w)
        for j in range(i):
            table[i * (n + w) + j] = math.inf  # it stands in the other's row
        find_least(table, least, column, i, n + w)
    return find_row(least, found, n)


def renew(
    state: Column,
    walls: Column,
    skip: Column,
    table: Column,
    least: Column,
    column: Column,
    found: Column,
    first: int,
    second: int,
    n: int,
    w: int,
) -> int:
    """Bound the future anew of one disc, or of two, after their state has changed; `second` is `first` for one."""
    width = n + w
    for i in range(n):
        table[i * width + first] = table[i * width + second] = math.inf
    fill_row(state, walls, skip, table, least, column, first, n, w)
    if second != first:
        fill_row(state, walls, skip, table, least, column, second, n, w)
        table[second * width + first] = math.inf  # it stands in the other's row, where they have not just met
    for i in range(n):
        if column[i] == first or column[i] == second:
            find_least(table, least, column, i, width)
    return find_row(least, found, n)


def find_row(least: Column, found: Column, n: int) -> int:
    """Find the row of the least bound of all."""
    best = 0
    for i in range(1, n):
        if least[i] < least[best]:
            best = i
    found[0] = best
    return best


def raise_bound(
    table: Column,
    least: Column,
    column: Column,
    found: Column,
    i: int,
    at: int,
    bound: float,
    until: float,
    n: int,
    width: int,
) -> int:
    """Replace the bound in row `i` and column `at`, and count the bounds up to a time: at most the first two."""
    table[i * width + at] = bound
    find_least(table, least, column, i, width)
    count = 0
    for r in range(n):
        if least[r] <= until:
            for k in range(width):
                if table[r * width + k] <= until:
                    count += 1
            if count >= 2:
                break
    found[1] = min(count, 2)
    return find_row(least, found, n)
