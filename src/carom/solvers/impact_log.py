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

from carom.physics.wall_features import are_decidable
from carom.solvers.rows import Rows
from carom.trace import (
    EDGE_DTYPE,
    IMPACT_DTYPE,
    SPIN_DTYPE,
    body_name,
    edge_array,
    impact_array,
    mode_array,
    spin_array,
    wall_index,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.physics.features import Feature
    from carom.solvers.run import Start
    from carom.trace import ImpactRecord, ModeRecord


def standstill_impacts(bodies: int) -> int:
    """Return after how many impacts at one instant time no longer advances, where there are this many bodies.

    Equal discs in a line make at most n(n-1)/2 impacts, all at one instant if they touch; masses 1:100 against a wall
    31, 1:10,000 314. A hundred times the square of the bodies lets all of these through, and ends a run in which time
    stands still after milliseconds; with many bodies ten million above those of a line do, after some seconds.
    """
    return min(100 * bodies**2, 10_000_000 + bodies**2 // 2)


def gliding_note(disc: int, wall: int, time_s: float) -> str:
    """Return what a user is told of a run that ends since a disc glides along a wall."""
    return f"disc {disc} glides along wall {wall} from {time_s:.17g} s on"


def crushing_note(disc: int, between: tuple[int, int], time_s: float) -> str:
    """Return what a user is told of a run that ends since a disc is crushed between two bodies."""
    one, other = map(body_name, between)
    return f"disc {disc} is crushed between {one} and {other} at {time_s:.17g} s"


class LastContact(NamedTuple):
    """An impact as the next one of the same disc sees it.

    Attributes:
        latest_s: The latest that it can have been, seconds.
        nx: Its normal.
        ny: Likewise.
        face: The face of a finite wall that it was on, where no friction acts; None for anything else.
        elastic: Whether nothing is lost on that.
    """

    latest_s: float = -math.inf
    nx: float = 0.0
    ny: float = 0.0
    face: Feature | None = None
    elastic: bool = False

    def interferes(self, begin_s: float, later: LastContact) -> bool:
        """Whether an impact, not before `begin_s`, may be at one instant with this one, which changes what it sees."""
        if not (begin_s <= self.latest_s and later.nx * self.nx + later.ny * self.ny != 0.0):
            return False
        if self.face is None or later.face is None:
            return True
        return not are_decidable(self.face, later.face, elastic=self.elastic and later.elastic)


class Recent:
    """A disc's impacts, as far as they tell whether its next one is ambiguous; compiled: `core/ambiguity.h`."""

    def __init__(self) -> None:
        self.furthest = self.across = LastContact()

    def add_contact(
        self,
        time_s: float,
        resolution_s: float,
        nx: float,
        ny: float,
        face: Feature | None = None,
        *,
        elastic: bool = False,
    ) -> bool:
        """Add an impact; return whether it is ambiguous."""
        furthest, begin_s = self.furthest, time_s - resolution_s
        last = LastContact(time_s + resolution_s, nx, ny, face, elastic)
        found = furthest.interferes(begin_s, last) or self.across.interferes(begin_s, last)
        parallel = nx * furthest.ny == ny * furthest.nx
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
        self.mode_records: list[ModeRecord] = []
        self._impacts = Rows(IMPACT_DTYPE)
        self._ambiguous: list[int] = []
        self._turns = arrays.turns
        self._spins = Rows(SPIN_DTYPE)
        self._rubs_discs, self._materials = arrays.rubs_discs, arrays.materials
        self._edges = None if arrays.has_half_planes else Rows(EDGE_DTYPE)
        self._recent = [Recent() if movable else None for movable in arrays.movable.tolist()]

    def __len__(self) -> int:
        return len(self.records)

    def add(
        self, record: ImpactRecord, resolution_s: float = 0.0, *, kept: bool = True, feature: Feature | None = None
    ) -> bool:
        """Append one impact, whose instant is known to `resolution_s` either way; return whether it is ambiguous.

        One that is not `kept` is only borne in mind for those that follow. `feature` is that of a finite wall.
        """
        discs = [self._recent[body] for body in (record.first, record.second) if body >= 0]
        material = None if record.second >= 0 else self._materials[wall_index(record.second)]
        rubs = self._rubs_discs if material is None else material.friction > 0.0
        nx, ny = (math.nan, math.nan) if rubs else record.normal
        face, elastic = None if rubs else feature, material is not None and material.restitution == 1.0
        found = [
            recent.add_contact(record.time_s, resolution_s, nx, ny, face, elastic=elastic) for recent in discs if recent
        ]
        if any(found) and kept:
            self._ambiguous.append(len(self.records))
        if kept:
            self.records.append(record)
        return any(found)

    def add_mode(self, mode: ModeRecord) -> None:
        """Append how a disc moves from an instant on, where contact that lasts begins, changes or ends."""
        self.mode_records.append(mode._replace(impacts=len(self.records)))

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only array of `carom.trace.IMPACT_DTYPE`, in the order they were carried out."""
        if len(self._impacts) < len(self.records):
            self._impacts.add(impact_array(self.records[len(self._impacts) :]))
        return self._impacts.array()

    def spins(self) -> NDArray[np.void] | None:
        """Return their spins as a read-only array of `carom.trace.SPIN_DTYPE`; None if no disc spins."""
        if self._turns and len(self._spins) < len(self.records):
            self._spins.add(spin_array(self.records[len(self._spins) :]))
        return self._spins.array() if self._turns else None

    def edges(self) -> NDArray[np.void] | None:
        """Return the edges that they were on, as an array of `carom.trace.EDGE_DTYPE`; None without finite walls."""
        if self._edges is not None and len(self._edges) < len(self.records):
            self._edges.add(edge_array(self.records[len(self._edges) :]))
        return None if self._edges is None else self._edges.array()

    def modes(self) -> NDArray[np.void] | None:
        """Return where discs slide, roll or rest, as an array of `carom.trace.MODE_DTYPE`; None if nothing does."""
        return mode_array(self.mode_records) if self.mode_records else None

    def ambiguous(self) -> tuple[int, ...]:
        """Return the rows that are ambiguous."""
        return tuple(self._ambiguous)
