"""Base class of worlds that can take many steps in one call while nothing touches (`carom.engines.api.QuietWorld`)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class QuietSteps(ABC):
    """A world that reads its state as plain numbers after each step.

    Attributes:
        size_without_warning: If `math.hypot` of all numbers of a state is below this bound, `observe` returns no
            warning.
    """

    size_without_warning = math.inf

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take steps."""

    @abstractmethod
    def read(self) -> list[float]:
        """Return x, y, both components of the velocity and the spin of each disc, in the scene's units."""

    @abstractmethod
    def has_contacts(self) -> bool:
        """Whether the last step may have had contacts."""

    def take_quiet_steps(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> int:
        """Take steps until a step may have contacts or a warning; see `carom.engines.api.QuietWorld`."""
        advance, read, has_contacts, size = self.advance, self.read, self.has_contacts, self.size_without_warning
        numbers: list[float] = []
        for _ in range(len(position_m)):
            advance(1)
            state = read()
            numbers += state
            if has_contacts() or not math.hypot(*state) < size:
                break
        rows = to_rows(numbers).reshape(-1, position_m.shape[1], 5)
        steps_taken = len(rows)
        position_m[:steps_taken], velocity_m_s[:steps_taken] = rows[..., :2], rows[..., 2:4]
        spin_rad_s[:steps_taken] = rows[..., 4]
        return steps_taken


def to_rows(numbers: list[float]) -> Array:
    """Return the numbers of states as an array with a row for each disc."""
    return np.array(numbers, dtype=np.float64).reshape(-1, 5)
