"""Prescribed motion of driven bodies: a path of straight parts with constant velocity, called legs.

At the instant between two legs, the body has the velocity of the later leg.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

Vector = tuple[float, float]


class Course(NamedTuple):
    """A leg, one straight part of a driven body's path.

    Attributes:
        begin_s: Time at which the leg begins, in seconds since the start.
        end_s: Time at which the next leg begins; infinity for the last leg.
        moved: Displacement of the body from time 0 to the beginning of the leg, in metres.
        velocity: Velocity during the leg, in m/s.
    """

    begin_s: float
    end_s: float
    moved: Vector
    velocity: Vector

    def moved_at(self, time_s: float) -> Vector:
        """Return the body's displacement since time 0, in metres. The time must be within the leg."""
        (x, y), (u, v), elapsed_s = self.moved, self.velocity, time_s - self.begin_s
        return x + u * elapsed_s, y + v * elapsed_s


class Drive(NamedTuple):
    """The path of a driven body, starting from its position at time 0.

    Attributes:
        legs: The straight parts of the path, in order of time. The first part begins at 0.
    """

    legs: tuple[Course, ...]

    @classmethod
    def along(cls, legs: Iterable[tuple[float, Vector]]) -> Drive:
        """Return the path with the given start times and velocities of its legs.

        The displacement at the beginning of each leg is summed exactly and then rounded once.
        """
        leg_list = list(legs)
        ends = [*[begin_s for begin_s, _ in leg_list[1:]], math.inf]
        path, x, y = [], Fraction(0), Fraction(0)
        for (begin_s, (u, v)), end_s in zip(leg_list, ends, strict=True):
            path.append(Course(begin_s, end_s, (float(x), float(y)), (u, v)))
            if end_s < math.inf:
                duration_s = Fraction(end_s) - Fraction(begin_s)
                x, y = x + duration_s * Fraction(u), y + duration_s * Fraction(v)
        return cls(tuple(path))

    @property
    def is_stationary(self) -> bool:
        """Whether the body never moves."""
        return not any(any(leg.velocity) for leg in self.legs)

    @property
    def fastest(self) -> float:
        """Greatest speed of the body, in m/s."""
        return max(math.hypot(*leg.velocity) for leg in self.legs)

    def leg_at(self, time_s: float) -> Course:
        """Return the part of the path at a time since the start; the first part for a negative time."""
        return self.legs[self._find_leg_number(time_s)]

    def legs_from(self, time_s: float) -> tuple[Course, ...]:
        """Return the part of the path at a time since the start, and all later parts."""
        return self.legs[self._find_leg_number(time_s) :]

    def velocity_at(self, time_s: float) -> Vector:
        """Return the body's velocity at a time since the start, in m/s."""
        return self.leg_at(time_s).velocity

    def moved_at(self, time_s: float) -> Vector:
        """Return the body's displacement at a time since the start, in metres."""
        return self.leg_at(time_s).moved_at(time_s)

    def velocities_within(self, begin_s: float, end_s: float) -> list[Vector]:
        """Return the body's velocities between two times. For equal times, return the velocity just afterwards."""
        return [leg.velocity for leg in self.legs_from(begin_s) if leg.begin_s <= max(begin_s, end_s)]

    def _find_leg_number(self, time_s: float) -> int:
        return max(bisect_right(self.legs, time_s, key=lambda leg: leg.begin_s) - 1, 0)
