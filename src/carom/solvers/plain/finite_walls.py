"""Finite walls as PIT sees them: what of a wall is nearest to a disc, and the normal there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.trace import EdgeKind

if TYPE_CHECKING:
    from carom.outline import Outline

Vector = tuple[float, float]


class Hit(NamedTuple):
    """What of a wall a disc meets, or has met.

    Attributes:
        normal: Unit vector from the wall to the disc.
        edge: Number of the edge in the file, and its kind, in the order of `carom.trace.EDGE_DTYPE`.
    """

    normal: Vector
    edge: tuple[int, int]


class SampledWall:
    """A chain or a circle, and what discs meet of it."""

    def __init__(self, outline: Outline) -> None:
        self.outline = outline

    def hit_from(self, x: float, y: float) -> Hit | None:
        """Return what of the wall is nearest to a disc's centre; None where that is on the wall's line."""
        foot = self.outline.nearest(x, y)
        dx, dy = x - foot.x, y - foot.y
        distance = math.sqrt(dx * dx + dy * dy)
        if distance == 0.0:
            return None
        stretch = self.outline.stretches[foot.edge]
        bent = EdgeKind.FACE if stretch.centre is None else EdgeKind.ARC
        kind = bent if foot.inner else EdgeKind.VERTEX
        return Hit((dx / distance, dy / distance), (foot.edge, kind))
