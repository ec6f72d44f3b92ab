"""An engine that is a program, behind the seam: what `carom.engines.api.Adapter` asks for, answered over two pipes."""

from __future__ import annotations

import atexit
import math
from collections.abc import Mapping
from functools import cached_property
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
from carom.engines.protocol.manifest import Manifest, ProgramProfile, load_manifest
from carom.engines.protocol.messages import (
    Close,
    Cut,
    Done,
    Look,
    Prepare,
    Prepared,
    Restore,
    Save,
    Saved,
    Seen,
    Step,
    Stepped,
    Touched,
    Touching,
)
from carom.engines.protocol.process import Program
from carom.errors import AdapterError
from carom.model.scene import Scene
from carom.model.trace import Setting


class ProgramWorld:
    """A world that lives in the program; its clock is the program's own.

    Attributes:
        settings: The settings that the program says it uses.
        seconds: Seconds that all steps have taken so far, as the program measured them: pipes are no part of them.
    """

    def __init__(self, program: Program, scene: Scene, settings: Mapping[str, Setting]) -> None:
        prepared = program.ask(Prepare(scene=scene, settings=dict(settings)), Prepared)
        self._program, self._number = program, prepared.world
        self.settings: Mapping[str, Setting] = prepared.settings
        self.seconds = 0.0

    def advance(self, steps: int) -> None:
        """Take `steps` steps."""
        self.seconds += self._program.ask(Step(world=self._number, steps=steps), Stepped).seconds

    def observe(self) -> Observation:
        """Return the present state and the contacts of the last step."""
        told = self._program.ask(Look(world=self._number), Seen)
        contacts = tuple(
            Contact(
                contact.first,
                contact.second,
                contact.time_s,
                contact.normal,
                contact.impulse_n_s,
                tangential_impulse_n_s=contact.tangential_impulse_n_s,
            )
            for contact in told.contacts
        )
        return Observation(
            np.array(told.position_m, dtype=np.float64),
            np.array(told.velocity_m_s, dtype=np.float64),
            contacts,
            told.warning,
            None if told.spin_rad_s is None else np.array(told.spin_rad_s, dtype=np.float64),
        )

    def cut(self, dt_s: float) -> None:
        """Make the coming steps `dt_s` seconds long."""
        self._program.ask(Cut(world=self._number, dt_s=dt_s), Done)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of bodies that the engine's own contact test finds in contact now."""
        return frozenset(self._program.ask(Touching(world=self._number), Touched).pairs)

    def save(self) -> object:
        """Return whatever `restore` needs."""
        return self._program.ask(Save(world=self._number), Saved).state

    def restore(self, state: object) -> None:
        """Come back to a state that `save` returned."""
        self._program.ask(Restore(world=self._number, state=state), Done)

    def close(self) -> None:
        """Let the program forget this world; one that has ended has."""
        if not self._program.ended:
            self._program.ask(Close(world=self._number), Done)


class ProgramAdapter:
    """The adapter of the engine that a manifest describes. The program is started by the first world, and kept.

    Attributes:
        manifest: What describes it.
        folder: Where that lies.
        name: The name given to ``--engine``.
        engine: The engine.
        capabilities: What it can do.
        profiles: Its profiles by name.
        knobs: Settings that may be searched, and how far, by name.
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

    @cached_property
    def profiles(self) -> Mapping[str, Profile]:
        """Profiles by name."""
        return {name: _profile(profile) for name, profile in self.manifest.profiles.items()}

    def unavailable(self) -> str:
        """Return why the program can't be started here, empty where it can."""
        return self.manifest.missing(self.folder)

    def version(self) -> str:
        """Return the engine's version as the manifest or the npm package has it; may be empty."""
        return self.manifest.version_from(self.folder)

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> ProgramWorld:
        """Build the scene in the program, which is started where it does not run.

        Raises:
            AdapterError: The scene is beyond what is declared, or the program refuses, fails or ends.
        """
        known = {name: None for profile in self.manifest.profiles.values() for name in profile.settings}
        require_sound(self.engine.name, scene, settings, [*known, *self.knobs])
        for name, setting in settings.items():
            if isinstance(setting, float) and not math.isfinite(setting):
                raise AdapterError(f"{self.engine.name}: {name} must be finite, as JSON's numbers are, got {setting}")
        require_supported(self.engine.name, scene, self.capabilities, float(settings["dt_s"]))
        if self._program is None or self._program.ended:
            self._program = self._started()
            atexit.register(self._program.end)
        return ProgramWorld(self._program, scene, settings)

    def _started(self) -> Program:
        try:
            return Program(self.name, self.manifest.command_from(self.folder))
        except AdapterError as error:
            relative = [word for word in self.manifest.command if not word.startswith((".", "/"))]
            beside = next((word for word in relative if (self.folder / word).is_file()), "")
            if not beside:
                raise
            hint = f"it runs in an empty folder, and {beside} next to its manifest is to be written ./{beside}"
            hints = [*error.hints, f"{hint}: see docs/reference/engine-protocol.md#the-manifest"]
            raise AdapterError(error.message, hints=hints) from error


def _profile(profile: ProgramProfile) -> Profile:
    def settings(dt_s: float) -> Mapping[str, Setting]:
        return {**profile.settings, "dt_s": dt_s}

    return Profile(
        profile.description, settings, profile.accuracy, profile.located, profile.capabilities, profile.changed
    )


def program_adapter(path: Path | str) -> ProgramAdapter:
    """Return the adapter of the engine that a manifest describes: all that a package of such an engine needs.

    Args:
        path: The manifest.

    Raises:
        AdapterError: There is no such file, or it is no manifest.
    """
    path = Path(path)
    return ProgramAdapter(load_manifest(path), path.resolve().parent)
