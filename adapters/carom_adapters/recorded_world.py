"""Base class of the worlds of PIC and PIT, whose runs record all impacts."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import Capabilities, Contact, ContactTimes, Observation, Setting
from carom.solvers.rows import RecordedImpacts

Array = NDArray[np.float64]
#: Capabilities of PIT. PIC also computes the instants of impacts.
CAPABILITIES = Capabilities(
    segments=True,
    arcs=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    belts=True,
    edge_belts=True,
    gravity=True,
    damping=True,
    rolling_resistance=True,
    table_friction=True,
    restitution=(0.0, 1.0),
    contact_times=ContactTimes.STEP,
    spin=True,
    friction=(0.0, sys.float_info.max),
    tangential_restitution=True,
)


class RecordedWorld:
    """A run of PIC or PIT that is observed at the ends of steps. Observations do not change the run."""

    def __init__(self, run: Any, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self._run = run
        self._contacts_read = 0
        self._warning = ""

    def advance(self, steps: int) -> None:
        """Take steps, and compute all impacts in these steps."""
        raise NotImplementedError  # PIC and PIT have different implementations

    def take_quiet_steps(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> int:
        """Take steps until a step has an impact or a warning; see `carom.engines.api.QuietWorld`."""
        run, turns = self._run, self._run.spins() is not None
        for k in range(len(position_m)):
            self.advance(1)
            position_m[k], velocity_m_s[k] = run.positions(), run.velocities()
            if turns:
                spin_rad_s[k] = run.spins()
            if len(run.log) > self._contacts_read or self._warning:
                return k + 1
        return len(position_m)

    def observe(self) -> Observation:
        """Return the state at the end of the last step, and the impacts since the previous observation."""
        contacts = list_contacts_since(self._run.log, self._contacts_read)
        self._contacts_read += len(contacts)
        run = self._run
        return Observation(run.positions(), run.velocities(), contacts, self._warning, spin_rad_s=run.spins())

    def close(self) -> None:
        """Do nothing, because a run holds no resources."""


def list_contacts_since(log: RecordedImpacts, old_count: int) -> tuple[Contact, ...]:
    """Return all impacts except the first `old_count`, each with the velocities before and after the impact."""
    if len(log) == old_count:  # most steps have no impact
        return ()
    impacts, all_spins = log.array()[old_count:].tolist(), log.spins()
    spins = [None] * len(impacts) if all_spins is None else all_spins[old_count:].tolist()
    return tuple(
        Contact(first, second, time_s, (nx, ny), None, ((a, b), (c, d), (e, f), (g, h)), spins_rad_s=spin)
        for (time_s, first, second, (nx, ny), (a, b), (c, d), (e, f), (g, h)), spin in zip(impacts, spins, strict=True)
    )
