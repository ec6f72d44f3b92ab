"""PIT of many discs with a broad phase: identical to the plain loop to the bit.

A list of near pairs stands for all pairs as long as no two discs can have moved far enough to make another pair touch.
Of the listed pairs, those are tested that are due (`carom.solvers.pit.bounds`). Positions and bounds are arrays; what
decides an impact, and the impact itself, is the very arithmetic of the plain loop, on plain floats.
"""

from __future__ import annotations

import heapq
import math
from bisect import bisect_left
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.impact_log import ImpactLog
from carom.solvers.pit.bounds import MARGIN, MOST_FRAMES, pairs_free_until, walls_free_until
from carom.solvers.pit.neighbours import near_pairs
from carom.solvers.pit.skipping import last_of_accumulated
from carom.solvers.plain.bodies import Bodies, require_supported

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["ManyDiscsRun"]

#: Rims up to so many median diameters apart are listed. More pairs to keep against fewer lists to make; measured at
#: packing .3, where 0.5 and 2 are slower.
_LISTED_DIAMETERS = 1.0

#: Part of that distance which discs may use up before the list is made anew; the rest covers rounding.
_USABLE = 0.99


class ManyDiscsRun:
    """A PIT run that tests near pairs only, and of these only such as are due."""

    def __init__(self, scene: Scene) -> None:
        require_supported(scene, "PIT")
        self.bodies = bodies = Bodies(scene)
        self.log = ImpactLog(scene)
        self.time_s = 0.0
        self.pair_tests = 0
        self.frames = 0
        self.frames_looked_at = 0
        self.lists = 0
        self._horizon_s = 2.0 * scene.duration_s
        self._x, self._y = np.array(bodies.x), np.array(bodies.y)
        self._vx, self._vy = np.array(bodies.vx), np.array(bodies.vy)
        self._radius = np.array(bodies.radius)
        self._movable = np.array(bodies.inverse_mass) > 0.0
        self._walls = [(px, py, nx, ny, abs(px) + abs(py)) for px, py, nx, ny in bodies.walls]
        self._listed_m = _LISTED_DIAMETERS * 2.0 * float(np.median(self._radius))
        self._next_look_s = 0.0
        self._bounds_hold_to = 0
        self._fastest_m_s = 0.0
        # How much nearer to each other discs may still come before the list must be made anew, and as of when.
        self._left_m, self._left_at_s = 0.0, 0.0
        self._list()

    def advance_frame(self, next_frame_s: float) -> None:
        """Look at the present frame, if anything can happen at it, and move every disc to the next one."""
        self.advance_frames((next_frame_s,))

    def advance_frames(self, frames_s: Sequence[float]) -> None:
        """Go through the present frame and on to each of the following ones; the last is reached, not looked at."""
        at, count = 0, len(frames_s)
        while at < count:
            if self.time_s >= self._next_look_s or self.frames >= self._bounds_hold_to:
                self._look()
            most = min(count, at + self._bounds_hold_to - self.frames) - 1
            stop = bisect_left(frames_s, self._next_look_s, at, most)
            dts = np.diff(np.array([self.time_s, *frames_s[at : stop + 1]]))
            self._x = np.where(self._movable, last_of_accumulated(self._x, self._vx, dts), self._x)
            self._y = np.where(self._movable, last_of_accumulated(self._y, self._vy, dts), self._y)
            self.time_s = frames_s[stop]
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
            "pair_lists": self.lists,
        }

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        # As `Bodies.positions_at`: adding nothing turns -0 into 0.
        return np.stack([self._x + self._vx * 0.0, self._y + self._vy * 0.0], axis=1)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return np.stack([self._vx, self._vy], axis=1)

    def _look(self) -> None:
        self._keep_list()
        now = self.time_s
        self.frames_looked_at += 1
        due = np.flatnonzero(self._due_s <= now)
        near = self._bound_pairs(due)
        self.pair_tests += len(due)
        turned = self._collide_pairs(due, due[near])
        wall_due = [np.flatnonzero(wall_due_s <= now) for wall_due_s in self._wall_due_s]
        changed = np.zeros(len(self._radius), np.bool_)
        changed[list(turned)] = True
        if turned:
            moved = np.flatnonzero(changed)
            wall_due = [np.union1d(discs, moved) for discs in wall_due]
        struck = self._collide_walls(wall_due)
        changed[list(struck)] = True
        turned |= struck
        if turned:
            discs = np.array(sorted(turned), np.intp)
            speed = float(np.max(np.hypot(self._vx[discs], self._vy[discs])))
            self._fastest_m_s = max(self._fastest_m_s, speed)
            pairs = np.unique(np.concatenate([self._near.pairs_of(disc) for disc in turned]))
            self._bound_pairs(pairs)
            for k in range(len(self._walls)):
                self._bound_wall(k, discs)
        list_ends_s = now + self._left_m / (2.0 * self._fastest_m_s) if self._fastest_m_s else math.inf
        earliest = [float(part.min()) for part in (self._due_s, *self._wall_due_s) if len(part)]
        self._next_look_s = min([list_ends_s * (1.0 - MARGIN), *earliest])

    def _keep_list(self) -> None:
        """Make the list of near pairs anew where discs may have come near that are not on it."""
        now = self.time_s
        self._left_m -= 2.0 * self._fastest_m_s * (now - self._left_at_s)
        self._left_at_s = now
        if self._left_m <= 0.0 < self._fastest_m_s or self.frames >= self._bounds_hold_to:
            self._list()

    def _list(self) -> None:
        now = self.time_s
        speed = np.hypot(self._vx, self._vy)
        self._fastest_m_s = float(np.max(speed))
        reach = np.abs(self._x) + np.abs(self._y) + speed * self._horizon_s + self._radius
        # What the usable part leaves, and this, is more than rounding can use up.
        gap = self._listed_m + 4.0 * MARGIN * float(np.max(reach))
        self._near = near_pairs((self._x, self._y), self._radius, self._movable, gap)
        self._contact = self._radius[self._near.first] + self._radius[self._near.second]
        self._left_m = _USABLE * self._listed_m
        self._bounds_hold_to = self.frames + MOST_FRAMES
        self._due_s = np.full(len(self._near), now)
        self._wall_due_s = [np.where(self._movable, now, math.inf) for _ in self._walls]
        self.lists += 1

    def _bound_pairs(self, pairs: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Find until when pairs can't collide; return which of them approach within reach of an overlap."""
        i, j = self._near.first[pairs], self._near.second[pairs]
        until, near = pairs_free_until(
            self._x[j] - self._x[i],
            self._y[j] - self._y[i],
            self._vx[j] - self._vx[i],
            self._vy[j] - self._vy[i],
            self._contact[pairs],
            self._reach(i) + self._reach(j),
            self.time_s,
        )
        self._due_s[pairs] = until
        return near

    def _bound_wall(self, k: int, discs: NDArray[np.intp]) -> NDArray[np.bool_]:
        px, py, nx, ny, place = self._walls[k]
        vx, vy = self._vx[discs], self._vy[discs]
        until, near = walls_free_until(
            (self._x[discs] - px) * nx + (self._y[discs] - py) * ny,
            vx * nx + vy * ny,
            np.hypot(vx, vy),
            self._radius[discs],
            self._reach(discs) + place,
            self.time_s,
        )
        self._wall_due_s[k][discs] = until
        return near

    def _reach(self, discs: NDArray[np.intp]) -> NDArray[np.float64]:
        reach: NDArray[np.float64] = np.abs(self._x[discs]) + np.abs(self._y[discs])
        reach += (np.abs(self._vx[discs]) + np.abs(self._vy[discs])) * self._horizon_s
        return reach

    def _collide_pairs(self, due: NDArray[np.intp], near: NDArray[np.intp]) -> set[int]:
        """Carry out the impacts of this frame, pair by pair in the plain loop's order; return the discs they turned."""
        bodies, first, second = self.bodies, self._near.first, self._near.second
        turned: set[int] = set()
        queue: list[int] = near.tolist()  # ascending, so a heap already
        queued = set(queue)
        looked_at = queued if len(near) == 0 else set(due.tolist())
        while queue:
            pair = heapq.heappop(queue)
            i, j = int(first[pair]), int(second[pair])
            self._take(i)
            self._take(j)
            self.pair_tests += pair not in looked_at
            if not bodies.pair_approaches_and_overlaps(i, j):
                continue
            self.log.add(bodies.collide_pair(i, j))
            for disc in (i, j):
                turned.add(disc)
                self._vx[disc], self._vy[disc] = bodies.vx[disc], bodies.vy[disc]
                # Turned, it can approach in this very frame what it overlapped and left alone before.
                for other in self._near.pairs_of(disc).tolist():
                    if other > pair and other not in queued:
                        queued.add(other)
                        heapq.heappush(queue, other)
        return turned

    def _collide_walls(self, due: Sequence[NDArray[np.intp]]) -> set[int]:
        turned: set[int] = set()
        near: set[int] = set()
        for k, discs in enumerate(due):
            self.pair_tests += len(discs)
            near.update(discs[self._bound_wall(k, discs)].tolist())
        for i in sorted(near):
            self._take(i)
            self.pair_tests += len(self._walls)
            for k in range(len(self._walls)):
                if self.bodies.wall_approaches_and_overlaps(i, k):
                    self.log.add(self.bodies.collide_wall(i, k))
                    turned.add(i)
            self._vx[i], self._vy[i] = self.bodies.vx[i], self.bodies.vy[i]
        return turned

    def _take(self, i: int) -> None:
        """Give the plain floats of a disc its present place."""
        self.bodies.x[i], self.bodies.y[i] = float(self._x[i]), float(self._y[i])
        if self._movable[i]:
            self.bodies.time[i] = self.time_s
