"""Rounded arcs and vertices, and times of impact with one feature, by the core."""

from carom.core import primitives
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import Arc, Feature, Mover, Point
from carom.core.wall_parts import Between, Round, subtract, to_exact
from carom.model.chain_geometry import ExactCircle


def build_side(circle: ExactCircle, ends: tuple[Point, Point] | None = None, *, inside: bool) -> Round:
    """Return one side of a circle, or of its arc that runs counterclockwise from `ends[0]` to `ends[1]`."""
    centre = circle.x, circle.y
    sector = None if ends is None else Between(*(subtract(to_exact(end), centre) for end in ends))
    return Round(centre, circle.radius2, inside, sector)


def build_arc(
    circle: ExactCircle, ends: tuple[Point, Point] | None = None, half_width: float = 0.0, *, inside: bool
) -> Arc:
    """Return one side of a circle, or of its arc between two points, with rounded numbers."""
    return Arc.of(build_side(circle, ends, inside=inside), half_width)


def build_vertex(at: Point, half_width: float = 0.0) -> Arc:
    """Return a vertex, with rounded numbers."""
    return Arc.of(Round(to_exact(at)), half_width)


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
