"""Finite walls as plain solvers see them: when a disc meets which feature, and the normal there."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.arc_time import from_pair, reach_of
from carom.physics.face_time import face_gap
from carom.physics.feature_time import feature_time, normal_at
from carom.physics.features import Face, Mover
from carom.physics.pair_time import excess
from carom.physics.wall_features import WallFeature, features_of
from carom.solvers.impact.resolution import ULP, gap_resolution, pair_resolution, size_of, wall_resolution
from carom.trace import EdgeKind

if TYPE_CHECKING:
    from carom.outline import Outline
    from carom.physics.features import Feature

Vector = tuple[float, float]


class Hit(NamedTuple):
    """What of a wall a disc meets, or has met.

    Attributes:
        feature: The feature; None where it was found late, by looking for what is nearest.
        normal: Unit vector from the wall to the disc.
        edge: Number of the edge in the file, and its kind, in the order of `carom.trace.EDGE_DTYPE`.
        again: Whether the disc comes back to it, with nothing between: then no rounded gap bears on the instant.
    """

    feature: Feature | None
    normal: Vector
    edge: tuple[int, int]
    again: bool = False


class FiniteWall:
    """A chain or a circle, and what discs meet of it."""

    def __init__(self, outline: Outline) -> None:
        self.outline = outline

    @cached_property
    def features(self) -> tuple[WallFeature, ...]:
        """Its features, in the order in which they are met at one instant; none are made until somebody asks."""
        return features_of(self.outline)

    def next_time(self, disc: Mover, last: Feature | None) -> tuple[float, WallFeature | None, bool]:
        """Return the seconds until a disc meets the wall, what of it, and whether it glides there.

        Args:
            disc: The disc.
            last: The feature that it met last, on the path that it is on.
        """
        least: tuple[float, WallFeature | None, bool] = (math.inf, None, False)
        for part in self.features:
            touch = feature_time(disc, part.feature, just_left=part.feature is last)
            if touch.time < least[0]:
                least = (touch.time, part, touch.glides)
        return least

    def hit(self, disc: Mover, part: WallFeature) -> Hit:
        """Return what a disc, brought to it, meets of a feature."""
        normal = normal_at(part.feature, disc)
        if len(part.edges) == 1:
            return Hit(part.feature, normal, (part.edges[0], part.kind))
        return Hit(part.feature, normal, (self.outline.edge_at(disc.x[0], disc.y[0], part.edges), part.kind))

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
        return Hit(None, (dx / distance, dy / distance), (foot.edge, kind))


def gap_of(disc: Mover, feature: Feature) -> float:
    """Return the distance of a disc's rim from a feature, along the normal, metres.

    Of an arc its radius may be many times all else: the difference of two distances from the centre would be rounded as
    these are, so that of their squares is taken, to which almost no rounding is done.
    """
    if isinstance(feature, Face):
        return float(face_gap(disc, feature)[0]) / feature.length[0]
    at, reach = feature.centre, reach_of(disc, feature)
    gap = excess(from_pair(disc.x, at[0]), from_pair(disc.y, at[1]), reach)[0] / (_away(disc, feature)[0] + reach[0])
    return -gap if feature.inside else gap


def overlap_since(disc: Mover, feature: Feature) -> float:
    """Return when the rim of a disc that overlaps a feature, and closes on it, came to it: seconds from now, 0 or less.

    On a straight path, by plain formulas; now, where these leave no speed at which it closes.
    """
    (vx, _), (vy, _) = disc.ux, disc.uy
    gap = min(gap_of(disc, feature), 0.0)
    if isinstance(feature, Face):
        speed = vx * feature.normal[0] + vy * feature.normal[1]
        return -gap / speed if speed < 0.0 else 0.0
    away, reach = _away(disc, feature)
    nx, ny = normal_at(feature, disc)
    sign = -1.0 if feature.inside else 1.0
    # |d + t u| = reach, with d out from the centre: the root in the past that is nearer.
    a, b, c = vx * vx + vy * vy, sign * away * (vx * nx + vy * ny), sign * gap * (away + reach)
    root = math.sqrt(max(b * b - a * c, 0.0))
    if sign > 0.0:
        return (-b - root) / a
    return -c / (b + root) if b + root > 0.0 else 0.0


def bend_of(feature: Feature, disc: Mover) -> float:
    """Return how the normal turns as the disc moves along a feature, radians a metre: above 0 where gaps open by it."""
    if isinstance(feature, Face):
        return 0.0
    away, _ = _away(disc, feature)
    return -1.0 / away if feature.inside else 1.0 / away


def _away(disc: Mover, feature: Feature) -> tuple[float, float]:
    """Return how far a disc is from the centre of a vertex or arc, and how far where it touches."""
    if isinstance(feature, Face):
        raise TypeError("a face has no centre")
    x, y = disc.x[0] - feature.centre[0][0], disc.y[0] - feature.centre[1][0]
    return math.sqrt(x * x + y * y), reach_of(disc, feature)[0]


def sizes_of(feature: Feature) -> float:
    """Return the sum of the magnitudes of a feature's coordinates and lengths, as `size_of` that of a disc's."""
    if isinstance(feature, Face):
        return size_of(*feature.a, feature.half_width)
    return size_of(feature.centre[0][0], feature.centre[1][0], feature.radius[0] + feature.half_width)


def gap_resolution_m(size: float, feature: Feature) -> float:
    """Return how well the gap between a disc and a feature is known, metres: to the rounding of the numbers it is of.

    `size` is that of the disc's own coordinates and radius, as `size_of` sums them up: where a wall has been driven far
    these are larger than those that the wall sees. An arc's centre and radius are pairs of floats, so they are known to
    a rounding of a rounding.
    """
    sizes = sizes_of(feature)
    if not isinstance(feature, Face) and not feature.is_vertex:
        sizes = feature.half_width + ULP * sizes
    return gap_resolution(size + sizes)


def resolution_s(size: float, disc: Mover, feature: Feature, speed: float, velocity: Vector) -> float:
    """Return to how many seconds the instant is known at which a disc meets a feature, at a speed along its normal.

    The disc is as the wall sees it; `size` is what it is for `gap_resolution_m`.
    """
    sizes = size + sizes_of(feature)
    if isinstance(feature, Face):
        return wall_resolution(sizes, speed)
    return pair_resolution(sizes, _away(disc, feature)[1], *velocity, speed)
