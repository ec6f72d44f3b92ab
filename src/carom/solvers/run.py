"""Interface of the runs of all solvers, and a base class of runs whose units or damping are converted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from carom.core.extension import find_extension_notes
from carom.model.disc_arrays import DiscArrays
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace, Vector
from carom.solvers.rows import Conversion, RecordedImpacts

#: Function called from time to time with the number of impacts and the time so far, in seconds.
Progress = Callable[[int, float], None]


class ScaledScene(NamedTuple):
    """A scene in the units of `carom.solvers.units`. The fields have the same names as in `Scene`."""

    arrays: DiscArrays
    gravity_m_s2: Vector
    wall_rolling_resistance: float
    table_deceleration_m_s2: float
    duration_s: float


#: The start of a run.
Start = Scene | ScaledScene


class Run(Protocol):
    """A run in progress, which can be advanced in any number of pieces without an effect on the result."""

    @property
    def time_s(self) -> float:
        """Time that the run has reached, in seconds since the start."""

    @property
    def log(self) -> RecordedImpacts:
        """The impacts so far."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the run, for the user."""

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of operations so far, by name."""

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Apply every impact up to and including `time_s`, or stop after `max_impacts` impacts in all.

        Raises:
            InputError: An argument is invalid, see `carom.solvers.options.require_goal`.
        """

    def positions(self) -> NDArray[np.float64]:
        """Return the current centres, in metres, shape ``(n, 2)``."""

    def velocities(self) -> NDArray[np.float64]:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""

    def spins(self) -> NDArray[np.float64] | None:
        """Return the current spins, in rad/s; None if no disc turns."""

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc, shape ``(n,)``."""


class SeenRun:
    """A run that wraps another run and converts its units or damping.

    Subclasses override the methods whose results they convert. The wrapped run must be at its start. From then on, its
    log contains converted rows.
    """

    def __init__(self, run: Run, convert: Conversion) -> None:
        self.log = run.log
        self.log.add_conversion(convert)
        self._run = run

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the run, for the user."""
        return self._run.notes

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of operations so far, by name."""
        return self._run.counts

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc, shape ``(n,)``."""
        return self._run.impacts_per_disc()

    def positions(self) -> NDArray[np.float64]:
        """Return the current centres, in metres, shape ``(n, 2)``."""
        return self._run.positions()


def build_trace(run: Run, method: str, scene: Scene, outcome: Outcome, **extra_fields: Any) -> Trace:
    """Return the trace of a run with its outcome. `extra_fields` are added to the trace, or replace its fields."""
    fields: dict[str, Any] = {
        "impacts": run.log.array(),
        "spins": run.log.spins(),
        "edges": run.log.edges(),
        "modes": run.log.modes(),
        "ambiguous": run.log.ambiguous(),
        "final_position_m": run.positions(),
        "final_velocity_m_s": run.velocities(),
        "final_spin_rad_s": run.spins(),
        "end_time_s": run.time_s,
        "counts": run.counts,
        "notes": (*run.notes, *find_extension_notes()),
    }
    return Trace(method=method, scene=scene, outcome=outcome, **(fields | extra_fields))
