"""Times of impact with one feature, by the core."""

from carom.core import primitives
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import Feature, Mover, Point


def build_wall_features(feature: Feature) -> primitives.WallFeatures:
    """Return a wall of one feature."""
    return primitives.WallFeatures([build_feature_row(feature, 0)])


def compute_feature_time(disc: Mover, feature: Feature, *, just_left: bool = False) -> tuple[float, bool]:
    """Return when a disc on a straight path touches a feature, and whether it glides there."""
    time, _, glides = build_wall_features(feature).first_touch(disc, 0 if just_left else -1)
    return time, glides


def compute_feature_fall_time(disc: Mover, feature: Feature, gravity: Point, leaving: float | None = None) -> float:
    """Return when a falling disc touches a feature; `leaving` is the speed at which it has just left it."""
    time, _ = build_wall_features(feature).first_fall(disc, *gravity, -1 if leaving is None else 0, leaving or 0.0)
    return time
