"""Whether the rest of a run is free flight: then an engine need not be driven through it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.physics.time_of_impact import time_of_impact
from carom.physics.wall_time import wall_time

if TYPE_CHECKING:
    from carom.adapter import Observation
    from carom.scene import Scene

__all__ = ["FreeFlight"]

#: Engines see contacts before bodies touch, by margins and by looking ahead. A margin as wide as the discs themselves,
#: and two steps more, are beyond any of them.
_MARGIN_RADII = 2.0
_AHEAD_STEPS = 2


class FreeFlight:
    """Tells, step by step, whether anything can still happen.

    The engine's own state decides, not the reference: no two bodies overlap, or come near each other before the end, on
    the paths that the engine has put them on; and its last two steps left every velocity as it was, to the bit, so that
    it neither damps nor pushes. Then the end is where these straight paths lead.
    """

    def __init__(self, scene: Scene, dt_s: float) -> None:
        self._scene = scene
        self._dt_s = dt_s
        self._last: tuple[Observation, ...] = ()
        self._look_from_s = 0.0
        n = len(scene.discs)
        movable = np.array([not disc.immovable for disc in scene.discs])
        first, second = np.triu_indices(n, 1)
        kept = movable[first] | movable[second]
        self._first, self._second = first[kept], second[kept]
        self._radius = np.array([disc.radius_m for disc in scene.discs])

    def begins(self, time_s: float, now: Observation) -> bool:
        """Whether the rest of the run is free flight; to be asked after every step."""
        quiet = len(self._last) == 2 and all(
            not state.contacts and np.array_equal(state.velocity_m_s, now.velocity_m_s) for state in self._last
        )
        self._last = (*self._last[-1:], now)
        if now.contacts:
            self._look_from_s = 0.0
        if not quiet or now.contacts or time_s < self._look_from_s:
            return False
        # No pair can meet before that, so there is no use in asking again.
        self._look_from_s = time_s + self._earliest(now)
        return self._look_from_s > self._scene.duration_s + _AHEAD_STEPS * self._dt_s

    def _earliest(self, now: Observation) -> float:
        p, v, a, b = now.position_m, now.velocity_m_s, self._first, self._second
        if np.any(np.hypot(*(p[b] - p[a]).T) <= self._radius[a] + self._radius[b]):
            return 0.0  # what overlaps may still be pushed apart
        r = _MARGIN_RADII * self._radius
        pairs = np.asarray(time_of_impact(p[a], v[a], r[a], p[b], v[b], r[b])) if len(a) else np.array([math.inf])
        walls = [
            wall_time(
                float(p[i, 0]),
                float(p[i, 1]),
                float(v[i, 0]),
                float(v[i, 1]),
                float(r[i]),
                *wall.point_m,
                *wall.normal,
            )
            for wall in self._scene.walls
            for i in range(len(r))
        ]
        return min([float(np.min(pairs, initial=math.inf)), *walls])
