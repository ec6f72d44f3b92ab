"""The impacts of a run as they happen: recorded, and watched for those whose result no physics decides.

An impact is *ambiguous* where it shares a movable disc with an earlier recorded one at what may be the same instant, as
far as `carom.solvers.impact.resolution` knows both; unless the two normals are exactly orthogonal, for then neither
impulse changes what the other impact sees. The result then depends on an order that is a convention: (time, first,
second).
Friction pushes across the normal, too: an impact with friction counts as one of no direction (NaN), orthogonal to none.

Of a disc's earlier impacts no more than two need be known. No direction is orthogonal to two that are not parallel. So
of all impacts that reach as far as some later one, the one that reaches furthest interferes with it, or else the one
does that reaches furthest of those not parallel to it, or else none does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.solvers.rows import Rows
from carom.trace import IMPACT_DTYPE, SPIN_DTYPE, impact_array, spin_array

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.solvers.run import Start
    from carom.trace import ImpactRecord

__all__ = ["ImpactLog", "Recent", "standstill_impacts"]


def standstill_impacts(bodies: int) -> int:
    """Return after how many impacts at one instant time no longer advances, where there are so many bodies.

    Equal discs in a line make at most n(n-1)/2 impacts, all at one instant if they touch; masses 1:100 against a wall
    31, 1:10,000 314. A hundred times the square of the bodies lets all of these through, and ends a run in which time
    stands still after milliseconds; with many bodies ten million above those of a line do, after some seconds.
    """
    return min(100 * bodies**2, 10_000_000 + bodies**2 // 2)


class LastContact(NamedTuple):
    """An impact as the next one of the same disc sees it: the latest that it can have been, seconds, and its normal."""

    latest_s: float = -math.inf
    nx: float = 0.0
    ny: float = 0.0

    def interferes(self, begin_s: float, nx: float, ny: float) -> bool:
        """Whether an impact, not before `begin_s`, may be at one instant with this one, which changes what it sees."""
        return begin_s <= self.latest_s and nx * self.nx + ny * self.ny != 0.0


class Recent:
    """A disc's impacts, as far as they tell whether its next one is ambiguous; compiled: `impact/ambiguity.pxd`."""

    def __init__(self) -> None:
        self.furthest = self.across = LastContact()

    def add_contact(self, time_s: float, resolution_s: float, nx: float, ny: float) -> bool:
        """Add an impact; return whether it is ambiguous."""
        furthest, begin_s = self.furthest, time_s - resolution_s
        found = furthest.interferes(begin_s, nx, ny) or self.across.interferes(begin_s, nx, ny)
        parallel = nx * furthest.ny == ny * furthest.nx
        last = LastContact(time_s + resolution_s, nx, ny)
        if last.latest_s > furthest.latest_s:
            if not parallel:
                self.across = furthest
            self.furthest = last
        elif not parallel and last.latest_s > self.across.latest_s:
            self.across = last
        return found


class ImpactLog:
    """Impacts in order, and those without a unique answer."""

    def __init__(self, start: Start) -> None:
        arrays = start.arrays
        self.records: list[ImpactRecord] = []
        self._impacts = Rows(IMPACT_DTYPE)
        self._ambiguous: list[int] = []
        self._turns = arrays.turns
        self._spins = Rows(SPIN_DTYPE)
        self._rubs_discs, self._rubs_walls = arrays.rubs_discs, arrays.rubs_walls
        self._recent = [Recent() if movable else None for movable in arrays.movable.tolist()]

    def __len__(self) -> int:
        return len(self.records)

    def add(self, record: ImpactRecord, resolution_s: float = 0.0, *, kept: bool = True) -> bool:
        """Append one impact, whose instant is known to `resolution_s` either way; return whether it is ambiguous.

        One that is not `kept` is only borne in mind for those that follow.
        """
        discs = [self._recent[body] for body in (record.first, record.second) if body >= 0]
        rubs = self._rubs_discs if record.second >= 0 else self._rubs_walls
        nx, ny = (math.nan, math.nan) if rubs else record.normal
        found = [recent.add_contact(record.time_s, resolution_s, nx, ny) for recent in discs if recent]
        if any(found) and kept:
            self._ambiguous.append(len(self.records))
        if kept:
            self.records.append(record)
        return any(found)

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only array of `carom.trace.IMPACT_DTYPE`, in the order they were carried out."""
        if len(self._impacts) < len(self.records):
            self._impacts.add(impact_array(self.records[len(self._impacts) :]))
        return self._impacts.array()

    def spins(self) -> NDArray[np.void] | None:
        """Return their spins as a read-only array of `carom.trace.SPIN_DTYPE`; None where nothing turns."""
        if self._turns and len(self._spins) < len(self.records):
            self._spins.add(spin_array(self.records[len(self._spins) :]))
        return self._spins.array() if self._turns else None

    def ambiguous(self) -> tuple[int, ...]:
        """Return the rows that are ambiguous."""
        return tuple(self._ambiguous)
