"""Consistency of a run: contradictions between its reported impacts and its own states.

Section 5 of `docs/theory/scoring.md` lists the checks and the allowed deviations. The checks need no reference, so they
also apply beyond a horizon.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from carom.comparator.scales import Array, Scales, compute_lengths, compute_own_scales, find_largest
from carom.comparator.slowing import Slowing
from carom.comparator.thresholds import THRESHOLDS
from carom.model.scene import Wall
from carom.model.trace import Trace, rim_speeds, velocities, wall_index


@dataclass(frozen=True, slots=True)
class Deviation:
    """The largest deviation of one kind, and the disc and time at which it was found.

    Attributes:
        size: The deviation, divided by the scene's greatest speed or by its largest radius.
        disc: Number of the disc.
        since_s: Time of the impact at which the disc's free flight began, in seconds; 0 for a flight from the start.
    """

    size: float = 0.0
    disc: int = 0
    since_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Consistency:
    """Sizes of the contradictions between a run's reported impacts and its states.

    If nothing can be checked, all sizes are 0.

    Attributes:
        velocity: Largest change of a velocity between impacts, or after the last one, divided by the scene's greatest
            speed.
        spin: Largest change of a disc's rim speed (spin times radius) between impacts, divided by the scene's greatest
            disc or rim speed; 0 if no disc spins.
        position: Largest distance of a disc from the position that its own velocities imply, divided by the largest
            radius.
        excess: The part of `position` that is not explained by moving overlapping bodies apart. At each end of a
            flight, moving a disc by up to the depth that bodies can overlap after one step is allowed.
        stamp_s: Largest time, in seconds, by which the time stamp of an impact is outside of the run or of the step
            that reported the impact.
        across: Largest velocity change perpendicular to the normal at an impact, divided by the scene's greatest speed.
            If the velocity change has the wrong sign along the normal, the whole change counts.
        normal_rad: Angle between normal and velocity change at the impact that determines `across`, in radians.
        normal_length: Largest difference between a normal's length and 1.
        momentum: Largest change of the velocity of two discs' centre of mass at their impact, divided by the scene's
            greatest speed.
        angular: Largest change of a disc's angular momentum about the point of contact at an impact; 0 if no disc
            spins. The change is divided by the disc's mass, its radius and the scene's greatest disc or rim speed.
        angular_excess: The part of `angular` that is not explained by the overlap gained in a step.
        arm: The distance from the disc's centre at which friction seems to act, divided by the disc's radius. The
            impact with the largest change of angular momentum determines this value. NaN if there was no friction.
        strayed: Like `position`, but divided by the largest coordinate that the disc can reach, because rounding errors
            are proportional to this coordinate.
        strayed_excess: The largest `excess`, also divided by the largest coordinate that the disc can reach.
        unchecked: Number of free flights that are not checked, because a disc had several contacts in one step or the
            flight ends after the compared range.
    """

    velocity: Deviation
    spin: Deviation
    position: Deviation
    excess: Deviation
    stamp_s: float
    across: float
    normal_rad: float
    normal_length: float
    momentum: float
    angular: float
    angular_excess: float
    arm: float
    strayed: float
    strayed_excess: float
    unchecked: int


def measure_consistency(trace: Trace, scales: Scales, until_s: float = math.inf) -> Consistency:
    """Measure the contradictions between a run's reported impacts and its states.

    Only times up to `until_s` are checked, because there is no free flight after a disc comes to rest.
    """
    flights = np.concatenate(list(_iterate_flights(trace, until_s)), axis=1)
    disc, since_s, velocity_error, spun, position_error, allowed = flights
    reach = compute_own_scales(trace).reach_m[disc.astype(np.intp)]

    def find_worst(sizes: Array) -> Deviation:
        known = np.where(np.isnan(sizes), 0.0, sizes)  # NaN: the flight can't be followed; see `unchecked`
        worst_row = int(np.argmax(known))
        if not known[worst_row] > 0.0:
            return Deviation()
        return Deviation(float(known[worst_row]), int(disc[worst_row]), float(since_s[worst_row]))

    across, normal_rad = _measure_normal_error(trace, scales)
    angular, excess, arm = _measure_angular_error(trace) if trace.spins is not None else (0.0, 0.0, math.nan)
    return Consistency(
        velocity=find_worst(velocity_error / scales.speed_m_s),
        spin=find_worst(spun / scales.rim_m_s),
        position=find_worst(position_error / scales.length_m),
        excess=find_worst((position_error - allowed) / scales.length_m),
        stamp_s=_measure_stamp_error(trace),
        across=across,
        normal_rad=normal_rad,
        normal_length=float(np.max(np.abs(np.hypot(*trace.impacts["normal"].T) - 1.0), initial=0.0)),
        momentum=_measure_momentum_error(trace) / scales.speed_m_s,
        angular=angular / scales.rim_m_s,
        angular_excess=excess / scales.rim_m_s,
        arm=arm,
        strayed=find_worst(position_error / reach).size,
        strayed_excess=find_worst((position_error - allowed) / reach).size,
        unchecked=int(np.isnan(velocity_error).sum()),
    )


def _iterate_flights(trace: Trace, until_s: float) -> Iterator[Array]:
    """For each disc, yield an array of shape ``(6, k)`` with a column for each of the disc's k free flights.

    A free flight ends at an impact of the disc or at the end of the run. The rows are the disc, the time at which the
    flight begins, and the deviations of velocity, rim speed and position at the flight's end. Deviations are NaN if the
    flight can't be followed. The last row is the largest distance by which the engine may have moved an overlapping
    disc at the two ends of the flight together.
    """
    impacts, count = trace.impacts, len(trace.impacts)
    bodies = np.concatenate([impacts["first"], impacts["second"]])
    order = np.lexsort((np.tile(np.arange(count), 2), bodies))
    first_of = np.searchsorted(bodies[order], np.arange(len(trace.scene.discs) + 1))
    turning = find_turn_times(trace)
    begin_s = turning - trace.dt_s if trace.state_before is None else trace.state_before["time_s"]
    before, after = velocities(impacts, "before"), velocities(impacts, "after")
    closing = np.hypot(*(before[1] - before[0]).T)
    arrivals, departures = before.reshape(-1, 2), after.reshape(-1, 2)
    places = _compute_turn_places(trace, turning).reshape(-1, 2)
    rims_arriving, rims_leaving = rim_speeds(trace, "before").ravel(), rim_speeds(trace, "after").ravel()
    start, slowing = trace.scene.arrays, Slowing.of(trace.scene)
    rims_end = np.zeros(len(start)) if trace.final_spin_rad_s is None else start.radius_m * trace.final_spin_rad_s
    for number, disc in enumerate(trace.scene.discs):
        if disc.legs:  # a disc with a prescribed path changes its velocity without impacts
            continue
        rows = order[first_of[number] : first_of[number + 1]]
        own_impacts = rows % max(count, 1)
        time = np.concatenate([[0.0], turning[own_impacts], [trace.end_time_s]])
        leaving = np.concatenate([[disc.velocity_m_s], departures[rows]])
        arriving = np.concatenate([arrivals[rows], [trace.final_velocity_m_s[number]]])
        place = np.concatenate([[disc.position_m], places[rows], [trace.final_position_m[number]]])
        duration_s = np.diff(time)
        kept_fraction, flown_s = _compute_slowing(slowing, duration_s, np.hypot(*leaving.T))
        change = arriving - leaving * kept_fraction[:, None]
        rim_leaving = np.concatenate([start.surface_speed_m_s[[number]], rims_leaving[rows]])
        rim_arriving = np.concatenate([rims_arriving[rows], rims_end[[number]]])
        spun = np.abs(rim_arriving - rim_leaving * kept_fraction)
        path_error = _compute_path_errors(place, leaving * flown_s[:, None])
        allowed = trace.dt_s * np.concatenate([[0.0], closing[own_impacts], [0.0]])
        gx, gy = (0.0, 0.0) if disc.immovable else trace.scene.gravity_m_s2
        pull = math.hypot(gx, gy)
        if pull > 0.0:
            along, across = np.array([gx, gy]) / pull, np.array([-gy, gx]) / pull
            # Velocities are known at step boundaries only. So gravity may act up to two steps longer than the flight,
            # because contacts begin and end within steps.
            most_change = pull * (time[1:] + trace.dt_s - np.concatenate([[0.0], begin_s[own_impacts]]))
            beyond = np.maximum(np.maximum(-pull * trace.dt_s - change @ along, change @ along - most_change), 0.0)
            velocity_error, distance = np.hypot(change @ across, beyond), np.abs(path_error @ across)
        else:
            velocity_error, distance = np.hypot(*change.T), np.hypot(*path_error.T)
            # An engine may move a slowed disc at a constant speed during a step. At the end of the step, the disc is
            # then off its exact path by up to half of the lost speed times the step size.
            distance = np.maximum(distance - 0.5 * trace.dt_s * np.hypot(*leaving.T) * (1.0 - kept_fraction), 0.0)
        followed = np.isfinite(duration_s) & (time[1:] <= until_s)
        deviations = (np.where(followed, deviation, math.nan) for deviation in (velocity_error, spun, distance))
        yield np.stack([np.full(len(duration_s), number), time[:-1], *deviations, allowed[:-1] + allowed[1:]])


def _compute_slowing(slowing: Slowing, duration_s: Array, speed: Array) -> tuple[Array, Array]:
    """Return the fraction of each flight's initial speed that is left, and the distance divided by this speed."""
    if not slowing:
        return np.ones_like(duration_s), duration_s
    flights = list(zip(duration_s.tolist(), speed.tolist(), strict=True))
    kept_fraction = np.array([slowing.compute_kept_fraction(*flight) for flight in flights])
    return kept_fraction, np.array([slowing.compute_flown_time(*flight) for flight in flights])


def find_turn_times(trace: Trace) -> Array:
    """Return the time at which each impact changed the paths of its bodies; NaN if this time is unknown."""
    times: Array = trace.impacts["time_s"] if trace.effective_time_s is None else trace.effective_time_s
    return times


def _compute_turn_places(trace: Trace, turning: Array) -> Array:
    """Return the positions of both bodies when each impact changed their paths, shape ``(2, m, 2)``; NaN if unknown."""
    state = trace.state_before
    if state is None:
        return np.full((2, len(trace.impacts), 2), math.nan)
    before = velocities(trace.impacts, "before")
    waited = np.broadcast_to(turning - state["time_s"], (2, len(turning)))
    slowing = Slowing.of(trace.scene)
    if slowing:  # only the velocity at the impact is known, so follow the flight backwards
        speed = compute_lengths(before)
        flown = [
            _compute_slowing(slowing, -duration_s, fast)[1] for duration_s, fast in zip(waited, speed, strict=True)
        ]
        waited = -np.array(flown)
        if slowing.table_m_s2:  # the earlier path of a disc that has stopped is not known
            waited = np.where(speed > 0.0, waited, math.nan)
    places: Array = np.stack([state["position_first"], state["position_second"]]) + before * waited[..., None]
    return places


def _compute_path_errors(place: Array, displacement: Array) -> Array:
    """Return each position minus its prediction from the previous known position, shape ``(k, 2)``; NaN if unknown.

    Args:
        place: Positions of the disc at the start, at each impact and at the end, shape ``(k + 1, 2)``; NaN if unknown.
        displacement: Displacements between successive positions that the disc's own velocities imply, shape ``(k, 2)``;
            NaN if unknown.
    """
    unknown = np.asarray(np.isnan(displacement).any(axis=1))
    gaps = np.concatenate([[0], np.cumsum(unknown)])
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(np.where(unknown[:, None], 0.0, displacement), axis=0)])
    known = ~np.asarray(np.isnan(place).any(axis=1))
    anchor = np.maximum.accumulate(np.where(known, np.arange(len(place)), 0))[:-1]
    later_rows = np.arange(1, len(place))
    error_m: Array = place[later_rows] - (place[anchor] + (path[later_rows] - path[anchor]))
    # An overflowed distance counts as infinite, not NaN.
    error_m = np.where(known[later_rows, None] & np.isnan(error_m), math.inf, error_m)
    return np.where((gaps[later_rows] == gaps[anchor])[:, None], error_m, math.nan)


def _measure_stamp_error(trace: Trace) -> float:
    stamp = trace.impacts["time_s"]
    outside = np.maximum(-stamp, stamp - trace.end_time_s - trace.dt_s)  # the last step may reach beyond the end
    if trace.state_before is not None:
        waited = stamp - trace.state_before["time_s"]
        outside = np.maximum(outside, np.maximum(-waited, waited - trace.dt_s))
    return find_largest(outside[outside > 0.0], default=0.0)


def _measure_normal_error(trace: Trace, scales: Scales) -> tuple[float, float]:
    """Return the largest unexplained velocity change perpendicular to the normal, and an angle at the same impact.

    The returned change is divided by the scene's greatest speed. The returned angle is between the whole velocity
    change of this impact and the normal. Without friction and gravity, the relative velocity changes only along the
    normal. At a half-plane wall, the whole change counts as a change along the normal of the wall itself. Friction adds
    a perpendicular change of at most the coefficient of friction times the normal change. Gravity adds a change if it
    acts on only one of the bodies. If a disc has several contacts in one step, their velocity changes can't be
    separated and are not checked.
    """
    impacts, second, movable = trace.impacts, trace.impacts["second"], trace.scene.arrays.movable
    changes = velocities(impacts, "after") - velocities(impacts, "before")
    change = changes[1] - changes[0]
    size, friction = np.hypot(*change.T), trace.scene.arrays.friction_of(second)
    for k in np.flatnonzero(second < 0).tolist():
        if isinstance(wall := trace.scene.walls[wall_index(int(second[k]))], Wall):
            change[k], friction[k] = -size[k] * np.array(wall.normal), 0.0
    normal = _compute_unit_normals(trace)
    along, across = np.sum(change * normal, axis=1), _compute_cross_products(change, normal)
    has_one_movable = (second >= 0) & (movable[impacts["first"]] != movable[np.maximum(second, 0)])
    pulled = np.where(has_one_movable, _compute_gravity_across(trace, impacts["normal"]), 0.0)
    error_m_s = np.where(along > 0.0, np.maximum(across - friction * along - pulled, 0.0), size)
    error_m_s = np.where(np.isfinite(find_turn_times(trace)), error_m_s, 0.0)
    if not len(error_m_s):
        return 0.0, 0.0
    worst_row = int(np.argmax(error_m_s))
    return float(error_m_s[worst_row]) / scales.speed_m_s, math.atan2(float(across[worst_row]), float(along[worst_row]))


def _compute_unit_normals(trace: Trace) -> Array:
    length = np.hypot(*trace.impacts["normal"].T)
    normal: Array = trace.impacts["normal"] / np.where(length > 0.0, length, 1.0)[:, None]
    return normal


def _compute_gravity_across(trace: Trace, normal: Array) -> Array:
    """Return the largest velocity (m/s) that gravity may add perpendicular to the normal during each contact."""
    gravity = np.broadcast_to(np.array(trace.scene.gravity_m_s2), normal.shape)
    return _compute_cross_products(gravity, normal) * _compute_contact_durations(trace)


def _measure_momentum_error(trace: Trace) -> float:
    """Return the largest velocity change of two discs' centre of mass at an impact, in metres per second.

    The velocity that gravity adds during the contact is allowed. If a disc has several contacts in one step, none of
    these contacts is checked.
    """
    impacts = trace.impacts
    mass = trace.scene.arrays.mass_kg
    first, second = mass[impacts["first"]], mass[np.maximum(impacts["second"], 0)]
    is_known = (impacts["second"] >= 0) & np.isfinite([first, second, find_turn_times(trace)]).all(axis=0)
    changes = velocities(impacts, "after") - velocities(impacts, "before")
    share = 1.0 / (1.0 + second / first)  # the first mass, divided by the sum of both masses; NaN if both are infinite
    centre = share[:, None] * changes[0] + (1.0 - share)[:, None] * changes[1]
    error_m_s = np.hypot(*centre.T) - math.hypot(*trace.scene.gravity_m_s2) * _compute_contact_durations(trace)
    return find_largest(error_m_s[is_known & ~(error_m_s <= 0.0)], default=0.0)


def _measure_angular_error(trace: Trace) -> tuple[float, float, float]:
    """Return the largest change of angular momentum about a contact, its unexplained part, and friction's lever arm.

    The angular momentum is divided by mass and radius, so it is in metres per second. An impulse at the contact has no
    moment about the contact. So friction changes two quantities of the first body by the same amount: the velocity
    perpendicular to the normal, and ``k R w`` (inertia factor k, radius R, spin w). For the second body, the change has
    the opposite sign. Two effects of checking once per step are allowed. First, bodies that are found in contact
    already overlap, so friction's lever arm is shorter than the radius. Second, the normal turns during a contact of
    several steps. The velocity that gravity adds perpendicular to the normal is also allowed. If a disc has several
    contacts in one step, none of these contacts is checked. Walls with rolling resistance are not checked either,
    because this resistance changes angular momentum.
    """
    impacts, start = trace.impacts, trace.scene.arrays
    before, after = velocities(impacts, "before"), velocities(impacts, "after")
    change, spun = after - before, rim_speeds(trace, "after") - rim_speeds(trace, "before")
    normal = _compute_unit_normals(trace)
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    closing = np.hypot(*(before[1] - before[0]).T)
    pulled = _compute_gravity_across(trace, normal)
    known, duration_s = np.isfinite(find_turn_times(trace)), _compute_contact_durations(trace)
    if trace.scene.wall_rolling_resistance:
        known &= impacts["second"] >= 0
    # If a contact acts in a single step, `duration_s` is at most three steps.
    lasting = (impacts["second"] >= 0) & (duration_s > 3.0 * trace.dt_s * (1.0 + THRESHOLDS.rounding))
    bodies = np.stack([impacts["first"], impacts["second"]])
    discs = np.maximum(bodies, 0)
    inertia, radius = start.inertia[discs], start.radius_m[discs]
    from_velocity = np.array([[1.0], [-1.0]]) * np.sum(change * tangent, axis=2)
    from_spin = inertia * spun  # NaN for discs that can't turn, which are excluded below
    is_checked = known & (bodies >= 0) & start.movable[discs] & np.isfinite(inertia)
    error = np.where(is_checked, np.maximum(np.abs(from_spin - from_velocity) - pulled, 0.0), 0.0)
    shorter = (from_spin * from_velocity >= 0.0) & (np.abs(from_spin) <= np.abs(from_velocity))
    explained = np.where(shorter, np.abs(from_velocity) * closing * trace.dt_s / radius, 0.0)
    explained += np.where(lasting, compute_lengths(change) * closing * duration_s / radius, 0.0)
    excess = float(np.max(error - explained, initial=0.0))
    if not np.any(error > 0.0):
        return 0.0, excess, math.nan
    worst = np.unravel_index(np.argmax(error), error.shape)
    arm = float(from_spin[worst] / from_velocity[worst]) + 0.0 if from_velocity[worst] else math.nan
    return float(error[worst]), excess, arm


def _compute_contact_durations(trace: Trace) -> Array:
    """Return each contact's longest possible duration: a step, plus twice the time from step start to impact."""
    duration_s = np.full(len(trace.impacts), trace.dt_s)
    if trace.state_before is not None:
        waited = find_turn_times(trace) - trace.state_before["time_s"]
        duration_s += np.where(waited > 0.0, 2.0 * waited, 0.0)
    return duration_s


def _compute_cross_products(a: Array, b: Array) -> Array:
    """Return the magnitude of the cross product of the two vectors in each row, shape ``(m,)``."""
    size: Array = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return size
