"""Class for adapters of engines that are Python packages, and helpers to declare their profiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from carom.engines.api import Accuracy, Capabilities, Engine, Imported, Knob, Profile, Scene, Setting, World

Settings = Mapping[str, Setting]

#: Reason in `Profile.changed` for a setting that differs from the engine's default because the scene determines the
#: setting.
OF_THE_SCENE = "the scene's"
#: Reason in `Profile.changed` for discs that can't turn. Without spin and friction, nothing turns a disc anyway.
NOT_TURNED = "discs cannot turn if the scene has no spin or friction, which changes only rounding errors"

#: Capabilities that most engines have. Each adapter adds further capabilities of its engine.
GENERAL = Capabilities(
    segments=True,
    posts=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    gravity=True,
    restitution=(0.0, 1.0),
)

#: Declared accuracy of a method that has only PIT's errors.
SOUND = Accuracy()


@dataclass(frozen=True)
class EngineAdapter:
    """Adapter of an engine that is a Python package.

    Attributes:
        name: Name for ``--engine``.
        engine: The engine.
        capabilities: Capabilities of the engine.
        knobs: Settings that ``carom tune`` may change, with their ranges, by name.
        profiles: Profiles by name.
        world: Function that builds a world from a scene and settings. The function raises AdapterError if the engine
            does not support the scene or a setting.
        code: Function that writes the same world as code for the engine (`carom.engines.api.CodedAdapter`); None if the
            adapter writes no code.
        read: Function that reads a file of the engine as a scene (`carom.engines.api.ReadingAdapter`); None if the
            adapter reads no files.
    """

    name: str
    engine: Engine
    capabilities: Capabilities
    knobs: Mapping[str, Knob]
    profiles: Mapping[str, Profile]
    world: Callable[[Scene, Settings], World]
    code: Callable[[Scene, Settings, str], str] | None = None
    read: Callable[[bytes, str, float], Imported] | None = None

    def prepare(self, scene: Scene, settings: Settings) -> World:
        """Build a world.

        Raises:
            AdapterError: The engine does not support the scene or a setting.
        """
        return self.world(scene, settings)


def build_engine(name: str, extra: str, module: str, distribution: str = "", **releases: Any) -> Engine:
    """Return the description of an engine that an extra of Carom installs. `distribution` is `module` by default."""
    return Engine(name, module, distribution or module, f"pip install 'carom[{extra}]'", **releases)


def add_step(settings: Settings) -> Callable[[float], Settings]:
    """Return a function that adds a step size to the settings."""
    return lambda dt_s: {"dt_s": dt_s, **settings}


def build_tuned_profile(effect: str, settings: Settings, accuracy: Accuracy = SOUND) -> Profile:
    """Return the profile `tuned`. `effect` describes for users what the settings change."""
    description = f"The most exact fixed-step settings known, from Carom's own measurements: {effect}."
    return Profile(description, add_step(settings), accuracy)


def build_located_profile(
    finder: str, settings: Settings, accuracy: Accuracy = SOUND, but: str = "", then: str = ""
) -> Profile:
    """Return the profile `located`.

    `but` describes how the settings differ from the settings of `tuned`, and `then` describes how steps are taken.
    """
    description = (
        f"The tuned settings{but}, but Carom shortens steps so that they end when {finder} begins to find an overlap"
    )
    return Profile(f"{description} (Carom's own bisection){then}.", add_step(settings), accuracy, located=True)
