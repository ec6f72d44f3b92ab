"""Which form of a finite wall is solved for: compiled code, or plain Python where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.extension import extension_available
from carom.solvers.plain.finite_walls import FiniteWall

if TYPE_CHECKING:
    from carom.outline import Outline


def finite_wall(outline: Outline) -> FiniteWall:
    """Return a wall that is solved for in compiled code where that serves, with the same bits."""
    if not extension_available():
        return FiniteWall(outline)
    from carom.solvers.plain.compiled_walls import CompiledWall

    return CompiledWall(outline)
