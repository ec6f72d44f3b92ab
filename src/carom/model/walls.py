"""Immutable classes of walls: half-planes, chains of straight edges and arcs, and circles.

`docs/theory/walls.md` describes the surface that discs hit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice, pairwise
from typing import Annotated, Any, ClassVar, Union

from pydantic import BeforeValidator, Field, Strict

from carom.errors import Problem, SceneError
from carom.model.chain_checks import find_crossings
from carom.model.chain_geometry import Outline
from carom.model.prescribed_motion import Drive
from carom.support.fields import Direction, Model, NonNegative, Number, Vector
from carom.support.formatting import format_metres, format_number
from carom.support.limits import LARGEST, MOST_LEGS, MOST_WALLS, SMALLEST

#: Largest number of crossings of one chain that a message names.
_NAMED = 3


def _refuse_bumper(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool) and value > 1:
        raise ValueError("must be at most 1: above 1 each impact adds energy, so speeds would have no limit")
    return value


Point = tuple[float, float]
WallRestitution = Annotated[
    Annotated[float, Strict(), Field(ge=0, le=1, allow_inf_nan=False)] | None, BeforeValidator(_refuse_bumper)
]


class Leg(Model):
    """A leg of a driven body's path: a time span in which the body has constant velocity.

    Attributes:
        from_s: Start of the leg, in seconds since the start of the scene. The first leg starts at 0.
        velocity_m_s: Velocity of the body, in metres per second.
    """

    from_s: NonNegative
    velocity_m_s: Vector


def find_leg_problems(legs: tuple[Leg, ...], velocity: Point) -> Iterator[Problem]:
    """Yield the problems of a driven body's legs. A body with legs must have the `velocity` (0, 0)."""
    if velocity != (0.0, 0.0):
        yield Problem(("velocity_m_s",), f"must be left out if legs contain velocities, got {velocity}")
    if len(legs) > MOST_LEGS:
        yield Problem(("legs",), f"must contain at most {MOST_LEGS:,} legs, got {len(legs):,}")
        return
    if legs[0].from_s != 0.0:
        yield Problem(("legs", 0, "from_s"), f"must be 0, the start of the scene, got {legs[0].from_s}")
    for k, (one, other) in enumerate(pairwise(legs), 1):
        if not one.from_s < other.from_s:
            message = f"must be above {one.from_s}, when leg {k - 1} begins, got {other.from_s}"
            yield Problem(("legs", k, "from_s"), message)
            return


def build_drive(legs: tuple[Leg, ...], velocity: Point) -> Drive:
    """Return the path of a body with the given legs. A body without legs has the given velocity."""
    return Drive.along([(leg.from_s, leg.velocity_m_s) for leg in legs] or [(0.0, velocity)])


class _Common(Model):
    """Base of all kinds of walls."""

    left_out: ClassVar[tuple[str, ...]] = ("restitution", "friction", "velocity_m_s", "legs", "surface_speed_m_s")

    restitution: WallRestitution = None
    friction: NonNegative | None = None
    velocity_m_s: Vector = (0.0, 0.0)
    legs: tuple[Leg, ...] = ()
    surface_speed_m_s: Number = 0.0

    def model_post_init(self, _context: object, /) -> None:
        """Refuse invalid legs.

        Raises:
            SceneError: The first leg does not begin at 0. A leg does not begin after the previous leg. There are too
                many legs. The wall has both legs and a velocity.
        """
        if self.legs and (problems := list(find_leg_problems(self.legs, self.velocity_m_s))):
            raise SceneError(problems)

    @property
    def driven(self) -> bool:
        """Whether the wall moves."""
        return self.velocity_m_s != (0.0, 0.0) or any(leg.velocity_m_s != (0.0, 0.0) for leg in self.legs)

    @property
    def drive(self) -> Drive:
        """The path of the wall."""
        return build_drive(self.legs, self.velocity_m_s)


class Wall(_Common):
    """A half-plane that no disc may enter.

    Attributes:
        point_m: Any point on the wall's surface, in metres.
        normal: Vector from the surface to the discs' side. The length may be anything except 0, and is stored as 1.
        restitution: Coefficient of restitution between this wall and any disc, 0 to 1; None for the scene's
            coefficient.
        friction: Coulomb's coefficient of friction between this wall and any disc, 0 or more; None for the scene's
            coefficient.
        velocity_m_s: Velocity of a driven wall, in metres per second. Impacts don't change this velocity. A wall
            with (0, 0) is at rest. `point_m` is the position at time 0.
        legs: Velocities of a driven wall, each with the time at which it begins; replaces `velocity_m_s`.
        surface_speed_m_s: Speed of a conveyor, in metres per second: the wall's surface moves to the left of the
            normal. A conveyor acts on discs only by friction.

    Examples:
        >>> wall = carom.Wall(point_m=(3.0, 0.0), normal=(-1.0, 0.0))
        >>> wall.normal  # points to the left, where the discs are
        (-1.0, 0.0)
    """

    point_m: Vector
    normal: Direction


class Chain(_Common):
    """A line of straight edges and arcs, optionally with a width. Discs can't cross the line from either side.

    Attributes:
        points_m: Points at which edges begin and end, in metres.
        bulges: For each edge, the tangent of a quarter of the arc's angle: 0 for a straight edge, 1 for half of a
            circle, positive for a counterclockwise arc. Empty if all edges are straight.
        closed: Whether an edge runs from the last point to the first.
        half_width_m: The wall consists of all points within this distance of the line, in metres. Ends and corners are
            therefore round.
        solid: Whether the inside of a closed chain is also part of the wall, so that no disc may begin there.
        pieces: Number of pieces into which adapters divide each edge for engines. PIC and PIT ignore this number.
        restitution: Coefficient of restitution between this wall and any disc, 0 to 1; None for the scene's
            coefficient.
        friction: Coulomb's coefficient of friction between this wall and any disc, 0 or more; None for the scene's
            coefficient.
        velocity_m_s: Velocity of a driven wall, in metres per second. Impacts don't change this velocity. A wall
            with (0, 0) is at rest. `points_m` contains the points at time 0.
        legs: Velocities of a driven wall, each with the time at which it begins; replaces `velocity_m_s`.
        surface_speed_m_s: Speed of a conveyor, in metres per second. On either side of the line, the surface moves to
            the left of the normal that points to the disc. A conveyor acts on discs only by friction.

    Examples:
        >>> stair = carom.Chain(points_m=[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0)])
        >>> len(stair.points_m), stair.closed
        (3, False)
    """

    left_out = ("bulges", "closed", "half_width_m", "solid", "pieces", *_Common.left_out)

    points_m: tuple[Vector, ...]
    bulges: tuple[Number, ...] = ()
    closed: Annotated[bool, Strict()] = False
    half_width_m: NonNegative = 0.0
    solid: Annotated[bool, Strict()] = False
    pieces: Annotated[int, Strict(), Field(ge=1, le=MOST_WALLS)] = 1

    def model_post_init(self, _context: object, /) -> None:
        """Refuse chains with too few points, with edges of length 0, or with a line that crosses or touches itself.

        Raises:
            SceneError: The message names the invalid edge, or the two edges that meet and their common point.
        """
        super().model_post_init(_context)
        if problems := list(_find_shape_problems(self)) or list(_find_crossing_problems(self)):
            raise SceneError(problems)

    @property
    def outline(self) -> Outline:
        """The shape of the wall."""
        edges = len(self.points_m) - (not self.closed)
        bulges = self.bulges or (0.0,) * edges
        return Outline(self.points_m, bulges, self.half_width_m, self.closed, self.solid)


class Ring(_Common):
    """A circle that no disc may cross. Discs can be inside or outside. A circle of radius 0 is a point.

    Attributes:
        centre_m: Centre, in metres.
        radius_m: Radius, in metres, 0 or more.
        half_width_m: The wall consists of all points within this distance of the circle, in metres.
        restitution: Coefficient of restitution between this wall and any disc, 0 to 1; None for the scene's
            coefficient.
        friction: Coulomb's coefficient of friction between this wall and any disc, 0 or more; None for the scene's
            coefficient.
        velocity_m_s: Velocity of a driven wall, in metres per second. Impacts don't change this velocity. A wall
            with (0, 0) is at rest. `centre_m` is the position at time 0.
        legs: Velocities of a driven wall, each with the time at which it begins; replaces `velocity_m_s`.
        surface_speed_m_s: Speed of a conveyor, in metres per second. Inside and outside of the circle, the surface
            moves to the left of the normal that points to the disc. A conveyor acts on discs only by friction.

    Examples:
        >>> post = carom.Ring(centre_m=(1.0, 2.0), radius_m=0.5)
        >>> post.radius_m
        0.5
    """

    left_out = ("half_width_m", *_Common.left_out)

    centre_m: Vector
    radius_m: NonNegative
    half_width_m: NonNegative = 0.0

    @property
    def outline(self) -> Outline:
        """The shape of the wall."""
        return Outline((self.centre_m,), (), self.half_width_m, radius=self.radius_m)


#: The fields of scene files that only one kind of wall has, each with this kind.
_TELLING: Mapping[str, type[Chain | Ring]] = {"points_m": Chain, "centre_m": Ring, "radius_m": Ring}


def kind_of_wall(fields: Iterable[str]) -> type[Wall | Chain | Ring]:
    """Return the class of a wall with the given fields; `Wall` if no field belongs only to another class."""
    return next((kind for name, kind in _TELLING.items() if name in fields), Wall)


def _parse_wall(value: Any) -> Any:
    if isinstance(value, Wall | Chain | Ring):
        return value
    if not isinstance(value, dict):
        raise ValueError("must be a table of fields, or a wall")
    kind = kind_of_wall(value)
    telling = [name for name in ("point_m", "normal", *_TELLING) if name in value]
    if wrong := [name for name in telling if name not in kind.model_fields]:
        explanation = "a chain has points_m" if kind is Chain else "a circle has centre_m and radius_m"
        raise SceneError([Problem((name,), f"belongs to another kind of wall: {explanation}") for name in wrong])
    return kind(**value)


AnyWall = Annotated[Union[Wall, Chain, Ring], BeforeValidator(_parse_wall)]  # noqa: UP007 - of types that are made late


def _find_shape_problems(chain: Chain) -> Iterator[Problem]:
    points = len(chain.points_m)
    min_points = 2 if not chain.closed or any(chain.bulges) else 3
    if points < min_points:
        suffix = " for a closed chain without bulges" if min_points == 3 else ""
        yield Problem(("points_m",), f"must contain at least {min_points} points{suffix}, got {points}")
        return
    edges = points - (not chain.closed)
    if chain.bulges and len(chain.bulges) != edges:
        message = f"must have one number for each edge ({edges}), or be left out, got {len(chain.bulges)}"
        yield Problem(("bulges",), message)
    for k, bulge in enumerate(chain.bulges[:edges]):
        chord = math.dist(chain.points_m[k], chain.points_m[(k + 1) % points])
        if bulge and not chord * (1.0 / abs(bulge) + abs(bulge)) / 4.0 <= LARGEST:
            yield Problem(
                ("bulges", k),
                f"makes edge {k} an arc of a radius above {format_metres(LARGEST)}; use 0 for a straight edge",
            )
    if chain.solid and not chain.closed:
        yield Problem(("solid",), "needs closed = true: an open chain has no inside")
    for k in range(edges):
        a, b = chain.points_m[k], chain.points_m[(k + 1) % points]
        place: tuple[str | int, ...] = ("points_m", (k + 1) % points)
        if a == b:
            yield Problem(place, f"must not be the point at which edge {k} begins, got {a}: the edge has length 0")
        elif (length := math.dist(a, b)) < SMALLEST:
            yield Problem(
                place,
                f"makes edge {k} only {format_metres(length)} long: edges and radii must be at least "
                f"{format_metres(SMALLEST)}",
            )


def _find_crossing_problems(chain: Chain) -> Iterator[Problem]:
    for hit in islice(find_crossings(chain.outline.edges, closed=chain.closed), _NAMED):
        yield Problem(
            ("points_m",),
            "must not cross, touch or run back over itself other than at its joints: "
            f"edge {hit.second} meets edge {hit.first} at ({format_number(hit.x, 6)}, {format_number(hit.y, 6)})",
        )


def count_edges(wall: object) -> int:
    """Return how many edges a wall in a file can have; 1 for a half-plane or a circle. The wall may be invalid."""
    points = wall.get("points_m") if isinstance(wall, dict) else None
    return max(1, len(points)) if isinstance(points, list) else 1


def shift_legs(body: Any, time_s: float) -> Any:
    """Return a wall or driven disc with the times of its legs counted from `time_s` instead of the start."""
    if not body.legs:
        return body
    present, *later = body.drive.legs_from(time_s)
    legs = [Leg(from_s=0.0, velocity_m_s=present.velocity)]
    legs += [Leg(from_s=leg.begin_s - time_s, velocity_m_s=leg.velocity) for leg in later]
    return body.model_copy(update={"legs": tuple(legs)})


def reverse_motion(wall: AnyWall) -> AnyWall:
    """Return the wall as seen when time runs backwards: with opposite velocity and surface speed."""
    u, v = wall.drive.velocity_at(0.0)
    changed = {"velocity_m_s": (-u, -v), "legs": (), "surface_speed_m_s": -wall.surface_speed_m_s}
    return wall.model_copy(update=changed) if wall.driven or wall.surface_speed_m_s else wall


def move_wall(wall: AnyWall, x: float, y: float) -> AnyWall:
    """Return the wall displaced by the vector ``(x, y)``, without checking its shape again."""
    if isinstance(wall, Chain):
        return wall.model_copy(update={"points_m": tuple((px + x, py + y) for px, py in wall.points_m)})
    field = "point_m" if isinstance(wall, Wall) else "centre_m"
    px, py = getattr(wall, field)
    return wall.model_copy(update={field: (px + x, py + y)})
