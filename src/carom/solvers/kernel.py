"""The event-driven kernel: takes a run forward from event to event.

One source, two forms: as plain Python on lists, for a few discs; compiled on arrays, for many. Both give the same bits.

Each disc keeps one predicted impact, its earliest, and the next thing that ends its stay in its cell. Only the discs of
an impact are predicted again. That no impact is missed rests on this: of any two discs, whichever was predicted later
saw the other's present path, so the lesser of the two times stored for them is never later than their impact. A stored
impact whose partner has changed its path since is *stale*; it is predicted again when it comes up. A disc's position
moves only when the disc itself collides.

No result depends on the cells: they decide when a pair is looked at, never what is found (see `carom.solvers.cells`).
Simultaneous impacts are carried out in the order of (first, second).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.double_double import two_sum
from carom.solvers.cells import change_cell, insert_all
from carom.solvers.collision import collide_pair, collide_wall, move, reported_time
from carom.solvers.layout import (
    ALONE,
    ANEW,
    AT_INSTANT,
    CAPACITY,
    CERTAIN,
    CROSSINGS,
    DISCS,
    DONE,
    EPOCH,
    EPOCH_REST,
    EPOCHS,
    EXACT,
    EXIT,
    FULL,
    INVERSE_MASS,
    KEEP_FROM,
    KEEP_TO,
    LEAVE,
    LIMIT,
    NOBODY,
    NOW,
    OFFSET,
    OWN_TIME,
    PAIR,
    PARTNER,
    PARTNER_VERSION,
    PREDICTIONS,
    READY,
    RECORDED,
    ROW,
    SINCE_EPOCH,
    STALE,
    STANDSTILL,
    TIES,
    TIMES,
    TOP,
    TOTAL,
    VERSION,
    WALL,
    WALLS,
)
from carom.solvers.prediction import next_exit, pair_event_time, predict, scan_edge
from carom.solvers.tournament import earliest, least_other, lesser, next_at, set_time

if TYPE_CHECKING:
    from carom.solvers.layout import Column

__all__ = ["EPOCH_IMPACTS", "INLINE", "STANDSTILL_IMPACTS", "run"]

#: Impacts a disc after which time is counted from a new epoch. Times of this many free flights hold to within
#: 2^-53 of that time, in which a disc moves less than its own position is rounded by; a new one costs a prediction
#: a disc, against two an impact.
EPOCH_IMPACTS = 32

#: Impacts at one instant after which time stands still: as in `carom.solvers.impact_log`, a hundred times the
#: square of the number of bodies; but for many bodies ten million (ten seconds) above the n^2/2 of a touching line.
STANDSTILL_IMPACTS = 100
MOST_STANDSTILL_IMPACTS = 10_000_000


def is_stale(link: Column, i: int) -> bool:
    """Whether the partner of disc `i` has changed its path since the impact with it was predicted."""
    a = i * ROW
    partner = int(link[a + PARTNER])
    return bool(partner != NOBODY and link[partner * ROW + VERSION] != link[a + PARTNER_VERSION])


def new_epoch(body: Column, clock: Column, tally: Column, discs: int) -> None:
    """Bring every disc to the present instant, and count time from there."""
    now = clock[NOW]
    for i in range(discs):
        if body[i * ROW + INVERSE_MASS] > 0.0:
            move(body, i, now)
        body[i * ROW + OWN_TIME] = 0.0
    # The epoch is a pair of floats: what the first loses by rounding, the second keeps.
    total, rest = two_sum(clock[EPOCH], now)
    clock[EPOCH_REST] += rest
    clock[EPOCH] = total
    clock[NOW] = 0.0
    tally[SINCE_EPOCH] = 0
    tally[EPOCHS] += 1


def predict_anew(
    body: Column,
    link: Column,
    walls: Column,
    heads: Column,
    near_wall: Column,
    times: Column,
    tree: Column,
    winner: Column,
    law: Column,
    size: Column,
    i: int,
) -> None:
    """Predict all that is next for disc `i`, whose path is a new one."""
    predict(body, link, heads, times, size, i)
    next_exit(body, link, walls, near_wall, times, law, size, i)
    set_time(tree, winner, size, i, lesser(times[i * TIMES + PAIR], times[i * TIMES + LEAVE]))


def settle(
    body: Column,
    link: Column,
    walls: Column,
    heads: Column,
    near_wall: Column,
    times: Column,
    tree: Column,
    winner: Column,
    tally: Column,
    law: Column,
    size: Column,
    i: int,
) -> int:
    """Make the next event of disc `i` a certain impact, if it is not one yet: return ANEW, CERTAIN or ALONE.

    A disc that leaves its cell is taken over the edge and predicted against those that have become its neighbours; a
    stale impact is predicted again; one known only by a bound is solved for.
    """
    a, pair, leave = i * ROW, i * TIMES + PAIR, i * TIMES + LEAVE
    leaves = times[leave] <= times[pair]
    if leaves and link[a + EXIT] >= WALL and times[leave] < times[pair]:
        return CERTAIN
    leaves = leaves and link[a + EXIT] < WALL
    first = step = 0
    if leaves:
        tally[CROSSINGS] += 1
        first, step = change_cell(link, heads, i, size)
        next_exit(body, link, walls, near_wall, times, law, size, i)
    if is_stale(link, i):
        tally[STALE] += 1
        predict(body, link, heads, times, size, i)
    elif leaves:
        scan_edge(body, link, heads, times, size, i, first, step)
    elif link[a + EXACT] == 0:
        link[a + EXACT] = 1
        times[pair] = pair_event_time(body, i, link[a + PARTNER])
        # Mostly it is the next of all still; then its disc will be predicted anew, and the tree need not hear of it.
        if times[pair] < lesser(times[leave], least_other(tree, size, i)):
            return ALONE
    else:
        return CERTAIN
    set_time(tree, winner, size, i, lesser(times[pair], times[leave]))
    return ANEW


def impact_of(link: Column, times: Column, i: int, time: float) -> tuple[int, int]:
    """Return the first in order of the impacts that disc `i` holds at `time`, as first and second body."""
    first, second = i, i
    if times[i * TIMES + PAIR] == time:
        partner = int(link[i * ROW + PARTNER])
        first, second = (i, partner) if i < partner else (partner, i)
    if times[i * TIMES + LEAVE] == time and first == i:
        second = -1 - (int(link[i * ROW + EXIT]) - WALL)
    return first, second


def first_in_order(
    body: Column,
    link: Column,
    walls: Column,
    heads: Column,
    near_wall: Column,
    times: Column,
    tree: Column,
    winner: Column,
    tally: Column,
    law: Column,
    size: Column,
) -> tuple[float, int, int]:
    """Return the next impact where several discs share the least time: the first by (time, first, second).

    Every disc of the least time is settled first, until none of them has anything left but certain impacts. Of impacts
    that a disc has at one time it holds the first in order, so the first of all is among those held.
    """
    discs = int(size[DISCS])
    while True:
        least = tree[size[OFFSET + size[TOP]]]
        first, second = discs, discs
        i = next_at(tree, size, 0, least) if least < math.inf else discs
        unsettled = False
        while i < discs:
            found = settle(body, link, walls, heads, near_wall, times, tree, winner, tally, law, size, i)
            time = lesser(times[i * TIMES + PAIR], times[i * TIMES + LEAVE])
            if found == ANEW or time != least:
                set_time(tree, winner, size, i, time)
                unsettled = True
            elif not unsettled:
                held_first, held_second = impact_of(link, times, i, least)
                if held_first < first or (held_first == first and held_second < second):
                    first, second = held_first, held_second
            i = next_at(tree, size, i + 1, least)
        if not unsettled:
            return least, first, second


def run(
    body: Column,
    link: Column,
    walls: Column,
    heads: Column,
    near_wall: Column,
    times: Column,
    tree: Column,
    winner: Column,
    clock: Column,
    tally: Column,
    law: Column,
    size: Column,
    records: Column,
    until: float,
    impacts: int,
) -> int:
    """Carry out impacts until the time `until` (seconds from the start), or until there have been `impacts` in all.

    Args:
        body: Paths, see `carom.solvers.layout`; so are `link`, `clock`, `tally`, `law`, `size` and `records`.
        link: Cells and predictions.
        walls: Four floats a wall: a point, and the unit normal.
        heads: First disc of each cell.
        near_wall: Which walls are near each cell.
        times: When each disc meets another, and when it leaves its cell or meets a wall.
        tree: Tournament tree.
        winner: The disc that each least time in it belongs to.
        clock: Times.
        tally: Counts.
        law: Restitution, cells and window.
        size: How much there is of everything.
        records: Room for impacts; none are kept where it is empty.
        until: Impacts up to and including this time are carried out.
        impacts: Number of impacts, counted from the start of the run, after which to stop.

    Returns:
        DONE, FULL (no room left in `records`: call again), LIMIT (there would be another impact by `until`) or
        STANDSTILL.
    """
    discs = size[DISCS]
    capacity = size[CAPACITY]
    bodies = discs + size[WALLS]
    standstill = min(STANDSTILL_IMPACTS * bodies * bodies, MOST_STANDSTILL_IMPACTS + bodies * bodies // 2)
    while True:
        if tally[SINCE_EPOCH] >= EPOCH_IMPACTS * discs:
            new_epoch(body, clock, tally, discs)
            tally[READY] = 0
        if tally[READY] == 0:
            insert_all(body, link, heads, law, size, clock[NOW])
            for i in range(discs):
                # A disc that never moves need not look for those that meet it: they see it.
                if body[i * ROW + INVERSE_MASS] > 0.0:
                    predict_anew(body, link, walls, heads, near_wall, times, tree, winner, law, size, i)
            tally[READY] = 1
        i = earliest(winner, size)
        time = tree[i]
        if not time < math.inf or reported_time(clock, time) > until:
            return DONE
        found = settle(body, link, walls, heads, near_wall, times, tree, winner, tally, law, size, i)
        if found == ANEW:
            continue
        time = lesser(times[i * TIMES + PAIR], times[i * TIMES + LEAVE])
        first, second = impact_of(link, times, i, time)
        if found == CERTAIN and least_other(tree, size, i) <= time:
            tally[TIES] += 1
            set_time(tree, winner, size, i, time)
            time, first, second = first_in_order(
                body, link, walls, heads, near_wall, times, tree, winner, tally, law, size
            )
        if not time < math.inf:
            return DONE
        now = reported_time(clock, time if time > clock[NOW] else clock[NOW])
        if now > until:
            return DONE
        if tally[TOTAL] >= impacts:
            return LIMIT
        keep = capacity > 0 and law[KEEP_FROM] <= now <= law[KEEP_TO]
        if keep and tally[RECORDED] == capacity:
            return FULL
        if second < 0:
            collide_wall(body, link, walls, clock, tally, law, size, records, first, -1 - second, time, keep)
        else:
            collide_pair(body, link, clock, tally, law, records, first, second, time, keep)
        for k in range(2):
            changed = first if k == 0 else second
            if changed >= 0 and body[changed * ROW + INVERSE_MASS] > 0.0:
                tally[PREDICTIONS] += 1
                predict_anew(body, link, walls, heads, near_wall, times, tree, winner, law, size, changed)
        if tally[AT_INSTANT] > standstill:
            return STANDSTILL


#: What costs less than a call.
INLINE = (settle, predict_anew, impact_of, is_stale)
