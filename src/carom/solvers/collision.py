"""What happens to the discs of the event-driven kernel at an impact, and what is written down of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.impact_law import pair_push
from carom.solvers.layout import (
    AT_INSTANT,
    CONTACT_TIME,
    DISCS,
    EPOCH,
    EPOCH_REST,
    LAST,
    MOVES,
    NORMAL_X,
    NORMAL_Y,
    NOW,
    OWN_TIME,
    PREDICTIONS,
    PUSHED,
    RADIUS,
    RECORD,
    RECORDED,
    REPORTED,
    RESTITUTION,
    ROW,
    SINCE_EPOCH,
    TOTAL,
    VERSION,
    VX,
    VY,
    WALL_IMPACTS,
    WALL_RESTITUTION,
    WALL_ROW,
    X,
    Y,
)

if TYPE_CHECKING:
    from carom.solvers.layout import Column, Columns

__all__ = ["INLINE", "collide_pair", "collide_wall", "move", "note_instant", "reported_time"]

#: Unit in the last place of 1.
UNIT = 2.0**-52


def reported_time(clock: Column, time: float) -> float:
    """Return the time since the start of a time since the epoch; never less than one reported before."""
    since_start: float = clock[EPOCH] + (clock[EPOCH_REST] + time)
    last: float = clock[REPORTED]
    return since_start if since_start > last else last


def move(body: Column, i: int, time: float) -> None:
    """Bring disc `i` forward to `time` along its straight path."""
    a = i * ROW
    dt = time - body[a + OWN_TIME]
    body[a + X] += body[a + VX] * dt
    body[a + Y] += body[a + VY] * dt
    body[a + OWN_TIME] = time


def note_instant(s: Columns, time: float) -> None:
    """Bring the clock to `time`, never back, and begin to count the impacts of this instant if it is a new one."""
    if time > s.clock[NOW]:
        s.clock[NOW] = time
        s.tally[AT_INSTANT] = 0


def restitution_now(s: Columns, i: int, time: float, restitution: float) -> float:
    """Return the restitution of an impact of disc `i` at `time`: 1 so soon after its last that they are one contact."""
    if s.law[CONTACT_TIME] > 0.0 and s.link[i * ROW + MOVES] != 0:
        if time - s.last_impact[i] < s.law[CONTACT_TIME]:
            restitution = 1.0
        s.last_impact[i] = time
    return restitution


def record(
    s: Columns,
    i: int,
    j: int,
    nx: float,
    ny: float,
    approach: float,
    before: tuple[float, float, float, float],
) -> None:
    """Write one impact down; `j` below 0 is a wall, and `approach` is the speed along the normal.

    How well the instant is known is that of `carom.solvers.plain.bodies.Bodies.resolution_s`.
    """
    body, clock, records = s.body, s.clock, s.records
    r = s.tally[RECORDED] * RECORD
    a = i * ROW
    records[r] = clock[REPORTED]
    records[r + 1] = i
    records[r + 2] = j
    records[r + 3] = nx
    records[r + 4] = ny
    records[r + 5] = before[0]
    records[r + 6] = before[1]
    records[r + 7] = before[2]
    records[r + 8] = before[3]
    records[r + 9] = body[a + VX]
    records[r + 10] = body[a + VY]
    records[r + 11] = body[j * ROW + VX] if j >= 0 else 0.0
    records[r + 12] = body[j * ROW + VY] if j >= 0 else 0.0
    size = abs(body[a + X]) + abs(body[a + Y]) + body[a + RADIUS]
    if j >= 0:
        o = j * ROW
        reach = body[a + RADIUS] + body[o + RADIUS]
        error = 5.0 * UNIT * (size + abs(body[o + X]) + abs(body[o + Y]) + body[o + RADIUS])
        ux, uy = before[0] - before[2], before[1] - before[3]
        speed2 = ux * ux + uy * uy
        uncertain = math.sqrt(2.0 * reach * error / speed2) if speed2 > 0.0 else math.inf
    else:
        error = 5.0 * UNIT * size
        uncertain = math.inf
    if approach > 0.0 and error / approach < uncertain:
        uncertain = error / approach
    records[r + 13] = uncertain + 2.0 * UNIT * clock[REPORTED]
    s.tally[RECORDED] += 1


def count_impact(tally: Column) -> None:
    """Count an impact."""
    tally[TOTAL] += 1
    tally[SINCE_EPOCH] += 1
    tally[AT_INSTANT] += 1


def collide_pair(s: Columns, i: int, j: int, time: float, keep: bool) -> None:
    """Carry out the impact of discs `i` < `j` at `time`."""
    body, link, clock = s.body, s.link, s.clock
    a, o = i * ROW, j * ROW
    note_instant(s, time)
    clock[REPORTED] = reported_time(clock, clock[NOW])
    time = clock[NOW]
    restitution = restitution_now(s, i, time, s.law[RESTITUTION])
    restitution = restitution_now(s, j, time, restitution)
    # An immovable disc stands where it stood at the start: moving it on would change nothing but its own time.
    if link[a + MOVES] != 0:
        move(body, i, time)
    if link[o + MOVES] != 0:
        move(body, j, time)
    dx, dy = body[o + X] - body[a + X], body[o + Y] - body[a + Y]
    before = (body[a + VX], body[a + VY], body[o + VX], body[o + VY])
    inverse_1, inverse_2 = s.inverse_mass[i], s.inverse_mass[j]
    push = pair_push(dx, dy, before[2] - before[0], before[3] - before[1], inverse_1 + inverse_2, restitution)
    body[a + VX] += push * inverse_1 * dx
    body[a + VY] += push * inverse_1 * dy
    body[o + VX] -= push * inverse_2 * dx
    body[o + VY] -= push * inverse_2 * dy
    distance2 = dx * dx + dy * dy
    clock[PUSHED] -= push * distance2
    link[a + VERSION] += 1
    link[o + VERSION] += 1
    link[a + LAST], link[o + LAST] = j, i
    count_impact(s.tally)
    s.tally[PREDICTIONS] += (inverse_1 > 0.0) + (inverse_2 > 0.0)
    if keep:
        distance = math.sqrt(distance2)
        nx, ny = dx / distance, dy / distance
        speed = (before[0] - before[2]) * nx + (before[1] - before[3]) * ny
        record(s, i, j, nx, ny, speed, before)


def collide_wall(s: Columns, i: int, k: int, time: float, keep: bool) -> None:
    """Carry out the impact of disc `i` on wall `k` at `time`."""
    body, link, clock, walls = s.body, s.link, s.clock, s.walls
    a = i * ROW
    nx, ny = walls[k * WALL_ROW + NORMAL_X], walls[k * WALL_ROW + NORMAL_Y]
    note_instant(s, time)
    clock[REPORTED] = reported_time(clock, clock[NOW])
    time = clock[NOW]
    restitution = restitution_now(s, i, time, s.law[WALL_RESTITUTION])
    move(body, i, time)
    link[a + VERSION] += 1
    link[a + LAST] = s.size[DISCS] + k
    before = (body[a + VX], body[a + VY], 0.0, 0.0)
    along = before[0] * nx + before[1] * ny
    if along < 0.0:  # rounding can turn the weakest of grazes into a separation: an impact never pulls
        body[a + VX] -= (1.0 + restitution) * along * nx
        body[a + VY] -= (1.0 + restitution) * along * ny
    count_impact(s.tally)
    s.tally[WALL_IMPACTS] += 1
    s.tally[PREDICTIONS] += 1
    if keep:
        record(s, i, -1 - k, -nx, -ny, -along, before)


#: Called at one place, or so short that it costs less than a call.
INLINE = (collide_pair, move, reported_time, note_instant, restitution_now, count_impact)
