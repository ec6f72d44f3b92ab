"""Finite walls for comparisons: an outline, and its features in the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.core import primitives
from carom.core.numbered import numbers_of
from carom.core.wall_features import features_of

if TYPE_CHECKING:
    from carom.model.chain_geometry import Outline

#: Instead of the number of a feature.
NO_FEATURE = -1


class FiniteWall:
    """A chain or a circle, and its features in the order in which they are met at the same time.

    Attributes:
        outline: The wall.
        features: The times at which discs meet its features, and the normals there.
    """

    def __init__(self, outline: Outline) -> None:
        self.outline = outline
        self.features = primitives.WallFeatures([numbers_of(part.feature, 0) for part in features_of(outline)])
