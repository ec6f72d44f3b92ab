"""Time of impact of a disc with any feature of a wall, and the normal there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.physics.arc_time import Touch, from_pair, inner_arc_time, outer_arc_time
from carom.physics.face_time import face_time
from carom.physics.features import Face

if TYPE_CHECKING:
    from carom.physics.features import Feature, Mover, Point


def feature_time(disc: Mover, feature: Feature, *, just_left: bool = False) -> Touch:
    """Return when a disc in straight uniform motion touches a feature.

    With `just_left` the feature is the last thing that the disc met, on the path that it is on now: a straight path
    does not come back, except to an arc from inside.
    """
    if isinstance(feature, Face):
        return Touch(math.inf if just_left else face_time(disc, feature))
    if feature.inside:
        return inner_arc_time(disc, feature, just_left=just_left)
    return Touch(math.inf if just_left else outer_arc_time(disc, feature))


def normal_at(feature: Feature, disc: Mover) -> Point:
    """Return the unit vector from a feature to a disc that touches it."""
    if isinstance(feature, Face):
        return feature.normal
    x, y = from_pair(disc.x, feature.centre[0])[0], from_pair(disc.y, feature.centre[1])[0]
    sign = -1.0 if feature.inside else 1.0
    distance = math.sqrt(x * x + y * y)
    return sign * x / distance, sign * y / distance
