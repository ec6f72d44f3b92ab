"""The line that each disc of a trace draws, and where the discs stand at its impacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.trace import Trace

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
    scene = trace.scene
    gravity = np.array(scene.gravity_m_s2)
    pieces = _PIECES_OF_A_PARABOLA if gravity.any() else 1
    times = [[0.0] for _ in scene.discs]
    points = [[np.array(disc.position_m, dtype=np.float64)] for disc in scene.discs]
    velocity = [np.array(disc.velocity_m_s, dtype=np.float64) for disc in scene.discs]

    def fly_to(disc: int, end_s: float) -> None:
        """Add the flight of a disc from its last point; its velocity becomes that at the end."""
        begin_s, begin = times[disc][-1], points[disc][-1]
        pull = np.zeros(2) if scene.discs[disc].immovable else gravity
        for piece in range(1, pieces + 1):
            flown = (end_s - begin_s) * piece / pieces
            times[disc].append(end_s if piece == pieces else begin_s + flown)
            points[disc].append(begin + velocity[disc] * flown + 0.5 * pull * flown**2)
        velocity[disc] = velocity[disc] + pull * (end_s - begin_s)

    stands = []
    for impact in trace.impacts:
        time = float(impact["time_s"])
        for body, after in _discs_of(impact):
            fly_to(body, time)
            velocity[body] = after
            stands.append(Stand(body, time, points[body][-1]))
    for disc in range(len(scene.discs)):
        fly_to(disc, trace.end_time_s)
        points[disc][-1] = trace.final_position_m[disc]
    lines = tuple((np.array(times[i]), np.array(points[i])) for i in range(len(scene.discs)))
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
        stands += [Stand(body, time, paths.at(body, time)) for body, _ in _discs_of(impact)]
    return Paths(lines, tuple(stands), positions, times)


def _discs_of(impact: np.void) -> Iterator[tuple[int, NDArray[np.float64]]]:
    for body, after in (("first", "velocity_first_after"), ("second", "velocity_second_after")):
        if impact[body] >= 0:
            yield int(impact[body]), impact[after]
