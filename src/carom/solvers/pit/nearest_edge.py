"""What of a finite wall is nearest to a disc, as PIT finds it, and the normal there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.trace import EdgeKind

if TYPE_CHECKING:
    from carom.outline import Outline


class Hit(NamedTuple):
    """What of a wall a disc meets, or has met.

    Attributes:
        normal: Unit vector from the wall to the disc.
        edge: Number of the edge in the file, and its kind, in the order of `carom.trace.EDGE_DTYPE`.
    """

    normal: tuple[float, float]
    edge: tuple[int, int]


def find_hit(outline: Outline, x: float, y: float) -> Hit | None:
    """Return what of a wall is nearest to a disc's centre; None for a centre on the wall's line."""
    foot = outline.nearest(x, y)
    dx, dy = x - foot.x, y - foot.y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return None
    bent = EdgeKind.FACE if outline.stretches[foot.edge].centre is None else EdgeKind.ARC
    kind = bent if foot.inner else EdgeKind.VERTEX
    return Hit((dx / distance, dy / distance), (foot.edge, kind))
