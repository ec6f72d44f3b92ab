"""Finite walls for who asks for one disc at a time; they need the compiled extension."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.physics import wall_times
from carom.physics.numbered import numbers_of
from carom.solvers.plain.finite_walls import FiniteWall

if TYPE_CHECKING:
    from carom.outline import Outline
    from carom.physics.features import Feature, Mover
    from carom.physics.wall_features import WallFeature


class CompiledWall(FiniteWall):
    """A `FiniteWall`, to the bit."""

    def __init__(self, outline: Outline) -> None:
        super().__init__(outline)
        self._times = wall_times.Features([numbers_of(part.feature, 0) for part in self.features])

    def next_time(self, disc: Mover, last: Feature | None) -> tuple[float, WallFeature | None, bool]:
        """Return what `FiniteWall.next_time` does."""
        left = next((k for k, part in enumerate(self.features) if part.feature is last), -1)
        time_s, number, glides = self._times.first_time(*disc, left)
        return time_s, None if number < 0 else self.features[number], glides
