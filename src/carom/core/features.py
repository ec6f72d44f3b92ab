"""Features of finite walls that a disc's rim meets: straight faces, vertices, and both sides of arcs.

A wall is a line of straight edges and arcs, and all points within a half width of it. A disc touches it where its
centre is at half width plus radius from the line. Such centres form a straight line for a face, and a circle for a
vertex and both sides of an arc. So a vertex is a circle of radius 0.

Features are frozen, and contain all that the times of impact need, precomputed from the numbers of the file. An exact
value is stored as a pair ``(high, low)`` of its nearest floats: see `core/double_double.h`.
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

#: Bits of a square root before it becomes a pair: more than a pair's 106, and some to round by.
_ROOT_BITS = 160

#: Room in a circle, in parts of its coordinates, that holds four to eight floats each way: below, normals are rounding.
_PLACES = 2.0**-50


class Mover(NamedTuple):
    """A disc as seen from a wall: for a driven wall, in the frame that moves with it.

    Attributes:
        x: Coordinate of its centre, metres.
        y: The other one.
        ux: Component of its velocity less the wall's, metres a second.
        uy: The other one.
        radius: Its radius, metres.
    """

    x: Pair
    y: Pair
    ux: Pair
    uy: Pair
    radius: float

    @classmethod
    def at(cls, position: Point, velocity: Point, radius: float, wall_velocity: Point = (0.0, 0.0)) -> Mover:
        """Return a disc as seen from a wall that is where the file has it, and moves at a velocity."""
        ux, uy = primitives.two_diff(velocity[0], wall_velocity[0]), primitives.two_diff(velocity[1], wall_velocity[1])
        return cls((position[0], 0.0), (position[1], 0.0), ux, uy, radius)


@dataclass(frozen=True, slots=True)
class Face:
    """One side of a straight edge from a to b: the side on the left of the way from a to b.

    Attributes:
        a: Where the edge begins, metres.
        b: Where it ends.
        half_width: The wall is all points within this of the edge, metres.
        along: The two components of b - a, exactly.
        length: Its length.
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
        """Return the side on the left of an edge; its ends differ."""
        along = primitives.two_diff(b[0], a[0]), primitives.two_diff(b[1], a[1])
        ex, ey = (Fraction(high) + Fraction(low) for high, low in along)
        length2 = ex * ex + ey * ey
        normal = _nearest_root(-ey, length2), _nearest_root(ex, length2)
        return cls(a, b, half_width, along, root_of(length2), normal)


@dataclass(frozen=True, slots=True)
class Sector:
    """The directions from an arc's centre to its points: counterclockwise from `first` to `last`.

    Attributes:
        first: The two components of the vector from the centre to where the arc begins, metres.
        last: Those to where it ends.
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
        radius: The circle's radius, metres; 0 of a vertex.
        half_width: The wall is all points within this of the arc, metres.
        inside: Whether it is the side that the centre is on.
        sector: The part of the circle that the arc is; None for all of it.
        fits_below: Narrower discs fit inside, metres: they alone meet the inner side, and the others its stops.
    """

    centre: tuple[Pair, Pair]
    radius: Pair
    half_width: float
    inside: bool
    sector: Sector | None
    fits_below: float = 0.0

    @classmethod
    def vertex(cls, at: Point, half_width: float = 0.0) -> Arc:
        """Return an end of a line, or a joint at which it is not smooth, from all sides."""
        return cls(((at[0], 0.0), (at[1], 0.0)), (0.0, 0.0), half_width, inside=False, sector=None)

    @property
    def is_vertex(self) -> bool:
        """Whether it is a point."""
        return self.radius[0] == 0.0

    @classmethod
    def on(
        cls, circle: ExactCircle, ends: tuple[Point, Point] | None = None, half_width: float = 0.0, *, inside: bool
    ) -> Arc:
        """Return one side of a circle's arc counterclockwise between two of its points, or of all of it."""
        sector = None if ends is None else _sector(circle, *ends)
        place, size = (pair_of(circle.x), pair_of(circle.y)), root_of(circle.radius2)
        return cls(place, size, half_width, inside, sector, _fits_below(place, size, half_width) if inside else 0.0)

    def stop(self, circle: ExactCircle, way: tuple[Fraction, Fraction]) -> Arc:
        """Return the point of this inner side, in a direction from its circle's centre, that stops wide discs."""
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
    """Return from which radius on a disc has no room in a circle, or so little that floats do not tell its places."""
    return radius[0] - half_width - _PLACES * (abs(centre[0][0]) + abs(centre[1][0]) + radius[0])


def _nearest_root(part: Fraction, square: Fraction) -> float:
    """Return ``part / sqrt(square)`` to the nearest float."""
    return math.copysign(root_of(part * part / square)[0], part)


def _sector(circle: ExactCircle, a: Point, b: Point) -> Sector:
    first, last = ((Fraction(x) - circle.x, Fraction(y) - circle.y) for x, y in (a, b))
    turn = first[0] * last[1] - first[1] * last[0]
    return Sector((pair_of(first[0]), pair_of(first[1])), (pair_of(last[0]), pair_of(last[1])), turn < 0)
