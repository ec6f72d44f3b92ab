"""The line that each disc of a trace draws, and where the discs stand at its impacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.trace import Trace, free_flights

__all__ = ["Paths", "Stand", "exact_paths", "observed_paths"]

#: The chord of a 24th of a parabola leaves it by 1/576 of its sagitta: less than a line's width in any picture.
_PIECES_OF_A_PARABOLA = 24


@dataclass(frozen=True)
class Stand:
    """A disc at the instant of one of its impacts."""

    disc: int
    time_s: float
    position_m: NDArray[np.float64]


@dataclass(frozen=True)
class Paths:
    """What there is to draw of a trace.

    Attributes:
        lines: For each disc its times and centres, shapes ``(k,)`` and ``(k, 2)``.
        stands: Each disc at each of its impacts.
        frame_positions: Centres at the steps looked at, shape ``(k, n, 2)``; None where the trace has no steps.
        frame_times: The times of these steps.
    """

    lines: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]
    stands: tuple[Stand, ...]
    frame_positions: NDArray[np.float64] | None = None
    frame_times: NDArray[np.float64] | None = None

    def at(self, disc: int, time_s: float) -> NDArray[np.float64]:
        """Return where a disc is, on its line."""
        times, points = self.lines[disc]
        return np.array([np.interp(time_s, times, points[:, axis]) for axis in (0, 1)])

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the least and the greatest coordinates of all centres."""
        points = np.concatenate([points for _, points in self.lines])
        points = points[np.isfinite(points).all(axis=1)]
        return points.min(axis=0), points.max(axis=0)


def exact_paths(trace: Trace) -> Paths:
    """Return the free flights from impact to impact, by the trace's own velocities: exact for a trace without steps.

    A free flight is straight without gravity, and a parabola with it, drawn as a chain of short lines.
    """
    pieces = _PIECES_OF_A_PARABOLA if any(trace.scene.gravity_m_s2) else 1
    times = [[0.0] for _ in trace.scene.discs]
    points = [[np.array(disc.position_m, dtype=np.float64)] for disc in trace.scene.discs]
    stands = []
    for flight in free_flights(trace):
        for time in np.linspace(flight.begin_s, flight.end_s, pieces + 1)[1:].tolist():
            times[flight.disc].append(time)
            points[flight.disc].append(flight.at(time))
        if flight.impact < len(trace.impacts):
            stands.append(Stand(flight.disc, flight.end_s, points[flight.disc][-1]))
    for disc, place in enumerate(trace.final_position_m):
        points[disc][-1] = place
    lines = tuple((np.array(times[i]), np.array(points[i])) for i in range(len(points)))
    return Paths(lines, tuple(stands))


def observed_paths(trace: Trace) -> Paths:
    """Return lines through the sampled states, with the impacts where the paths turned; exact ones without samples."""
    samples = trace.samples
    if samples is None or not len(samples.time_s):
        return exact_paths(trace)
    # The last step may reach beyond the scene's end; the final state is that at the end.
    inside = samples.time_s < trace.end_time_s
    times = np.append(samples.time_s[inside], trace.end_time_s)
    positions = np.concatenate([samples.position_m[inside], trace.final_position_m[None]])
    lines = tuple((times, positions[:, disc]) for disc in range(positions.shape[1]))
    paths = Paths(lines, (), positions, times)
    effective = trace.impacts["time_s"] if trace.effective_time_s is None else trace.effective_time_s
    stands = []
    for impact, turned in zip(trace.impacts, effective, strict=True):
        time = float(turned if np.isfinite(turned) else impact["time_s"])
        discs = [int(impact[side]) for side in ("first", "second") if impact[side] >= 0]
        stands += [Stand(disc, time, paths.at(disc, time)) for disc in discs]
    return Paths(lines, tuple(stands), positions, times)
