"""Linear damping ``v' = -c v`` as a change of time, in which damped discs move straight at constant speeds.

With ``s = (1 - exp(-c t)) / c`` a damped path ``x + v s`` is linear in s, and every velocity is ``exp(-c t) = 1 - c s``
of the undamped one. Restitution, Coulomb's law and tangential restitution are homogeneous in velocities, so impacts are
the same. `docs/theory/damping.md` derives it. Single times are exact to the last bit on every machine:
`core/exponentials.h`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.core import damped_time

#: A product c t below this changes a time by less than half a unit in its last place: ``s = t (1 - c t / 2 + ...)``.
_NOTHING = 2.0**-54


@dataclass(frozen=True, slots=True)
class Damping:
    """A rate of damping, and the maps between damped time (of clocks) and undamped time.

    Attributes:
        per_s: The rate c, 0 or more, a second.
    """

    per_s: float

    def kept(self, seconds: float) -> float:
        """Return the remaining part of a speed after some seconds; negative seconds give the earlier speed."""
        return damped_time.kept(self.per_s, seconds)

    def undamped(self, seconds: float) -> float:
        """Return the time in which an undamped disc gets as far as a damped one in some seconds."""
        return damped_time.undamped(self.per_s, seconds)

    def damped(self, undamped_s: float) -> float:
        """Return the time in which a damped disc gets as far as an undamped one in `undamped_s`; infinity for never."""
        return damped_time.damped(self.per_s, undamped_s)

    def all_kept(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `kept` of each of some times."""
        return np.exp(-self.per_s * seconds)

    def all_undamped(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `undamped` of each of some times, 0 or more."""
        way = self.per_s * seconds
        return np.where(way >= _NOTHING, -np.expm1(-way) / (self.per_s or 1.0), seconds)

    def all_damped(self, undamped_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `damped` of each of some times, to the bit."""
        return damped_time.all_damped(self.per_s, np.ravel(undamped_s)).reshape(np.shape(undamped_s))

    def latest(self, seconds: float) -> float:
        """Return the greatest undamped time, 0 or more, that is no later than some seconds, 0 or more, by `damped`.

        So a time that is mapped back is never later than requested. It is a few floats from `undamped`, by the rounding
        of the two functions.
        """
        return damped_time.latest_undamped(self.per_s, seconds)


#: No damping: both times are equal.
UNDAMPED = Damping(0.0)
