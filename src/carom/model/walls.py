"""The walls of a scene: half-planes, chains of straight edges and arcs, and circles. Validated and immutable.

Their fields distinguish them: a half-plane has a point and a normal, a chain has points, a circle a radius.
`docs/theory/walls.md` describes the surface that discs meet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice, pairwise
from typing import Annotated, Any, ClassVar, Union

from pydantic import BeforeValidator, Field, Strict

from carom.errors import Problem, SceneError
from carom.model.chain_checks import meetings
from carom.model.chain_geometry import Outline
from carom.model.prescribed_motion import Drive
from carom.support.fields import Direction, Friction, Model, Number, Since, Vector
from carom.support.formatting import metres, number
from carom.support.limits import LARGEST, MOST_LEGS, MOST_WALLS, SMALLEST

#: Crossings of one chain that are named.
_NAMED = 3


def _no_bumper(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool) and value > 1:
        raise ValueError(
            "must be at most 1: with a bumper, which adds energy at each impact, speeds have no limit that could "
            "scale errors"
        )
    return value


Point = tuple[float, float]
WallRestitution = Annotated[
    Annotated[float, Strict(), Field(ge=0, le=1, allow_inf_nan=False)] | None, BeforeValidator(_no_bumper)
]
Width = Friction  # a number, 0 or more
Radius = Friction


class Leg(Model):
    """Part of a driven body's path with one velocity, from an instant to the start of the next leg.

    Attributes:
        from_s: Begin, seconds since the start; 0 for the first. The body has its velocity from there on.
        velocity_m_s: Velocity of the body, metres a second.
    """

    from_s: Since
    velocity_m_s: Vector


def leg_problems(legs: tuple[Leg, ...], velocity: Point) -> Iterator[Problem]:
    """Yield the errors in the legs of a driven body; its own velocity must be (0, 0)."""
    if not legs:
        return
    if velocity != (0.0, 0.0):
        yield Problem(("velocity_m_s",), f"must be left out where there are legs, which contain it, got {velocity}")
    if len(legs) > MOST_LEGS:
        yield Problem(("legs",), f"must be {MOST_LEGS:,} at most, got {len(legs):,}")
        return
    if legs[0].from_s != 0.0:
        yield Problem(("legs", 0, "from_s"), f"must be 0, where the scene begins, got {legs[0].from_s}")
    for k, (one, other) in enumerate(pairwise(legs), 1):
        if not one.from_s < other.from_s:
            told = f"must be above {one.from_s}, where leg {k - 1} begins, got {other.from_s}"
            yield Problem(("legs", k, "from_s"), told)
            return


def drive_of(legs: tuple[Leg, ...], velocity: Point) -> Drive:
    """Return the path of a body of these legs, or of one velocity where it has none."""
    return Drive.along([(leg.from_s, leg.velocity_m_s) for leg in legs] or [(0.0, velocity)])


class _Common(Model):
    """Base of all kinds of walls."""

    left_out: ClassVar[tuple[str, ...]] = ("restitution", "friction", "velocity_m_s", "legs", "surface_speed_m_s")

    restitution: WallRestitution = None
    friction: Friction | None = None
    velocity_m_s: Vector = (0.0, 0.0)
    legs: tuple[Leg, ...] = ()
    surface_speed_m_s: Number = 0.0

    def model_post_init(self, _context: object, /) -> None:
        """Refuse legs that are no path.

        Raises:
            SceneError: The first does not begin at 0, one does not begin after the one before it, there are too many,
                or a velocity is also given.
        """
        if self.legs and (problems := list(leg_problems(self.legs, self.velocity_m_s))):
            raise SceneError(problems)

    @property
    def driven(self) -> bool:
        """Whether the wall moves."""
        return self.velocity_m_s != (0.0, 0.0) or any(leg.velocity_m_s != (0.0, 0.0) for leg in self.legs)

    @property
    def drive(self) -> Drive:
        """The path of the wall."""
        return drive_of(self.legs, self.velocity_m_s)


class Wall(_Common):
    """A half-plane that no disc may enter.

    Attributes:
        point_m: Any point on the wall's surface, metres.
        normal: Direction into the free side, of any length but zero; stored as a unit vector.
        restitution: Coefficient of restitution of this wall and any disc, 0 to 1; None for the scene's.
        friction: Coulomb's coefficient of friction of this wall and any disc, 0 or more; None for the scene's.
        velocity_m_s: The wall is driven: it moves at this velocity, whatever strikes it, and is where its other fields
            say at time 0. At (0, 0) it is at rest.
        legs: The wall is driven along a broken line: the velocity from an instant to the next; instead of
            `velocity_m_s`.
        surface_speed_m_s: The wall is a belt: its surface runs at this speed to the left of the normal into the free
            side, metres a second; on a line, on either side. It acts through friction alone.

    Examples:
        >>> wall = carom.Wall(point_m=(3.0, 0.0), normal=(-1.0, 0.0))
        >>> wall.normal  # the discs are on its left
        (-1.0, 0.0)
    """

    point_m: Vector
    normal: Direction


class Chain(_Common):
    """A line of straight edges and arcs, which no disc may cross from either side, or all within a width of it.

    Attributes:
        points_m: Where the edges begin and end, metres.
        bulges: Tangent of a quarter of each edge's angle: 0 straight, 1 half of a circle, above 0
            counterclockwise. Empty for all straight.
        closed: Whether an edge runs from the last point to the first.
        half_width_m: The wall is all points within this of the line, metres: rounded at its ends and corners.
        solid: Whether the inside of a closed chain is matter, too, so that no disc may begin there.
        pieces: Number of pieces into which each edge is cut for engines. PIC and PIT ignore it.
        restitution: Coefficient of restitution of this wall and any disc, 0 to 1; None for the scene's.
        friction: Coulomb's coefficient of friction of this wall and any disc, 0 or more; None for the scene's.
        velocity_m_s: The wall is driven: it moves at this velocity, whatever strikes it, and is where its other fields
            say at time 0. At (0, 0) it is at rest.
        legs: The wall is driven along a broken line: the velocity from an instant to the next; instead of
            `velocity_m_s`.
        surface_speed_m_s: The wall is a belt: its surface runs at this speed to the left of the normal into the free
            side, metres a second; on a line, on either side. It acts through friction alone.

    Examples:
        >>> stair = carom.Chain(points_m=[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0)])
        >>> len(stair.points_m), stair.closed
        (3, False)
    """

    left_out = ("bulges", "closed", "half_width_m", "solid", "pieces", *_Common.left_out)

    points_m: tuple[Vector, ...]
    bulges: tuple[Number, ...] = ()
    closed: Annotated[bool, Strict()] = False
    half_width_m: Width = 0.0
    solid: Annotated[bool, Strict()] = False
    pieces: Annotated[int, Strict(), Field(ge=1, le=MOST_WALLS)] = 1

    def model_post_init(self, _context: object, /) -> None:
        """Refuse what is no line, and what crosses or touches itself.

        Raises:
            SceneError: Names the edge, or the two, and where they meet.
        """
        super().model_post_init(_context)
        if problems := list(_shape_problems(self)) or list(_crossing_problems(self)):
            raise SceneError(problems)

    @property
    def outline(self) -> Outline:
        """Its shape."""
        return _outline(self)


class Ring(_Common):
    """A circle that no disc may cross: a container of those inside, a post for those outside; a point, of radius 0.

    Attributes:
        centre_m: Its centre, metres.
        radius_m: Its radius, metres, 0 or more.
        half_width_m: The wall is all points within this of the circle, metres.
        restitution: Coefficient of restitution of this wall and any disc, 0 to 1; None for the scene's.
        friction: Coulomb's coefficient of friction of this wall and any disc, 0 or more; None for the scene's.
        velocity_m_s: The wall is driven: it moves at this velocity, whatever strikes it, and is where its other fields
            say at time 0. At (0, 0) it is at rest.
        legs: The wall is driven along a broken line: the velocity from an instant to the next; instead of
            `velocity_m_s`.
        surface_speed_m_s: The wall is a belt: its surface runs at this speed to the left of the normal into the free
            side, metres a second; on a line, on either side. It acts through friction alone.

    Examples:
        >>> post = carom.Ring(centre_m=(1.0, 2.0), radius_m=0.5)
        >>> post.radius_m
        0.5
    """

    left_out = ("half_width_m", *_Common.left_out)

    centre_m: Vector
    radius_m: Radius
    half_width_m: Width = 0.0

    @property
    def outline(self) -> Outline:
        """Its shape."""
        return Outline((self.centre_m,), (), self.half_width_m, radius=self.radius_m)


#: Fields that identify a kind of wall.
_TELLING: Mapping[str, type[Chain | Ring]] = {"points_m": Chain, "centre_m": Ring, "radius_m": Ring}


def kind_of_wall(fields: Iterable[str]) -> type[Wall | Chain | Ring]:
    """Return the kind of wall that has fields of such names, by default a half-plane."""
    return next((kind for name, kind in _TELLING.items() if name in fields), Wall)


def _as_wall(value: Any) -> Any:
    if isinstance(value, Wall | Chain | Ring):
        return value
    if not isinstance(value, dict):
        raise ValueError("must be a table of fields, or a wall")
    kind = kind_of_wall(value)
    telling = [name for name in ("point_m", "normal", *_TELLING) if name in value]
    if wrong := [name for name in telling if name not in kind.model_fields]:
        of = "a chain has points_m" if kind is Chain else "a circle has centre_m and radius_m"
        raise SceneError([Problem((name,), f"belongs to another kind of wall: {of}") for name in wrong])
    return kind(**value)


AnyWall = Annotated[Union[Wall, Chain, Ring], BeforeValidator(_as_wall)]  # noqa: UP007 - of types that are made late


def _outline(chain: Chain) -> Outline:
    edges = len(chain.points_m) - (not chain.closed)
    bulges = chain.bulges or (0.0,) * edges
    return Outline(chain.points_m, bulges, chain.half_width_m, chain.closed, chain.solid)


def _shape_problems(chain: Chain) -> Iterator[Problem]:
    points = len(chain.points_m)
    least = 2 if not chain.closed or any(chain.bulges) else 3
    if points < least:
        of = " of a closed chain without bulges" if least == 3 else ""
        yield Problem(("points_m",), f"must be {least} points{of} at least, got {points}")
        return
    edges = points - (not chain.closed)
    if chain.bulges and len(chain.bulges) != edges:
        yield Problem(("bulges",), f"must be one for each of the {edges} edges, or left out, got {len(chain.bulges)}")
    for k, bulge in enumerate(chain.bulges[:edges]):
        chord = math.dist(chain.points_m[k], chain.points_m[(k + 1) % points])
        if bulge and not chord * (1.0 / abs(bulge) + abs(bulge)) / 4.0 <= LARGEST:
            yield Problem(("bulges", k), f"makes edge {k} an arc of a radius above {metres(LARGEST)}: 0 is straight")
    if chain.solid and not chain.closed:
        yield Problem(("solid",), "needs closed = true: an open chain has no inside")
    for k in range(edges):
        a, b = chain.points_m[k], chain.points_m[(k + 1) % points]
        place: tuple[str | int, ...] = ("points_m", (k + 1) % points)
        if a == b:
            yield Problem(place, f"must not be where edge {k} begins, got {a}: it has no length")
        elif (length := math.dist(a, b)) < SMALLEST:
            yield Problem(
                place,
                f"makes edge {k} {metres(length)} long: {metres(SMALLEST)} is the least, as of a radius",
            )


def _crossing_problems(chain: Chain) -> Iterator[Problem]:
    for met in islice(meetings(chain.outline.edges, closed=chain.closed), _NAMED):
        yield Problem(
            ("points_m",),
            "must not cross, touch or run back over itself other than at its joints: "
            f"edge {met.second} meets edge {met.first} at ({number(met.x, 6)}, {number(met.y, 6)})",
        )


def edge_count(wall: object) -> int:
    """Return the number of edges of a wall in a file, valid or not; a half-plane or a circle counts as one."""
    points = wall.get("points_m") if isinstance(wall, dict) else None
    return max(1, len(points)) if isinstance(points, list) else 1


Unit = Callable[[float], float]


def with_lengths(wall: AnyWall, length: Unit, speed: Unit, time: Unit) -> AnyWall:
    """Return a wall with other lengths, speeds and times: functions of each; the shape is not checked again."""
    changed: dict[str, Any] = {
        "velocity_m_s": _each(wall.velocity_m_s, speed),
        "legs": with_speeds(wall.legs, speed, time),
        "surface_speed_m_s": speed(wall.surface_speed_m_s),
    }
    if not isinstance(wall, Wall):
        changed["half_width_m"] = length(wall.half_width_m)
    if isinstance(wall, Ring):
        changed["radius_m"] = length(wall.radius_m)
    return _placed(wall, lambda point: _each(point, length)).model_copy(update=changed)


def with_speeds(legs: tuple[Leg, ...], speed: Unit, time: Unit) -> tuple[Leg, ...]:
    """Return legs with other velocities and times: functions of each."""
    return tuple(
        leg.model_copy(update={"from_s": time(leg.from_s), "velocity_m_s": _each(leg.velocity_m_s, speed)})
        for leg in legs
    )


def begun_at(body: Any, time_s: float) -> Any:
    """Return a wall or driven disc with the legs of its path counted from another time, before the start or after."""
    if not body.legs:
        return body
    legs = tuple(Leg(from_s=begin_s, velocity_m_s=velocity) for begin_s, velocity in body.drive.begun_at(time_s))
    return body.model_copy(update={"legs": legs})


def driven_back(wall: AnyWall) -> AnyWall:
    """Return a wall with the opposite motion and belt: the motion, reversed in time, that leads to its start."""
    u, v = wall.drive.velocity_at(0.0)
    changed = {"velocity_m_s": (-u, -v), "legs": (), "surface_speed_m_s": -wall.surface_speed_m_s}
    return wall.model_copy(update=changed) if wall.driven or wall.surface_speed_m_s else wall


def moved_by(wall: AnyWall, x: float, y: float) -> AnyWall:
    """Return a wall moved by a vector; the shape is not checked again."""
    return _placed(wall, lambda point: (point[0] + x, point[1] + y))


def _each(point: Point, of: Unit) -> Point:
    return of(point[0]), of(point[1])


def _placed(wall: AnyWall, of: Callable[[Point], Point]) -> AnyWall:
    """Return a wall with other points: a function of each."""
    if isinstance(wall, Wall):
        return wall.model_copy(update={"point_m": of(wall.point_m)})
    if isinstance(wall, Chain):
        return wall.model_copy(update={"points_m": tuple(map(of, wall.points_m))})
    return wall.model_copy(update={"centre_m": of(wall.centre_m)})
