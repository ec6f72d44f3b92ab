"""A contact that an engine reports in one or more steps, and the computation of the instant of its impact."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from carom.comparator.slowing import Slowing, find_nearest_time
from carom.comparator.thresholds import THRESHOLDS
from carom.engines.api import Contact, Observation
from carom.execution.observation.final_state import Array
from carom.model.prescribed_motion import Course
from carom.model.trace import Vector

#: Numbers of two bodies.
Pair = tuple[int, int]

#: Velocity and spin of a body.
Motion = tuple[float, float, float]

#: Motions of the two bodies of a contact.
Motions = tuple[Motion, Motion]


@dataclass(eq=False)
class OpenContact:
    """A contact that may continue in the next step.

    Attributes:
        number: Number of the contact, counted in the order in which contacts began.
        reported: The contact as reported in its first step.
        before: Velocities and spins of the two bodies before the contact's first step.
        start_s: Time at the start of the contact's first step, in seconds.
        start: State at the start of the contact's first step.
        after: Velocities and spins after the contact's last step so far.
        end_s: Time at the end of the contact's last step so far, in seconds.
        end: State at the end of the contact's last step so far.
        is_isolated: Whether the two bodies had no other contacts during the steps of this contact.
        steps: Number of the contact's steps so far.
        impulse: Sum of the impulses of all steps. If no impulses are reported, sum of the changes of relative velocity.
        impulse_vector: Sum over all steps of the impulse times the normal vector.
        weighted_length: Sum over all steps of the impulse times the length of the normal vector.
        at_rest: Copy of the contact at the end of the step in which the pair came to rest; None if the pair does not
            rest.
    """

    number: int
    reported: Contact
    before: Motions
    start_s: float
    start: Observation
    after: Motions
    end_s: float
    end: Observation
    is_isolated: bool = True
    steps: int = 0
    impulse: float = 0.0
    impulse_vector: Vector = (0.0, 0.0)
    weighted_length: float = 0.0
    at_rest: OpenContact | None = None

    @property
    def pair(self) -> Pair:
        """Numbers of the two bodies."""
        return (self.reported.first, self.reported.second)

    def cut_at_rest(self) -> OpenContact:
        """Return the contact as it was at the end of the step in which the pair came to rest.

        If the pair does not rest, return the whole contact.
        """
        return self if self.at_rest is None or self.at_rest.steps == self.steps else self.at_rest

    def add(self, impulse: float, normal: Vector) -> None:
        """Add the impulse of a step."""
        (x, y), (nx, ny) = self.impulse_vector, normal
        self.steps += 1
        self.impulse += impulse
        self.impulse_vector = (x + impulse * nx, y + impulse * ny)
        self.weighted_length += impulse * math.hypot(*normal)

    def has_turned(self, float_bits: int) -> bool:
        """Whether a velocity changed by more than rounding; see `carom.comparator.non_finite.find_turned_impacts`."""
        velocities = [(x, y) for x, y, _ in (*self.before, *self.after)]
        changes = [(ux - x, uy - y) for (x, y, _), (ux, uy, _) in zip(self.before, self.after, strict=True)]
        greatest, change = (max(math.sqrt(x * x + y * y) for x, y in one) for one in (velocities, changes))
        return change > THRESHOLDS.rounding_of(float_bits) * greatest

    def compute_normal(self) -> Vector:
        """Return a normal vector with the direction of the total impulse and the mean length of the steps' normals.

        If the contact has one step or no impulse, return its first normal.
        """
        size = math.hypot(*self.impulse_vector)
        if self.steps == 1 or not (size > 0.0 and self.impulse > 0.0):
            return self.reported.normal
        length = self.weighted_length / self.impulse
        return (length * self.impulse_vector[0] / size, length * self.impulse_vector[1] / size)

    def compute_landing_time(self, gravity: Array, leg: Course) -> float:
        """Return the instant at which two bodies meet, for a pair that comes to rest.

        `compute_turn_time` needs a free path after the impact, but resting bodies do not separate. At the returned
        instant, the free paths before the impact bring the bodies to the distance that they have while they rest. The
        distance of the resting bodies changes at the normal speed that they have at the end of the contact. The free
        path is a parabola, or a line if gravity accelerates both bodies equally.

        Args:
            gravity: Acceleration of each disc, from `compute_gravity`.
            leg: Motion of the wall, if the second body is a wall.
        """
        d0, u0 = self._compute_relative_motion(self.start, self.start_s, leg)
        d1, u1 = self._compute_relative_motion(self.end, self.end_s, leg)
        normal = np.array(self.compute_normal())
        normal /= np.hypot(*normal)
        duration_s = self.end_s - self.start_s
        bend = float(self._compute_relative_pull(gravity) @ normal) / 2
        closing = float((u1 - u0) @ normal)
        gap = float((d0 - d1 + u1 * duration_s) @ normal)
        # The result is the first root of `gap - closing t + bend t^2 = 0`. The formula below avoids the subtraction of
        # nearly equal numbers, which would lose digits.
        square = closing * closing - 4.0 * bend * gap
        if not (square >= 0.0 and closing + math.sqrt(square) > 0.0):
            return math.nan
        return self.start_s + 2.0 * gap / (closing + math.sqrt(square))

    def compute_turn_time(self, gravity: Array, slowing: Slowing, leg: Course) -> float:
        """Return the instant at which the free paths before and after the contact are nearest to each other.

        Let d0 and u0 be the relative position and velocity at the time t0, in the last state before the contact. Let d1
        and u1 be the relative position and velocity at the time t1, in the first state after the contact. The paths are
        the lines d0 + u0 (t - t0) and d1 + u1 (t - t1). The difference of the paths is a linear function of t with
        slope u0 - u1. The difference is also linear under gravity, where both paths are parabolas of the same
        curvature. With damping, the paths are lines in undamped time: the time that an undamped disc needs for the same
        distance. On a table that slows discs, the paths have different curvatures. The nearest instant is found by
        least squares.

        Args:
            gravity: Acceleration of each disc, from `compute_gravity`.
            slowing: Law that slows discs down.
            leg: Motion of the wall, if the second body is a wall.
        """
        d0, u0 = self._compute_relative_motion(self.start, self.start_s, leg)
        d1, u1 = self._compute_relative_motion(self.end, self.end_s, leg)
        duration_s = self.end_s - self.start_s
        pull = self._compute_relative_pull(gravity)
        if slowing.table_m_s2:
            return find_nearest_time(lambda time_s: self._compute_gap_on_table(slowing, leg, time_s), self.end_s)
        flown_time_s = slowing.damping.to_undamped(duration_s)
        u1 = u1 / slowing.damping.compute_kept_fraction(duration_s)
        slope = u0 - u1 + pull * duration_s
        squared = float(slope @ slope)
        if squared == 0.0:
            return math.nan
        # Times are counted from the contact's start, since large times would have larger rounding errors.
        offset = d0 - (d1 - u1 * flown_time_s + pull * (duration_s * duration_s / 2))
        turn_s = self.start_s + slowing.damping.to_damped(-float(offset @ slope) / squared)
        return turn_s if math.isfinite(turn_s) else math.nan

    def _compute_gap_on_table(self, slowing: Slowing, leg: Course, time_s: float) -> tuple[Array, Array]:
        """Return how far the free paths before and after the contact differ, and how fast this difference changes."""
        motions = []
        for state, since_s in ((self.start, self.start_s), (self.end, self.end_s)):
            speed, elapsed_s = np.hypot(*state.velocity_m_s.T), np.array(time_s - since_s)
            place = state.position_m + state.velocity_m_s * slowing.compute_flown_times(elapsed_s, speed)[:, None]
            velocity = state.velocity_m_s * slowing.compute_kept_fractions(elapsed_s, speed)[:, None]
            moved = replace(state, position_m=place, velocity_m_s=velocity)
            motions.append(self._compute_relative_motion(moved, time_s, leg))
        (d0, u0), (d1, u1) = motions
        return d0 - d1, u0 - u1

    def _compute_relative_pull(self, gravity: Array) -> Array:
        first, second = self.pair
        pull: Array = gravity[second] - gravity[first] if second >= 0 else -gravity[first]
        return pull

    def _compute_relative_motion(self, state: Observation, time_s: float, leg: Course) -> tuple[Array, Array]:
        """Return position and velocity of the second body relative to the first.

        The position of a wall is its displacement since time 0.
        """
        first, second = self.pair
        place, velocity = state.position_m, state.velocity_m_s
        if second < 0:
            return leg.moved_at(time_s) - place[first], leg.velocity - velocity[first]
        return place[second] - place[first], velocity[second] - velocity[first]
