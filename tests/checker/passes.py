"""Whether any body passes another unseen: the closest approach of every disc to every near disc, and to every wall.

Time is cut into short windows. In each, every disc stays within a circle: about where it is at the window's beginning,
with its radius and the way that it goes as radius. Only discs whose circles overlap can meet; these are found by cells,
and their flights compared: a straight relative motion, whose closest approach has a closed form. Discs that fall do so
alike, so theirs is straight as well; that of one that falls and one that does not is a parabola (`_lowest`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights, spans
from tests.checker.watch import Stretch

from carom import DiscArrays

Floats = NDArray[np.float64]
Vector = tuple[Floats, Floats]
Ranks = NDArray[np.intp]

#: Impacts a disc in a window: fewer make smaller circles, more make fewer of them.
IMPACTS_PER_WINDOW = 0.3
#: Discs in all windows that are dealt with at a time: what is computed of them still fits into a cache.
DISCS_AT_A_TIME = 4_000
#: Pairs of discs that are dealt with at a time: where all discs fly far in a window, each is near all others.
PAIRS_AT_A_TIME = 100_000
#: Halvings of a span of time: it is then as short as a float of its length can tell.
HALVINGS = 53
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
        depth_m: How deep they overlap, in metres.
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
        x, y = flights.place(first, wait)
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
    overlap. Beyond the last column and row there is an empty one, so that the neighbours of any row of cells are three
    in a row.
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

    In addition to the errors of both places, rounding leaves an overlap where an impact is found late (as for
    `contact`), and where the velocities after one, right to 8 u of either, still approach.
    """
    begin = np.maximum(flights.begin_s[a], flights.begin_s[b])
    end = np.minimum(flights.end_s[a], flights.end_s[b])
    a_wait, b_wait = begin - flights.begin_s[a], begin - flights.begin_s[b]
    (ax, ay), (bx, by) = flights.place(a, a_wait), flights.place(b, b_wait)
    (avx, avy), (bvx, bvy) = flights.velocity(a, a_wait), flights.velocity(b, b_wait)
    dx, dy = bx - ax, by - ay
    ux, uy = bvx - avx, bvy - avy
    speed2 = ux * ux + uy * uy
    closest = -(dx * ux + dy * uy) / (speed2 + (speed2 == 0.0))
    closest = np.minimum(np.maximum(closest, 0.0), end - begin)
    distance2 = (dx + ux * closest) ** 2 + (dy + uy * closest) ** 2
    velocities = flights.speed_m_s[a] + flights.speed_m_s[b]
    if flights.fall:
        bends = flights.falls[b] - flights.falls[a]
        k = np.flatnonzero(bends)
        pull = bends[k] * flights.gravity_m_s2[0], bends[k] * flights.gravity_m_s2[1]
        closest[k], distance2[k] = _lowest((dx[k], dy[k]), (ux[k], uy[k]), pull, (end - begin)[k])
        speed2[k] = velocities[k] ** 2
    i, j = flights.disc[a], flights.disc[b]
    reach = start.radius_m[i] + start.radius_m[j]
    deep = np.flatnonzero(~(distance2 >= reach * reach))
    a, b, reach, end, velocities = a[deep], b[deep], reach[deep], end[deep], velocities[deep]
    depth = reach - np.sqrt(distance2[deep])
    size = np.maximum(flights.size_m[a], flights.size_m[b])
    rounding = 16 * size + 5 * end * np.sqrt(speed2[deep]) + 4 * reach + 8 * velocities * (end - begin[deep])
    bound = flights.error_m[a] + flights.error_m[b] + UNIT * rounding
    bodies = np.stack([i[deep], j[deep]], axis=1)
    return bodies, begin[deep] + closest[deep], flights.look[a], depth, bound


def _lowest(p: Vector, v: Vector, g: Vector, duration_s: Floats) -> Vector:
    """Return when a parabola is nearest to the origin, and the square of that distance: p + v t + g t^2 / 2.

    The distance is least at an end, or where its square's derivative, a cubic, passes 0. The roots of the cubic's own
    derivative part the time into three spans in which it only grows or only falls, and halving finds its root in each.
    """
    pv, pg = p[0] * v[0] + p[1] * v[1], p[0] * g[0] + p[1] * g[1]
    vv, vg, gg = v[0] ** 2 + v[1] ** 2, v[0] * g[0] + v[1] * g[1], g[0] ** 2 + g[1] ** 2
    root = np.sqrt(np.maximum(9.0 * vg**2 - 6.0 * gg * (vv + pg), 0.0))
    turns = [np.clip((-3.0 * vg + sign * root) / (3.0 * gg), 0.0, duration_s) for sign in (-1.0, 1.0)]
    cuts = np.array([np.zeros_like(duration_s), *turns, duration_s])

    def slope(t: Floats) -> Floats:
        grows: Floats = pv + t * (vv + pg + t * (1.5 * vg + t * 0.5 * gg))
        return grows

    low, high = cuts[:-1], cuts[1:]
    falls_first = slope(low) < 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        before = (slope(middle) < 0.0) == falls_first
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    t = np.vstack([cuts, low, high])
    x, y = (p[k] + t * (v[k] + 0.5 * g[k] * t) for k in (0, 1))
    distance2 = x * x + y * y
    least = np.argmin(distance2, axis=0)[None]
    return np.take_along_axis(t, least, axis=0)[0], np.take_along_axis(distance2, least, axis=0)[0]


def wall_overlaps(start: DiscArrays, flights: Flights) -> Overlap:
    """Return where a movable disc reached into a wall: a flight is deepest at an end, or where gravity turns it."""
    k = np.flatnonzero(np.isfinite(start.mass_kg)[flights.disc])
    duration = flights.end_s[k] - flights.begin_s[k]
    nothing = np.empty(0)
    parts = [(np.empty((0, 2), np.intp), nothing, np.empty(0, np.intp), nothing, nothing)]
    for wall, (_, _, nx, ny) in enumerate(start.half_planes()):
        parts.append(_in_wall(start, flights, wall, k, duration))
        away = flights.gravity_m_s2[0] * nx + flights.gravity_m_s2[1] * ny
        if away > 0.0:
            turn = -(flights.vx[k] * nx + flights.vy[k] * ny) / away
            within = np.flatnonzero((turn > 0.0) & (turn < duration))
            parts.append(_in_wall(start, flights, wall, k[within], turn[within]))
    bodies, times, looks, depths, bounds = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Overlap(len(k) * len(start.walls), bodies, times, looks, depths, bounds)


def _in_wall(
    start: DiscArrays, flights: Flights, wall: int, k: Ranks, wait: Floats
) -> tuple[Ranks, Floats, Ranks, Floats, Floats]:
    """Return where flights are in a wall some time after they began: bodies, times, looks, depths and their bounds."""
    qx, qy, nx, ny = start.half_planes()[wall]
    disc = flights.disc[k]
    x, y = flights.place(k, wait)
    radius = start.radius_m[disc]
    depth = radius - ((x - qx) * nx + (y - qy) * ny)
    deep = np.flatnonzero(~(depth <= 0.0))
    flight, end = k[deep], flights.begin_s[k[deep]] + wait[deep]
    size = np.maximum(flights.size_m[flight], max(abs(qx), abs(qy)))
    speed = flights.speed_m_s[flight]
    rounding = 16 * size + 5 * end * speed + 4 * radius[deep] + 8 * speed * wait[deep]
    bodies = np.stack([disc[deep], np.full(len(deep), -1 - wall)], axis=1)
    return bodies, end, flights.look[flight], depth[deep], flights.error_m[flight] + UNIT * rounding
