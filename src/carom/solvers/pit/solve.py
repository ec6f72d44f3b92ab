"""PIT runs that can be advanced in pieces, and the function `solve_pit`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from carom.core import pit
from carom.model.damping import UNDAMPED, Damping
from carom.model.scene import Scene, to_scene
from carom.model.trace import EDGE_DTYPE, NO_EDGE, Outcome, Trace
from carom.solvers.options import NO_LIMIT, require_goal
from carom.solvers.pit.clock import FrameClock
from carom.solvers.request import compute_frames
from carom.solvers.rows import RecordedImpacts
from carom.solvers.run import Progress, Start, build_trace
from carom.solvers.units import RunInUnits, Units, run_in_ordinary_units

#: PIT searches around each disc for frames at which no bodies can touch, and skips these frames. PIT stops skipping
#: when the searches have cost more work than they have saved, and the difference is larger than the work of MOST_WASTE
#: searches around all discs. The number is a guess that has not been tuned.
MOST_WASTE = 2.0
#: Number of overlap tests that one call of the compiled code makes, in some hundredths of a second. Between calls, the
#: run reports progress and reacts to Ctrl-C.
_WORK = 2.0**23
#: A recorded contact stores the wall's edge as one number: the number of the edge times this factor, plus the kind of
#: the edge's part. See core/pit/chain_distance.h.
_EDGE_KINDS = 4


class FrameRun:
    """A PIT run in progress; implements `carom.solvers.run.Run`.

    The stored state is that of the last frame so far. States at other times are computed from this state. So pieces of
    a run may end between frames, without an effect on the result.

    Args:
        loop: The compiled loop over the frames.
        clock: Times of the frames.
        edges_of: Function that finds the wall edges of recorded impacts; None without finite walls.
        damping: Damping of the discs.
    """

    def __init__(
        self,
        loop: pit.FrameLoop,
        clock: FrameClock,
        edges_of: Callable[[NDArray[np.void]], NDArray[np.void]] | None = None,
        damping: Damping = UNDAMPED,
    ) -> None:
        self.clock = clock
        self.log = RecordedImpacts(loop, loop.present_spins() is not None, edges_of)
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()
        self._loop = loop
        self._damping = damping

    @property
    def frames(self) -> int:
        """Number of frames so far, including frames that were skipped because no bodies can touch."""
        return self._loop.frames

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of operations so far, by name."""
        return self._loop.counts

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Run every frame before `time_s`, or stop after the frame with impact number `max_impacts`.

        A frame at `time_s` itself is not run. All impacts of a frame are applied, so that a few more than `max_impacts`
        are possible.

        Args:
            time_s: Seconds from the start.
            max_impacts: Number of impacts, counted from the start of the run; None for no limit.
            progress: Function called from time to time with the number of impacts and the time so far.

        Raises:
            InputError: The time is negative or not finite, or `max_impacts` is not a whole number of 0 or more.
        """
        require_goal(time_s, max_impacts)
        outcome = self._advance(self.clock.count_frames_before(time_s), max_impacts, progress)
        self.time_s = max(self.time_s, time_s if outcome is Outcome.COMPLETED else self._last_frame_s)
        return outcome

    def advance_frames(self, frames: int) -> None:
        """Run this many frames, and advance to the time of the next frame."""
        self._advance(self.frames + frames, None, None)
        self.time_s = max(self.time_s, self.clock.time_s(self.frames))

    def observe_frames(
        self, position_m: NDArray[np.float64], velocity_m_s: NDArray[np.float64], spin_rad_s: NDArray[np.float64]
    ) -> int:
        """Run frames until a frame has an impact, and write the state after each frame.

        Return the number of states written. With damping, no states are written, and the number is 0.
        """
        if self._damping.per_s:
            return 0
        clock = self.clock
        frames = self._loop.run_frames(
            clock.step_s, clock.rate_hz, NO_LIMIT, _WORK, position_m, velocity_m_s, spin_rad_s
        )
        self.time_s = max(self.time_s, clock.time_s(self.frames))
        return frames

    def positions(self) -> NDArray[np.float64]:
        """Return the current centres, in metres, shape ``(n, 2)``."""
        return self._loop.states(self._damping.to_undamped(self.time_s))[:, :2].copy()

    def velocities(self) -> NDArray[np.float64]:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""
        velocities = self._loop.states(self._damping.to_undamped(self.time_s))[:, 2:].copy()
        kept_fraction = self._damping.compute_kept_fraction(self.time_s)
        return velocities if kept_fraction == 1.0 else velocities * kept_fraction

    def spins(self) -> NDArray[np.float64] | None:
        """Return the current spins, in rad/s; None if no disc turns."""
        spins = self._loop.present_spins()
        return None if spins is None else spins * self._damping.compute_kept_fraction(self.time_s)

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc, shape ``(n,)``."""
        impacts = self.log.array()
        bodies = np.concatenate([impacts["first"], impacts["second"]])
        return np.bincount(bodies[bodies >= 0], minlength=len(self.positions()))

    @property
    def _last_frame_s(self) -> float:
        return self.clock.time_s(max(0, self.frames - 1))

    def _advance(self, until: int, max_impacts: int | None, progress: Progress | None) -> Outcome:
        while self.frames < until:
            if max_impacts is not None and len(self.log) >= max_impacts:
                return Outcome.MAX_IMPACTS
            self._loop.run(until, NO_LIMIT if max_impacts is None else max_impacts, _WORK)
            if progress is not None:
                progress(len(self.log), self._last_frame_s)
        return Outcome.COMPLETED


def start_pit_run(scene: Scene, clock: FrameClock, *, skipping: bool = True) -> FrameRun | RunInUnits:
    """Return a PIT run at the start of a scene.

    Args:
        scene: The scene.
        clock: Times of the frames.
        skipping: Whether to skip tests that can't find an impact. The choice does not change the result.
    """

    def make(start: Start, units: Units) -> FrameRun:
        damping = units.convert_damping(scene.damping_per_s) if scene.damping_per_s else UNDAMPED
        run_clock = clock.convert_units(units)
        edges_of = None if start.arrays.has_half_planes else build_edges
        loop = pit.FrameLoop(start, run_clock, skipping, MOST_WASTE, damping.per_s)
        return FrameRun(loop, run_clock, edges_of=edges_of, damping=damping)

    run: FrameRun | RunInUnits = run_in_ordinary_units(scene.undamped, make)
    return run


def build_edges(contacts: NDArray[np.void]) -> NDArray[np.void]:
    """Convert recorded contacts to wall edges (`trace.EDGE_DTYPE`): see `recorded_edge` in core/pit/separation.h."""
    edges = np.full(len(contacts), np.array(NO_EDGE, EDGE_DTYPE))
    number, kind = np.divmod(contacts["feature"], _EDGE_KINDS)
    is_edge = contacts["feature"] >= 0
    edges["edge"][is_edge], edges["kind"][is_edge] = number[is_edge], kind[is_edge]
    return edges


def solve_pit(scene: Scene | str, *, frame_rate_hz: float | None = None, skipping: bool = True) -> Trace:
    """Run a scene by PIT.

    PIT checks for overlap at the times ``k / frame_rate_hz`` before `scene.duration_s`, with k = 0, 1, 2, ...

    Args:
        scene: The scene, or its name in the catalogue.
        frame_rate_hz: Frames per second; None for the scene's frame rate.
        skipping: Whether to skip tests that can't find an impact. Only `Trace.counts` depends on `skipping`.

    Raises:
        InputError: The frame rate is not a positive number, or leads to too many frames.

    Examples:
        >>> len(carom.solve_pit("paper/missed", frame_rate_hz=24).impacts)  # misses the impact between two frames
        0
        >>> len(carom.solve_pit("paper/missed", frame_rate_hz=240).impacts)
        1
    """
    scene = to_scene(scene)
    rate, _ = compute_frames(scene, frame_rate_hz)
    clock = FrameClock(rate_hz=rate)
    run = start_pit_run(scene, clock, skipping=skipping)
    outcome = run.advance_to(scene.duration_s)
    return build_trace(run, "pit", scene, outcome, dt_s=clock.frame_s)
