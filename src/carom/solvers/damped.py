"""PIC runs with damping, which convert the results of a run without damping. See `carom.model.damping`.

Discs move along the same paths with and without damping, but at other times and with other velocities.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carom.core import damped_time
from carom.model.damping import Damping
from carom.model.trace import SPIN_DTYPE, Outcome
from carom.solvers.options import ALWAYS, RunOptions, require_goal
from carom.solvers.run import Progress, Run, SeenRun

Array = NDArray[np.float64]


def build_undamped_options(options: RunOptions, damping: Damping) -> RunOptions:
    """Return the options of the run without damping. The contact time is 0: damping does not support the TC model."""
    if options.window_s == ALWAYS:
        return replace(options, contact_duration_s=0.0)
    begin, end = options.window_s
    undamped_begin_s, undamped_end_s = -math.inf, end
    if begin > 0.0:
        # Because of rounding, several undamped times correspond to the same damped time. The window of recorded impacts
        # starts with the smallest of these undamped times.
        undamped_begin_s = math.nextafter(damping.find_latest_undamped(math.nextafter(begin, -math.inf)), math.inf)
    if end >= 0.0:
        undamped_end_s = damping.find_latest_undamped(end)
    return replace(options, contact_duration_s=0.0, window_s=(undamped_begin_s, undamped_end_s))


class DampedRun(SeenRun):
    """A PIC run with damping; implements `carom.solvers.run.Run`.

    Args:
        run: The run without damping, which must be at its start.
        damping: Damping of the scene.
    """

    def __init__(self, run: Run, damping: Damping) -> None:
        super().__init__(run, lambda rows, undamped: _slow_rows(rows, undamped, damping))
        self.time_s = 0.0
        self._damping = damping

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Apply every impact up to and including `time_s`, or stop after `max_impacts` impacts in all.

        Raises:
            InputError: An argument is invalid, see `carom.solvers.options.require_goal`.
        """
        require_goal(time_s, max_impacts)
        report = None if progress is None else lambda impacts, time: progress(impacts, self._damping.to_damped(time))
        goal_s = time_s if time_s < 0.0 else self._damping.find_latest_undamped(time_s)
        outcome = self._run.advance_to(goal_s, max_impacts, report)
        completed = outcome is Outcome.COMPLETED and time_s < math.inf
        self.time_s = max(self.time_s, time_s if completed else self._damping.to_damped(self._run.time_s))
        return outcome

    def velocities(self) -> Array:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""
        return self._run.velocities() * self._damping.compute_kept_fraction(self.time_s)

    def spins(self) -> Array | None:
        """Return the current spins, in rad/s; None if no disc turns."""
        spins = self._run.spins()
        return None if spins is None else spins * self._damping.compute_kept_fraction(self.time_s)


def _slow_rows(rows: NDArray[np.void], undamped: NDArray[np.void], damping: Damping) -> NDArray[np.void]:
    """Convert impacts, or their spins, of the run without damping to those of the run with damping."""
    slowed = rows.copy()
    if rows.dtype == SPIN_DTYPE:
        damped_time.slow_spins(damping.per_s, undamped.view(np.uint8), slowed.view(np.uint8))
    else:
        damped_time.slow_impacts(damping.per_s, slowed.view(np.uint8))
    return slowed
