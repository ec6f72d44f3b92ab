"""Time of impact of a falling disc with any feature of a wall; apart, as a scene without gravity loads none of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.arc_time_falling import arc_time_falling
from carom.physics.face_time_falling import face_time_falling
from carom.physics.features import Face

if TYPE_CHECKING:
    from collections.abc import Iterable

    from carom.physics.features import Feature, Mover, Point
    from carom.physics.wall_features import WallFeature


def feature_time_falling(disc: Mover, feature: Feature, gravity: Point, leaving: float | None = None) -> float:
    """Return the seconds until a falling disc touches a feature; 0 for one that rests on it, infinity for never.

    Where the feature is the last thing that the disc met, `leaving` is the speed at which it left it, along the normal.
    """
    if isinstance(feature, Face):
        return face_time_falling(disc, feature, gravity, leaving)
    return arc_time_falling(disc, feature, gravity, leaving)


def first_feature_falling(
    disc: Mover, features: Iterable[WallFeature], gravity: Point, last: Feature | None, leaving: float
) -> tuple[float, WallFeature | None]:
    """Return the seconds until a falling disc meets a wall, and which feature of it; infinity and None for never.

    Args:
        disc: The disc.
        features: Those of one wall, in the order in which they are met at one instant.
        gravity: In m/s^2.
        last: The feature that it met last, on the path that it is on.
        leaving: The speed at which it left that one, along the normal.
    """
    least: tuple[float, WallFeature | None] = (math.inf, None)
    for part in features:
        time = feature_time_falling(disc, part.feature, gravity, leaving if part.feature is last else None)
        if time < least[0]:
            least = (time, part)
    return least
