"""The impacts that a run of the event-driven kernel has recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.trace import IMPACT_DTYPE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.event_driven import kernel

__all__ = ["RecordedImpacts"]


class RecordedImpacts:
    """Impacts in their order: the memory that the kernel wrote them into, handed over when somebody asks."""

    def __init__(self, run: kernel.Kernel) -> None:
        self._kernel = run
        self._taken = np.empty(0, IMPACT_DTYPE)

    def __len__(self) -> int:
        return self._kernel.recorded

    def array(self) -> NDArray[np.void]:
        """Return the impacts so far as a read-only array of `carom.trace.IMPACT_DTYPE`.

        Without a copy the first time; what comes later is joined to what was there.
        """
        if len(self._taken) < self._kernel.recorded:
            new = self._kernel.take_impacts()
            self._taken = np.concatenate([self._taken, new]) if len(self._taken) else new
        self._taken.flags.writeable = False
        return self._taken

    def ambiguous(self) -> tuple[int, ...]:
        """Return the rows of `array` that share a movable disc with an earlier one at what may be the same instant."""
        return self._kernel.ambiguous()
