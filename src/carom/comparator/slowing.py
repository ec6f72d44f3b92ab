"""What slows discs down between impacts, and leaves them their direction: linear damping, or a table.

A disc of velocity v is left with a part of it, ``kept v``, and has moved by ``flown v``. With damping both are the same
for all discs, see `carom.model.damping`; on a table, which slows a disc down by a until it stops, they depend on its
speed s: ``1 - a t / s`` and ``t - a t^2 / (2 s)``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.model.damping import Damping
from carom.model.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Slowing:
    """The law of a scene.

    Attributes:
        damping: Its damping; none on a table.
        table_m_s2: Its table's deceleration, 0 without one.
    """

    damping: Damping
    table_m_s2: float

    @classmethod
    def of(cls, scene: Scene) -> Slowing:
        """Return that of a scene."""
        return cls(Damping(scene.damping_per_s), scene.table_deceleration_m_s2)

    def __bool__(self) -> bool:
        """Whether anything slows discs down."""
        return bool(self.damping.per_s or self.table_m_s2)

    def kept(self, seconds: float, speed: float) -> float:
        """Return what part of a speed is left after some seconds; below 0 seconds, what it was before, over it."""
        if not self.table_m_s2:
            return self.damping.kept(seconds)
        if not speed:
            return 1.0
        return 0.0 if seconds >= self.stops_s(speed) else 1.0 - self.table_m_s2 * seconds / speed

    def flown(self, seconds: float, speed: float) -> float:
        """Return by how much of its velocity a disc moves in some seconds; below 0, to where it was before."""
        if not self.table_m_s2:
            return self.damping.undamped(seconds)
        lasts = min(seconds, self.stops_s(speed))
        return lasts - 0.5 * lasts * (self.table_m_s2 * lasts / speed) if speed else 0.0

    def stops_s(self, speed: float) -> float:
        """Return after how many seconds a disc of that speed stops; infinity for never, and of one at rest."""
        return speed / self.table_m_s2 if self.table_m_s2 and speed else math.inf

    def all_kept(self, seconds: Array, speed: Array) -> Array:
        """Return `kept` of each of some times and speeds, which broadcast."""
        if not self.table_m_s2:
            return self.damping.all_kept(seconds)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.maximum(1.0 - self.table_m_s2 * seconds / speed, 0.0)
        kept: Array = np.where(speed > 0.0, left, 1.0)
        return kept

    def all_flown(self, seconds: Array, speed: Array) -> Array:
        """Return `flown` of each of some times, with damping 0 or more, and speeds, which broadcast."""
        if not self.table_m_s2:
            return self.damping.all_undamped(seconds)
        with np.errstate(divide="ignore", invalid="ignore"):
            lasts = np.minimum(seconds, speed / self.table_m_s2)
            way = lasts - 0.5 * lasts * (self.table_m_s2 * lasts / speed)
        flown: Array = np.where(speed > 0.0, way, 0.0)
        return flown

    def bends(self, speed: float) -> float:
        """Return how fast a disc of that speed is slowed down, metres a second squared."""
        return self.damping.per_s * speed + self.table_m_s2

    def all_bends(self, speed: Array) -> Array:
        """Return `bends` of each of some speeds."""
        return self.damping.per_s * speed + self.table_m_s2


#: Newton's steps from a chord: each squares what is left of the error, a part of a step of a path that hardly bends.
_NEWTON = 6


def nearest_s(apart: Callable[[float], tuple[Array, Array]], begin_s: float) -> float:
    """Return when two paths come nearest, by least squares: the root, if they meet; NaN if they do not part.

    Args:
        apart: Returns by how much the two are apart at a time, metres, and how fast that changes.
        begin_s: A time near it.
    """
    time_s = begin_s
    for _ in range(_NEWTON):
        place, rate = apart(time_s)
        squared = float(rate @ rate)
        if squared == 0.0:
            return math.nan
        time_s -= float(place @ rate) / squared
    return time_s
