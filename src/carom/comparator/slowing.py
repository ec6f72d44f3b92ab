"""Slowing of discs between impacts, by linear damping or by friction with a table.

A disc starts with the velocity v. After a time t, its velocity is ``kept * v`` and its displacement is ``flown * v``.
With damping, both factors are the same for all discs (see `carom.model.damping`). A table decelerates a disc at the
rate a until the disc stops. The factors then depend on the disc's initial speed s: ``kept = 1 - a t / s`` and
``flown = t - a t^2 / (2 s)``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from carom.model.damping import Damping
from carom.model.scene import Scene

Array = NDArray[np.float64]
_Speed = TypeVar("_Speed", float, Array)


@dataclass(frozen=True, slots=True)
class Slowing:
    """The way in which the discs of a scene slow down between impacts.

    Attributes:
        damping: The scene's damping. A scene with a table has no damping.
        table_m_s2: Deceleration by the scene's table; 0 without a table.
    """

    damping: Damping
    table_m_s2: float

    @classmethod
    def of(cls, scene: Scene) -> Slowing:
        """Return the slowing of a scene."""
        return cls(Damping(scene.damping_per_s), scene.table_deceleration_m_s2)

    def __bool__(self) -> bool:
        """Whether the scene has damping or a table."""
        return bool(self.damping.per_s or self.table_m_s2)

    def compute_kept_fraction(self, seconds: float, speed: float) -> float:
        """Return the fraction of a speed that is left after some seconds; above 1 for negative seconds."""
        if not self.table_m_s2:
            return self.damping.compute_kept_fraction(seconds)
        if not speed:
            return 1.0
        return 0.0 if seconds >= self.compute_stop_time(speed) else 1.0 - self.table_m_s2 * seconds / speed

    def compute_flown_time(self, seconds: float, speed: float) -> float:
        """Return the displacement of a disc in some seconds, divided by its initial velocity.

        If `seconds` is negative, the disc moves back to an earlier position.
        """
        if not self.table_m_s2:
            return self.damping.to_undamped(seconds)
        moving_s = min(seconds, self.compute_stop_time(speed))
        return moving_s - 0.5 * moving_s * (self.table_m_s2 * moving_s / speed) if speed else 0.0

    def compute_stop_time(self, speed: float) -> float:
        """Return the seconds until a disc with this speed stops; infinite if it never stops or is at rest."""
        return speed / self.table_m_s2 if self.table_m_s2 and speed else math.inf

    def compute_kept_fractions(self, seconds: Array, speed: Array) -> Array:
        """Return the results of `compute_kept_fraction` for arrays of times and speeds that broadcast."""
        if not self.table_m_s2:
            return np.exp(-self.damping.per_s * seconds)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.maximum(1.0 - self.table_m_s2 * seconds / speed, 0.0)
        fractions: Array = np.where(speed > 0.0, left, 1.0)
        return fractions

    def compute_flown_times(self, seconds: Array, speed: Array) -> Array:
        """Return the results of `compute_flown_time` for arrays that broadcast.

        With damping, times must not be negative.
        """
        if not self.table_m_s2:
            return self.damping.to_undamped_array(seconds)
        with np.errstate(divide="ignore", invalid="ignore"):
            moving_s = np.minimum(seconds, speed / self.table_m_s2)
            equivalent_s = moving_s - 0.5 * moving_s * (self.table_m_s2 * moving_s / speed)
        flown_s: Array = np.where(speed > 0.0, equivalent_s, 0.0)
        return flown_s

    def compute_deceleration(self, speed: _Speed) -> _Speed:
        """Return the deceleration at a speed, or at each speed of an array, in metres per second squared."""
        return self.damping.per_s * speed + self.table_m_s2


#: Number of iterations of Gauss-Newton's method. If the paths meet, each iteration squares the remaining error.
_NEWTON = 6


def find_nearest_time(compute_offset: Callable[[float], tuple[Array, Array]], begin_s: float) -> float:
    """Return the time at which two bodies on two paths are nearest; NaN if their distance never changes.

    If the bodies meet, the result is the time of their meeting.

    Args:
        compute_offset: A function that returns the vector between the two bodies at a time, in metres, and its time
            derivative.
        begin_s: A time near the result, in seconds.
    """
    time_s = begin_s
    for _ in range(_NEWTON):
        place, rate = compute_offset(time_s)
        squared = float(rate @ rate)
        if squared == 0.0:
            return math.nan
        time_s -= float(place @ rate) / squared
    return time_s
