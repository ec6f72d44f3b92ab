"""Features of finite walls that a disc's rim meets: straight faces, vertices, and both sides of arcs.

A wall consists of all points within a half width of a line of straight edges and arcs. A disc touches the wall when its
centre is at the distance half width plus radius from that line. Such centres form a straight line for a face, and a
circle for a vertex or for a side of an arc. So a vertex is represented as a circle of radius 0.

Features are frozen. Features contain everything that times of impact need, precomputed from the numbers of the scene
file. An exact value is stored as a pair ``(high, low)`` of its nearest floats: see `core/arithmetic/double_double.h`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from carom.core import primitives

if TYPE_CHECKING:
    from carom.model.chain_geometry import ExactCircle

Point = tuple[float, float]
Pair = tuple[float, float]

#: Number of bits of a square root before the root is rounded to a pair, which has 106 bits.
_ROOT_BITS = 160

#: Least room of a disc inside a circle, as a fraction of the circle's coordinates. This room has four to eight floats
#: in each direction. With less room, normals would consist of rounding errors.
_PLACES = 2.0**-50


class Mover(NamedTuple):
    """A disc in the frame of a wall, which may be driven.

    Attributes:
        x: First coordinate of the disc's centre, metres.
        y: Second coordinate of the centre, metres.
        ux: First component of the disc's velocity relative to the wall, metres a second.
        uy: Second component of this velocity, metres a second.
        radius: Radius of the disc, metres.
    """

    x: Pair
    y: Pair
    ux: Pair
    uy: Pair
    radius: float

    @classmethod
    def at(cls, position: Point, velocity: Point, radius: float, wall_velocity: Point = (0.0, 0.0)) -> Mover:
        """Return a disc in the frame of a wall that is at its position in the file, and has a velocity."""
        ux, uy = primitives.two_diff(velocity[0], wall_velocity[0]), primitives.two_diff(velocity[1], wall_velocity[1])
        return cls((position[0], 0.0), (position[1], 0.0), ux, uy, radius)


@dataclass(frozen=True, slots=True)
class Face:
    """The left side of a straight edge, as seen from its start a towards its end b.

    Attributes:
        a: Start of the edge, metres.
        b: End of the edge, metres.
        half_width: Half width of the wall, metres: all points within this distance of the edge belong to the wall.
        along: The two components of b - a, exactly.
        length: Length of the edge, metres.
        normal: Unit vector into the free side, to the nearest floats.
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
        normal = _nearest_root(-ey, length2), _nearest_root(ex, length2)
        return cls(a, b, half_width, along, root_of(length2), normal)


@dataclass(frozen=True, slots=True)
class Sector:
    """The directions from an arc's centre to its points: counterclockwise from `first` to `last`.

    Attributes:
        first: Vector from the centre to the start of the arc, metres; two components.
        last: Vector from the centre to the end of the arc, metres; two components.
        reflex: Whether the arc is more than half of its circle.
    """

    first: tuple[Pair, Pair]
    last: tuple[Pair, Pair]
    reflex: bool


@dataclass(frozen=True, slots=True)
class Arc:
    """One side of an arc, or of a whole circle; or a vertex.

    Attributes:
        centre: The two coordinates of the circle's centre, metres.
        radius: Radius of the circle, metres; 0 for a vertex.
        half_width: Half width of the wall, metres: all points within this distance of the arc belong to the wall.
        inside: Whether this is the side on which the circle's centre is.
        sector: Directions of the arc's points from the centre; None for a whole circle.
        fits_below: Smallest radius of discs that do not fit inside, metres. Such discs meet the arc's stops instead of
            its inner side.
    """

    centre: tuple[Pair, Pair]
    radius: Pair
    half_width: float
    inside: bool
    sector: Sector | None
    fits_below: float = 0.0

    @classmethod
    def vertex(cls, at: Point, half_width: float = 0.0) -> Arc:
        """Return a vertex: an end of a line, or a joint at which the line is not smooth.

        Discs meet a vertex from all sides.
        """
        return cls(((at[0], 0.0), (at[1], 0.0)), (0.0, 0.0), half_width, inside=False, sector=None)

    @property
    def is_vertex(self) -> bool:
        """Whether this is a vertex, which is a single point."""
        return self.radius[0] == 0.0

    @classmethod
    def on(
        cls, circle: ExactCircle, ends: tuple[Point, Point] | None = None, half_width: float = 0.0, *, inside: bool
    ) -> Arc:
        """Return one side of a circle, or of its arc counterclockwise from the first of `ends` to the second."""
        sector = None if ends is None else _sector(circle, *ends)
        place, size = (pair_of(circle.x), pair_of(circle.y)), root_of(circle.radius2)
        return cls(place, size, half_width, inside, sector, _fits_below(place, size, half_width) if inside else 0.0)

    def stop(self, circle: ExactCircle, way: tuple[Fraction, Fraction]) -> Arc:
        """Return the stop of this inner side that is at `way` from the circle's centre. Wide discs meet the stop."""
        (x, y), nothing = way, (0.0, 0.0)
        half = Sector((pair_of(-y), pair_of(x)), (pair_of(y), pair_of(-x)), reflex=False)
        place = pair_of(circle.x + x), pair_of(circle.y + y)
        return Arc(place, nothing, self.half_width, inside=False, sector=half, fits_below=self.fits_below)


Feature = Face | Arc


def pair_of(number: Fraction) -> Pair:
    """Return a rational number as the pair nearest to it, to 2^-106 of itself."""
    high = float(number)
    return high, float(number - Fraction(high))


def root_of(square: Fraction) -> Pair:
    """Return the square root of a rational number, 0 or more, as the pair nearest to it, to 2^-106 of itself."""
    if square == 0:
        return 0.0, 0.0
    # The root of square 4^shift has some _ROOT_BITS bits before its point.
    shift = _ROOT_BITS - (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    return pair_of(Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift)


def _fits_below(centre: tuple[Pair, Pair], radius: Pair, half_width: float) -> float:
    """Return the smallest radius of discs that have no room in a circle, or less room than floats can resolve."""
    return radius[0] - half_width - _PLACES * (abs(centre[0][0]) + abs(centre[1][0]) + radius[0])


def _nearest_root(part: Fraction, square: Fraction) -> float:
    """Return ``part / sqrt(square)`` to the nearest float."""
    return math.copysign(root_of(part * part / square)[0], part)


def _sector(circle: ExactCircle, a: Point, b: Point) -> Sector:
    first, last = ((Fraction(x) - circle.x, Fraction(y) - circle.y) for x, y in (a, b))
    turn = first[0] * last[1] - first[1] * last[0]
    return Sector((pair_of(first[0]), pair_of(first[1])), (pair_of(last[0]), pair_of(last[1])), turn < 0)
