"""The impacts that a run of the event-driven kernel keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.layout import RECORD
from carom.trace import IMPACT_DTYPE, ImpactRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.layout import Column

__all__ = ["KeptImpacts"]


class KeptImpacts:
    """Impacts in their order, as the kernel wrote them; turned into what a trace holds only when somebody asks."""

    def __init__(self) -> None:
        self._blocks: list[NDArray[np.float64]] = []
        self._count = 0
        self._records: list[ImpactRecord] = []

    def __len__(self) -> int:
        return self._count

    def add(self, records: Column, count: int) -> None:
        """Take over the first `count` rows of the kernel's buffer."""
        if count:
            self._blocks.append(np.array(records[: count * RECORD], np.float64).reshape(count, RECORD))
            self._count += count

    def rows(self) -> NDArray[np.float64]:
        """Return all rows, shape ``(n, 14)``, in the columns of the kernel's layout."""
        if len(self._blocks) != 1:
            self._blocks = [np.concatenate(self._blocks) if self._blocks else np.empty((0, RECORD))]
        return self._blocks[0]

    def array(self) -> NDArray[np.void]:
        """Return the impacts as a read-only structured array of `IMPACT_DTYPE`."""
        rows = self.rows()
        impacts = np.empty(len(rows), IMPACT_DTYPE)
        impacts["time_s"], impacts["first"], impacts["second"] = rows[:, 0], rows[:, 1], rows[:, 2]
        for k, name in enumerate(IMPACT_DTYPE.names[3:] if IMPACT_DTYPE.names else ()):
            impacts[name] = rows[:, 3 + 2 * k : 5 + 2 * k]
        impacts.flags.writeable = False
        return impacts

    def ambiguous(self, immovable: NDArray[np.bool_]) -> tuple[int, ...]:
        """Return the indices of impacts whose result hangs on the order taken.

        They share a movable disc with an earlier impact at what may be the same instant, their difference being no more
        than rounding makes of it, unless the two normals are exactly orthogonal: then neither impulse changes what the
        other sees. A third impact can't be orthogonal to two that are, so each is held against the disc's last two.
        """
        rows = self.rows()
        discs = np.concatenate([rows[:, 1], rows[:, 2]]).astype(np.int64)
        impact = np.tile(np.arange(len(rows)), 2)
        movable = discs >= 0  # not a wall
        movable[movable] = ~immovable[discs[movable]]
        discs, impact = discs[movable], impact[movable]
        order = np.lexsort((impact, discs))
        discs, impact = discs[order], impact[order]
        found: set[int] = set()
        for lag in (1, 2):
            later, earlier = impact[lag:], impact[:-lag]
            with np.errstate(over="ignore"):  # a contact all but at rest is known to no time at all
                known = rows[later, -1] + rows[earlier, -1]
            together = (discs[lag:] == discs[:-lag]) & (rows[later, 0] - rows[earlier, 0] <= known)
            later, earlier = later[together], earlier[together]
            across = np.sum(rows[later, 3:5] * rows[earlier, 3:5], axis=1) == 0.0
            found.update(later[~across].tolist())
        return tuple(sorted(found))

    @property
    def records(self) -> list[ImpactRecord]:
        """The impacts as records; those made before are not made again."""
        if len(self._records) < self._count:
            for row in self.rows()[len(self._records) :].tolist():
                vectors = [(row[k], row[k + 1]) for k in range(3, RECORD - 1, 2)]
                self._records.append(ImpactRecord(row[0], int(row[1]), int(row[2]), *vectors))
        return self._records
