"""Detects when no further impact is possible in a run, so that the remaining steps can be skipped."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import Observation
from carom.engines.api.checks import MANTISSA_BITS
from carom.execution.observation import approach
from carom.model.broad_phase import Pairs, find_near_pairs
from carom.model.chain_geometry import Outline
from carom.model.scene import Scene, Wall

Array = NDArray[np.float64]

#: Engines report contacts before bodies touch: within a margin, and if the bodies would touch in the next step. No
#: engine reports a contact farther from a disc's centre than `_MARGIN_RADII` radii plus the motion in `_AHEAD_STEPS`
#: steps.
_MARGIN_RADII = 2.0
_AHEAD_STEPS = 2

#: Factor on the radii in the search for touching discs. The factor covers the rounding of the squared distances that
#: the search compares.
_WIDER = 1.0 + 2.0**-40

#: Approaching pairs are searched for longer and longer times ahead. Each time is the previous time multiplied by this
#: factor.
_WIDENED = 4.0

#: In scenes with at most this number of discs, all pairs are tested, which is faster than a search for near pairs.
_FEW_DISCS = 32

#: Free flight requires that this number of steps left all velocities unchanged and moved all discs straight.
QUIET_STEPS = 2

#: Allowed rounding error of a position in a step, in units in the last place of the largest coordinate or path length.
#: The product, the sum, the instants, the step and the engine's origin all contribute to the rounding error.
_ROUNDINGS = 4


class FreeFlight:
    """Determines after each step whether another impact is possible.

    The decision uses only the engine's own states. The rest of a run is free flight if two conditions hold after a
    step:

    - If all bodies continue on straight paths, no two overlap or come near each other before the scene's end.
    - The last two steps left every bit of every velocity unchanged, and moved every disc by its velocity times the step
      size, except for rounding. So the engine does not damp discs, push them or move them in any other way.

    If both conditions hold, the final state is at the ends of the straight paths.

    Attributes:
        next_check_s: Time before which free flight can't begin. Until this time, `has_begun` needs to be called only
            after steps with contacts.

    Args:
        scene: The scene.
        dt_s: The step size, in seconds.
        float_bits: Number of bits of the floats in which the engine computes, as its adapter declares.
    """

    def __init__(self, scene: Scene, dt_s: float, float_bits: int = 64) -> None:
        self._scene = scene
        self._dt_s = dt_s
        self._roundings = _ROUNDINGS * 2.0 ** -MANTISSA_BITS[float_bits]
        #: Times and states of the last steps.
        self._last_states: deque[tuple[float, Observation]] = deque(maxlen=QUIET_STEPS + 1)
        self._turns = scene.arrays.turns
        self._check_interval_s = dt_s
        self.next_check_s = (QUIET_STEPS + 0.5) * dt_s
        self._movable, self._radius = scene.arrays.movable, scene.arrays.radius_m
        self._wider_radius, self._margin = _WIDER * self._radius, _MARGIN_RADII * self._radius
        self._few_pairs = _list_pairs(self._movable) if len(self._movable) <= _FEW_DISCS else None
        half_planes = [(*wall.point_m, *wall.normal) for wall in scene.walls if isinstance(wall, Wall)]
        self._half_planes = np.array(half_planes, dtype=np.float64).reshape(-1, 4)
        self._outlines = [wall.outline for wall in scene.walls if not isinstance(wall, Wall)]

    def add_state(self, time_s: float, state: Observation) -> None:
        """Add the state after a step. `has_begun` needs the states after the two previous steps."""
        self._last_states.append((time_s, state))

    def has_begun(self, time_s: float, state: Observation) -> bool:
        """Add the state, and return whether the run is free flight from this state on.

        See `next_check_s` for the steps after which this method must be called.
        """
        self.add_state(time_s, state)
        if state.contacts:
            self.next_check_s, self._check_interval_s = time_s + (QUIET_STEPS - 0.5) * self._dt_s, self._dt_s
        if time_s < self.next_check_s or not self._is_quiet():
            return False
        earliest_s = time_s + self._compute_earliest_contact(state, self._scene.duration_s - time_s)
        # No pair comes near before `earliest_s`, so no test is needed until then. While a pair is near, the test is
        # repeated at increasing intervals.
        self._check_interval_s *= 2.0
        self.next_check_s = max(earliest_s, time_s + self._check_interval_s)
        return earliest_s > self._scene.duration_s + _AHEAD_STEPS * self._dt_s

    def _is_quiet(self) -> bool:
        """Whether the last steps left all velocities and spins unchanged, and moved all discs straight."""
        states = [state for _, state in self._last_states]
        spins = [state.spin_rad_s for state in states if state.spin_rad_s is not None] if self._turns else []
        if len({state.velocity_m_s.tobytes() for state in states}) != 1 or len({spin.tobytes() for spin in spins}) > 1:
            return False
        for (_, before), (end_s, after) in pairwise(self._last_states):
            motion = (before.position_m, after.position_m, after.velocity_m_s)
            if not approach.has_moved_straight(*motion, self._dt_s, end_s, self._roundings):
                return False
        return True

    def _compute_earliest_contact(self, state: Observation, left_s: float) -> float:
        """Return the seconds until a contact is possible.

        If a disc comes near a wall before the scene's end, pairs of discs are not examined.
        """
        p, v = state.position_m, state.velocity_m_s
        if any(approach.are_overlapping(p, self._radius, *pairs) for pairs in self._find_pairs(p, self._wider_radius)):
            return 0.0  # overlapping bodies may still be pushed apart
        nearest = approach.compute_wall_time(p, v, self._margin, self._half_planes)
        for outline in self._outlines:
            nearest = min(nearest, self._compute_outline_wait(outline, p, v))
        return nearest if nearest <= left_s else min(nearest, self.compute_pair_wait(p, v, left_s))

    def compute_pair_wait(self, p: Array, v: Array, left_s: float) -> float:
        """Return the seconds until two discs come near each other.

        A result after the scene's end is only a lower bound.
        """
        if self._few_pairs is not None:
            return approach.compute_pair_time(p, v, self._margin, *self._few_pairs)
        speed, end_s = np.hypot(v[:, 0], v[:, 1]), left_s + (_AHEAD_STEPS + 1) * self._dt_s
        # First examine only the few pairs that can come near within `within_s`, since a scene can have millions of
        # pairs.
        within_s = min(self._check_interval_s, end_s)
        while True:
            near_pairs = find_near_pairs(p, self._margin + speed * within_s, self._movable)
            wait = min(approach.compute_pair_time(p, v, self._margin, *pairs) for pairs in near_pairs)
            if wait <= within_s or within_s >= end_s:
                return wait
            within_s = min(_WIDENED * within_s, end_s)

    def _find_pairs(self, p: Array, reach: Array) -> Iterable[Pairs]:
        """Return blocks of pairs that contain all pairs within reach. In scenes with few discs, return all pairs."""
        return find_near_pairs(p, reach, self._movable) if self._few_pairs is None else (self._few_pairs,)

    def _compute_outline_wait(self, outline: Outline, p: Array, v: Array) -> float:
        """Return a lower bound of the seconds until a disc comes near a wall, computed from distances and speeds."""
        margins = self._margin.tolist()
        away = np.array([outline.compute_gap(x, y, reach) for (x, y), reach in zip(p.tolist(), margins, strict=True)])
        speed = np.hypot(v[:, 0], v[:, 1])
        waits = np.maximum(away[speed > 0.0], 0.0) / speed[speed > 0.0]
        return float(np.min(waits, initial=math.inf))


def _list_pairs(movable: NDArray[np.bool_]) -> Pairs:
    """Return all pairs of discs, except pairs of two immovable discs."""
    first, second = np.triu_indices(len(movable), 1)
    moves = movable[first] | movable[second]
    return first[moves], second[moves]
