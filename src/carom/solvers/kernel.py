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
from carom.solvers.exits import next_exit
from carom.solvers.layout import (
    AHEAD,
    ANEW,
    AT_INSTANT,
    BOUNDED,
    CAPACITY,
    CELL,
    CERTAIN,
    COLUMN_BITS,
    COLUMN_MASK,
    CONTACT_TIME,
    CROSSINGS,
    DISCS,
    DONE,
    EDGE,
    EPOCH,
    EPOCH_REST,
    EPOCHS,
    EXACT,
    EXIT,
    FULL,
    GUESSED,
    KEEP_FROM,
    KEEP_TO,
    LATER,
    LEAVE,
    LEAVES,
    LIMIT,
    MOVES,
    NOBODY,
    NOW,
    OWN_TIME,
    PAIR,
    PARTNER,
    PARTNER_VERSION,
    READY,
    RECORDED,
    ROW,
    SINCE_EPOCH,
    STALE,
    STANDSTILL,
    STRIDE,
    TIES,
    TOTAL,
    VERSION,
    WALL,
    WALLS,
    Columns,
    index,
)
from carom.solvers.lookahead import fetch_disc, fetch_neighbours, fetch_surroundings, runner_up
from carom.solvers.prediction import expected, find_earliest, pair_event_time, store
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


def new_epoch(s: Columns) -> None:
    """Bring every disc to the present instant, and count time from there; all is predicted anew."""
    body, clock = s.body, s.clock
    now = clock[NOW]
    for i in range(s.size[DISCS]):
        if s.link[i * ROW + MOVES] != 0:
            move(body, i, now)
        body[i * ROW + OWN_TIME] = 0.0
        if s.law[CONTACT_TIME] > 0.0:
            s.last_impact[i] -= now
    # The epoch is a pair of floats: what the first loses by rounding, the second keeps.
    total, rest = two_sum(clock[EPOCH], now)
    clock[EPOCH_REST] += rest
    clock[EPOCH] = total
    clock[NOW] = 0.0
    s.tally[SINCE_EPOCH] = 0
    s.tally[EPOCHS] += 1
    s.tally[READY] = 0


def next_step(s: Columns, i: int) -> int:
    """Return what the next event of disc `i` asks for: LEAVES, GUESSED, BOUNDED or CERTAIN."""
    body, link = s.body, s.link
    a, pair, leave = i * ROW, body[i * ROW + PAIR], body[i * ROW + LEAVE]
    if leave <= pair:
        if link[a + EXIT] < WALL:
            return LEAVES
        if leave < pair:
            return CERTAIN
    if is_stale(link, i):
        return GUESSED
    return CERTAIN if link[a + EXACT] != 0 else BOUNDED


def solve(s: Columns, i: int) -> None:
    """Replace the bound on the next impact of disc `i` by its time."""
    s.link[i * ROW + EXACT] = 1
    s.body[i * ROW + PAIR] = pair_event_time(s.body, i, index(s.link[i * ROW + PARTNER]))


def impact_of(s: Columns, i: int, time: float) -> tuple[int, int]:
    """Return the first in order of the impacts that disc `i` holds at `time`, as first and second body."""
    body, link = s.body, s.link
    first, second = i, i
    if body[i * ROW + PAIR] == time:
        partner = index(link[i * ROW + PARTNER])
        first, second = (i, partner) if i < partner else (partner, i)
    if body[i * ROW + LEAVE] == time and first == i:
        second = -1 - (index(link[i * ROW + EXIT]) - WALL)
    return first, second


def same_impact(s: Columns, i: int, time: float) -> int:
    """Return the disc whose next event is the same impact as that of disc `i` at `time`: the partner, or `i` itself."""
    body, link = s.body, s.link
    j = index(link[i * ROW + PARTNER])
    if j == NOBODY or body[i * ROW + PAIR] != time or body[j * ROW + LEAVE] <= time:
        return i
    same = link[j * ROW + PARTNER] == i and link[j * ROW + PARTNER_VERSION] == link[i * ROW + VERSION]
    return j if same else i


def first_in_order(s: Columns, least: float) -> int:
    """Return the disc to go on with where several share the least time.

    It is one whose next event is not a certain impact, if there is one left, and else the one whose impact is the first
    by (first, second). Of impacts that a disc has at one time it holds the first in order, so the first of all is held.
    """
    discs = index(s.size[DISCS])
    found, first, second = discs, discs, discs
    i = next_at(s, index(0), least)
    while i < discs:
        if next_step(s, i) != CERTAIN:
            return i
        held_first, held_second = impact_of(s, i, least)
        if held_first < first or (held_first == first and held_second < second):
            found, first, second = i, held_first, held_second
        i = next_at(s, i + 1, least)
    return found


def settle(s: Columns, i: int, step: int) -> tuple[int, int]:
    """Make sure of the next event of disc `i`, an impact: that it is certain, and the next of all.

    Args:
        s: All columns.
        i: The disc of the least time in the tree.
        step: What its next event asks for: BOUNDED or CERTAIN.

    Returns:
        A disc, and what is to be done with it: CERTAIN where its impact is the next of all.
    """
    body, tree = s.body, s.tree
    if step == BOUNDED:
        solve(s, i)
        # Its time was a lower bound: the disc may leave its cell before it.
        if next_step(s, i) == LEAVES:
            return i, LATER
    time = lesser(body[i * ROW + PAIR], body[i * ROW + LEAVE])
    # Mostly it is the next of all by far. Then its disc is predicted anew: no need to tell the tree of its time first.
    if time < least_other(s, i, same_impact(s, i, time)):
        return i, CERTAIN
    if tree[i] != time:
        return i, LATER
    s.tally[TIES] += 1
    i = first_in_order(s, time)
    step = next_step(s, i)
    if step != BOUNDED:
        return i, step
    solve(s, i)
    return i, LATER


def foresee(s: Columns, i: int, step: int, edge: int, across: int) -> None:
    """Predict what is next for disc `i`.

    Args:
        s: All columns.
        i: The disc, a movable one.
        step: How its future has changed: ANEW, GUESSED (all impacts, but not its leaving its cell), or EDGE.
        edge: First of three more cells to look at, where it is EDGE; `across` is the way from each to the next.
        across: See `edge`.
    """
    low, high, partner = math.inf, math.inf, NOBODY
    first, lines, to_line, to_cell = edge, 1, 0, across
    if step == EDGE:
        low, high, partner = expected(s, i)
    else:
        place, stride = index(s.link[i * ROW + CELL]), index(s.size[STRIDE])
        first = ((place >> COLUMN_BITS) - 1) * stride + (place & COLUMN_MASK) - 1
        lines, to_line, to_cell = 3, stride, 1
    low, high, found = find_earliest(s, i, first, lines, to_line, to_cell, low, high, partner)
    if step != EDGE or found != partner:
        store(s, i, low, high, found)
    if step != GUESSED:
        next_exit(s, i)


def run(
    body: Column,
    link: Column,
    cells: Column,
    nearby: Column,
    field: Column,
    walls: Column,
    near_wall: Column,
    inverse_mass: Column,
    last_impact: Column,
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

    What is done for each event is called at one place only, so that a compiler can make it part of this function.

    Args:
        body: The columns, see `carom.solvers.layout.Columns`; so are all up to `records`.
        link: See `body`.
        cells: See `body`.
        nearby: See `body`.
        field: See `body`.
        walls: See `body`.
        near_wall: See `body`.
        inverse_mass: See `body`.
        last_impact: See `body`.
        tree: See `body`.
        winner: See `body`.
        clock: See `body`.
        tally: See `body`.
        law: See `body`.
        size: See `body`.
        records: See `body`.
        until: Impacts up to and including this time are carried out.
        impacts: Number of impacts, counted from the start of the run, after which to stop.

    Returns:
        DONE, FULL (no room left in `records`: call again), LIMIT (there would be another impact by `until`) or
        STANDSTILL.
    """
    s = Columns(
        body,
        link,
        cells,
        nearby,
        field,
        walls,
        near_wall,
        inverse_mass,
        last_impact,
        tree,
        winner,
        clock,
        tally,
        law,
        size,
        records,
    )
    discs, capacity = index(size[DISCS]), size[CAPACITY]
    bodies = discs + size[WALLS]
    standstill = min(STANDSTILL_IMPACTS * bodies * bodies, MOST_STANDSTILL_IMPACTS + bodies * bodies // 2)
    while True:
        if tally[AT_INSTANT] > standstill:
            return STANDSTILL
        # Which discs' futures change, and how.
        i, j, step, edge, across, ahead = NOBODY, NOBODY, ANEW, 0, 0, NOBODY
        if tally[READY] < discs:
            if tally[READY] == 0:
                insert_all(s)
            i = index(tally[READY])
            tally[READY] += 1
        else:
            i = earliest(s)
            if not tree[i] < math.inf or reported_time(clock, tree[i]) > until:
                return DONE
            if size[AHEAD] != 0:
                ahead = runner_up(s, i)
                fetch_disc(s, ahead)
            step = next_step(s, i)
            if step in (BOUNDED, CERTAIN):
                i, step = settle(s, i, step)
            if step == CERTAIN:
                time = lesser(body[i * ROW + PAIR], body[i * ROW + LEAVE])
                now = reported_time(clock, time if time > clock[NOW] else clock[NOW])
                if now > until:
                    return DONE
                if tally[TOTAL] >= impacts:
                    return LIMIT
                keep = capacity > 0 and law[KEEP_FROM] <= now <= law[KEEP_TO]
                if keep and tally[RECORDED] == capacity:
                    return FULL
                i, j = impact_of(s, i, time)
                if j < 0:
                    collide_wall(s, i, -1 - j, time, keep)
                else:
                    collide_pair(s, i, j, time, keep)
                if tally[SINCE_EPOCH] >= EPOCH_IMPACTS * discs:
                    new_epoch(s)
                    continue
                step = ANEW
            elif step == LEAVES:
                tally[CROSSINGS] += 1
                edge, across = change_cell(s, i)
                step = EDGE
                if is_stale(link, i):
                    tally[STALE] += 1
                    step = ANEW
            elif step == GUESSED:
                tally[STALE] += 1
        for k in range(2):
            changed = i if k == 0 else j
            # A disc that never moves need not look for those that meet it: they see it.
            if changed < 0 or link[changed * ROW + MOVES] == 0:
                continue
            if step != LATER:
                foresee(s, changed, step, edge, across)
            if ahead != NOBODY:
                fetch_surroundings(s, ahead)
            set_time(s, changed, lesser(body[changed * ROW + PAIR], body[changed * ROW + LEAVE]))
        if ahead != NOBODY:
            fetch_neighbours(s, ahead)


#: Called at one place, or so short that it costs less than a call.
INLINE = (foresee, impact_of, is_stale, next_step, same_impact, settle, solve)
