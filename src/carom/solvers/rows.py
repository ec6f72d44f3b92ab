"""Array to which rows are appended. Appending takes constant time on average."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import DTypeLike, NDArray

from carom.core import pic, pit
from carom.model.trace import EDGE_DTYPE, IMPACT_DTYPE, MODE_DTYPE, SPIN_DTYPE


class Rows:
    """An array to which rows can be appended. Arrays that were returned earlier do not change."""

    def __init__(self, dtype: DTypeLike) -> None:
        self._rows: NDArray[np.void] = np.empty(0, dtype)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, later: NDArray[np.void]) -> None:
        """Append rows. The rows of the first call are stored without a copy."""
        begin, self._count = self._count, self._count + len(later)
        if begin == 0:
            self._rows = later
            return
        if self._count > len(self._rows):  # doubling the size copies each row only once or twice
            rows = np.empty(max(self._count, 2 * begin), self._rows.dtype)
            rows[:begin] = self._rows[:begin]
            self._rows = rows
        self._rows[begin : self._count] = later

    def array(self) -> NDArray[np.void]:
        """Return all rows so far, read-only."""
        rows = self._rows[: self._count]
        rows.flags.writeable = False
        return rows


#: Type of a row with the position of an impact and the number of the wall's part, equal to `Contact` of carom_core.h.
CONTACT_DTYPE = np.dtype([("x", "f8"), ("y", "f8"), ("feature", "i8")])


#: Function that converts rows of impacts, spins or modes. Its second argument contains the unconverted impacts to which
#: the rows of spins belong.
Conversion = Callable[["NDArray[np.void]", "NDArray[np.void]"], "NDArray[np.void]"]


class RecordedImpacts:
    """The impacts that a run has recorded, and the changes of discs between flight, sliding, rolling and rest.

    `edges_of` converts contacts (`CONTACT_DTYPE`) to edges of walls. `edges_of` is None in scenes without finite walls.
    """

    def __init__(
        self,
        run: pic.Kernel | pit.FrameLoop,
        turns: bool,
        edges_of: Callable[[NDArray[np.void]], NDArray[np.void]] | None = None,
    ) -> None:
        self._run = run
        self._conversions: list[Conversion] = []
        self._taken = Rows(IMPACT_DTYPE)
        self._spins = Rows(SPIN_DTYPE) if turns else None
        self._edges_of = edges_of
        self._edges = None if edges_of is None else Rows(EDGE_DTYPE)
        self._modes = Rows(MODE_DTYPE)
        self._contacts: list[NDArray[np.void]] = []  # contacts whose edges are not computed yet

    def __len__(self) -> int:
        return self._run.recorded

    def add_conversion(self, convert: Conversion) -> None:
        """Apply a function to all rows that the log receives from now on, after functions that were added earlier."""
        self._conversions.append(convert)

    def _convert(self, rows: NDArray[np.void], impacts: NDArray[np.void]) -> NDArray[np.void]:
        for convert in self._conversions:
            rows = convert(rows, impacts)
        return rows

    def array(self) -> NDArray[np.void]:
        """Return the impacts so far, read-only, as `trace.IMPACT_DTYPE`.

        The rows of the first call are returned without a copy.
        """
        if len(self._taken) < self._run.recorded:
            taken, spins, contacts = self._run.take_impacts()
            impacts = np.frombuffer(memoryview(taken), IMPACT_DTYPE)
            self._taken.add(self._convert(impacts, impacts))
            if self._spins is not None and spins is not None:
                self._spins.add(self._convert(np.frombuffer(memoryview(spins), SPIN_DTYPE), impacts))
            if contacts is not None:
                self._contacts.append(np.frombuffer(memoryview(contacts), CONTACT_DTYPE))
        return self._taken.array()

    def ambiguous(self) -> tuple[int, ...]:
        """Return the numbers of impacts that may be simultaneous with an earlier one of the same movable disc."""
        return self._run.ambiguous()

    def spins(self) -> NDArray[np.void] | None:
        """Return the spins before and after the impacts so far, as `trace.SPIN_DTYPE`; None if no disc spins."""
        self.array()
        return None if self._spins is None else self._spins.array()

    def modes(self) -> NDArray[np.void] | None:
        """Return the changes between flight, sliding, rolling and rest, as `MODE_DTYPE`; None if there are none."""
        if (taken := self._run.take_modes()) is not None:
            modes = np.frombuffer(memoryview(taken), MODE_DTYPE)
            self._modes.add(self._convert(modes, modes))
        return self._modes.array() if len(self._modes) else None

    def edges(self) -> NDArray[np.void] | None:
        """Return the wall edges that the impacts hit; None in scenes without finite walls."""
        if self._edges_of is None or self._edges is None:
            return None
        self.array()
        while self._contacts:
            self._edges.add(self._edges_of(self._contacts.pop(0)))
        return self._edges.array()
