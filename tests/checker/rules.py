"""What must hold of every impact, and what breaks it."""

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights, build_flights
from tests.checker.laws import find_law_violations
from tests.checker.passes import Overlap, disc_overlaps, wall_overlaps
from tests.checker.report import Report, Violation, build_violation, find_violations, largest_ratio
from tests.checker.rest import Rests, find_end_violations, find_resting
from tests.checker.watch import Stretch
from tests.scene_builders import require_value

from carom import DiscArrays

Floats = NDArray[np.float64]
Ranks = NDArray[np.intp]


def check(
    start: DiscArrays,
    stretch: Stretch,
    report: Report,
    *,
    gravity_m_s2: tuple[float, float] = (0.0, 0.0),
    contact_duration_s: float = 0.0,
) -> None:
    """Check all that is seen in a stretch of a run by every rule, and add what comes out to a report."""
    report.impacts += len(stretch.impacts)
    found = _broken_rows(start, stretch)
    missing = float(abs(int(stretch.looks[-1]) - len(stretch.impacts)))
    if missing:
        found.append(Violation("count", stretch.first_row, (), float(stretch.time_s[0]), missing, 0.0))
    found = found or _broken_order(stretch)
    if not found:  # else the discs can't be followed
        flights = build_flights(start, stretch, gravity_m_s2)
        found += _broken_history(start, stretch, flights)
        found += _broken_impacts(start, stretch, flights, report)
        found += find_law_violations(start, stretch, flights, contact_duration_s, report)
        rests = find_resting(start, stretch, flights)
        found += find_end_violations(stretch, rests)
        found += _broken_state(start, stretch, flights, rests)
        # Where the law is broken speeds have no bound: each disc may be near all others, and squares overflow.
        if all(one.rule != "law" for one in found):
            for overlap in (disc_overlaps(start, stretch, flights), wall_overlaps(start, flights)):
                report.pairs += overlap.pairs
                found += _too_deep(start, stretch, overlap, report)
    report.violations += sorted(found, key=lambda one: one.time_s)


def _broken_rows(start: DiscArrays, stretch: Stretch) -> list[Violation]:
    rows = stretch.impacts
    first, second, discs, walls = rows["first"], rows["second"], len(start.radius_m), len(start.walls)
    valid = (first >= 0) & (first < discs) & (second >= -walls) & (second < discs) & (first != second)
    immovable = np.append(np.isinf(start.mass_kg), True)  # a wall, at -1, is
    valid &= ~(immovable[np.where(valid, first, -1)] & immovable[np.where(valid & (second >= 0), second, -1)])
    # Discs in the order of their numbers, which all that reads a trace may count on.
    valid &= (second < 0) | (first < second)
    for name in rows.dtype.names or ():
        valid &= np.isfinite(rows[name]).all(axis=tuple(range(1, rows[name].ndim)))
    if stretch.spins is not None:
        for name in stretch.spins.dtype.names or ():
            valid &= np.isfinite(stretch.spins[name])
    return [build_violation("row", stretch, k, 1.0, 0.0) for k in np.flatnonzero(~valid).tolist()]


def _broken_order(stretch: Stretch) -> list[Violation]:
    time = stretch.impacts["time_s"]
    look = np.repeat(np.arange(len(stretch.looks) - 1), np.diff(stretch.looks))
    late = np.maximum(np.append(stretch.time_s[0], time[:-1]), stretch.time_s[look]) - time
    late = np.maximum(late, time - stretch.time_s[look + 1])
    return [build_violation("order", stretch, k, float(late[k]), 0.0) for k in np.flatnonzero(~(late <= 0.0)).tolist()]


def _spin_of_flights(stretch: Stretch, flights: Flights) -> Floats:
    """Return the spin of the disc of each flight, as its impacts, or the look, left it."""
    spin = np.zeros(len(flights.disc))
    spin[flights.first] = require_value(stretch.spin_rad_s)[:-1]
    for side, name in enumerate(("first_after", "second_after")):
        k = np.flatnonzero(flights.after[:, side] >= 0)
        spin[flights.after[k, side]] = require_value(stretch.spins)[name][k]
    return spin


def _broken_spin_history(start: DiscArrays, stretch: Stretch, flights: Flights) -> list[Violation]:
    if stretch.spins is None:
        return []
    spin, found = _spin_of_flights(stretch, flights), []
    frozen = np.append(~start.movable | np.isinf(start.inertia), True)  # a wall, at -1, is
    for side, name in enumerate(("first", "second")):
        before, after = stretch.spins[f"{name}_before"], stretch.spins[f"{name}_after"]
        known = flights.after[:, side]
        expected = np.where(known >= 0, spin[known - 1], 0.0)
        wrong = (before != expected) | (frozen[np.maximum(stretch.impacts[name], -1)] & (after != 0.0))
        found += [
            build_violation("history", stretch, k, float(abs(before[k] - expected[k])), 0.0)
            for k in np.flatnonzero(wrong).tolist()
        ]
    return found


def _broken_history(start: DiscArrays, stretch: Stretch, flights: Flights) -> list[Violation]:
    found = []
    for side, name in enumerate(("velocity_first_before", "velocity_second_before")):
        k = np.flatnonzero(flights.after[:, side] >= 0)
        known = flights.after[k, side] - 1
        before = np.ascontiguousarray(stretch.impacts[name][k])
        after = np.stack(flights.velocity(known, flights.end_s[known] - flights.begin_s[known]), axis=1)
        wrong = _differ(before, after, flights.velocity_error(known))
        size, bound = np.abs(before - after).max(axis=1, initial=0.0), flights.velocity_error(known)
        found += [
            build_violation("history", stretch, int(k[w]), float(size[w]), float(bound[w]))
            for w in np.flatnonzero(wrong)
        ]
    found += _broken_spin_history(start, stretch, flights)
    wall = stretch.impacts["second"] < 0
    for name in ("velocity_second_before", "velocity_second_after"):
        moving = np.flatnonzero(wall & stretch.impacts[name].any(axis=1)).tolist()
        found += [build_violation("history", stretch, k, 1.0, 0.0) for k in moving]
    return found


def _differ(one: Floats, other: Floats, bound: Floats) -> NDArray[np.bool_]:
    """Return which vectors, shape ``(m, 2)``, are further apart than their bound; bit for bit where that is 0."""
    bits = np.ascontiguousarray(one).view(np.int64) != np.ascontiguousarray(other).view(np.int64)
    apart: NDArray[np.bool_] = np.where(bound > 0.0, ~(np.hypot(*(one - other).T) <= bound), np.any(bits, axis=1))
    return apart


def _broken_impacts(start: DiscArrays, stretch: Stretch, flights: Flights, report: Report) -> list[Violation]:
    """Check touch, approach and normal of all impacts.

    At the instant that a solver finds, its two bodies touch up to three errors. The motion of both to one instant adds
    8 u S each. The root and its sum with the clock round by 4 u T + u T, and the difference, distance and sum of radii
    here by 4 u R. The normal is off by what its ends are, over R, and some roundings of its own.
    """
    rows, time = stretch.impacts, stretch.impacts["time_s"]
    first, second = rows["first"], rows["second"]
    hit = second >= 0
    wall = np.array(start.walls, np.float64).reshape(-1, 4)
    wall = np.append(wall, [[0.0, 0.0, 1.0, 0.0]], axis=0)[np.where(hit, -1, -1 - second)]
    ended = flights.after - 1
    (ax, ay, a_error, a_size), (bx, by, b_error, b_size) = (
        _at_end(flights, np.where(ended[:, side] >= 0, ended[:, side], 0)) for side in (0, 1)
    )
    depth = (ax - wall[:, 0]) * wall[:, 2] + (ay - wall[:, 1]) * wall[:, 3]
    dx = np.where(hit, bx - ax, -depth * wall[:, 2])
    dy = np.where(hit, by - ay, -depth * wall[:, 3])
    reach = start.radius_m[first] + np.where(hit, start.radius_m[np.where(hit, second, 0)], 0.0)
    size = np.maximum(a_size, np.where(hit, b_size, np.abs(wall[:, :2]).max(axis=1)))
    error = a_error + np.where(hit, b_error, 0.0)

    v1, v2 = rows["velocity_first_before"], rows["velocity_second_before"]
    ux, uy = (v2 - v1).T
    speed = np.hypot(ux, uy)
    distance = np.where(hit, np.hypot(dx, dy), depth)
    gap = distance - reach
    bound = error + UNIT * (16 * size + 5 * time * speed + 4 * reach)
    bodies = np.stack([first, second], axis=1)
    look = np.repeat(np.arange(len(stretch.looks) - 1), np.diff(stretch.looks))
    off = _since_look(start, stretch, bodies, look, -gap, bound)
    report.worst_gap = max(report.worst_gap, largest_ratio(off, bound))
    found = find_violations("contact", stretch, np.abs(off), bound)

    apart = np.maximum(np.hypot(dx, dy), np.finfo(float).tiny)
    nx, ny = rows["normal"].T
    # A disc that falls back to its wall has the speed that it left with, not that of the velocity recorded.
    known = flights.velocity_error(np.where(ended[:, 0] >= 0, ended[:, 0], 0)) * ~hit
    found += find_violations("approach", stretch, ux * nx + uy * ny, speed * (2 * bound / apart + 8 * UNIT) + known)
    off = np.hypot(nx - np.where(hit, dx / apart, -wall[:, 2]), ny - np.where(hit, dy / apart, -wall[:, 3]))
    found += find_violations("normal", stretch, off, np.where(hit, 2 * bound / apart, 0.0) + 8 * UNIT)
    return found


def _broken_state(start: DiscArrays, stretch: Stretch, flights: Flights, rests: Rests | None) -> list[Violation]:
    found = []
    last = flights.last
    x, y, error, size = _at_end(flights, last.ravel())
    speed = flights.speed_m_s[last.ravel()]
    seen = stretch.position_m[1:].reshape(-1, 2)
    off = np.hypot(seen[:, 0] - x, seen[:, 1] - y)
    end = np.repeat(stretch.time_s[1:], last.shape[1])
    bound = error + UNIT * (16 * size + 4 * speed * end)
    every = last.ravel()
    velocity = np.stack(flights.velocity(every, flights.end_s[every] - flights.begin_s[every]), axis=-1)
    known = rounding = flights.velocity_error(every)
    if rests is not None:
        known = rounding.copy()
        known[-len(rests.speed_m_s) :] += rests.speed_m_s
    same = ~_differ(velocity, stretch.velocity_m_s[1:].reshape(-1, 2), known).reshape(last.shape)
    if stretch.spin_rad_s is not None:
        due = _spin_of_flights(stretch, flights)[last]
        same &= due == stretch.spin_rad_s[1:]
        if rests is not None:
            n = len(start)
            moved = velocity[-n:], stretch.velocity_m_s[-1]
            same[-1] |= rests.landed(start, moved, (due[-1], stretch.spin_rad_s[-1]), rounding[-n:])
    for k in np.flatnonzero(~(off <= bound) | ~same.ravel()):
        body = (int(k % last.shape[1]),)
        found.append(Violation("state", -1, body, float(end[k]), float(off[k]), float(bound[k])))
    return found


def _too_deep(start: DiscArrays, stretch: Stretch, overlap: Overlap, report: Report) -> list[Violation]:
    bodies, time, bound = overlap.bodies, overlap.time_s, overlap.bound_m
    depth = _since_look(start, stretch, bodies, overlap.look, overlap.depth_m, bound)
    report.worst_overlap = max(report.worst_overlap, largest_ratio(depth, bound))
    return [
        Violation(
            "passed", -1, (int(bodies[k, 0]), int(bodies[k, 1])), float(time[k]), float(depth[k]), float(bound[k])
        )
        for k in np.flatnonzero(~(depth <= bound))
    ]


def _since_look(
    start: DiscArrays, stretch: Stretch, bodies: Ranks, looks: Ranks, depth: Floats, bound: Floats
) -> Floats:
    """Return by how much overlaps have become deeper since the last look at the state, where they exceed their bound.

    In an inelastic collapse two discs meet any number of times without moving away, and each flight's rounding adds to
    the one before. What was there at the last look has been checked; later arrivals are bounded like all others. There
    may be several looks at one instant.
    """
    deep = np.flatnonzero(depth > bound)
    look = looks[deep]
    first, second = bodies[deep].T
    x, y = stretch.position_m[look, first].T
    hit = second >= 0
    dx, dy = (stretch.position_m[look, np.where(hit, second, 0)] - stretch.position_m[look, first]).T
    then = start.radius_m[first] + start.radius_m[np.where(hit, second, 0)] - np.hypot(dx, dy)
    for k, (qx, qy, nx, ny) in enumerate(start.half_planes()):
        at_wall = start.radius_m[first] - ((x - qx) * nx + (y - qy) * ny)
        then = np.where(second == -1 - k, at_wall, then)
    since = depth.copy()
    since[deep] -= np.maximum(then, 0.0)
    return since


def _at_end(flights: Flights, k: Ranks) -> tuple[Floats, Floats, Floats, Floats]:
    """Return x, y and the bounds on error and size at the end of flights."""
    x, y = flights.place(k, flights.end_s[k] - flights.begin_s[k])
    return x, y, flights.error_m[k], flights.size_m[k]
