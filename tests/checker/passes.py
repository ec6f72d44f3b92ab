"""Whether any body passes another unseen: the closest approach of every disc to every near disc, and to every wall.

Time is cut into short windows. In each, every disc stays within a circle: about where it is at the window's beginning,
with its radius and the way that it goes as radius. Only discs whose circles overlap can meet; these are found by cells,
and their flights held against each other: a straight relative motion, whose closest approach has a closed form.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights, spans
from tests.checker.watch import Stretch

from carom import DiscArrays

Floats = NDArray[np.float64]
Ranks = NDArray[np.intp]

#: Impacts a disc in a window: fewer make smaller circles, more make fewer of them.
IMPACTS_PER_WINDOW = 0.3
#: Discs in all windows that are dealt with at a time: what is computed of them still fits into a cache.
DISCS_AT_A_TIME = 4_000
#: Pairs of discs that are dealt with at a time: where all discs fly far in a window, each is near all others.
PAIRS_AT_A_TIME = 100_000
#: Cells along a side at most, so that their numbers have 16 bits and are sorted by digits.
MOST_CELLS = 250


@dataclass(frozen=True)
class Overlap:
    """Where two bodies came closer than contact, which rounding makes of every second impact.

    Attributes:
        pairs: How many pairs of flights, or flights and walls, were looked at.
        bodies: Whom it concerns, shape ``(k, 2)``, a wall as ``-1 - k``.
        time_s: When, shape ``(k,)``, as are the others.
        look: Number in the stretch of the last look before; several may be at one instant.
        depth_m: How deep they overlap, metres.
        bound_m: How deep rounding can make it.
    """

    pairs: int
    bodies: Ranks
    time_s: Floats
    look: Ranks
    depth_m: Floats
    bound_m: Floats


@dataclass(frozen=True)
class _Windows:
    """Windows of time, one after another.

    Attributes:
        begin_s: Shape ``(w,)``.
        end_s: Shape ``(w,)``.
        first: The flight that each disc is on when the window begins, shape ``(w, n)``.
        last: The flight that it is on when the window ends.
    """

    begin_s: Floats
    end_s: Floats
    first: Ranks
    last: Ranks


def _windows(stretch: Stretch, flights: Flights, movable: int) -> _Windows:
    discs = stretch.position_m.shape[1]
    step = max(1, round(IMPACTS_PER_WINDOW * movable / 2))
    rows = np.diff(stretch.looks)
    count = np.maximum(1, -(-rows // step))
    first_window = np.cumsum(count) - count
    look, k = spans(np.zeros_like(count), count)
    # Each window ends with the impact before the next, and the last one with the look.
    end_row = stretch.looks[look] + (k + 1) * step - 1
    end_s = stretch.time_s[look + 1]
    within = k + 1 < count[look]
    end_s[within] = stretch.impacts["time_s"][end_row[within]]
    begin_s = np.append(stretch.time_s[0], end_s[:-1])

    look_of_row, row = spans(np.zeros_like(rows), rows)
    of_row = first_window[look_of_row] + row // step
    impacts = np.zeros((len(look), discs), np.intp)
    for name in ("first", "second"):
        body = stretch.impacts[name]
        impacts += np.bincount((of_row * discs + body)[body >= 0], minlength=impacts.size).reshape(impacts.shape)
    before = np.cumsum(impacts, axis=0) - impacts
    first = flights.first[look] + before - before[first_window][look]
    return _Windows(begin_s, end_s, first, first + impacts)


def disc_overlaps(start: DiscArrays, stretch: Stretch, flights: Flights) -> Overlap:
    """Return where two discs came closer than contact; two immovable ones may overlap."""
    discs = stretch.position_m.shape[1]
    windows = _windows(stretch, flights, int(np.isfinite(start.mass_kg).sum()))
    # Paths are differences of a long sum, each term of which is off by its rounding.
    margin = len(flights.path_m) * UNIT * float(flights.path_m[-1]) + 2 * float(flights.error_m.max())
    pairs, parts = 0, []
    step = max(1, DISCS_AT_A_TIME // discs)
    for k in range(0, len(windows.begin_s), step):
        first, last = windows.first[k : k + step], windows.last[k : k + step]
        begin_s, end_s = windows.begin_s[k : k + step, None], windows.end_s[k : k + step, None]
        movable = np.tile(np.isfinite(start.mass_kg), len(first))
        wait = begin_s - flights.begin_s[first]
        vx, vy = flights.vx[first], flights.vy[first]
        x, y = flights.x[first] + vx * wait, flights.y[first] + vy * wait
        way = flights.path_m[last] - flights.path_m[first] - flights.speed_m_s[first] * wait
        way += flights.speed_m_s[last] * (end_s - flights.begin_s[last])
        for near_a, near_b in _near(x, y, start.radius_m + way + margin):
            moves = movable[near_a] | movable[near_b]
            a, b = near_a[moves], near_b[moves]
            one, other = _joint(flights, first.ravel()[a], last.ravel()[a], first.ravel()[b], last.ravel()[b])
            pairs += len(one)
            parts.append(_closest(start, flights, one, other))
    bodies, time_s, look, depth, bound = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Overlap(pairs, bodies, time_s, look, depth, bound)


def _joint(flights: Flights, a: Ranks, a_last: Ranks, b: Ranks, b_last: Ranks) -> tuple[Ranks, Ranks]:
    """Return, for pairs of discs, all pairs of flights that are at one time in a window.

    There is one at the window's beginning, and one wherever either disc begins another flight, with the one that the
    other disc is on meanwhile.
    """
    ones, others = [a], [b]
    for this, last, that, that_last, mine, its in (
        (a, a_last, b, b_last, ones, others),
        (b, b_last, a, a_last, others, ones),
    ):
        owner, begun = spans(this + 1, last - this)
        meanwhile, latest = that[owner], that_last[owner]
        ahead = np.flatnonzero(meanwhile < latest)
        while len(ahead):
            ahead = ahead[flights.row[meanwhile[ahead] + 1] <= flights.row[begun[ahead]]]
            meanwhile[ahead] += 1
            ahead = ahead[meanwhile[ahead] < latest[ahead]]
        mine.append(begun)
        its.append(meanwhile)
    return np.concatenate(ones), np.concatenate(others)


def _near(x: Floats, y: Floats, radius: Floats) -> Iterator[tuple[Ranks, Ranks]]:
    """Yield all pairs of circles that overlap, as indices into the flattened arrays, each of shape ``(w, n)``.

    A cell is as wide as the largest circle of its window, so that only circles in the same or in neighbouring cells
    overlap. Beyond the last column and row lies an empty one, so that the neighbours of a row of cells are three in a
    row, wherever it lies.
    """
    windows, discs = x.shape
    east, north = x - x.min(axis=1, keepdims=True), y - y.min(axis=1, keepdims=True)
    across, along = east.max(axis=1, keepdims=True), north.max(axis=1, keepdims=True)
    width = np.maximum(2 * radius.max(axis=1, keepdims=True), np.maximum(across, along) / MOST_CELLS)
    stride, rows = (across / width).astype(np.intp) + 2, (along / width).astype(np.intp) + 2
    cell = (north / width).astype(np.intp) * stride + (east / width).astype(np.intp)
    order = np.argsort(cell.astype(np.uint16), axis=1, kind="stable")
    base = np.cumsum(stride * rows).reshape(-1, 1) - stride * rows
    sorted_cell = (np.take_along_axis(cell, order, axis=1) + base).ravel()
    order = (order + np.arange(windows)[:, None] * discs).ravel()
    begins = np.append(0, np.cumsum(np.bincount(sorted_cell, minlength=int((stride * rows).sum()))))
    x, y, radius = x.ravel()[order], y.ravel()[order], radius.ravel()[order]
    up = np.repeat(stride.ravel(), discs) + sorted_cell
    rank = np.arange(len(order))
    beyond = len(begins) - 1
    for begin, end in ((rank + 1, begins[sorted_cell + 2]), (begins[up - 1], begins[np.minimum(up + 2, beyond)])):
        count = np.maximum(end - begin, 0)
        for some in _blocks(count):
            a, b = spans(begin[some], count[some])
            a += some.start
            reach = radius[a] + radius[b]
            near = np.flatnonzero((x[b] - x[a]) ** 2 + (y[b] - y[a]) ** 2 <= reach * reach)
            yield order[a[near]], order[b[near]]


def _blocks(count: Ranks) -> Iterator[slice]:
    """Yield the parts of an array of counts of pairs that are dealt with at a time."""
    total = np.cumsum(count)
    cuts = np.searchsorted(total, np.arange(PAIRS_AT_A_TIME, total[-1], PAIRS_AT_A_TIME)).tolist()
    for begin, end in pairwise([0, *cuts, len(count)]):
        yield slice(begin, end)


def _closest(start: DiscArrays, flights: Flights, a: Ranks, b: Ranks) -> tuple[Ranks, Floats, Ranks, Floats, Floats]:
    """Return where two of the discs of these pairs of flights overlap: bodies, times, looks, depths and their bounds.

    Beside the errors of both places rounding leaves an overlap where an impact is found late (as for `contact`), and
    where the velocities after one, right to 8 u of either, still approach.
    """
    begin = np.maximum(flights.begin_s[a], flights.begin_s[b])
    end = np.minimum(flights.end_s[a], flights.end_s[b])
    avx, avy, bvx, bvy = flights.vx[a], flights.vy[a], flights.vx[b], flights.vy[b]
    a_wait, b_wait = begin - flights.begin_s[a], begin - flights.begin_s[b]
    dx = (flights.x[b] + bvx * b_wait) - (flights.x[a] + avx * a_wait)
    dy = (flights.y[b] + bvy * b_wait) - (flights.y[a] + avy * a_wait)
    ux, uy = bvx - avx, bvy - avy
    speed2 = ux * ux + uy * uy
    closest = -(dx * ux + dy * uy) / (speed2 + (speed2 == 0.0))
    closest = np.minimum(np.maximum(closest, 0.0), end - begin)
    distance2 = (dx + ux * closest) ** 2 + (dy + uy * closest) ** 2
    i, j = flights.disc[a], flights.disc[b]
    reach = start.radius_m[i] + start.radius_m[j]
    deep = np.flatnonzero(~(distance2 >= reach * reach))
    a, b, reach, end = a[deep], b[deep], reach[deep], end[deep]
    depth = reach - np.sqrt(distance2[deep])
    size = np.maximum(flights.size_m[a], flights.size_m[b])
    velocities = flights.speed_m_s[a] + flights.speed_m_s[b]
    rounding = 16 * size + 5 * end * np.sqrt(speed2[deep]) + 4 * reach + 8 * velocities * (end - begin[deep])
    bound = flights.error_m[a] + flights.error_m[b] + UNIT * rounding
    bodies = np.stack([i[deep], j[deep]], axis=1)
    return bodies, begin[deep] + closest[deep], flights.look[a], depth, bound


def wall_overlaps(start: DiscArrays, flights: Flights) -> Overlap:
    """Return where a movable disc reached into a wall: on a straight flight that is deepest at one of its ends."""
    k = np.flatnonzero(np.isfinite(start.mass_kg)[flights.disc])
    disc, end = flights.disc[k], flights.end_s[k]
    wait = end - flights.begin_s[k]
    vx, vy = flights.vx[k], flights.vy[k]
    x, y = flights.x[k] + vx * wait, flights.y[k] + vy * wait
    radius = start.radius_m[disc]
    bodies, times, depths, bounds = [np.empty((0, 2), np.intp)], [np.empty(0)], [np.empty(0)], [np.empty(0)]
    looks = [np.empty(0, np.intp)]
    for wall, (qx, qy, nx, ny) in enumerate(start.walls):
        depth = radius - ((x - qx) * nx + (y - qy) * ny)
        deep = np.flatnonzero(~(depth <= 0.0))
        flight = k[deep]
        size = np.maximum(flights.size_m[flight], max(abs(qx), abs(qy)))
        speed = flights.speed_m_s[flight]
        rounding = 16 * size + 5 * end[deep] * speed + 4 * radius[deep] + 8 * speed * wait[deep]
        bodies.append(np.stack([disc[deep], np.full(len(deep), -1 - wall)], axis=1))
        times.append(end[deep])
        looks.append(flights.look[flight])
        depths.append(depth[deep])
        bounds.append(flights.error_m[flight] + UNIT * rounding)
    return Overlap(
        len(k) * len(start.walls),
        np.concatenate(bodies),
        np.concatenate(times),
        np.concatenate(looks),
        np.concatenate(depths),
        np.concatenate(bounds),
    )
