"""Whether the rest of a run is free flight: then an engine need not be driven through it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.physics.time_of_impact import time_of_impact

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.adapter import Observation
    from carom.scene import Scene, Wall

    Array = NDArray[np.float64]

__all__ = ["FreeFlight"]

#: Engines see contacts before bodies touch, by margins and by looking ahead. A margin as wide as the discs themselves,
#: and two steps more, are beyond any of them.
_MARGIN_RADII = 2.0
_AHEAD_STEPS = 2

#: Steps that must have left every velocity as it was.
_QUIET_STEPS = 2


class FreeFlight:
    """Tells, step by step, whether anything can still happen.

    The engine's own state decides, not the reference: no two bodies overlap, or come near each other before the end, on
    the paths that the engine has put them on; and its last two steps left every velocity as it was, to the bit, so that
    it neither damps nor pushes. Then the end is where these straight paths lead.
    """

    def __init__(self, scene: Scene, dt_s: float) -> None:
        self._scene = scene
        self._dt_s = dt_s
        self._velocity = b""
        self._quiet_steps = 0
        self._look_from_s = 0.0
        self._pause_s = dt_s
        n = len(scene.discs)
        movable = np.array([not disc.immovable for disc in scene.discs])
        first, second = np.triu_indices(n, 1)
        kept = movable[first] | movable[second]
        self._first, self._second = first[kept], second[kept]
        self._radius = np.array([disc.radius_m for disc in scene.discs])

    def begins(self, time_s: float, now: Observation) -> bool:
        """Whether the rest of the run is free flight; to be asked after every step."""
        velocity = now.velocity_m_s.tobytes()
        self._quiet_steps = 0 if now.contacts or velocity != self._velocity else self._quiet_steps + 1
        self._velocity = velocity
        if now.contacts:
            self._look_from_s, self._pause_s = 0.0, self._dt_s
        if self._quiet_steps < _QUIET_STEPS or time_s < self._look_from_s:
            return False
        earliest_s = time_s + self._earliest(now, self._scene.duration_s - time_s)
        # No pair comes near another before that; and where one is near now, ask ever less often.
        self._pause_s *= 2.0
        self._look_from_s = max(earliest_s, time_s + self._pause_s)
        return earliest_s > self._scene.duration_s + _AHEAD_STEPS * self._dt_s

    def _earliest(self, now: Observation, left_s: float) -> float:
        """Return after how many seconds something may happen; a wall within what is left of the scene says enough."""
        p, v, a, b = now.position_m, now.velocity_m_s, self._first, self._second
        if np.any(np.hypot(*(p[b] - p[a]).T) <= self._radius[a] + self._radius[b]):
            return 0.0  # what overlaps may still be pushed apart
        r = _MARGIN_RADII * self._radius
        # With such a margin no rounding matters, so plain quotients do for the walls; and they are asked first.
        nearest = min((self._reaches(wall, p, v, r) for wall in self._scene.walls), default=math.inf)
        if nearest <= left_s or not len(a):
            return nearest
        return min(nearest, float(np.min(time_of_impact(p[a], v[a], r[a], p[b], v[b], r[b]))))

    @staticmethod
    def _reaches(wall: Wall, p: Array, v: Array, r: Array) -> float:
        gap = (p - np.array(wall.point_m)) @ np.array(wall.normal) - r
        along = v @ np.array(wall.normal)
        waits = np.maximum(gap[along < 0.0], 0.0) / -along[along < 0.0]
        return float(np.min(waits, initial=math.inf))
