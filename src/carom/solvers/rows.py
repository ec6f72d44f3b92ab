"""Rows that are added to and never changed: a log that is looked at after every step, in linear time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import DTypeLike, NDArray

__all__ = ["Rows"]


class Rows:
    """An array that grows; what it has given out stays as it was."""

    def __init__(self, dtype: DTypeLike) -> None:
        self._room: NDArray[np.void] = np.empty(0, dtype)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, later: NDArray[np.void]) -> None:
        """Add rows: the first are taken as they are, without a copy."""
        begin, self._count = self._count, self._count + len(later)
        if begin == 0:
            self._room = later
            return
        if self._count > len(self._room):  # doubled, so that each row is copied once or twice in all
            room = np.empty(max(self._count, 2 * begin), self._room.dtype)
            room[:begin] = self._room[:begin]
            self._room = room
        self._room[begin : self._count] = later

    def array(self) -> NDArray[np.void]:
        """Return all rows so far, read-only."""
        rows = self._room[: self._count]
        rows.flags.writeable = False
        return rows
