"""Linear damping ``v' = -c v``. Motion with damping equals motion without damping in another time variable s.

With ``s = (1 - exp(-c t)) / c``, a damped disc has the position ``x + v s``, which is linear in s. Every velocity is
``exp(-c t) = 1 - c s`` times the undamped velocity. The same impacts happen as without damping, because the laws of
impact remain true if all velocities are multiplied by one factor. `docs/theory/damping.md` derives this. Conversions of
single times are bit-identical on every machine; see `core/arithmetic/exponentials.h`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.core import damped_time

#: If ``c t`` is below this number, s equals t except for rounding, because ``s = t (1 - c t / 2 + ...)``.
_NOTHING = 2.0**-54


@dataclass(frozen=True, slots=True)
class Damping:
    """A rate c of damping, and conversions between clock time t and undamped time ``s = (1 - exp(-c t)) / c``.

    Attributes:
        per_s: The rate c, in 1/s, 0 or more.
    """

    per_s: float

    def compute_kept_fraction(self, seconds: float) -> float:
        """Return the fraction of a speed that is left after a time. For a negative time, the fraction is above 1."""
        return damped_time.kept(self.per_s, seconds)

    def to_undamped(self, seconds: float) -> float:
        """Return the time in which an undamped disc moves as far as a damped disc in `seconds`."""
        return damped_time.undamped(self.per_s, seconds)

    def to_damped(self, undamped_s: float) -> float:
        """Return the time in which a damped disc moves as far as an undamped disc in `undamped_s`.

        The time is infinite if the damped disc never moves as far.
        """
        return damped_time.damped(self.per_s, undamped_s)

    def to_undamped_array(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the result of `to_undamped` for each time. Times must be 0 or more."""
        if not self.per_s:
            return seconds
        exponent = self.per_s * seconds
        return np.where(exponent >= _NOTHING, -np.expm1(-exponent) / self.per_s, seconds)

    def to_damped_array(self, undamped_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return exactly the result of `to_damped` for each time."""
        if not self.per_s:
            return undamped_s
        return damped_time.all_damped(self.per_s, np.ravel(undamped_s)).reshape(np.shape(undamped_s))

    def find_latest_undamped(self, seconds: float) -> float:
        """Return the greatest undamped time, 0 or more, whose damped time is at most `seconds`.

        `seconds` must be 0 or more. Because of rounding, ``to_damped(to_undamped(seconds))`` may be greater than
        `seconds`. The result of this function differs from ``to_undamped(seconds)`` by a few units in the last place.
        """
        return damped_time.latest_undamped(self.per_s, seconds)


#: No damping: clock time and undamped time are equal.
UNDAMPED = Damping(0.0)
