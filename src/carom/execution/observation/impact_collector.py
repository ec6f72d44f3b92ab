"""Builds impacts from the states and contacts that an engine reports after each step.

A contact that lasts several steps becomes one impact. The velocities before the impact are those at the start of the
contact's first step. The velocities after the impact are those at the end of the contact's last step. If an engine
reports velocities with a contact, the reported velocities are used instead.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from carom.comparator.slowing import Slowing
from carom.engines.api import Contact, Observation
from carom.execution.observation.final_state import compute_gravity
from carom.execution.observation.open_contact import Motion, Motions, OpenContact, Pair
from carom.model.disc_arrays import STANDS
from carom.model.scene import Scene
from carom.model.trace import STATE_DTYPE, ImpactRecord, Vector, build_impact_array, build_spin_array, wall_index

#: A row of `STATE_DTYPE`.
_State = tuple[float, Vector, Vector]
_UNKNOWN: Vector = (math.nan, math.nan)
_NOWHERE: Vector = (0.0, 0.0)

#: Two touching bodies count as resting if their relative speed along the normal is at most the speed that gravity adds
#: in this number of steps. An engine may need one step to test for contact, and another step to change the velocities.
#: A leapfrog scheme, whose positions and velocities belong to times half a step apart, adds half a step.
_REST_STEPS = 2.5


class ImpactCollector:
    """Collects the observation after each step and returns the impacts of the whole run.

    Attributes:
        open: Contacts that may continue in the next step.
    """

    def __init__(self, scene: Scene, start: Observation, float_bits: int = 64) -> None:
        arrays = scene.arrays
        self._float_bits = float_bits
        self._discs = scene.discs
        self._inverse_mass = [1.0 / disc.mass_kg for disc in scene.discs]
        # Change of a disc's spin per newton second of tangential impulse; 0 for a disc that can't turn.
        self._spin_per_impulse = (1.0 / (arrays.inertia * arrays.mass_kg * arrays.radius_m)).tolist()
        self._turns = arrays.turns
        self._has_disc_friction, self._has_wall_friction = arrays.has_disc_friction, arrays.has_wall_friction
        self._walls = [arrays.drive_of_wall(k) for k in range(len(arrays.walls))]
        self._driven = dict(zip(arrays.driven_discs, arrays.disc_drives, strict=True))
        self._gravity, self._pull = compute_gravity(scene), math.hypot(*scene.gravity_m_s2)
        self._slowing = Slowing.of(scene)
        self._last = start
        self._last_s = 0.0
        self.open: dict[Pair, OpenContact] = {}
        self._done: list[tuple[int, ImpactRecord, float, _State]] = []
        self._numbers = count(1)

    def skip_to(self, time_s: float, observation: Observation) -> None:
        """Replace the last state by the state at `time_s`. The steps between the two states must have no contacts."""
        self._last, self._last_s = observation, time_s

    def add(self, time_s: float, observation: Observation) -> None:
        """Add the validated state and contacts of the step that ended at `time_s`."""
        before = self._last
        active: dict[Pair, Contact] = {}
        struck_discs: set[int] = set()
        for contact in observation.contacts:
            pair = (contact.first, contact.second)
            if contact.velocities is not None:
                spins = contact.spins_rad_s if self._turns else None
                record = ImpactRecord(contact.time_s, *pair, contact.normal, *contact.velocities, spins)
                # The state before a disc's first impact in the step is the state at the step's start. The state before
                # later impacts in the same step is unknown.
                free = contact.time_s == self._last_s or struck_discs.isdisjoint(pair)
                struck_discs.update(self._list_movable(pair))
                state = _build_state(pair, self._last_s, before if free else None)
                self._done.append((next(self._numbers), record, contact.time_s, state))
            elif self._has_effect(contact, before, observation, time_s - self._last_s):
                active[pair] = contact
        touched = Counter(body for pair in active for body in self._list_movable(pair))
        motion = {body: self._motion_of(before, body) for body in touched}
        for pair in [pair for pair in self.open if pair not in active]:
            self._close(pair)
        for pair, contact in active.items():
            self._extend(pair, contact, motion, touched, time_s, observation)
        self._last, self._last_s = observation, time_s

    def finish(self) -> tuple[NDArray[np.void], NDArray[np.float64], NDArray[np.void], NDArray[np.void] | None]:
        """Return the impacts, sorted by reported time, with effective times, the states before them, and spins.

        The effective time of an impact is the instant at which the paths of the bodies turn. In a scene without spins,
        the spins are None.
        """
        for pair in list(self.open):
            self._close(pair)
        # Impacts with the same time are sorted by the order in which their contacts began.
        ordered = sorted(self._done, key=lambda item: (item[1].time_s, item[0]))
        effective = np.array([effective for _, _, effective, _ in ordered], dtype=np.float64)
        states = np.array([state for _, _, _, state in ordered], dtype=STATE_DTYPE)
        records = [record for _, record, _, _ in ordered]
        return build_impact_array(records), effective, states, build_spin_array(records) if self._turns else None

    def _list_movable(self, pair: Pair) -> list[int]:
        return [body for body in pair if body >= 0 and self._inverse_mass[body] > 0.0]

    def _motion_of(self, state: Observation, body: int) -> Motion:
        spin = state.spin_rad_s
        return (*_to_vector(state.velocity_m_s, body), 0.0 if spin is None or not self._turns else float(spin[body]))

    def _find_unchanged_motion(self, body: int, time_s: float) -> Motion:
        """Return velocity and spin of an immovable or driven body in the step that ends at `time_s`."""
        middle_s = 0.5 * (self._last_s + time_s)
        if body < 0:
            return (*self._walls[wall_index(body)].velocity_at(middle_s), 0.0)
        return (*self._driven.get(body, STANDS).velocity_at(middle_s), self._discs[body].spin_rad_s)

    def _has_effect(self, contact: Contact, before: Observation, after: Observation, step_s: float) -> bool:
        """Whether a reported contact changed a velocity or spin. Engines also report contacts in which no force acts.

        A contact of two immovable bodies has no effect. If no impulse is reported, a contact has an effect unless
        damping or a table explains all changes of velocity and spin.
        """
        if not self._list_movable((contact.first, contact.second)):
            return False
        if contact.impulse_n_s is not None:
            return contact.impulse_n_s > 0.0
        bodies = [body for body in (contact.first, contact.second) if body >= 0]
        motions = [(self._motion_of(before, body), self._motion_of(after, body)) for body in bodies]
        if not self._slowing:
            return any(was != is_now for was, is_now in motions)
        kept_fractions = [self._slowing.compute_kept_fraction(step_s, math.hypot(*was[:2])) for was, _ in motions]
        return any(
            math.dist([left * part for part in was], is_now) > (1.0 - left) * math.hypot(*was)
            for (was, is_now), left in zip(motions, kept_fractions, strict=True)
        )

    def _extend(
        self,
        pair: Pair,
        contact: Contact,
        motion: dict[int, Motion],
        touched: Counter[int],
        time_s: float,
        observation: Observation,
    ) -> None:
        """Open a contact, or extend it by a step.

        `motion` contains the velocity and spin of movable discs after the earlier contacts of the step. This method
        updates `motion`, and adds the velocity and spin of other bodies. `touched` contains the number of contacts of
        each movable disc in the step.
        """
        first, second = pair
        for body in pair:
            if body not in motion:
                motion[body] = self._find_unchanged_motion(body, time_s)
        motions_before = (motion[first], motion[second])
        for body, sign in ((first, -1.0), (second, 1.0)):
            if touched[body] > 1 and self._has_all_impulses(contact):
                motion[body] = self._apply_impulse(motion[body], contact, body, sign)
            elif body in touched:
                motion[body] = self._motion_of(observation, body)
        after = (motion[first], motion[second])
        approaches = _compute_separation_speed(motions_before, contact.normal) < 0.0
        known = self.open.get(pair)
        if known and approaches and _compute_separation_speed(known.after, known.reported.normal) > 0.0:
            # The two bodies separated, and a third body pushed them together again, so this contact is a second impact.
            self._close(pair)
        if pair not in self.open:
            number, start_s, start = next(self._numbers), self._last_s, self._last
            self.open[pair] = OpenContact(number, contact, motions_before, start_s, start, after, time_s, observation)
        known = self.open[pair]
        known.after, known.end_s, known.end = after, time_s, observation
        known.is_isolated = known.is_isolated and all(touched[body] <= 1 for body in pair)
        impulse = contact.impulse_n_s
        if impulse is None:
            impulse = math.dist(_compute_relative_velocity(after), _compute_relative_velocity(motions_before))
        known.add(impulse, contact.normal)
        # A pair does not rest if its normal speed exceeds the speed that free fall adds in `_REST_STEPS` steps.
        slowest = _REST_STEPS * self._pull * (time_s - self._last_s)
        if not abs(_compute_separation_speed(after, contact.normal)) <= slowest:
            known.at_rest = None
        elif known.at_rest is None:
            known.at_rest = replace(known)

    def _has_all_impulses(self, contact: Contact) -> bool:
        """Whether the engine reports the normal impulse and, for bodies with friction, the tangential impulse."""
        has_friction = self._has_wall_friction if contact.second < 0 else self._has_disc_friction
        return contact.impulse_n_s is not None and (not has_friction or contact.tangential_impulse_n_s is not None)

    def _apply_impulse(self, motion: Motion, contact: Contact, body: int, sign: float) -> Motion:
        """Return a body's velocity and spin after the impulses of a contact.

        `motion` contains velocity and spin before the impulses.
        """
        (vx, vy, spin), (nx, ny) = motion, contact.normal
        by_normal = sign * (contact.impulse_n_s or 0.0) * self._inverse_mass[body]
        vx, vy = vx + by_normal * nx, vy + by_normal * ny
        tangential = contact.tangential_impulse_n_s
        if not tangential:  # without friction, results stay bit-identical
            return (vx, vy, spin)
        by_friction = sign * tangential * self._inverse_mass[body]
        return (vx - by_friction * ny, vy + by_friction * nx, spin - tangential * self._spin_per_impulse[body])

    def _close(self, pair: Pair) -> None:
        open_contact = self.open.pop(pair)
        contact = open_contact.cut_at_rest()
        # If the velocities before and after the contact are equal, the two paths differ only by rounding, and their
        # intersection has no physical meaning.
        effective = math.nan
        if contact.is_isolated and contact.has_turned(self._float_bits):
            drive = self._walls[wall_index(pair[1])] if pair[1] < 0 else STANDS
            leg = drive.leg_at(0.5 * (contact.start_s + contact.end_s))
            if contact is open_contact:
                effective = contact.compute_turn_time(self._gravity, self._slowing, leg)
            else:  # the pair comes to rest
                effective = contact.compute_landing_time(self._gravity, leg)
        # Gravity accelerates two falling discs equally, so their relative path is straight. Relative to an immovable
        # body, a disc falls on a parabola.
        falls = self._pull > 0.0
        bent = falls and len(self._list_movable(pair)) < len(pair)
        motions = [*contact.before, *contact.after]
        if self._slowing or (falls and not bent and math.isfinite(effective)):
            motions = self._compute_motions_at_impact(effective, contact)
        a, b, c, d = motions
        spins = (a[2], b[2], c[2], d[2]) if self._turns else None
        velocities = (a[:2], b[:2], c[:2], d[:2])
        record = ImpactRecord(contact.reported.time_s, *pair, contact.compute_normal(), *velocities, spins)
        state = _build_state(pair, contact.start_s, contact.start if contact.is_isolated and not bent else None)
        self._done.append((contact.number, record, effective, state))

    def _compute_motions_at_impact(self, effective_s: float, contact: OpenContact) -> list[Motion]:
        """Return velocities and spins of two falling, damped or braked discs just before and just after their impact.

        The velocities and spins are known at step boundaries. Between the impact and a step boundary, the velocities
        change by gravity or by slowing. A scene has at most one of these two effects. For slowed discs, the instant may
        be before the contact's start or after its end by at most the contact's duration. If the instant can't be
        computed, the reported instant is used.
        """
        beyond_s = contact.end_s - contact.start_s if self._slowing else 0.0
        at_s = effective_s if math.isfinite(effective_s) else contact.reported.time_s
        at_s = min(max(at_s, contact.start_s - beyond_s), contact.end_s + beyond_s)
        gx, gy = _to_vector(self._gravity, contact.reported.first)
        motions = []
        for both, since_s in ((contact.before, contact.start_s), (contact.after, contact.end_s)):
            for vx, vy, spin in both:
                if self._slowing:
                    kept = self._slowing.compute_kept_fraction(at_s - since_s, math.hypot(vx, vy))
                    motions.append((vx * kept, vy * kept, spin * kept))
                else:
                    motions.append((vx + gx * (at_s - since_s), vy + gy * (at_s - since_s), spin))
        return motions


def _build_state(pair: Pair, time_s: float, state: Observation | None) -> _State:
    """Return the state before an impact.

    If `state` is None, the positions are not known, and become NaN.
    """
    if state is None:
        return (time_s, _UNKNOWN, _UNKNOWN)
    first, second = pair
    place = _NOWHERE if second < 0 else _to_vector(state.position_m, second)
    return (time_s, _to_vector(state.position_m, first), place)


def _to_vector(array: NDArray[np.float64], body: int) -> Vector:
    return (float(array[body, 0]), float(array[body, 1]))


def _compute_relative_velocity(motions: Motions) -> Vector:
    """Return the velocity of the second body relative to the first."""
    (ux, uy, _), (vx, vy, _) = motions
    return (vx - ux, vy - uy)


def _compute_separation_speed(motions: Motions, normal: Vector) -> float:
    """Return the speed along the normal at which two bodies separate; negative if they approach."""
    x, y = _compute_relative_velocity(motions)
    return x * normal[0] + y * normal[1]
