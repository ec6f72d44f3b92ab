"""Adapter of Carom's own PIT, the periodic interference test."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import AdapterError, Engine, Profile, Scene, Setting, World, require_supported
from carom.engines.api.helpers import AliasedProfiles
from carom.model.trace import PROFILE_ALIASES
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import FrameRun, start_pit_run
from carom_adapters.recorded_world import CAPABILITIES, Array, RecordedWorld


class PitWorld(RecordedWorld):
    """A PIT run with one frame every `dt_s`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        super().__init__(start_pit_run(scene, FrameClock(step_s=float(settings["dt_s"]))), settings)

    def advance(self, steps: int) -> None:
        """Test for impacts and move the discs, frame by frame. Frames in which no bodies can touch are skipped."""
        self._run.advance_frames(steps)

    def take_quiet_steps(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> int:
        """Take steps until a step has an impact; see `carom.engines.api.QuietWorld`."""
        steps = 0
        if isinstance(self._run, FrameRun):
            steps = self._run.observe_frames(position_m, velocity_m_s, spin_rad_s)
        return steps or super().take_quiet_steps(position_m, velocity_m_s, spin_rad_s)

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of tests and frames so far, by name."""
        counts: Mapping[str, int] = self._run.counts
        return counts


class PitAdapter:
    """PIT, exactly as Algorithm 1 of the source paper. PIT has one form, and no settings that can be tuned."""

    name = "pit"
    engine = Engine("Carom")
    capabilities = CAPABILITIES
    profiles: Mapping[str, Profile] = AliasedProfiles(
        {"tuned": Profile("The source paper's Algorithm 1, without settings to tune.", lambda dt_s: {"dt_s": dt_s})},
        PROFILE_ALIASES["pit"],
    )

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build a PIT run that begins at the initial state of the scene.

        Raises:
            AdapterError: A setting has an unknown name, or the scene needs a feature that is not declared.
        """
        for setting in settings:
            if setting != "dt_s":
                raise AdapterError(f"pit: no setting {setting!r}; the only setting is dt_s")
        require_supported("pit", scene, self.capabilities, float(settings["dt_s"]))
        return PitWorld(scene, settings)


adapter = PitAdapter()
