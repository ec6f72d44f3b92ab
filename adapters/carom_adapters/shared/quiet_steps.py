"""Base class of worlds that can take many steps without contacts in one call (`carom.engines.api.QuietWorld`)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class QuietSteps(ABC):
    """A world that reads its state as plain numbers after each step.

    Attributes:
        size_without_warning: Bound for the root of the sum of the squares of all numbers of a state. Below this bound,
            `observe` returns no warning.
    """

    size_without_warning = math.inf

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take steps."""

    @abstractmethod
    def read(self) -> list[tuple[float, ...]]:
        """Return x, y, both components of the velocity and the spin of each disc, in the scene's units."""

    @abstractmethod
    def has_contacts(self) -> bool:
        """Whether the last step may have contacts."""

    def take_quiet_steps(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> int:
        """Take steps until a step may have contacts or a warning; see `carom.engines.api.QuietWorld`."""
        found: list[tuple[float, ...]] = []
        for _ in range(len(position_m)):
            self.advance(1)
            state = self.read()
            found += state
            if self.has_contacts() or not math.hypot(*chain.from_iterable(state)) < self.size_without_warning:
                break
        discs: int = position_m.shape[1]
        steps_taken = len(found) // discs
        numbers = to_rows(found).reshape(steps_taken, discs, 5)
        position_m[:steps_taken], velocity_m_s[:steps_taken] = numbers[..., :2], numbers[..., 2:4]
        spin_rad_s[:steps_taken] = numbers[..., 4]
        return steps_taken


def to_rows(states: Iterable[Iterable[float]]) -> Array:
    """Return the numbers of states as rows of an array.

    All numbers are first put into one list, since NumPy converts one list twice as fast as many small sequences.
    """
    return np.array([*chain.from_iterable(states)], dtype=np.float64).reshape(-1, 5)
