"""Paths of the discs of a trace, and their positions at impacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from carom.model.trace import Trace, turn_times
from carom.report.tracks import Array, Track, Turning, build_reference_tracks, compute_turnings, list_sampled_positions

#: Number of straight pieces with which a parabola is drawn. The pieces differ from the parabola by at most 1/576 of its
#: height, which is less than the width of a line in any picture.
_PIECES_OF_A_PARABOLA = 24


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
