"""Adapter of Carom's own PIC, the predicted instant of collision."""

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
    Stamp,
    require_supported,
)
from carom.model.trace import Outcome
from carom.solvers.pic import pic_run
from carom_adapters.recorded_contacts import contacts_since

if TYPE_CHECKING:
    from carom.engines.api import World
    from carom.solvers.run import Run


class PicWorld:
    """A PIC run, observed every `dt_s`. The observations do not change the run."""

    def __init__(self, run: Run, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self._run = run
        self._dt_s = float(settings["dt_s"])
        self._steps = 0
        self._seen = 0
        self._warning = ""

    def advance(self, steps: int) -> None:
        """Advance the run, with all its impacts, to the end of the last step."""
        self._steps += steps
        outcome = self._run.advance_to(self._steps * self._dt_s)
        # Lasting contact is not a failure: the state no longer changes, and the harness scores nothing after it.
        if outcome is not Outcome.COMPLETED and not outcome.in_contact:
            self._warning = outcome.value

    def observe(self) -> Observation:
        """Return the state at the end of the last step, and the impacts since the previous observation."""
        contacts = contacts_since(self._run.log, self._seen)
        self._seen += len(contacts)
        run = self._run
        return Observation(run.positions(), run.velocities(), contacts, self._warning, spin_rad_s=run.spins())

    def close(self) -> None:
        """Nothing to release."""


class PicAdapter:
    """PIC, event-driven (`tuned`) or as the source paper's Algorithm 2 (`default`)."""

    name = "pic"
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
        contact_times=ContactTimes.SOLVED,
        stamp=Stamp.INSTANT,
        continuous_detection=True,
        spin=True,
        friction=(0.0, sys.float_info.max),
        tangential_restitution=True,
    )
    profiles: Mapping[str, Profile] = {
        "default": Profile(
            "The source paper's Algorithm 2: frame by frame, with every pair solved again after each impact.",
            lambda dt_s: {"dt_s": dt_s, "form": "framewise"},
        ),
        "tuned": Profile(
            "Event-driven: no frames, only the discs of an impact are predicted again.",
            lambda dt_s: {"dt_s": dt_s, "form": "event-driven"},
        ),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Predict the first impacts.

        Raises:
            AdapterError: There is no such setting, or the scene needs what is not declared.
        """
        for setting in settings:
            if setting not in {"dt_s", "form"}:
                raise AdapterError(f"pic: no setting {setting!r}; there are: dt_s, form")
        require_supported("pic", scene, self.capabilities, float(settings["dt_s"]))
        run = pic_run(scene, all_pairs=settings["form"] == "framewise")
        return PicWorld(run, settings)


adapter = PicAdapter()
