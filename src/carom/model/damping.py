"""Linear damping ``v' = -c v``, described by a time variable s in which damped discs have constant velocities.

With ``s = (1 - exp(-c t)) / c`` a damped path ``x + v s`` is linear in s. Every velocity is ``exp(-c t) = 1 - c s``
times the undamped one. Impacts don't change: restitution, Coulomb's law and tangential restitution are homogeneous in
velocities. `docs/theory/damping.md` derives this. Conversions of single times have the same bits on every machine,
see `core/arithmetic/exponentials.h`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.core import damped_time

#: If a product c t is below this, damping changes a time by less than half a unit in its last place:
#: ``s = t (1 - c t / 2 + ...)``.
_NOTHING = 2.0**-54


@dataclass(frozen=True, slots=True)
class Damping:
    """A rate of damping, and conversions between damped time (clock time) and undamped time.

    Attributes:
        per_s: The rate c, 1/s, 0 or more.
    """

    per_s: float

    def compute_kept_fraction(self, seconds: float) -> float:
        """Return the fraction of a speed that is left after a time. A negative time gives a factor above 1."""
        return damped_time.kept(self.per_s, seconds)

    def to_undamped(self, seconds: float) -> float:
        """Return the time in which an undamped disc moves as far as a damped disc does in `seconds`."""
        return damped_time.undamped(self.per_s, seconds)

    def to_damped(self, undamped_s: float) -> float:
        """Return the time in which a damped disc moves as far as an undamped disc does in `undamped_s`, or infinity."""
        return damped_time.damped(self.per_s, undamped_s)

    def to_undamped_array(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the result of `to_undamped` for each time. Times must be 0 or more."""
        exponent = self.per_s * seconds
        return np.where(exponent >= _NOTHING, -np.expm1(-exponent) / (self.per_s or 1.0), seconds)

    def to_damped_array(self, undamped_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the result of `to_damped` for each time, with the same bits."""
        return damped_time.all_damped(self.per_s, np.ravel(undamped_s)).reshape(np.shape(undamped_s))

    def find_latest_undamped(self, seconds: float) -> float:
        """Return the greatest undamped time that `to_damped` converts to at most `seconds`; both are 0 or more.

        So a time that is converted back is never later than the given time. The result differs from the result of
        `to_undamped` by a few units in the last place, because both functions round.
        """
        return damped_time.latest_undamped(self.per_s, seconds)


#: No damping: both times are equal.
UNDAMPED = Damping(0.0)
