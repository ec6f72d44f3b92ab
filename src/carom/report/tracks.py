"""Paths of the discs of a trace: tracks for replays and computations, and lines for pictures.

A track is stored as few points (knots). A disc flies freely from one knot to the next.
Between two knots, a disc moves on the straight line or, under gravity, on the parabola through both knots: ``p(t) = p_a
+ (p_b - p_a) (t - a) / (b - a) + g (t - a) (t - b) / 2``. So a knot consists of only a time and a position, and paths
never jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.model.flights import Flight, free_flights
from carom.model.scene import Scene
from carom.model.trace import Trace, turn_times

Array = NDArray[np.float64]

#: A recorded state is omitted if the flight between its neighbours passes the state within this fraction of the scene's
#: extent. The distance is a thousandth of a pixel in a picture of a hundred pixels, and a fiftieth of a pixel in the
#: largest picture.
SHARPNESS = 1e-5
#: Number of pieces into which the sliding of a disc is divided. In each piece, the disc is drawn with constant spin.
#: The error of the drawn angle is at most 1/576 of the angle that the change of spin causes.
_PIECES_OF_A_SLIDE = 12
#: Number of straight pieces with which a parabola is drawn. The pieces differ from the parabola by at most 1/576 of its
#: height, which is less than the width of a line in any picture.
_PIECES_OF_A_PARABOLA = 24


@dataclass(frozen=True)
class Track:
    """The path of one disc as a sequence of free flights.

    Attributes:
        time_s: Times at which flights begin, and the time at which the last flight ends; shape ``(k,)``, ascending.
        position_m: Positions of the disc at these times, shape ``(k, 2)``.
        pull_m_s2: Acceleration in each flight, shape ``(k - 1, 2)``.
    """

    time_s: Array
    position_m: Array
    pull_m_s2: Array

    def positions_at(self, time_s: Array) -> Array:
        """Return the positions of the disc at times within the run, shape ``(len(time_s), 2)``."""
        after = np.searchsorted(self.time_s, time_s, side="right")
        after = np.minimum(np.maximum(after, 1), len(self.time_s) - 1)
        ends = (self.time_s[after - 1], self.time_s[after]), (self.position_m[after - 1], self.position_m[after])
        return _compute_flight(time_s, *ends, self.pull_m_s2[after - 1])

    def convert_to_pull(self, pull_m_s2: Array, near_m: float) -> Track:
        """Convert a track to flights with a given acceleration, with a position error of at most `near_m`."""
        durations_s = np.diff(self.time_s)
        pull_difference = np.hypot(*(self.pull_m_s2 - pull_m_s2).T)
        count = np.maximum(1, np.ceil(durations_s * np.sqrt(pull_difference / (8.0 * near_m)))).astype(int)
        begins = self.time_s[:-1]
        pieces = [begins[k] + durations_s[k] * np.arange(n) / n for k, n in enumerate(count.tolist())]
        times = np.append(np.concatenate(pieces), self.time_s[-1])
        return Track(times, self.positions_at(times), np.tile(pull_m_s2, (len(times) - 1, 1)))


def _compute_flight(
    time_s: Array,
    ends_s: tuple[Array | float, Array | float],
    ends_m: tuple[Array, Array],
    pull_m_s2: Array,
) -> Array:
    """Return positions at times, shape ``(k, 2)``. For each time, the flight's ends and acceleration are given."""
    (begin, end), (first, last) = ends_s, ends_m
    with np.errstate(invalid="ignore", divide="ignore"):  # a flight without a duration ends where it begins
        part = np.where(end > begin, (time_s - begin) / (end - begin), 0.0)[:, None]
    bulge = 0.5 * ((time_s - begin) * (time_s - end))[:, None] * pull_m_s2
    return first * (1.0 - part) + last * part + bulge


@dataclass(frozen=True)
class Turning:
    """The angle of one disc over time. Between two successive stored times, the angle changes at a constant rate.

    Attributes:
        time_s: Times of the start, of impacts of the disc, of changes of its spin while it slides or rolls, and of the
            end; shape ``(k,)``, ascending.
        angle_rad: The angle at these times relative to the start, counterclockwise, shape ``(k,)``.
    """

    time_s: Array
    angle_rad: Array

    def angle_at(self, time_s: float) -> float:
        """Return the angle at a time within the run, in radians."""
        return float(np.interp(time_s, self.time_s, self.angle_rad))


def compute_turnings(trace: Trace) -> tuple[Turning, ...]:
    """Compute the angle of each disc over time from the trace's own spins; empty if no disc turns.

    While the spin of a disc is unknown (NaN), the disc's angle is constant.
    """
    if trace.spins is None:
        return ()
    turned = turn_times(trace)
    knots = [[(0.0, 0.0)] for _ in trace.scene.discs]
    spin = trace.scene.arrays.spins.tolist()
    rate = [0.0] * len(spin)

    def turn(disc: int, time_s: float) -> None:
        since, angle = knots[disc][-1]
        later = max(since, time_s) if np.isfinite(time_s) else since
        pieces = _PIECES_OF_A_SLIDE if rate[disc] else 1
        for passed in ((later - since) * (k + 1) / pieces for k in range(pieces)):
            knots[disc].append((since + passed, angle + (spin[disc] + 0.5 * rate[disc] * passed) * passed))
        spin[disc] += rate[disc] * (later - since)

    modes = [] if trace.modes is None else list(trace.modes[::-1])

    def change_before(impacts: int) -> None:
        while modes and modes[-1]["impacts"] <= impacts:
            mode = modes.pop()
            disc = int(mode["disc"])
            turn(disc, float(mode["time_s"]))
            spin[disc], rate[disc] = float(mode["spin"]), float(mode["spin_rate"])

    for k in np.argsort(turned, kind="stable").tolist():
        change_before(k)
        for side in ("first", "second"):
            disc = int(trace.impacts[side][k])
            if disc >= 0:
                turn(disc, float(turned[k]))
                after = float(trace.spins[f"{side}_after"][k])
                spin[disc] = after if np.isfinite(after) else 0.0
    change_before(len(turned))
    for disc in range(len(knots)):
        turn(disc, trace.end_time_s)
    return tuple(Turning(*np.array(of_disc).T) for of_disc in knots)


def build_reference_tracks(trace: Trace) -> tuple[Track, ...]:
    """Return the free flights of each disc between impacts. The flights are exact if the method takes no steps."""
    discs = trace.scene.discs
    times = [[0.0] for _ in discs]
    places = [[np.array(disc.position_m, dtype=np.float64)] for disc in discs]
    pulls: list[list[Array]] = [[] for _ in discs]
    for flight in free_flights(trace):
        for time_s in _compute_knot_times(flight):
            times[flight.disc].append(time_s)
            places[flight.disc].append(flight.position_at(time_s))
            pulls[flight.disc].append(flight.pull_m_s2)
    return tuple(Track(*map(np.array, of_disc)) for of_disc in zip(times, places, pulls, strict=True))


def _compute_knot_times(flight: Flight) -> list[float]:
    """Return the times of a flight's knots. With damping, a flight needs several knots.

    With a damping rate c and a time h between two knots, a disc of speed v has an error of up to `c v h^2 / 8`. The
    error must be at most `SHARPNESS` times the flight's length. When the remaining path is shorter than this limit, the
    disc is drawn at rest.
    """
    duration_s, rate = flight.end_s - flight.begin_s, flight.damping.per_s
    undamped_s, begin_s = flight.damping.to_undamped(duration_s), flight.begin_s
    if not rate * duration_s > SHARPNESS:
        return [flight.end_s]
    moving_s = min(duration_s, -math.log(SHARPNESS) / rate)
    count = math.ceil(moving_s * math.sqrt(rate / (8.0 * SHARPNESS * undamped_s)))
    return [*(begin_s + moving_s * k / count for k in range(1, count)), flight.end_s]


def build_observed_tracks(trace: Trace, extent_m: float) -> tuple[Track, ...]:
    """Return tracks through the recorded states, or tracks computed from the impacts.

    Tracks are computed from the impacts if no states are recorded, or if these tracks pass through all states.

    If a method advances to the instants of impacts, discs change direction between two recorded states. For such a
    method, tracks from impacts are better than tracks from states.

    Args:
        trace: The run.
        extent_m: Size of the drawing. The largest error is `SHARPNESS` times this size.
    """
    impact_tracks = build_reference_tracks(trace)
    if (sampled := list_sampled_positions(trace)) is None:
        return tuple(map(_cut_at_non_finite, impact_tracks))
    times, places = sampled
    near = SHARPNESS * extent_m
    if all(_has_states(track, times, places[:, disc], near) for disc, track in enumerate(impact_tracks)):
        return impact_tracks
    pulls = list_flight_pulls(trace.scene)
    return tuple(_thin_track(times, places[:, k], pull, near) for k, pull in enumerate(pulls))


def list_flight_pulls(scene: Scene) -> list[Array]:
    """Return the acceleration of each disc while it flies freely."""
    return [np.array((0.0, 0.0) if disc.immovable else scene.gravity_m_s2) for disc in scene.discs]


def list_sampled_positions(trace: Trace) -> tuple[Array, Array] | None:
    """Return the times and positions of a trace's samples and of its end; None if there are no samples.

    The last step may end after the scene. A sample after the end of the scene is omitted, and the final state is used
    instead.
    """
    samples = trace.samples
    if samples is None or not len(samples.time_s):
        return None
    inside = samples.time_s < trace.end_time_s
    times = np.append(samples.time_s[inside], trace.end_time_s)
    return times, np.concatenate([samples.position_m[inside], trace.final_position_m[None]])


def _cut_at_non_finite(track: Track) -> Track:
    """Return a track up to its first NaN or infinite number. After its last point, the disc is drawn at rest."""
    known = np.isfinite(track.time_s) & np.isfinite(track.position_m).all(axis=1)
    count = len(known) if known.all() else int(known.argmin())
    return Track(track.time_s[:count], track.position_m[:count], track.pull_m_s2[: count - 1])


def _has_states(track: Track, times: Array, places: Array, near: float) -> bool:
    """Return whether a track passes through all given states; False if the track contains NaN or infinite numbers."""
    away = np.abs(track.positions_at(times) - places)
    return bool(np.isfinite(away).all() and away.max() <= near)


def _thin_track(times: Array, places: Array, pull: Array, near: float) -> Track:
    """Return a track through a few of the states. The other states are at most `near` away from the track."""
    finite = np.isfinite(places).all(axis=1)
    times, places = times[finite], places[finite]

    def measure_errors(first: int, last: int) -> Array:
        ends = (times[first], times[last]), (places[first], places[last])
        flight = _compute_flight(times[first : last + 1], *ends, pull)
        errors: Array = np.abs(flight - places[first : last + 1]).max(axis=1)
        return errors

    chosen = select_points(len(times), measure_errors, near)
    return Track(times[chosen], places[chosen], np.tile(pull, (len(chosen) - 1, 1)))


def select_points(count: int, measure_errors: Callable[[int, int], Array], most: float) -> list[int]:
    """Return the indices of a few points whose connecting lines pass near all other points (Douglas-Peucker).

    Args:
        count: Number of points.
        measure_errors: Function that takes the indices of two points, connects these two points, and returns how far
            these points and all points between them are from the connection.
        most: Largest allowed distance of a point from the connection.
    """
    selected, pending = [0], [(0, count - 1)]
    while pending:
        first, last = pending.pop()
        errors = measure_errors(first, last)
        if last - first > 1 and errors.max() > most:
            worst = first + int(errors.argmax())
            pending += [(worst, last), (first, worst)]
        else:
            selected.append(last)
    return selected


@dataclass(frozen=True)
class Paths:
    """The paths of a trace's discs, and its impacts, for drawing.

    Attributes:
        lines: For each disc, times and positions of its centre, shapes ``(k,)`` and ``(k, 2)``.
        impacts: For each disc, times of its impacts and its positions at these times, with the same shapes.
        turned: Rotation of each disc over time; empty if no disc turns.
        sampled: Whether the points of the lines are the positions at the recorded steps.
    """

    lines: tuple[tuple[Array, Array], ...]
    impacts: tuple[tuple[Array, Array], ...] = ()
    turned: tuple[Turning, ...] = ()
    sampled: bool = False

    def compute_bounds(self) -> tuple[Array, Array]:
        """Return the smallest and the largest coordinates of all centres."""
        points = np.concatenate([points for _, points in self.lines])
        points = points[np.isfinite(points).all(axis=1)]
        return points.min(axis=0), points.max(axis=0)


def build_exact_paths(trace: Trace) -> Paths:
    """Return the paths between impacts, computed from the trace's velocities.

    The paths are exact if the method takes no steps, but computes the times of impacts.

    With gravity, a flight is a parabola, which is drawn as a chain of short lines.
    """
    tracks = build_reference_tracks(trace)
    impact_times = _group_by_disc(trace, trace.impacts["time_s"])
    impacts = tuple((times, track.positions_at(times)) for times, track in zip(impact_times, tracks, strict=True))
    return Paths(tuple(map(_build_line, tracks)), impacts, compute_turnings(trace))


def _build_line(track: Track) -> tuple[Array, Array]:
    pieces = np.where(track.pull_m_s2.any(axis=1), _PIECES_OF_A_PARABOLA, 1).tolist()
    flights = zip(track.time_s[:-1].tolist(), np.diff(track.time_s).tolist(), pieces, strict=True)
    times = np.array(
        [begin + duration_s * (k / n) for begin, duration_s, n in flights for k in range(n)] + [track.time_s[-1]]
    )
    return times, track.positions_at(times)


def _group_by_disc(trace: Trace, time_s: Array) -> list[Array]:
    """Return for each disc the times of its impacts. `time_s` contains the times of all impacts."""
    first, second = trace.impacts["first"], trace.impacts["second"]
    return [time_s[(first == disc) | (second == disc)] for disc in range(len(trace.scene.discs))]


def build_observed_paths(trace: Trace) -> Paths:
    """Return lines through the recorded states, with the position of each impact on its disc's line.

    Without recorded states, return exact paths.
    """
    if (sampled := list_sampled_positions(trace)) is None:
        return build_exact_paths(trace)
    times, positions = sampled
    lines = tuple((times, positions[:, disc]) for disc in range(positions.shape[1]))
    impacts = tuple(
        (time_s, np.stack([np.interp(time_s, times, axis) for axis in points.T], axis=-1))
        for time_s, (_, points) in zip(_group_by_disc(trace, turn_times(trace)), lines, strict=True)
    )
    return Paths(lines, impacts, compute_turnings(trace), sampled=True)


def compute_extent(trace: Trace) -> float:
    """Return the larger side of the bounding box of a trace's discs, in metres."""
    low, high = build_exact_paths(trace).compute_bounds()
    return float(np.max(high - low)) + 2.0 * max(disc.radius_m for disc in trace.scene.discs)
