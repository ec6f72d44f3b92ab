"""Runs of scenes with damping: the undamped run, seen in the time of clocks. See `carom.damping`.

Nothing new is solved: PIC goes as far as the damped discs get, and its instants and velocities are mapped back. PIT
looks at the frames of the clock, at which its discs are as far as the damped ones.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from carom.damping import Damping
from carom.solvers.options import ALWAYS, require_goal
from carom.solvers.pit.frames import PlainFrameLoop
from carom.trace import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from carom.solvers.options import RunOptions
    from carom.solvers.pit.clock import FrameClock
    from carom.solvers.run import Progress, Run, RunImpacts, Start
    from carom.solvers.units import Units

    Array = NDArray[np.float64]


def damping_in(units: Units, damping_per_s: float) -> Damping:
    """Return a rate of damping in units of a run's own, or the greatest number if they have none for it."""
    return Damping(min(units.a_second(damping_per_s), sys.float_info.max))


def undamped_options(options: RunOptions, damping: Damping) -> RunOptions:
    """Return the options of the undamped run; a contact time is not there with damping."""
    if options.window_s == ALWAYS:
        return replace(options, contact_duration_s=0.0)
    begin, end = options.window_s
    # The least that is mapped to the window's begin is the float after the greatest that is mapped before it.
    least = -math.inf if begin <= 0.0 else math.nextafter(damping.latest(math.nextafter(begin, -math.inf)), math.inf)
    return replace(options, contact_duration_s=0.0, window_s=(least, end if end < 0.0 else damping.latest(end)))


class DampedRun:
    """A `carom.solvers.run.Run` by PIC with damping.

    Args:
        run: The run without it, at its start.
        damping: What slows the discs down.
    """

    def __init__(self, run: Run, damping: Damping) -> None:
        self.time_s = 0.0
        self.log = _DampedLog(run.log, lambda: map(damping.damped, run.log.array()["time_s"].tolist()), damping)
        self._run = run
        self._damping = damping

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of how the run was done."""
        return self._run.notes

    @property
    def counts(self) -> dict[str, int]:
        """Work so far, by name."""
        return self._run.counts

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc so far, with discs and walls, shape ``(n,)``."""
        return self._run.impacts_per_disc()

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Carry out every impact up to and including `time_s`, or until there have been `max_impacts` in all.

        Raises:
            InputError: One of the two is none, see `carom.solvers.options.require_goal`.
        """
        require_goal(time_s, max_impacts)
        look = None if progress is None else lambda impacts, time: progress(impacts, self._damping.damped(time))
        goal_s = time_s if time_s < 0.0 else self._damping.latest(time_s)
        outcome = self._run.advance_to(goal_s, max_impacts, look)
        completed = outcome is Outcome.COMPLETED and time_s < math.inf
        self.time_s = max(self.time_s, time_s if completed else self._damping.damped(self._run.time_s))
        return outcome

    def positions(self) -> Array:
        """Return the centres now, metres, shape ``(n, 2)``."""
        return self._run.positions()

    def velocities(self) -> Array:
        """Return the velocities now, metres a second, shape ``(n, 2)``."""
        return self._run.velocities() * self._damping.kept(self.time_s)

    def spins(self) -> Array | None:
        """Return the spins now, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        spins = self._run.spins()
        return None if spins is None else spins * self._damping.kept(self.time_s)


class _DampedLog:
    """The impacts of a run without damping, seen with it: as `carom.solvers.run.RunImpacts`.

    Args:
        log: The impacts without it.
        times_s: Returns when they are, by the clock.
        damping: What slows the discs down.
    """

    def __init__(self, log: RunImpacts, times_s: Callable[[], Iterable[float]], damping: Damping) -> None:
        self.ambiguous = log.ambiguous
        self.edges = log.edges
        self.modes = log.modes  # none: with damping there is no gravity
        self._log = log
        self._times_s = times_s
        self._damping = damping

    def __len__(self) -> int:
        return len(self._log)

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only array of `carom.trace.IMPACT_DTYPE`."""
        rows = self._slowed(self._log.array())
        rows.flags.writeable = True
        rows["time_s"] = np.fromiter(self._times_s(), np.float64, len(rows))
        rows.flags.writeable = False
        return rows

    def spins(self) -> NDArray[np.void] | None:
        """Return their spins as a read-only array of `carom.trace.SPIN_DTYPE`; None if no disc spins."""
        spins = self._log.spins()
        return None if spins is None else self._slowed(spins)

    def _slowed(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        """Return a copy with what is left of velocities and spins: ``1 - c s``, which is ``exp(-c t)`` there."""
        kept = 1.0 - self._damping.per_s * self._log.array()["time_s"]
        slowed = rows.copy()
        for name in rows.dtype.names or ():
            if rows.dtype[name].shape:  # a vector
                slowed[name] = rows[name] * kept[:, None] if name.startswith("velocity") else rows[name]
            elif name.startswith(("first_", "second_")):
                slowed[name] = rows[name] * kept
        slowed.flags.writeable = False
        return slowed


class DampedFrameLoop(PlainFrameLoop):
    """Algorithm 1 with damping: between frames discs move along their exact damped paths.

    Its places and velocities are those without damping, at the undamped times of the frames.
    """

    def __init__(self, start: Start, clock: FrameClock, damping: Damping) -> None:
        super().__init__(start, clock)
        self._damping = damping
        self._found_s = list[float]()

    @property
    def recorded(self) -> RunImpacts:
        """The impacts so far."""
        return _DampedLog(self.log, lambda: self._found_s, self._damping)

    def run(self, until: int, most: int, work: float) -> None:
        """Move every disc to the next frame, and test for interference there."""
        frame_s, before = self.clock.time_s(self.frames), len(self.log)
        super().run(until, most, work)
        self._found_s += [frame_s] * (len(self.log) - before)

    def _moved_s(self) -> float:
        return self._damping.undamped(super()._moved_s())
