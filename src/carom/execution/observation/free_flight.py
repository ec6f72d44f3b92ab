"""Detects when no further impact is possible in a run, so that the remaining steps can be skipped."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import Observation
from carom.engines.api.checks import MANTISSA_BITS
from carom.model.broad_phase import find_near_pairs
from carom.model.chain_geometry import Outline
from carom.model.scene import Scene, Wall

Array = NDArray[np.float64]

#: Engines report contacts before bodies touch: within a margin, and if the bodies would touch in the next step. No
#: engine reports contacts beyond this distance from a disc's centre plus two steps of motion. The unit is the radius.
_MARGIN_RADII = 2.0
_AHEAD_STEPS = 2

#: Factor on the radii in the search for touching discs. The factor covers the rounding of the squared distances that
#: the search compares.
_WIDER = 1.0 + 2.0**-40

#: The search for approaching pairs is repeated for longer and longer times ahead. Factor between successive times.
_WIDENED = 4.0

#: In free flight, this number of steps must have left every velocity unchanged and moved every disc by its velocity.
_QUIET_STEPS = 2

#: Allowed rounding error of a position in a step, in units in the last place of the largest coordinate or path length.
#: The product, the sum, the instants, the step and the engine's origin contribute up to one unit each.
_ROUNDINGS = 4


class FreeFlight:
    """Determines after each step whether another impact is possible.

    The decision uses only the engine's own states. The rest of a run is free flight if two conditions hold:

    -     On their present straight paths, no two bodies overlap or come near each other before the scene's end.
    - The last two steps left every bit of every velocity unchanged, and moved every disc by its velocity, apart from
    the rounding of the engine's floats. So the engine does not damp discs, push them or move them in any other way.

    In free flight, the final state is at the end of these straight paths.

    Attributes:
        needed_from_s: From this time on, call `has_begun` after every step. Before this time, call `has_begun` only
            after steps with contacts.

    Args:
        scene: The scene.
        dt_s: The step size, in seconds.
        float_bits: Number of bits of the floats in which the engine computes, as its adapter declares.
    """

    def __init__(self, scene: Scene, dt_s: float, float_bits: int = 64) -> None:
        self._scene = scene
        self._dt_s = dt_s
        self._unit = 2.0 ** -MANTISSA_BITS[float_bits]
        #: Times and observations of the last steps, and the bytes of their velocities and spins.
        self._seen: deque[tuple[float, Observation]] = deque(maxlen=_QUIET_STEPS + 1)
        self._motions: deque[bytes] = deque(maxlen=_QUIET_STEPS + 1)
        self._turns = scene.arrays.turns
        self._look_from_s = self.needed_from_s = 0.0
        self._pause_s = dt_s
        self._movable, self._radius = scene.arrays.movable, scene.arrays.radius_m
        self._margin = _MARGIN_RADII * self._radius
        self._walls = [
            (np.array(wall.point_m), np.array(wall.normal)) if isinstance(wall, Wall) else wall.outline
            for wall in scene.walls
        ]

    def has_begun(self, time_s: float, observation: Observation) -> bool:
        """Whether the rest of the run is free flight.

        `needed_from_s` determines after which steps this method must be called.
        """
        self._seen.append((time_s, observation))
        spins = observation.spin_rad_s if self._turns else None
        self._motions.append(observation.velocity_m_s.tobytes() + (b"" if spins is None else spins.tobytes()))
        if observation.contacts:
            self._look_from_s, self._pause_s, self.needed_from_s = 0.0, self._dt_s, 0.0
        if time_s < self._look_from_s or len(self._seen) <= _QUIET_STEPS or not self._is_quiet():
            return False
        earliest_s = time_s + self._compute_earliest_contact(observation, self._scene.duration_s - time_s)
        # No pair comes near before `earliest_s`, so no test is needed until then. While a pair is near, the test is
        # repeated at increasing intervals.
        self._pause_s *= 2.0
        self._look_from_s = max(earliest_s, time_s + self._pause_s)
        self.needed_from_s = self._look_from_s - (_QUIET_STEPS + 0.5) * self._dt_s
        return earliest_s > self._scene.duration_s + _AHEAD_STEPS * self._dt_s

    def _is_quiet(self) -> bool:
        """Whether the last steps left every velocity and spin unchanged, and moved every disc by its velocity."""
        _, *after_steps = (observation for _, observation in self._seen)
        if self._motions.count(self._motions[0]) < len(self._motions) or any(seen.contacts for seen in after_steps):
            return False
        return self._has_moved_straight(after_steps[-1].velocity_m_s)

    def _has_moved_straight(self, velocity: Array) -> bool:
        """Whether each step moved every disc by its velocity, except for rounding of coordinates and instants."""
        places, fastest = np.array([seen.position_m for _, seen in self._seen]), float(np.abs(velocity).max())
        far = np.abs(places).max(axis=(1, 2)).tolist()
        deviations = np.abs(places[1:] - places[:-1] - velocity * self._dt_s).max(axis=(1, 2)).tolist()
        return all(
            deviations[k] <= _ROUNDINGS * self._unit * max(far[k], far[k + 1], fastest * self._seen[k + 1][0])
            for k in range(len(deviations))
        )

    def _compute_earliest_contact(self, observation: Observation, left_s: float) -> float:
        """Return the seconds until a contact is possible.

        If a disc comes near a wall before the scene's end, the times of pairs of discs are not computed.
        """
        p, v = observation.position_m, observation.velocity_m_s
        for first, second in find_near_pairs(p, _WIDER * self._radius, self._movable):
            offsets = p[second] - p[first]
            if (np.hypot(offsets[:, 0], offsets[:, 1]) <= self._radius[first] + self._radius[second]).any():
                return 0.0  # overlapping bodies may still be pushed apart
        nearest = min((self._compute_wall_wait(wall, p, v) for wall in self._walls), default=math.inf)
        return nearest if nearest <= left_s else min(nearest, self.compute_pair_wait(p, v, left_s))

    def compute_pair_wait(self, p: Array, v: Array, left_s: float) -> float:
        """Return the seconds until two discs come near each other, or any time after the end if that is later."""
        speed, end_s = np.hypot(v[:, 0], v[:, 1]), left_s + (_AHEAD_STEPS + 1) * self._dt_s
        # First examine only the few pairs that can come near within `within_s`, since a scene can have millions of
        # pairs.
        within_s = min(self._pause_s, end_s)
        while True:
            wait = math.inf
            for first, second in find_near_pairs(p, self._margin + speed * within_s, self._movable):
                near = self._margin[first] + self._margin[second]
                waits = compute_time_until_near(p[second] - p[first], v[second] - v[first], near)
                wait = min(wait, float(np.min(waits, initial=math.inf)))
            if wait <= within_s or within_s >= end_s:
                return wait
            within_s = min(_WIDENED * within_s, end_s)

    def _compute_wall_wait(self, wall: tuple[Array, Array] | Outline, p: Array, v: Array) -> float:
        if not isinstance(wall, tuple):  # a lower bound: a disc must move this far to reach the wall
            away = np.array(
                [wall.compute_gap(x, y, reach) for (x, y), reach in zip(p.tolist(), self._margin.tolist(), strict=True)]
            )
            speed = np.hypot(v[:, 0], v[:, 1])
            waits = np.maximum(away[speed > 0.0], 0.0) / speed[speed > 0.0]
            return float(np.min(waits, initial=math.inf))
        point, normal = wall
        along = v @ normal
        closes = along < 0.0
        if not closes.any():
            return math.inf
        gap = (p - point) @ normal - self._margin
        return float((np.maximum(gap[closes], 0.0) / -along[closes]).min())


def compute_time_until_near(offsets: Array, velocity: Array, reach: Array) -> Array:
    """Return the seconds until pairs come within reach: 0 if near and approaching, infinity if never.

    This formula is twenty times faster than the computation of an impact's time. Its rounding does not matter, because
    the reach is much larger than the distance at which bodies touch.

    Args:
        offsets: Vector from the first to the second body of each pair, in metres, shape ``(n, 2)``.
        velocity: Velocity of the second body relative to the first, in metres per second, shape ``(n, 2)``.
        reach: Distance that counts as near, in metres, shape ``(n,)``.
    """
    with np.errstate(all="ignore"):
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        ux, uy = velocity[:, 0] / speed, velocity[:, 1] / speed
        along = offsets[:, 0] * ux + offsets[:, 1] * uy
        aside = np.abs(offsets[:, 0] * uy - offsets[:, 1] * ux)
        # The root of a product is computed as a product of roots, since the product of two lengths could overflow.
        half_chord = np.sqrt(reach - aside) * np.sqrt(reach + aside)
        wait = np.where((speed > 0.0) & (along < 0.0) & (aside < reach), (-along - half_chord) / speed, np.inf)
    # If a distance or a speed overflows, the result is unknown. Then 0 is returned, because an immediate contact is
    # possible.
    known = (speed == 0.0) | (np.isfinite(along) & np.isfinite(speed))
    return np.where(known, np.maximum(wait, 0.0), 0.0)
