"""Paths of the discs of a trace, and their positions at impacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carom.model.trace import Trace, turn_times
from carom.report.tracks import Track, Turning, build_reference_tracks, compute_turnings, list_sampled_positions

#: Number of straight pieces with which a parabola is drawn. The pieces differ from the parabola by at most 1/576 of its
#: height, which is less than the width of a line in any picture.
_PIECES_OF_A_PARABOLA = 24


@dataclass(frozen=True)
class ImpactPosition:
    """Position of a disc at the instant of one of its impacts."""

    disc: int
    time_s: float
    position_m: NDArray[np.float64]


@dataclass(frozen=True)
class Paths:
    """The paths of a trace's discs, and its impacts, for drawing.

    Attributes:
        lines: For each disc, times and positions of its centre, shapes ``(k,)`` and ``(k, 2)``.
        impact_positions: Position of each disc at each of its impacts.
        turned: Rotation of each disc over time; empty if no disc turns.
        sampled: Whether the points of the lines are the positions at the recorded steps.
    """

    lines: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]
    impact_positions: tuple[ImpactPosition, ...]
    turned: tuple[Turning, ...] = ()
    sampled: bool = False

    def position_at(self, disc: int, time_s: float) -> NDArray[np.float64]:
        """Return the position of a disc at a time."""
        times, points = self.lines[disc]
        return np.array([np.interp(time_s, times, points[:, axis]) for axis in (0, 1)])

    def compute_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
    turns = _list_turns(trace, trace.impacts["time_s"])
    impact_positions = tuple(
        ImpactPosition(disc, time, tracks[disc].positions_at(np.array([time]))[0]) for disc, time in turns
    )
    return Paths(tuple(map(_build_line, tracks)), impact_positions, compute_turnings(trace))


def _build_line(track: Track) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    pieces = np.where(track.pulls_m_s2.any(axis=1), _PIECES_OF_A_PARABOLA, 1).tolist()
    flights = zip(track.time_s[:-1].tolist(), np.diff(track.time_s).tolist(), pieces, strict=True)
    times = np.array(
        [begin + duration_s * (k / n) for begin, duration_s, n in flights for k in range(n)] + [track.time_s[-1]]
    )
    return times, track.positions_at(times)


def _list_turns(trace: Trace, time_s: NDArray[np.float64]) -> Iterator[tuple[int, float]]:
    """Yield the discs that take part in each impact, with the impact's time."""
    for impact, time in zip(trace.impacts, time_s.tolist(), strict=True):
        yield from ((int(impact[side]), time) for side in ("first", "second") if impact[side] >= 0)


def build_observed_paths(trace: Trace) -> Paths:
    """Return lines through the recorded states, with the position of each impact on its disc's line.

    Without recorded states, return exact paths.
    """
    if (sampled := list_sampled_positions(trace)) is None:
        return build_exact_paths(trace)
    times, positions = sampled
    lines = tuple((times, positions[:, disc]) for disc in range(positions.shape[1]))
    paths = Paths(lines, (), compute_turnings(trace), sampled=True)
    turns = _list_turns(trace, turn_times(trace))
    found = tuple(ImpactPosition(disc, time, paths.position_at(disc, time)) for disc, time in turns)
    return replace(paths, impact_positions=found)


def compute_extent(trace: Trace) -> float:
    """Return the larger side of the bounding box of a trace's discs, in metres."""
    low, high = build_exact_paths(trace).compute_bounds()
    return float(np.max(high - low)) + 2.0 * max(disc.radius_m for disc in trace.scene.discs)
