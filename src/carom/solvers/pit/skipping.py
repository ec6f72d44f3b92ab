"""PIT of a few bodies without the looks that can find nothing: identical to the plain loop to the bit.

Every pair has a time before which it can't collide (`carom.solvers.pit.bounds`). A frame before the earliest of these
is not looked at; in one that is looked at, only the pairs that are due are tested, and those that an impact of this
very frame has turned.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.impact_log import ImpactLog
from carom.solvers.pit.bounds import MOST_FRAMES, pair_free_until, wall_free_until
from carom.solvers.plain.bodies import Bodies, require_supported
from carom.trace import wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["SkippingRun", "last_of_accumulated"]

#: Fewer moves than these are made one by one: an array costs as much as some fifty plain additions. Measured, roughly.
_FEW_MOVES = 48
#: Moves held in memory at a time.
_MOST_MOVES = 2**18


class SkippingRun:
    """A PIT run that looks at a frame only where a pair is due."""

    def __init__(self, scene: Scene) -> None:
        require_supported(scene, "PIT")
        self.bodies = Bodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.pair_tests = 0
        self.frames = 0
        self.frames_looked_at = 0
        # A last step may reach beyond the scene's duration.
        self._horizon_s = 2.0 * scene.duration_s
        self._movable = [i for i, w in enumerate(self.bodies.inverse_mass) if w > 0.0]
        n = len(self.bodies)
        # In the order in which the plain loop tests them.
        self._pairs = [
            (i, j)
            for i in range(n)
            for j in range(i + 1, n)
            if self.bodies.inverse_mass[i] > 0.0 or self.bodies.inverse_mass[j] > 0.0
        ]
        self._pairs += [(i, wall_body(k)) for i in self._movable for k in range(len(self.bodies.walls))]
        self._due_s = [0.0] * len(self._pairs)
        self._next_look_s = 0.0 if self._pairs else math.inf
        self._bounds_hold_to = MOST_FRAMES

    def advance_frame(self, next_frame_s: float) -> None:
        """Look at the present frame, if anything can happen at it, and move every disc to the next one."""
        self.advance_frames((next_frame_s,))

    def advance_frames(self, frames_s: Sequence[float]) -> None:
        """Go through the present frame and on to each of the following ones; the last is reached, not looked at."""
        at, count = 0, len(frames_s)
        while at < count:
            if self.frames >= self._bounds_hold_to:
                self._due_s = [self.time_s] * len(self._pairs)
                self._next_look_s = self.time_s
                self._bounds_hold_to = self.frames + MOST_FRAMES
            if self.time_s >= self._next_look_s:
                self._look()
            most = min(count, at + self._bounds_hold_to - self.frames) - 1
            stop = bisect_left(frames_s, self._next_look_s, at, most)
            self._move(frames_s[at : stop + 1])
            self.frames += stop + 1 - at
            at = stop + 1

    @property
    def counts(self) -> dict[str, int]:
        """Work so far."""
        return {
            "frames": self.frames,
            "frames_looked_at": self.frames_looked_at,
            "frames_skipped": self.frames - self.frames_looked_at,
            "pair_tests": self.pair_tests,
        }

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self.bodies.positions_at(self.time_s)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self.bodies.velocities()

    def _look(self) -> None:
        bodies, log, now = self.bodies, self.log, self.time_s
        turned: set[int] = set()
        tested = []
        for p, (i, j) in enumerate(self._pairs):
            # What an impact of this frame has turned can approach a body that it overlapped and left alone before.
            if self._due_s[p] > now and i not in turned and j not in turned:
                continue
            tested.append(p)
            if j < 0:
                if bodies.wall_approaches_and_overlaps(i, wall_index(j)):
                    log.add(bodies.collide_wall(i, wall_index(j)))
                    turned.add(i)
            elif bodies.pair_approaches_and_overlaps(i, j):
                log.add(bodies.collide_pair(i, j))
                turned.update((i, j))
        self.pair_tests += len(tested)
        self.frames_looked_at += 1
        if turned:
            tested = [p for p, (i, j) in enumerate(self._pairs) if self._due_s[p] <= now or i in turned or j in turned]
        for p in tested:
            i, j = self._pairs[p]
            bound = (wall_free_until, wall_index(j)) if j < 0 else (pair_free_until, j)
            self._due_s[p] = bound[0](bodies, i, bound[1], now, self._horizon_s)
        self._next_look_s = min(self._due_s, default=math.inf)

    def _move(self, frames_s: Sequence[float]) -> None:
        bodies = self.bodies
        if len(frames_s) * len(self._movable) < _FEW_MOVES:
            for frame_s in frames_s:
                for i in self._movable:
                    bodies.move_to(i, frame_s)
        else:
            dts = np.diff(np.array([self.time_s, *frames_s]))
            for i in self._movable:
                bodies.x[i] = float(last_of_accumulated(bodies.x[i], bodies.vx[i], dts))
                bodies.y[i] = float(last_of_accumulated(bodies.y[i], bodies.vy[i], dts))
                bodies.time[i] = frames_s[-1]
        self.time_s = frames_s[-1]


def last_of_accumulated(
    start: NDArray[np.float64] | float, velocity: NDArray[np.float64] | float, dts: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return where steps one after the other lead, each rounded as ``x += v * dt`` rounds it.

    Args:
        start: Coordinates, shape ``()`` or ``(n,)``.
        velocity: Velocities along them, of the same shape.
        dts: The steps, shape ``(k,)``, k above 0.
    """
    at = np.asarray(start, dtype=np.float64)
    speed = np.asarray(velocity, dtype=np.float64)
    chunk = max(1, _MOST_MOVES // max(1, at.size))
    for k in range(0, len(dts), chunk):
        steps = np.multiply.outer(dts[k : k + chunk], speed)
        steps[0] += at
        at = np.add.accumulate(steps, axis=0)[-1]
    return at
