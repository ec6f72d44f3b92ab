"""What the adapters of Python packages have in common: an adapter around a class of worlds, and words of profiles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from carom.engines.api import Accuracy, Capabilities, Engine, Imported, Knob, Profile, Scene, Setting

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.engines.api import World

Settings = Mapping[str, Setting]

#: Reasons in `Profile.changed` of a `default`, which names all that is not as shipped by the engine's own name for it.
OF_THE_SCENE = "the scene's"
#: Said of a disc kept from turning. Friction is 0 where this is done and the disc is a circle: nothing turns it.
NOT_TURNED = "kept from turning where nothing spins or rubs, which alters roundings alone"

#: The promise of a method without an error of its own.
SOUND = Accuracy()


@dataclass(frozen=True)
class EngineAdapter:
    """An engine that is a Python package.

    Attributes:
        name: The one given to ``--engine``.
        engine: The engine.
        capabilities: What it can do.
        knobs: Settings that may be searched, and how far, by name.
        profiles: Its profiles, by name.
        world: Makes a world of a scene and settings; raises AdapterError where one is outside what the engine can do.
        code: Writes what `world` makes as code of the engine's own (`carom.engines.api.CodedAdapter`); None where there
            is none.
        read: Reads a file of the engine's as a scene (`carom.engines.api.ReadingAdapter`); None likewise.
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
            AdapterError: The scene or a setting is outside what the engine can do.
        """
        return self.world(scene, settings)


def vectors(found: Iterable[Iterable[float]]) -> NDArray[np.float64]:
    """Return vectors of two numbers each as an array of shape ``(n, 2)``, as an `Observation` has them.

    NumPy takes twice as long to make an array of small sequences as of numbers.
    """
    return np.array([*chain.from_iterable(found)], dtype=np.float64).reshape(-1, 2)


def tuned(means: str, settings: Callable[[float], Settings], accuracy: Accuracy = SOUND) -> Profile:
    """Return the profile `tuned`; `means` says what its settings do."""
    said = f"The most exact fixed-step settings known, from Carom's own measurements: {means}."
    return Profile(said, settings, accuracy)


def located(
    finder: str, settings: Callable[[float], Settings], accuracy: Accuracy = SOUND, but: str = "", then: str = ""
) -> Profile:
    """Return the profile `located`; `but` says what sets it apart from `tuned`, `then` what becomes of its steps."""
    said = f"The tuned settings{but}, each step cut at the instant from which on {finder} finds an overlap"
    return Profile(f"{said} (Carom's own bisection){then}.", settings, accuracy, located=True)
