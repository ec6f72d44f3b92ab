"""Adapter of Carom's own PIC, the predicted instant of collision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import (
    AdapterError,
    ContactTimes,
    Engine,
    Profile,
    Scene,
    Setting,
    Stamp,
    World,
    require_supported,
)
from carom.engines.api.helpers import AliasedProfiles
from carom.model.trace import PROFILE_ALIASES, Outcome
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run
from carom_adapters.recorded_world import CAPABILITIES, Array, RecordedWorld


class PicWorld(RecordedWorld):
    """A PIC run that is observed after each step of `dt_s`."""

    def __init__(self, run: Run, settings: Mapping[str, Setting]) -> None:
        super().__init__(run, settings)
        self._dt_s = float(settings["dt_s"])
        self._steps = 0

    def advance(self, steps: int) -> None:
        """Advance the run by `steps` steps, and compute all impacts in these steps."""
        self._steps += steps
        outcome = self._run.advance_to(self._steps * self._dt_s)
        # Lasting contact is not a failure. After lasting contact has begun, the state stays the same and is not
        # compared.
        if outcome is not Outcome.COMPLETED and not outcome.in_contact:
            self._warning = outcome.value

    def take_quiet_steps(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> int:
        """Take steps until a step has an impact or a warning; see `carom.engines.api.QuietWorld`."""
        steps, is_complete = 0, False
        if isinstance(self._run, EventDrivenRun):
            steps, is_complete = self._run.observe_steps(
                self._steps + 1, self._dt_s, position_m, velocity_m_s, spin_rad_s
            )
            self._steps += steps
        if is_complete:
            return steps
        return steps + super().take_quiet_steps(position_m[steps:], velocity_m_s[steps:], spin_rad_s[steps:])


class PicAdapter:
    """PIC in two forms: event-driven, and frame by frame, which is Algorithm 2 of the source paper."""

    name = "pic"
    engine = Engine("Carom")
    capabilities = replace(
        CAPABILITIES, contact_times=ContactTimes.SOLVED, stamp=Stamp.INSTANT, continuous_detection=True
    )
    profiles: Mapping[str, Profile] = AliasedProfiles(
        {
            "frame-by-frame": Profile(
                "The source paper's Algorithm 2 (also called default): after each impact, PIC predicts "
                "the impacts of all pairs again.",
                lambda dt_s: {"dt_s": dt_s, "form": "framewise"},
            ),
            "event-driven": Profile(
                "PIC without frames (also called tuned): after each impact, PIC predicts again only the "
                "impacts of the discs involved.",
                lambda dt_s: {"dt_s": dt_s, "form": "event-driven"},
            ),
        },
        PROFILE_ALIASES["pic"],
    )

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build a PIC run, and predict its first impacts.

        Raises:
            AdapterError: A setting has an unknown name, or the scene needs a feature that is not declared.
        """
        for setting in settings:
            if setting not in {"dt_s", "form"}:
                raise AdapterError(f"pic: no setting {setting!r}; the settings are dt_s and form")
        require_supported("pic", scene, self.capabilities, float(settings["dt_s"]))
        return PicWorld(start_pic_run(scene, all_pairs=settings["form"] == "framewise"), settings)


adapter = PicAdapter()
