"""Predictions of the event-driven kernel: when a disc next meets another.

The time of a pair is predicted from the later of the two discs' own times, so it depends on the pair's paths alone: not
on when the prediction is made, nor on the cell size, nor on where a run was interrupted. A scan works with cheap bounds
on these times and solves a pair exactly only where the bounds do not tell two candidates apart; the winner is solved
exactly when it comes to be the next event of all.

A scan has three rounds, each over all that is left, with as few branches as can be: a processor can't foresee which
discs are near and which approach, and a wrong guess costs it as much as the arithmetic of a whole pair.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.pair_time import approach, contact_time, encounter, separation
from carom.solvers.layout import (
    BATCH,
    CHAINED,
    CHAINS,
    DISCS,
    DX,
    DY,
    EXACT,
    HIGH,
    LAST,
    LOW,
    MOVES,
    NOBODY,
    OWN_TIME,
    PAIR,
    PARTNER,
    PARTNER_VERSION,
    RADIUS,
    REACH,
    ROW,
    SLOTS,
    START,
    UX,
    UY,
    VERSION,
    VX,
    VY,
    X,
    Y,
    index,
)

if TYPE_CHECKING:
    from carom.solvers.layout import Column, Columns

    Bounds = tuple[float, float]
    Candidate = tuple[float, float, int]

__all__ = ["INLINE", "expected", "find_earliest", "pair_event_time", "store"]

#: Relative error that a root of the plain form may have (2^-22), and how much smaller than its terms the error of each
#: must be (2^-24, three terms) for that to be certain.
_ROOT_ERROR = 2.0**-22
_TERM_ERROR = 2.0**24


def pair_event_time(body: Column, i: int, j: int) -> float:
    """Return the time at which discs `i` and `j` meet on their present paths, infinity for never."""
    a, o = (i * ROW, j * ROW) if i < j else (j * ROW, i * ROW)
    start = body[a + OWN_TIME] if body[a + OWN_TIME] > body[o + OWN_TIME] else body[o + OWN_TIME]
    wait, other_wait = start - body[a + OWN_TIME], start - body[o + OWN_TIME]
    ax, ay = body[a + X] + body[a + VX] * wait, body[a + Y] + body[a + VY] * wait
    ox, oy = body[o + X] + body[o + VX] * other_wait, body[o + Y] + body[o + VY] * other_wait
    avx, avy, ovx, ovy = body[a + VX], body[a + VY], body[o + VX], body[o + VY]
    b, b_error = approach(ox - ax, oy - ay, ovx - avx, ovy - avy)
    if b > b_error:
        return math.inf
    d, d_error = encounter(ox - ax, oy - ay, ovx - avx, ovy - avy, body[a + RADIUS] + body[o + RADIUS])
    if d < -d_error:
        return math.inf
    wait = contact_time(b, d, ax, ay, avx, avy, body[a + RADIUS], ox, oy, ovx, ovy, body[o + RADIUS])
    return float(start + wait)


def has_just_met(s: Columns, i: int) -> int:
    """Return the disc that movable disc `i` has met last if both are still on the paths that this gave them.

    Such a pair never meets again on these paths: what rounding leaves of their approach (all that there is, where
    the restitution is 0) must not become an impact, and another, without end. An immovable disc is always on its path.
    """
    last = index(s.link[i * ROW + LAST])
    if last == NOBODY or last >= s.size[DISCS]:
        return NOBODY
    return last if s.link[last * ROW + MOVES] == 0 or s.link[last * ROW + LAST] == i else NOBODY


def keep_approaching(s: Columns, i: int, met: int, count: int) -> int:
    """Keep of the discs found those that approach disc `i`, and note how each moves relative to it; return how many."""
    body, nearby, field = s.body, s.nearby, s.field
    a = i * ROW
    own, x, y, vx, vy, radius = (
        body[a + OWN_TIME],
        body[a + X],
        body[a + Y],
        body[a + VX],
        body[a + VY],
        body[a + RADIUS],
    )
    kept = 0
    for k in range(count):
        j = index(nearby[k])
        o = j * ROW
        other = body[o + OWN_TIME]
        start = own if own > other else other
        wait, other_wait = start - own, start - other
        dx = (body[o + X] + body[o + VX] * other_wait) - (x + vx * wait)
        dy = (body[o + Y] + body[o + VY] * other_wait) - (y + vy * wait)
        ux, uy = body[o + VX] - vx, body[o + VY] - vy
        field[DX + kept], field[DY + kept], field[UX + kept], field[UY + kept] = dx, dy, ux, uy
        field[REACH + kept], field[START + kept] = radius + body[o + RADIUS], start
        nearby[kept] = j
        b, b_error = approach(dx, dy, ux, uy)
        kept += (b <= b_error) & (j != i) & (j != met)
    return kept


def bound_times(field: Column, count: int) -> None:
    """Give each of the discs kept bounds on the time at which it is met; infinity for never."""
    for k in range(count):
        dx, dy, ux, uy, reach = field[DX + k], field[DY + k], field[UX + k], field[UY + k], field[REACH + k]
        b, b_error = approach(dx, dy, ux, uy)
        c, c_error = separation(dx, dy, reach)
        d, d_error = encounter(dx, dy, ux, uy, reach)
        never = (d < -d_error) | ((ux == 0.0) & (uy == 0.0))
        known = (c > _TERM_ERROR * c_error) & (d > _TERM_ERROR * d_error) & (-b > _TERM_ERROR * b_error)
        closing = math.sqrt(d if d > 0.0 else 0.0) - b
        wait = c / (closing if closing > 0.0 else 1.0)
        low = field[START + k] + wait * (1.0 - _ROOT_ERROR)
        high = field[START + k] + wait * (1.0 + _ROOT_ERROR)
        low, high = low if known else -math.inf, high if known else math.inf
        field[LOW + k] = math.inf if never else low
        field[HIGH + k] = math.inf if never else high


def earliest_of(s: Columns, i: int, count: int, low: float, high: float, partner: int) -> Candidate:
    """Return the earliest of a candidate and of the discs that have bounds."""
    field = s.field
    least, second, at = low, math.inf, -1
    for k in range(count):
        time = field[LOW + k]
        first = time < least
        at = k if first else at
        passed_over = least if first else time
        second = passed_over if passed_over < second else second
        least = time if first else least
    least_high = high if at < 0 else field[HIGH + (at if at > 0 else 0)]
    if second > least_high or least == math.inf:
        return least, least_high, partner if at < 0 else index(s.nearby[at if at > 0 else 0])
    return solve_earliest(s, i, count, low, high, partner)


def solve_earliest(s: Columns, i: int, count: int, low: float, high: float, partner: int) -> Candidate:
    """Return the earliest of a candidate and of the discs that have bounds, which do not tell them apart."""
    field = s.field
    latest = high
    for k in range(count):
        latest = field[HIGH + k] if field[HIGH + k] < latest else latest
    if low < high:
        low = high = pair_event_time(s.body, i, partner) if low <= latest else math.inf
    for k in range(count):
        if field[LOW + k] <= latest:
            j = index(s.nearby[k])
            time = pair_event_time(s.body, i, j)
            if time < low or (time == low and j < partner):
                low, high, partner = time, time, j
    return low, high, partner


def find_earliest(
    s: Columns, i: int, first: int, lines: int, to_line: int, to_cell: int, low: float, high: float, partner: int
) -> Candidate:
    """Return the earlier of a candidate (bounds on its time, and its partner) and the first of disc `i` in a block.

    Simultaneous candidates are decided for the partner of the lower number.

    Args:
        s: All columns.
        i: The disc, a movable one.
        first: First cell of the block.
        lines: Number of lines of three cells.
        to_line: From a line to the next.
        to_cell: From a cell of a line to the next.
        low: Bound on the candidate's time, infinity for none; so is `high`.
        high: See `low`.
        partner: The candidate's partner.
    """
    cells, nearby = s.cells, s.nearby
    met = has_just_met(s, i)
    count, chains = 0, 0
    for line in range(lines):
        for k in range(3):
            base = (first + line * to_line + k * to_cell) * SLOTS
            for slot in range(SLOTS):
                j = cells[base + slot]
                nearby[count] = j
                count += j > NOBODY
            chains += cells[base + SLOTS - 1] < NOBODY
    chain = NOBODY
    while True:
        kept = keep_approaching(s, i, met, count)
        bound_times(s.field, kept)
        low, high, partner = earliest_of(s, i, kept, low, high, partner)
        if chains == 0:
            return low, high, partner
        count, chains, chain = crowd(s, first, lines, to_line, to_cell, chains, chain)


def crowd(
    s: Columns, first: int, lines: int, to_line: int, to_cell: int, chains: int, chain: int
) -> tuple[int, int, int]:
    """Find more of the discs of a block that have no place of their own in their cells.

    Args:
        s: All columns.
        first: First cell of the block, as for `find_earliest`; so are `lines`, `to_line` and `to_cell`.
        lines: See `first`.
        to_line: See `first`.
        to_cell: See `first`.
        chains: Number of chains left, the one that has been begun included.
        chain: Disc with which that one goes on, NOBODY for none.

    Returns:
        How many discs were found, and `chains` and `chain` to go on with.
    """
    count, ahead = 0, chains
    if chain == NOBODY:
        for line in range(lines):
            for k in range(3):
                last = index(s.cells[(first + line * to_line + k * to_cell) * SLOTS + SLOTS - 1])
                if last < NOBODY:
                    ahead -= 1
                    if ahead == 0:
                        chain = CHAINED - last
    while chain != NOBODY and count < BATCH:
        s.nearby[count] = chain
        count += 1
        chain = index(s.cells[s.size[CHAINS] + chain])
    return count, chains if chain != NOBODY else chains - 1, chain


def expected(s: Columns, i: int) -> Candidate:
    """Return bounds on the time of the impact that is stored for disc `i`, and its partner."""
    low = high = s.body[i * ROW + PAIR]
    if s.link[i * ROW + EXACT] == 0:
        # A lower bound is stored, which is `_ROOT_ERROR` of the wait too low at most, or tells nothing.
        high = low * (1.0 + 4.0 * _ROOT_ERROR) if low >= 0.0 else math.inf
    return low, high, index(s.link[i * ROW + PARTNER])


def store(s: Columns, i: int, low: float, high: float, partner: int) -> None:
    """Store the next impact of disc `i` under the lower bound of its time, which is exact where both are the same."""
    link = s.link
    s.body[i * ROW + PAIR] = low
    link[i * ROW + PARTNER] = partner
    link[i * ROW + EXACT] = 1 if low == high else 0
    if partner != NOBODY:
        link[i * ROW + PARTNER_VERSION] = link[partner * ROW + VERSION]


#: Called at one place, or so short that it costs less than a call.
INLINE = (expected, find_earliest, has_just_met, keep_approaching, bound_times, earliest_of, store)
