"""Finite walls for who asks for one disc at a time: in compiled code, or in plain Python where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.extension import extension_available
from carom.physics.numbered import numbers_of
from carom.solvers.plain.finite_walls import FiniteWall

if TYPE_CHECKING:
    from carom.outline import Outline
    from carom.physics.features import Feature, Mover
    from carom.physics.wall_features import WallFeature


class CompiledWall(FiniteWall):
    """A `FiniteWall`, to the bit; it needs the compiled extension."""

    def __init__(self, outline: Outline) -> None:
        from carom.core import primitives

        super().__init__(outline)
        self._times = primitives.WallFeatures([numbers_of(part.feature, 0) for part in self.features])

    def next_time(self, disc: Mover, last: Feature | None) -> tuple[float, WallFeature | None, bool]:
        """Return what `FiniteWall.next_time` does."""
        left = next((k for k, part in enumerate(self.features) if part.feature is last), -1)
        time_s, number, glides = self._times.first_touch(disc, left)
        return time_s, None if number < 0 else self.features[number], glides


def finite_wall(outline: Outline) -> FiniteWall:
    """Return a wall that is solved for in compiled code where that serves, with the same bits."""
    return CompiledWall(outline) if extension_available() else FiniteWall(outline)
