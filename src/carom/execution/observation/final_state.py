"""The final state of a run: the state after its last step, moved along free paths to the end of the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carom.comparator.slowing import Slowing
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS
from carom.engines.api import Observation
from carom.model.scene import Scene

Array = NDArray[np.float64]


def compute_gravity(scene: Scene) -> Array:
    """Return each disc's acceleration in free flight, in metres per second squared, shape ``(n, 2)``."""
    return np.array([(0.0, 0.0) if disc.immovable else scene.gravity_m_s2 for disc in scene.discs])


@dataclass(frozen=True)
class LastStep:
    """The last step of a run.

    Attributes:
        scene: The scene.
        begin_s: Start of the step, in seconds; never after the scene's end.
        before: State at the start of the step.
        end_s: End of the step, in seconds; it may be after the scene's end.
        state: State at the end of the step.
    """

    scene: Scene
    begin_s: float
    before: Observation
    end_s: float
    state: Observation

    @cached_property
    def _gravity(self) -> Array:
        return compute_gravity(self.scene)

    @cached_property
    def _slowing(self) -> Slowing:
        return Slowing.of(self.scene)

    def move_to(self, time_s: float) -> Observation:
        """Return the state at a time, provided that no disc has an impact between this time and the step's end.

        The spins are None in a scene without spins.
        """
        seconds, state = time_s - self.end_s, self.state
        speed = np.hypot(*state.velocity_m_s.T).tolist()
        flown_times = np.array([self._slowing.compute_flown_time(seconds, fast) for fast in speed])
        kept_fractions = np.array([self._slowing.compute_kept_fraction(seconds, fast) for fast in speed])
        pull, spin_rate = self._compute_rates_of_change() if seconds < 0.0 else (self._gravity, None)
        spins = None
        if self.scene.arrays.turns:
            spins = np.zeros(len(speed)) if state.spin_rad_s is None else state.spin_rad_s
            spins = spins * kept_fractions if spin_rate is None else spins + spin_rate * seconds
        position = state.position_m + state.velocity_m_s * flown_times[:, None] + pull * (seconds * seconds / 2)
        velocity = state.velocity_m_s * kept_fractions[:, None] + pull * seconds
        return Observation(position, velocity, spin_rad_s=spins)

    def _compute_rates_of_change(self) -> tuple[Array, Array | None]:
        """Return how fast the velocities and spins of all discs change between the scene's end and the step's end.

        For a disc in flight, return the acceleration of gravity. For a resting disc, return the mean rates of the last
        step. A disc counts as resting if its mean acceleration in the last step differs from gravity by more than half
        of gravity, and is at most `RESTING_STEPS` times gravity.
        """
        falls = float(np.hypot(*self.scene.gravity_m_s2))
        if not falls:
            return self._gravity, None
        before, state, lasted_s = self.before, self.state, self.end_s - self.begin_s
        changed = (state.velocity_m_s - before.velocity_m_s) / lasted_s
        braking, left = np.hypot(*(changed - self._gravity).T), np.hypot(*changed.T)
        is_resting = (braking > falls / 2.0) & (left <= RESTING_STEPS * falls)
        pull = np.where(is_resting[:, None], changed, self._gravity)
        if state.spin_rad_s is None or before.spin_rad_s is None:
            return pull, None
        return pull, np.where(is_resting, (state.spin_rad_s - before.spin_rad_s) / lasted_s, 0.0)

    def undo_later_impacts(
        self,
        discs: Sequence[int],
        until_s: float,
        impacts: NDArray[np.void],
        turned_s: Array,
        spins: NDArray[np.void] | None,
    ) -> LastStep:
        """Return a copy of this step that ends at `until_s`.

        Impacts of `discs` that are not in `impacts` are undone.

        Each of the discs flies freely after its last impact, or after the start of the step if it has no impact.

        Args:
            discs: Numbers of the discs.
            until_s: End of the returned step, in seconds.
            impacts: The impacts to keep.
            turned_s: Time at which each impact changed the velocities of its bodies, in seconds.
            spins: Spins before and after each impact; None in a scene without spins.
        """
        position, velocity = self.state.position_m.copy(), self.state.velocity_m_s.copy()
        spin = None if self.state.spin_rad_s is None else self.state.spin_rad_s.copy()
        for disc in discs:
            place, speed, since_s = self.before.position_m[disc], self.before.velocity_m_s[disc], self.begin_s
            turning = None if self.before.spin_rad_s is None else self.before.spin_rad_s[disc]
            is_own_impact = (impacts["first"] == disc) | (impacts["second"] == disc)
            for row in np.flatnonzero((turned_s > self.begin_s) & is_own_impact).tolist():
                side = "first" if impacts["first"][row] == disc else "second"
                place, _ = self._fly(disc, place, speed, float(turned_s[row]) - since_s)
                speed, since_s = impacts[f"velocity_{side}_after"][row], float(turned_s[row])
                turning = turning if spins is None else spins[f"{side}_after"][row]
            position[disc], velocity[disc] = self._fly(disc, place, speed, until_s - since_s)
            if spin is not None and turning is not None:
                spin[disc] = turning * self._slowing.damping.compute_kept_fraction(until_s - since_s)
        moved_state = replace(self.state, position_m=position, velocity_m_s=velocity, spin_rad_s=spin)
        return replace(self, end_s=until_s, state=moved_state)

    def _fly(self, disc: int, place: Array, speed: Array, seconds: float) -> tuple[Array, Array]:
        """Return position and velocity of a disc after some seconds of free flight."""
        pull, fast = self._gravity[disc], float(np.hypot(*speed))
        displacement = speed * self._slowing.compute_flown_time(seconds, fast) + pull * (seconds * seconds / 2)
        return place + displacement, speed * self._slowing.compute_kept_fraction(seconds, fast) + pull * seconds
