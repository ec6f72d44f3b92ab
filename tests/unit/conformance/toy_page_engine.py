"""An engine of a page that checks for overlap once per step, with a margin, units and a combination rule of its own."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from carom.engines.api import (
    Accuracy,
    Capabilities,
    Contact,
    Engine,
    Observation,
    Profile,
    Scene,
    Setting,
    require_supported,
    wall_body,
)


class BouncerWorld:
    """Bodies that approach at a gap of less than the margin bounce at the step's start, by the law of impacts."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting], bouncer: Bouncer) -> None:
        self.settings = {name: bouncer.read(value) for name, value in settings.items()}
        self._scene, self._dt_s, self._margin = scene, float(settings["dt_s"]), bouncer.margin_m
        self._unit = bouncer.unit
        self._wall_e = scene.restitution if bouncer.one_coefficient else scene.wall_restitution
        self._shove, self._walls = bouncer.shove, [*scene.half_planes()]
        self._x = np.array([disc.position_m for disc in scene.discs]) * (1 + bouncer.nudge) * self._unit
        self._v = np.array([disc.velocity_m_s for disc in scene.discs]) * self._unit
        self._steps, self._contacts = 0, list[Contact]()

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self._contacts = []
            discs, places = self._scene.discs, (self._x / self._unit).tolist()
            for k, wall in enumerate(self._walls):
                (px, py), (nx, ny) = wall.point_m, wall.normal
                for i, disc in enumerate(discs):
                    x, y = places[i]
                    if (x - px) * nx + (y - py) * ny - disc.radius_m < self._margin:
                        self._meet(i, wall_body(k), np.array((-nx, -ny)), 1 / disc.mass_kg, self._wall_e)
            for (i, one), (j, other) in itertools.combinations(enumerate(discs), 2):
                x, y = places[j][0] - places[i][0], places[j][1] - places[i][1]
                away = math.hypot(x, y)
                if away - one.radius_m - other.radius_m < self._margin:
                    inverse = 1 / one.mass_kg + 1 / other.mass_kg
                    self._meet(i, j, np.array((x, y)) / away, inverse, self._scene.restitution)
            self._x += self._v * self._dt_s
            self._steps += 1

    def _meet(self, i: int, j: int, normal: Any, inverse: float, restitution: float) -> None:
        closing = (self._v[i] - (self._v[j] if j >= 0 else 0.0)) @ normal / self._unit
        if closing > 0 and inverse > 0:
            impulse = (1 + restitution) * closing / inverse * (1 + self._shove)
            for body, sign in ((i, -1), (j, 1)):
                if body >= 0:
                    self._v[body] += sign * impulse / self._scene.discs[body].mass_kg * normal * self._unit
            self._contacts.append(Contact(i, j, self._steps * self._dt_s, tuple(normal), impulse))

    def observe(self) -> Observation:
        return Observation(self._x / self._unit, self._v / self._unit, tuple(self._contacts))

    def close(self) -> None:
        pass


ENGINE, NO_ERROR = Engine("Bouncer"), Accuracy()


def return_unchanged(value: Setting) -> Setting:
    """Return a setting as it was asked for."""
    return value


@dataclass
class Bouncer:
    """The adapter, honest except for the given changes.

    Attributes:
        margin_m: What gap it answers.
        unit: How many of its lengths a metre has.
        nudge: By how much of itself each coordinate is off at the start.
        shove: By how much of itself each impulse is off.
        one_coefficient: Whether walls have the restitution of discs.
        read: What it makes of a setting.
        accuracy: Its promise.
        refuses: Whether it refuses what it does not declare.
    """

    margin_m: float = 0.0
    unit: float = 1.0
    nudge: float = 0.0
    shove: float = 0.0
    one_coefficient: bool = False
    read: Callable[[Setting], Setting] = return_unchanged
    accuracy: Accuracy = NO_ERROR
    refuses: bool = True
    capabilities: Capabilities = field(default_factory=lambda: Capabilities(restitution=(0.0, 1.0)))
    name: str = "bouncer"
    engine: Engine = ENGINE

    @property
    def profiles(self) -> Mapping[str, Profile]:
        profile = Profile("As it is.", lambda dt_s: {"dt_s": dt_s, "slop": 0.2, "iterations": 3}, self.accuracy)
        return {"default": profile, "tuned": profile}

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> BouncerWorld:
        if self.refuses:
            require_supported("Bouncer", scene, self.capabilities, float(settings["dt_s"]))
        return BouncerWorld(scene, settings, self)
