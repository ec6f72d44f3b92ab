"""Adapter of Carom's own PIT, the periodic interference test."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from carom.engines.api import (
    AdapterError,
    Capabilities,
    ContactTimes,
    Engine,
    Observation,
    Profile,
    Scene,
    Setting,
    require_supported,
)
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import pit_run
from carom_adapters.recorded_contacts import contacts_since

if TYPE_CHECKING:
    from carom.engines.api import World


class PitWorld:
    """A PIT run at one frame every `dt_s`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self._run = pit_run(scene, FrameClock(step_s=float(settings["dt_s"])))
        self._seen = 0

    def advance(self, steps: int) -> None:
        """Test and move, frame by frame. Frames in which nothing can touch are skipped."""
        self._run.advance_frames(steps)

    @property
    def counts(self) -> Mapping[str, int]:
        """Work counts so far."""
        return self._run.counts

    def observe(self) -> Observation:
        """Return the state at the present frame, and the impacts since the previous observation."""
        contacts = contacts_since(self._run.log, self._seen)
        self._seen += len(contacts)
        run = self._run
        return Observation(run.positions(), run.velocities(), contacts, spin_rad_s=run.spins())

    def close(self) -> None:
        """Nothing to release."""


class PitAdapter:
    """PIT, exactly the source paper's Algorithm 1. It has one form and nothing to tune."""

    name = "pit"
    engine = Engine("Carom")
    capabilities = Capabilities(
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
    profiles: Mapping[str, Profile] = {
        "default": Profile("The source paper's Algorithm 1.", lambda dt_s: {"dt_s": dt_s}),
        "tuned": Profile("The source paper's Algorithm 1: there is nothing to tune.", lambda dt_s: {"dt_s": dt_s}),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Copy the scene's start.

        Raises:
            AdapterError: There is no such setting, or the scene needs what is not declared.
        """
        for setting in settings:
            if setting != "dt_s":
                raise AdapterError(f"pit: no setting {setting!r}; there is: dt_s")
        require_supported("pit", scene, self.capabilities, float(settings["dt_s"]))
        return PitWorld(scene, settings)


adapter = PitAdapter()
