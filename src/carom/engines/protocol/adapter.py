"""Adapter of an engine that is a separate program. Messages go through two pipes."""

from __future__ import annotations

import atexit
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from carom.engines.api import (
    Capabilities,
    Contact,
    Engine,
    Knob,
    Observation,
    Profile,
    require_sound,
    require_supported,
)
from carom.engines.protocol import messages
from carom.engines.protocol.manifest import Manifest, ProgramProfile, load_manifest
from carom.engines.protocol.process import Program
from carom.errors import AdapterError
from carom.model.scene import Scene
from carom.model.trace import Setting


class ProgramWorld:
    """A world in the program. The program measures the run time of steps by its own clock.

    Attributes:
        settings: The settings in use, as reported by the program.
        seconds: Total run time of all steps so far, measured by the program. Communication is not included.
    """

    def __init__(self, program: Program, scene: Scene, settings: Mapping[str, Setting]) -> None:
        prepared = program.send_request(messages.Prepare(scene=scene, settings=dict(settings)), messages.Prepared)
        self._program, self._number = program, prepared.world
        self.settings: Mapping[str, Setting] = prepared.settings
        self.seconds = 0.0

    def advance(self, steps: int) -> None:
        """Take `steps` steps."""
        self.seconds += self._program.send_request(
            messages.Step(world=self._number, steps=steps), messages.Stepped
        ).seconds

    def observe(self) -> Observation:
        """Return the present state and the contacts of the last step."""
        answer = self._program.send_request(messages.Look(world=self._number), messages.Seen)
        return Observation(
            np.array(answer.position_m, dtype=np.float64),
            np.array(answer.velocity_m_s, dtype=np.float64),
            tuple(Contact(**dict(contact)) for contact in answer.contacts),
            answer.warning,
            None if answer.spin_rad_s is None else np.array(answer.spin_rad_s, dtype=np.float64),
        )

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps, in seconds."""
        self._program.send_request(messages.Cut(world=self._number, dt_s=dt_s), messages.Done)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of bodies that touch at this time, according to the engine's own contact test."""
        return frozenset(self._program.send_request(messages.Touching(world=self._number), messages.Touched).pairs)

    def save(self) -> object:
        """Return everything that `restore` needs."""
        return self._program.send_request(messages.Save(world=self._number), messages.Saved).state

    def restore(self, state: object) -> None:
        """Return to a state that `save` returned."""
        self._program.send_request(messages.Restore(world=self._number, state=state), messages.Done)

    def close(self) -> None:
        """Close this world in the program, unless the program has ended."""
        if not self._program.ended:
            self._program.send_request(messages.Close(world=self._number), messages.Done)


class ProgramAdapter:
    """Adapter of the engine that a manifest describes. The first world starts the program, and later worlds reuse it.

    Attributes:
        manifest: The manifest.
        folder: Folder of the manifest.
        name: Name for ``--engine``.
        engine: The engine.
        capabilities: Capabilities of the engine.
        profiles: Profiles of the engine, by name.
        knobs: Settings that ``carom tune`` may change, with their ranges, by name.
    """

    def __init__(self, manifest: Manifest, folder: Path) -> None:
        self.manifest, self.folder = manifest, folder
        self._program: Program | None = None
        self.name = manifest.name
        self.engine = Engine(
            manifest.engine or manifest.name, oldest=manifest.oldest, newest_tried=manifest.newest_tried
        )
        self.capabilities: Capabilities = manifest.capabilities
        self.knobs: Mapping[str, Knob] = manifest.knobs
        self.profiles = {name: _build_profile(profile) for name, profile in manifest.profiles.items()}

    def unavailable(self) -> str:
        """Return why the program can't be started on this machine; empty if it can be started."""
        return self.manifest.explain_unavailable(self.folder)

    def version(self) -> str:
        """Return the engine's version from the manifest or the npm package; empty if neither contains it."""
        return self.manifest.find_version(self.folder)

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> ProgramWorld:
        """Build the scene in the program. Start the program if it is not running.

        Raises:
            AdapterError: The capabilities exclude the scene, or the program refuses the scene, fails or ends.
        """
        known = {name: None for profile in self.manifest.profiles.values() for name in profile.settings}
        require_sound(self.engine.name, scene, settings, [*known, *self.knobs])
        for name, setting in settings.items():
            if isinstance(setting, float) and not math.isfinite(setting):
                raise AdapterError(f"{self.engine.name}: {name} must be finite, as JSON requires, got {setting}")
        require_supported(self.engine.name, scene, self.capabilities, float(settings["dt_s"]))
        if self._program is None or self._program.ended:
            self._program = self._start()
            atexit.register(self._program.end)
        return ProgramWorld(self._program, scene, settings)

    def _start(self) -> Program:
        try:
            return Program(self.name, self.manifest.resolve_command(self.folder))
        except AdapterError as error:
            relative = [argument for argument in self.manifest.command if not argument.startswith((".", "/"))]
            neighbour = next((argument for argument in relative if (self.folder / argument).is_file()), "")
            if not neighbour:
                raise
            hint = f"the program runs in an empty folder; write ./{neighbour} for the file next to its manifest"
            hints = [*error.hints, f"{hint}: see docs/reference/engine-protocol.md#the-manifest"]
            raise AdapterError(error.message, hints=hints) from error


def _build_profile(profile: ProgramProfile) -> Profile:
    def settings(dt_s: float) -> Mapping[str, Setting]:
        return {**profile.settings, "dt_s": dt_s}

    return Profile(
        profile.description, settings, profile.accuracy, profile.located, profile.capabilities, profile.changed
    )


def program_adapter(path: Path | str) -> ProgramAdapter:
    """Return the adapter of the engine that a manifest describes.

    An adapter's package needs no other code than this call.

    Args:
        path: Path of the manifest.

    Raises:
        AdapterError: There is no such file, or it is not a valid manifest.
    """
    path = Path(path)
    return ProgramAdapter(load_manifest(path), path.resolve().parent)
