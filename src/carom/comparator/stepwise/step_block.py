"""A block of successive steps of a run, as arrays with the rounding errors of each step."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from carom.comparator.scales import compute_lengths
from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.scene_bodies import Pair, SceneBodies
from carom.model.scene import Scene
from carom.model.step_windows import States

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Some engines change a disc's velocity before the disc touches a body: as soon as the gap is below a contact margin.
#: Box2D `default` has a margin of 1 cm, a tenth of the radius of the smallest discs of the catalogue. A margin explains
#: a change of velocity if a disc approaches a body before the step, and separates from it afterwards. The gap may be at
#: most this fraction of the contact distance.
_AHEAD_GAP = 0.25

#: Relative rounding error of a step's length. The times of a step's start and end are rounded by up to half a unit in
#: the last place.
_CLOCK = 2.0**-51


class Block:
    """Some steps of a run as arrays, with their rounding errors.

    The constructor's arguments have the same names as the attributes.

    Attributes:
        scene: The scene.
        bodies: The scene's bodies as plain floats.
        states: The states at the ends of the steps, and at the start of the first step.
        dt_s: The run's step size, in seconds. An engine that ends steps at impacts also has shorter steps.
        step_s: Length of each step, shape ``(k,)``.
        pull: Acceleration of each disc by gravity, shape ``(n, 2)``.
        unit: Relative rounding error of a velocity in a step.
        place_unit: Relative rounding error of a position in a step.
        agreement: Largest relative difference between two velocities that count as equal.
        own_speed: Greatest speed of each disc at either end of each step, shape ``(k, n)``.
        place_rounding: Rounding error of each disc's position in each step, in metres, shape ``(k, n)``.
        velocity_changed: Whether velocity or spin changed by more than rounding, shape ``(k, n)``.
        velocity_change: Magnitude of the change of each disc's velocity, in metres per second, shape ``(k, n)``.
        rim_speed_change: Magnitude of the change of each disc's rim speed, in metres per second, shape ``(k, n)``.
        path_deviation: Distance of each disc from the end of its free path, in metres, shape ``(k, n)``.
    """

    def __init__(
        self,
        scene: Scene,
        bodies: SceneBodies,
        states: States,
        dt_s: float,
        unit: float,
        place_unit: float,
        agreement: float,
    ) -> None:
        self.scene, self.bodies, self.states, self.dt_s = scene, bodies, states, dt_s
        self.unit, self.place_unit, self.agreement = unit, place_unit, agreement
        h = np.diff(states.time_s)[:, None]
        self.step_s: Array = h[:, 0]
        p, v = states.position_m, states.velocity_m_s
        speed = compute_lengths(v)
        kept_fraction = bodies.slowing.compute_kept_fractions(h, speed[:-1])
        flown_s = bodies.slowing.compute_flown_times(h, speed[:-1])
        radius = scene.arrays.radius_m
        self.pull: Array = np.where(scene.arrays.movable[:, None], np.array(bodies.gravity), 0.0)
        fallen = self.pull * h[..., None]
        self.velocity_change: Array = compute_lengths(v[1:] - v[:-1] * kept_fraction[..., None] - fallen)
        displacement = v[:-1] * flown_s[..., None]
        self.path_deviation: Array = compute_lengths(p[1:] - p[:-1] - displacement - 0.5 * fallen * h[..., None])
        rims = radius * states.spins
        self.rim_speed_change: Array = np.abs(rims[1:] - rims[:-1] * kept_fraction)
        # Bodies with a prescribed motion change their velocities without impacts.
        driven = list(scene.arrays.driven_discs)
        self.velocity_change[:, driven] = self.path_deviation[:, driven] = 0.0
        accelerations = np.hypot(*self.pull.T) + bodies.slowing.table_m_s2
        own_speed: Array = np.maximum(speed[1:], speed[:-1]) + accelerations * h
        self.own_speed = own_speed
        own_rim = np.maximum(own_speed, np.maximum(np.abs(rims[1:]), np.abs(rims[:-1])))
        far = np.max(np.abs(p), axis=2) + radius
        reach = np.maximum(far[1:], far[:-1]) + own_speed * h
        self.place_rounding: Array = place_unit * reach + own_speed * (_CLOCK * states.time_s[1:, None])
        has_changed = self.velocity_change > unit * (own_speed + bodies.fast)
        self.velocity_changed: Flags = has_changed | (self.rim_speed_change > unit * own_rim)

    def __len__(self) -> int:
        return len(self.step_s)

    def state(self, step: int, discs: tuple[int, ...] | list[int]) -> body_states.BodyStates:
        """Return the state of some discs at the start of a step.

        If `step` is the number of steps, the last state is returned.
        """
        states = self.states
        spins = None if states.spin_rad_s is None else states.spin_rad_s[step]
        return body_states.BodyStates(
            self.bodies, states.time_s[step], discs, states.position_m[step], states.velocity_m_s[step], spins
        )

    def has_early_turn(self, step: int, disc: int) -> bool:
        """Whether a disc approaches a near body before a step, and separates from it after the step."""
        everyone = [disc, *(other for other in range(self.bodies.n) if other != disc)]
        before, after = self.state(step, everyone), self.state(step + 1, everyone)
        for pair in self.bodies.list_pairs(everyone):
            if pair[0] != disc:
                break  # the pairs of `disc` come first
            contact = before.measure_separation(pair)
            near = contact.closing > 0.0 and contact.gap <= _AHEAD_GAP * self.bodies.reach(pair)
            if near and after.measure_separation(pair).closing <= 0.0:
                return True
        return False

    def is_possible(self, step: int, pairs: Collection[Pair]) -> bool:
        """Whether every disc has enough room between bodies on its opposite sides at the start of a step.

        Only bodies with a prescribed motion can leave a disc less room than its diameter. In too little room, the disc
        would have infinitely many impacts, with ever higher speeds, at one instant. Two bodies are on opposite sides if
        their normals are opposite within the rounding of positions.

        Args:
            step: The step.
            pairs: Pairs of bodies, including all bodies between which a disc may not fit.
        """
        bodies = self.bodies
        if not bodies.driven:
            return True
        state = self.state(step, sorted({body for pair in pairs for body in pair if body < bodies.n}))
        sides: dict[int, list[tuple[bool, float, float, float]]] = defaultdict(list)
        for pair in pairs:
            gap, (nx, ny), _ = state.measure_separation(pair)
            disc, other, sign = (pair[0], pair[1], 1.0) if not bodies.is_movable(pair[1]) else (pair[1], pair[0], -1.0)
            if not bodies.is_movable(other):
                sides[disc].append((bodies.is_driven(other), gap, sign * nx, sign * ny))
        return not any(
            one_gap + other_gap < 0.0
            and (one_driven or other_driven)
            and abs(nx * my - ny * mx) * bodies.radius[disc] <= 2.0 * self.place_rounding[step][disc]
            and nx * mx + ny * my < 0.0
            for disc, near in sides.items()
            for (one_driven, one_gap, nx, ny), (other_driven, other_gap, mx, my) in combinations(near, 2)
        )
