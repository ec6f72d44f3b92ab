"""Discs and half-planes from impact to impact by quadratics alone: a truth for scenes, independent of Carom."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.adapters.bare_runs import Stage

Array = NDArray[np.float64]
#: What a root is known to, over the time looked ahead: a disc that has just bounced is not met again within it.
_JUST_MET_S = 1e-12


@dataclass(frozen=True)
class Meeting:
    """An impact: when, of which disc with which other (a wall is -1 - k), and the velocities of all just after."""

    time_s: float
    first: int
    second: int
    velocity: Array


class Truth:
    """A scene by hand, to its end."""

    def __init__(self, stage: Stage, duration_s: float) -> None:
        self._stage, self._pull = stage, np.array(stage.gravity)
        self.mass = np.array([disc.mass for disc in stage.discs])
        self._falls = np.isfinite(self.mass)[:, None] * self._pull
        place = np.array([disc.place for disc in stage.discs])
        velocity = np.array([disc.velocity for disc in stage.discs])
        self._legs = [(0.0, place, velocity)]
        self.meetings: list[Meeting] = []
        now = 0.0
        while True:
            after_s, first, second = self._find_next_impact(place, velocity)
            if now + after_s >= duration_s:
                break
            now, place, velocity = now + after_s, *self._fly(place, velocity, after_s)
            velocity = self._resolve_impact(place, velocity, first, second)
            self._legs.append((now, place, velocity))
            self.meetings.append(Meeting(now, first, second, velocity))
        self.end_place, self.end_velocity = self.at(duration_s)
        ends = [np.hypot(*leg[2].T).max() for leg in self._legs] + [np.hypot(*self.end_velocity.T).max()]
        before = [np.hypot(*self.at(meeting.time_s - _JUST_MET_S)[1].T).max() for meeting in self.meetings]
        self.fastest = float(max(ends + before))

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Return places and velocities at an instant."""
        began, place, velocity = next(leg for leg in reversed(self._legs) if leg[0] <= max(time_s, 0.0))
        return self._fly(place, velocity, time_s - began)

    def _fly(self, place: Array, velocity: Array, time_s: float) -> tuple[Array, Array]:
        return place + velocity * time_s + self._falls * (time_s * time_s / 2), velocity + self._falls * time_s

    def _find_next_impact(self, place: Array, velocity: Array) -> tuple[float, int, int]:
        found = (math.inf, -1, -1)
        stage = self._stage
        for i, disc in enumerate(stage.discs):
            for j in range(i + 1, len(stage.discs)):
                other = stage.discs[j]
                (dx, dy), (ux, uy) = place[j] - place[i], velocity[j] - velocity[i]
                b, a = dx * ux + dy * uy, ux * ux + uy * uy
                c = dx * dx + dy * dy - (disc.radius + other.radius) ** 2
                if b < 0 and b * b - a * c > 0:
                    found = min(found, (max(c / (-b + math.sqrt(b * b - a * c)), 0.0), i, j))
            if math.isfinite(disc.mass):
                for k, (point, normal) in enumerate(stage.walls):
                    gap = float((place[i] - point) @ normal) - disc.radius
                    time = _landing_time(gap, float(velocity[i] @ normal), float(self._pull @ normal))
                    found = min(found, (time, i, -1 - k))
        return found

    def _resolve_impact(self, place: Array, velocity: Array, i: int, j: int) -> Array:
        velocity = velocity.copy()
        if j < 0:
            normal = np.array(self._stage.walls[-1 - j][1])
            velocity[i] -= (1 + self._stage.wall_restitution) * (velocity[i] @ normal) * normal
            return velocity
        normal = (place[j] - place[i]) / np.hypot(*(place[j] - place[i]))
        inverse = 1 / self.mass[[i, j]]
        push = (1 + self._stage.restitution) * ((velocity[i] - velocity[j]) @ normal) / inverse.sum()
        velocity[i] -= push * inverse[0] * normal
        velocity[j] += push * inverse[1] * normal
        return velocity


def _landing_time(gap: float, speed: float, pull: float) -> float:
    """Return when a gap that opens at a speed, and is pulled, closes; infinity if it does not."""
    if pull == 0:
        return max(-gap / speed, 0.0) if speed < 0 else math.inf
    square = speed * speed - 2 * pull * gap
    if square <= 0:
        return math.inf
    roots = ((-speed - math.sqrt(square)) / pull, (-speed + math.sqrt(square)) / pull)
    return min((t for t in roots if t > _JUST_MET_S and speed + pull * t < 0), default=math.inf)


def find_velocity_changes(
    states: Array, dt_s: float, stage: Stage, first: int, second: int, least: float
) -> Sequence[tuple[int, int]]:
    """Return of each turn that two bodies give each other the boundaries before and after it.

    Args:
        states: Place and velocity of each disc at each boundary, shape (steps + 1, n, 4).
        dt_s: The step.
        stage: What was run.
        first: A disc.
        second: Another, or a wall.
        least: A change of velocity up to this, metres per second a step, is rounding.
    """
    velocity = states[:, first, 2:] - (states[:, second, 2:] if second >= 0 else 0.0)
    alike = second >= 0 and math.isfinite(stage.discs[second].mass)
    change = np.diff(velocity, axis=0) - (0.0 if alike else np.array(stage.gravity) * dt_s)
    along = np.hypot(*change.T) if second >= 0 else change @ np.array(stage.walls[-1 - second][1])
    turned = np.flatnonzero(along > least).tolist()
    found: list[tuple[int, int]] = []
    for k in turned:
        if found and found[-1][1] == k:
            found[-1] = (found[-1][0], k + 1)
        else:
            found.append((k, k + 1))
    return found


def estimate_impact_time(
    states: Array, dt_s: float, stage: Stage, first: int, second: int, turn: tuple[int, int]
) -> float:
    """Return the instant at which the free paths before and after a turn come nearest, by least squares."""
    before, after = (states[k, first] - (states[k, second] if second >= 0 else np.zeros(4)) for k in turn)
    alike = second >= 0 and math.isfinite(stage.discs[second].mass)
    pull = np.zeros(2) if alike else np.array(stage.gravity)
    lasted = (turn[1] - turn[0]) * dt_s
    # From the first boundary on: d0 + u0 t and, flown back from the second, d1 - u1 (l - t) + g (l - t)^2/2 - g t^2/2.
    slope = before[2:] - after[2:] + pull * lasted
    offset = before[:2] - after[:2] + after[2:] * lasted - pull * (lasted * lasted / 2)
    return turn[0] * dt_s - float(offset @ slope) / float(slope @ slope)
