"""The columns of a run of the plain kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.kernel_state import KernelState

if TYPE_CHECKING:
    from carom.disc_arrays import DiscArrays
    from carom.solvers.layout import Columns

__all__ = ["columns_of"]


def columns_of(start: DiscArrays) -> Columns:
    """Return the columns of a run that has not begun, as lists."""
    return KernelState.of(start).as_lists().columns
