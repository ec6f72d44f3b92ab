"""Interface of the runs of all solvers, and a base class of runs whose units or damping are converted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from carom.core.extension import find_extension_notes
from carom.model.disc_arrays import DiscArrays
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace

#: Function called at intervals with the number of impacts and the time so far, in seconds.
Progress = Callable[[int, float], None]
#: Function that converts rows of impacts, spins or modes.
SeenRows = Callable[["NDArray[np.void]"], "NDArray[np.void]"]


class Start(Protocol):
    """Start of a run: a scene, or a scene converted to other units by `carom.solvers.units`."""

    @property
    def arrays(self) -> DiscArrays:
        """The discs and walls as arrays."""

    @property
    def gravity_m_s2(self) -> tuple[float, float]:
        """Uniform gravity."""

    @property
    def wall_rolling_resistance(self) -> float:
        """Coefficient of rolling resistance between discs and walls."""

    @property
    def table_deceleration_m_s2(self) -> float:
        """Deceleration of every disc by a table."""

    @property
    def duration_s(self) -> float:
        """Duration of the scene."""


class RunImpacts(Protocol):
    """The impacts that a run has recorded."""

    def __len__(self) -> int:
        """Return the number of impacts."""

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only array of `trace.IMPACT_DTYPE`, in order."""

    def spins(self) -> NDArray[np.void] | None:
        """Return the spins of impacts as an array of `trace.SPIN_DTYPE`; None if no disc spins."""

    def edges(self) -> NDArray[np.void] | None:
        """Return the wall edges that impacts hit, as `trace.EDGE_DTYPE`; None without finite walls."""

    def modes(self) -> NDArray[np.void] | None:
        """Return changes between flight, sliding, rolling and rest, as `trace.MODE_DTYPE`; None if there are none."""

    def ambiguous(self) -> tuple[int, ...]:
        """Return the rows of impacts that may be simultaneous with an earlier impact of one of their movable discs."""


class Run(Protocol):
    """A run in progress, which can be advanced in any number of pieces without an effect on the result."""

    @property
    def time_s(self) -> float:
        """Time that the run has reached, in seconds since the start."""

    @property
    def log(self) -> RunImpacts:
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
    """A run that wraps another run and converts its units or damping. Subclasses override the methods that convert."""

    def __init__(self, run: Run, rows: SeenRows) -> None:
        self.log = SeenLog(run.log, rows)
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


class SeenLog:
    """The converted impacts of a wrapped run; implements `RunImpacts`.

    Args:
        log: The impacts of the wrapped run.
        rows: Function that converts rows of impacts, spins or modes of the wrapped run.
    """

    def __init__(self, log: RunImpacts, rows: SeenRows) -> None:
        self.ambiguous = log.ambiguous
        self.edges = log.edges
        self._log = log
        self._rows = rows

    def __len__(self) -> int:
        return len(self._log)

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only array of `carom.model.trace.IMPACT_DTYPE`."""
        return self._convert(self._log.array())

    def spins(self) -> NDArray[np.void] | None:
        """Return the spins of impacts as an array of `trace.SPIN_DTYPE`; None if no disc spins."""
        spins = self._log.spins()
        return None if spins is None else self._convert(spins)

    def modes(self) -> NDArray[np.void] | None:
        """Return changes between flight, sliding, rolling and rest, as `trace.MODE_DTYPE`; None if there are none."""
        modes = self._log.modes()
        return None if modes is None else self._convert(modes)

    def _convert(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        converted = self._rows(rows)
        converted.flags.writeable = False
        return converted


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
