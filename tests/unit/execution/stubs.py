"""An adapter of one world, and a world in which nothing moves: what tests alter a part of."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from carom.engines.api import Capabilities, Engine, Observation, Profile, Scene, Setting


class Still:
    """A world of one disc at rest, which notes that it was closed."""

    closed = False
    settings: Mapping[str, Setting] = {"dt_s": 0.25}

    def advance(self, steps: int) -> None:
        pass

    def observe(self) -> Observation:
        return Observation(np.zeros((1, 2)), np.zeros((1, 2)))

    def close(self) -> None:
        self.closed = True


class Makes:
    """An adapter with one world, and a profile for each given name."""

    name, engine, capabilities = "makes", Engine("Makes"), Capabilities()
    profiles: Mapping[str, Profile] = {
        name: Profile("As it comes.", lambda dt_s: {"dt_s": dt_s}, located=name == "located")
        for name in ("default", "tuned", "located")
    }

    def __init__(self, world: Any) -> None:
        self.world = world

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> Any:
        del scene, settings
        return self.world
