"""Linear damping ``v' = -c v`` as a change of time: in it, damped discs move in straight lines at constant speeds.

With ``s = (1 - exp(-c t)) / c`` a damped path ``x + v s`` is straight in s, and what is left of every velocity is
``exp(-c t) = 1 - c s`` of what it would be undamped. Restitution, Coulomb's law and tangential restitution are
homogeneous in velocities, so that impacts are the same. `docs/damping.md` derives it.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.exponentials import exp, expm1, log1p

#: A product c t below this changes a time by less than half a unit in its last place: ``s = t (1 - c t / 2 + ...)``.
_NOTHING = 2.0**-54


@dataclass(frozen=True, slots=True)
class Damping:
    """A rate of damping, and the two times that belong to it: that of clocks, and that of undamped motion.

    Attributes:
        per_s: The rate c, 0 or more, a second.
    """

    per_s: float

    def kept(self, seconds: float) -> float:
        """Return what is left of a speed after some seconds, over the speed; below 0 seconds, what it was before."""
        try:
            return exp(-self.per_s * seconds)
        except OverflowError:
            return math.inf

    def undamped(self, seconds: float) -> float:
        """Return in what time an undamped disc would get as far as a damped one does in some seconds."""
        if not abs(self.per_s * seconds) >= _NOTHING:  # NaN stays NaN
            return seconds
        try:
            return -expm1(-self.per_s * seconds) / self.per_s
        except OverflowError:
            return -math.inf

    def damped(self, undamped_s: float) -> float:
        """Return how long a damped disc takes to get as far as an undamped one in `undamped_s`; infinity for never."""
        way = self.per_s * undamped_s
        if not abs(way) >= _NOTHING:  # NaN stays NaN
            return undamped_s
        return math.inf if way >= 1.0 else -log1p(-way) / self.per_s

    def all_kept(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `kept` of each of some times."""
        return np.exp(-self.per_s * seconds)

    def all_undamped(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `undamped` of each of some times, 0 or more."""
        way = self.per_s * seconds
        return np.where(way >= _NOTHING, -np.expm1(-way) / (self.per_s or 1.0), seconds)

    def all_damped(self, undamped_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `damped` of each of some times, 0 or more; infinity for never."""
        if not self.per_s:
            return undamped_s
        way = self.per_s * undamped_s
        reached = np.where((way >= _NOTHING) & (way < 1.0), way, 0.0)
        met = np.where(way >= _NOTHING, -np.log1p(-reached) / self.per_s, undamped_s)
        return np.where(way >= 1.0, np.inf, met)

    def latest(self, seconds: float) -> float:
        """Return the greatest undamped time, 0 or more, that is no later than some seconds, 0 or more, by `damped`.

        So what is mapped back is never later than what was asked for. From `undamped` it is a few floats away, which
        is how far the two functions round.
        """
        seconds = min(seconds, sys.float_info.max)  # what is never met is not met at the end of time
        found = min(max(self.undamped(seconds), 0.0), sys.float_info.max)
        while (later := math.nextafter(found, math.inf)) != found and self.damped(later) <= seconds:
            found = later
        while self.damped(found) > seconds:
            found = math.nextafter(found, 0.0)
        return found


#: None at all: both times are one.
UNDAMPED = Damping(0.0)
