"""Features of finite walls, which are the parts that a disc can touch: straight faces, vertices, and sides of arcs.

A wall consists of all points whose distance from a line of straight edges and arcs is at most a half width. A disc
touches the wall when the distance of its centre from that line is the half width plus the disc's radius. The centres of
discs that touch a face form a straight line. The centres of discs that touch a vertex, or one side of an arc, form a
circle. So a vertex is represented as a circle of radius 0. A disc meets a feature when the disc's rim touches it.

Features are immutable. A feature contains all numbers from which times of impact are computed. A number with more
digits than a float is stored as a pair ``(high, low)`` of floats, whose sum is nearest to the number: see
`core/arithmetic/double_double.h`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from carom.core import primitives
from carom.core.wall_parts import Pair, Round, WallPart, build_parts, compute_root, find_smallest_unfit, to_pair
from carom.model.chain_geometry import Outline

Point = tuple[float, float]


class Mover(NamedTuple):
    """A disc relative to a wall, which may be driven.

    Attributes:
        x: First coordinate of the disc's centre, in metres.
        y: Second coordinate of the centre, in metres.
        ux: First component of the disc's velocity relative to the wall, in m/s.
        uy: Second component of this velocity, in m/s.
        radius: Radius of the disc, in metres.
    """

    x: Pair
    y: Pair
    ux: Pair
    uy: Pair
    radius: float

    @classmethod
    def at(cls, position: Point, velocity: Point, radius: float, wall_velocity: Point = (0.0, 0.0)) -> Mover:
        """Return a disc relative to a wall that has `wall_velocity` and is now at its place in the scene file."""
        ux, uy = primitives.two_diff(velocity[0], wall_velocity[0]), primitives.two_diff(velocity[1], wall_velocity[1])
        return cls((position[0], 0.0), (position[1], 0.0), ux, uy, radius)


@dataclass(frozen=True, slots=True)
class Face:
    """The left side of a straight edge, as seen from its start a towards its end b.

    Attributes:
        a: Start of the edge, in metres.
        b: End of the edge, in metres.
        half_width: Half width of the wall, in metres. All points within this distance of the edge belong to the wall.
        along: The two components of ``b - a``, exactly.
        length: Length of the edge, in metres.
        normal: Unit vector to the free side, rounded to the nearest floats.
    """

    a: Point
    b: Point
    half_width: float
    along: tuple[Pair, Pair]
    length: Pair
    normal: Point

    @classmethod
    def between(cls, a: Point, b: Point, half_width: float = 0.0) -> Face:
        """Return the left side of an edge from a to b. The two points must differ."""
        along = primitives.two_diff(b[0], a[0]), primitives.two_diff(b[1], a[1])
        ex, ey = (Fraction(high) + Fraction(low) for high, low in along)
        length2 = ex * ex + ey * ey
        normal = _compute_nearest_root(-ey, length2), _compute_nearest_root(ex, length2)
        return cls(a, b, half_width, along, compute_root(length2), normal)

    def reverse(self) -> Face:
        """Return the other side of the edge. Differences from 0.0 are used, because negation could return -0.0."""
        x, y, normal = ((0.0 - first, 0.0 - second) for first, second in (*self.along, self.normal))
        return Face(self.b, self.a, self.half_width, (x, y), self.length, normal)


@dataclass(frozen=True, slots=True)
class Sector:
    """The directions from an arc's centre to its points: counterclockwise from `first` to `last`.

    Attributes:
        first: Vector from the centre to the start of the arc, in metres; two components.
        last: Vector from the centre to the end of the arc, in metres; two components.
        reflex: Whether the arc is more than half of its circle.
    """

    first: tuple[Pair, Pair]
    last: tuple[Pair, Pair]
    reflex: bool


@dataclass(frozen=True, slots=True)
class Arc:
    """A vertex, or one side of an arc or of a whole circle.

    Attributes:
        centre: The two coordinates of the circle's centre, in metres.
        radius: Radius of the circle, in metres; 0 for a vertex.
        half_width: Half width of the wall, in metres. All points within this distance of the arc belong to the wall.
        inside: Whether the circle's centre is on this side.
        sector: Directions of the arc's points from the centre; None for a whole circle.
        fits_below: Smallest radius of discs that do not fit inside, in metres. Discs of this radius or more meet the
            stops of the arc (see `build_stop`) instead of its inner side.
    """

    centre: tuple[Pair, Pair]
    radius: Pair
    half_width: float
    inside: bool
    sector: Sector | None
    fits_below: float = 0.0

    @classmethod
    def of(cls, shape: Round, half_width: float) -> Arc:
        """Return a vertex, a stop, or a side of an arc or circle, whose numbers are rounded."""
        sector = None
        if shape.sector is not None:
            first, last = ((to_pair(x), to_pair(y)) for x, y in shape.sector)
            sector = Sector(first, last, reflex=shape.is_reflex)
        inner = shape if shape.inside else shape.stops_of
        fits_below = 0.0 if inner is None else find_smallest_unfit(inner, half_width)
        x, y = map(to_pair, shape.centre)
        return cls((x, y), compute_root(shape.radius2), half_width, shape.inside, sector, fits_below)

    @property
    def is_vertex(self) -> bool:
        """Whether the feature is a single point: a vertex or a stop."""
        return self.radius[0] == 0.0


Feature = Face | Arc


def _compute_nearest_root(part: Fraction, square: Fraction) -> float:
    """Return ``part / sqrt(square)``, rounded to the nearest float."""
    return math.copysign(compute_root(part * part / square)[0], part)


class WallFeature(NamedTuple):
    """A feature of a wall, and the part of the wall that it represents."""

    feature: Feature
    part: WallPart


def build_features(outline: Outline, widest_m: float = math.inf) -> tuple[WallFeature, ...]:
    """Return the features of a wall, in the order of `build_parts`.

    Where a disc meets two features at once, it hits the first of them. Where a vertex adjoins a face, a disc meets the
    face at the same time or earlier. So the impact is on the face, which has the correct normal.
    """
    found: list[WallFeature] = []
    for number, part in enumerate(build_parts(outline, widest_m)):
        if isinstance(part.shape, Round):
            found.append(WallFeature(Arc.of(part.shape, outline.half_width), part))
            continue
        if number % 2 == 0:  # a left side; the right side of the same edge follows
            a, b = ((float(x), float(y)) for x, y in part.shape.stretch or ())
            face = Face.between(a, b, outline.half_width)
        else:
            face = face.reverse()
        found.append(WallFeature(face, part))
    return tuple(found)
