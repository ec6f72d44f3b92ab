"""Stores the states after consecutive steps as rows of arrays, which takes less memory than an object per step."""

from __future__ import annotations

import numpy as np

from carom.engines.api import Contact, Observation
from carom.model.step_windows import States


class StateRows:
    """Arrays of the states after consecutive steps, one row per state.

    Attributes:
        numbers: All numbers of each state, one row per state. Positions, velocities and spins are views of this array.
        position_m: Positions, shape ``(k, n, 2)``.
        velocity_m_s: Velocities, shape ``(k, n, 2)``.
        spin_rad_s: Spins, shape ``(k, n)``; 0 if an adapter reports no spins.
        has_spins: Whether the last state has spins.
        time_s: Times of the states, shape ``(k,)``.
    """

    def __init__(self, count: int, discs: int) -> None:
        self.time_s, self.numbers, self.has_spins = np.zeros(count), np.zeros((count, 5 * discs)), False
        self.position_m = self.numbers[:, : 2 * discs].reshape(count, discs, 2)
        self.velocity_m_s = self.numbers[:, 2 * discs : 4 * discs].reshape(count, discs, 2)
        self.spin_rad_s = self.numbers[:, 4 * discs :]

    def describe_column(self, number: int) -> str:
        """Return the name of the array that contains column `number` of a row, for messages."""
        names = ("position_m", "position_m", "velocity_m_s", "velocity_m_s", "spin_rad_s")
        return f"{names[5 * number // self.numbers.shape[1]]} of an Observation"

    def observation(self, row: int, contacts: tuple[Contact, ...] = ()) -> Observation:
        """Return a state as an observation, with views of its arrays."""
        spins = self.spin_rad_s[row] if self.has_spins else None
        return Observation(self.position_m[row], self.velocity_m_s[row], contacts, spin_rad_s=spins)

    def states(self, rows: slice) -> States:
        """Return a slice of the rows as `States`, with views of its arrays."""
        spins = self.spin_rad_s[rows] if self.has_spins else None
        return States(self.time_s[rows], self.position_m[rows], self.velocity_m_s[rows], spins)
