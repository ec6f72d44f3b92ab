"""Random scenes in which all features meet, each drawn from its number alone.

A scene is drawn in units in which its room is some metres wide and its discs move at some metres per second. Lengths,
times and masses are then scaled, and the scene is moved away from the origin. What the scene model refuses is not
drawn: discs are placed in free space, and friction, spin and driven bodies are drawn where the law of the scene has
them.
"""

import cmath
import math
import random
from collections.abc import Sequence
from enum import StrEnum
from typing import Any, NamedTuple

from carom import Chain, Disc, Ring, Scene, SceneError, Wall
from carom.model.units import convert_units
from carom.model.walls import AnyWall, Leg, move_wall

Point = tuple[float, float]

#: Restitutions of discs and walls: the ends of their range more often than anything between.
RESTITUTIONS = (0.0, 0.0, 0.3, 0.5, 0.8, 0.9, 1.0, 1.0, 1.0)
#: Exponents of ten of the largest and smallest lengths, times and masses, relative to those that scenes are drawn in.
MOST_LENGTH, MOST_TIME, MOST_MASS = 5.0, 2.0, 6.0
#: A scene is up to this many orders of magnitude of its own size away from the origin.
MOST_OFFSET = 6.0
#: Half the width of the room that a scene is drawn in, metres, and the margin in which discs may start outside it.
HALF_ROOM_M, MARGIN_M = 3.0, 0.5
#: Attempts at a place for a disc, after which the scene has one disc fewer.
MOST_PLACES = 200


class Law(StrEnum):
    """Motion of discs between impacts; tables show its value."""

    STRAIGHT = "straight"
    GRAVITY = "gravity"
    DAMPED = "damped"
    TABLE = "table"


#: How often each law is drawn.
_LAWS = [Law.STRAIGHT] * 4 + [Law.GRAVITY] * 3 + [Law.DAMPED] + [Law.TABLE] * 2


class Units(NamedTuple):
    """Factors of all lengths, times and masses of a scene, and how far it is moved from the origin."""

    length: float
    time: float
    mass: float
    offset_m: Point


def draw_scene(number: int) -> Scene:
    """Return the scene of a number, from 0 on."""
    rng = random.Random(f"features {number}")
    while True:
        try:
            scene = _Drawing(rng).scene(number)
        except SceneError:  # a chain that crosses itself, or a disc that a moved wall overlaps by rounding
            continue
        if not _has_filled_circle(scene):
            return scene


def _has_filled_circle(scene: Scene) -> bool:
    """Whether a disc fills a circle around it. It touches the circle everywhere, so an impact has no direction."""
    return any(
        isinstance(wall, Ring)
        and wall.radius_m - wall.half_width_m <= disc.radius_m
        and wall.centre_m == disc.position_m
        for wall in scene.walls
        for disc in scene.discs
    )


def law_of(scene: Scene) -> Law:
    """Return how the discs of a scene move between impacts."""
    if scene.gravity_m_s2 != (0.0, 0.0):
        return Law.GRAVITY
    if scene.table_deceleration_m_s2:
        return Law.TABLE
    return Law.DAMPED if scene.damping_per_s else Law.STRAIGHT


class _Drawing:
    """Choices that several parts of one scene depend on."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.law = rng.choice(_LAWS)
        self.turns = self.law is not Law.TABLE and rng.random() < 0.5
        self.can_drive = self.law in {Law.STRAIGHT, Law.GRAVITY} and rng.random() < 0.6
        self.is_plain = rng.random() < 0.3  # all walls are at rest, and of the scene's own material
        self.on_grid = rng.random() < 0.1  # numbers are quarters: ties, corners and contact
        self.tilt = cmath.rect(1.0, rng.choice((0.0, 0.0, rng.uniform(0.0, math.tau)))) if not self.on_grid else 1.0
        self.lies = False  # whether the disc that is drawn touches the first wall
        self.duration_s = math.exp(rng.uniform(math.log(2.0), math.log(40.0)))

    def scene(self, number: int) -> Scene:
        rng, law = self.rng, self.law
        walls = self.walls()
        discs = self.discs(walls)
        rubs = self.turns and rng.random() < 0.9
        fields: dict[str, Any] = {
            "restitution": self.restitution(),
            "wall_restitution": self.restitution(),
            "friction": self.friction() if rubs else 0.0,
            "wall_friction": self.friction() if rubs else 0.0,
        }
        if rubs:
            back = (0.0, 0.0, 0.0, 0.4, 1.0, -1.0, -0.5)
            fields |= {name: rng.choice(back) for name in ("tangential_restitution", "wall_tangential_restitution")}
        if law is Law.GRAVITY:
            fields["gravity_m_s2"] = self.gravity(walls)
            if not fields.get("wall_tangential_restitution", 0.0) and rng.random() < 0.3:
                fields["wall_rolling_resistance"] = rng.choice((0.01, 0.1, 0.5))
        elif law is Law.DAMPED:
            fields["damping_per_s"] = math.exp(rng.uniform(math.log(0.01), math.log(3.0)))
        elif law is Law.TABLE:
            fields["table_deceleration_m_s2"] = math.exp(rng.uniform(math.log(0.02), math.log(2.0)))
        drawn = Scene(name=f"features {number}", discs=discs, walls=walls, duration_s=self.duration_s, **fields)
        return _in_units(drawn, self.units())

    def units(self) -> Units:
        """Return the scene's units; on a grid they are powers of two, so that numbers keep their bits."""
        rng = self.rng
        exponents = [rng.uniform(-most, most) if rng.random() < 0.5 else 0.0 for most in (MOST_LENGTH, MOST_TIME)]
        if self.on_grid:
            length, time = (2.0 ** round(exponent * math.log2(10.0)) for exponent in exponents)
            return Units(length, time, 1.0, (0.0, 0.0))
        length, time = (10.0**exponent for exponent in exponents)
        away = length * 10.0 ** rng.uniform(0.0, MOST_OFFSET) if rng.random() < 0.25 else 0.0
        offset = cmath.rect(away, rng.uniform(0.0, math.tau)) if away else 0j
        return Units(length, time, 10.0 ** rng.uniform(-3.0, 3.0), (offset.real, offset.imag))

    # Numbers ----------------------------------------------------------------------------------------------------------

    def number(self, low: float, high: float) -> float:
        """Return a number between two others; a multiple of a quarter on a grid."""
        if self.on_grid:
            return self.rng.randint(math.ceil(4 * low), math.floor(4 * high)) / 4
        return self.rng.uniform(low, high)

    def vector(self, size: float) -> Point:
        if self.on_grid:
            return self.number(-size, size), self.number(-size, size)
        return self.rng.gauss(0.0, 0.5 * size), self.rng.gauss(0.0, 0.5 * size)

    def restitution(self) -> float:
        return self.rng.choice((*RESTITUTIONS, self.rng.random()))

    def friction(self) -> float:
        return self.rng.choice((0.0, 0.05, 0.3, 0.5, 1.0, 10.0))

    def gravity(self, walls: Sequence[AnyWall]) -> Point:
        size = math.exp(self.rng.uniform(math.log(0.2), math.log(20.0)))
        if self.on_grid:
            size = 2.0 ** round(math.log2(size))
        if self.on_grid or self.rng.random() < 0.3:
            return self.rng.choice(((0.0, -size), (0.0, -size), (size, 0.0), (0.0, size), (-size, 0.0)))
        if isinstance(walls[0] if walls else None, Wall) and self.rng.random() < 0.3:  # straight onto the first wall
            normal = walls[0].normal  # type: ignore[union-attr]
            return -size * normal[0], -size * normal[1]
        pull = cmath.rect(size, self.rng.uniform(0.0, math.tau))
        return pull.real, pull.imag

    # Walls ------------------------------------------------------------------------------------------------------------

    def walls(self) -> list[AnyWall]:
        """Return a room or none, and the obstacles in it."""
        rng = self.rng
        rooms = [self.box, self.box, self.polygon, self.polygon, self.ring, self.stadium, self.slopes, self.nothing]
        rooms += [self.box, self.polygon, self.slopes] if self.law is Law.GRAVITY else []
        walls = rng.choice(rooms)()
        inside = (self.bar, self.bar, self.island, self.post, self.post, self.cut)
        walls += [rng.choice(inside)() for _ in range(rng.choice((0, 0, 1, 1, 2, 3)))]
        return walls

    def surface(self) -> dict[str, Any]:
        """Return what a wall may have of its own: restitution, friction, a path, a belt."""
        rng = self.rng
        if self.is_plain:
            return {}
        own: dict[str, Any] = {}
        if rng.random() < 0.35:
            own["restitution"] = self.restitution()
        if self.turns and rng.random() < 0.3:
            own["friction"] = self.friction()
        if self.can_drive and rng.random() < 0.4:
            own |= self.path(0.3)
        if self.can_drive and self.turns and rng.random() < 0.25:
            own["surface_speed_m_s"] = self.number(-1.0, 1.0)
        return own

    def path(self, speed_m_s: float) -> dict[str, Any]:
        """Return a driven body's velocity or its legs."""
        rng = self.rng
        if rng.random() < 0.4:
            return {"velocity_m_s": self.vector(speed_m_s)}
        legs, begin_s, there = [], 0.0, (0.0, 0.0)
        for k in range(rng.randint(2, 9)):
            velocity = self.vector(speed_m_s)
            if k % 2:  # back again, so that it stays near
                velocity = (-0.5 * there[0], -0.5 * there[1])
            legs.append(Leg(from_s=begin_s, velocity_m_s=velocity))
            there = velocity
            begin_s += self.number(0.25, 1.5)
        return {"legs": tuple(legs)}

    def turned(self, *points: Point) -> list[Point]:
        if self.tilt == 1.0:
            return list(points)
        turned = (complex(*point) * self.tilt for point in points)
        return [(point.real, point.imag) for point in turned]

    def nothing(self) -> list[AnyWall]:
        return []

    def box(self) -> list[AnyWall]:
        normals = self.turned((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
        half = HALF_ROOM_M
        return [Wall(point_m=(-half * x, -half * y), normal=(x, y), **self.surface()) for x, y in normals]

    def polygon(self) -> list[AnyWall]:
        corners = self.rng.choice((3, 4, 4, 5, 7))
        points = []
        for k in range(corners):
            corner = cmath.rect(HALF_ROOM_M * 1.2, math.tau * k / corners + math.pi / 4)
            jitter = 0.0 if self.on_grid and corners == 4 else 0.5
            x, y = corner.real + self.number(-jitter, jitter), corner.imag + self.number(-jitter, jitter)
            points.append((round(4 * x) / 4, round(4 * y) / 4) if self.on_grid else (x, y))
        bulges = tuple(self.rng.choice((0.0, 0.0, 0.2, 0.4, -0.15)) for _ in points) if self.rng.random() < 0.5 else ()
        thick = self.rng.choice((0.0, 0.0, 0.125))
        more = self.surface()
        return [Chain(points_m=self.turned(*points), bulges=bulges, closed=True, half_width_m=thick, **more)]

    def ring(self) -> list[AnyWall]:
        return [Ring(centre_m=(0.0, 0.0), radius_m=HALF_ROOM_M * 1.1, **self.surface())]

    def stadium(self) -> list[AnyWall]:
        high = self.number(1.5, 2.5)
        points = self.turned((-2.0, -high), (2.0, -high), (2.0, high), (-2.0, high))
        return [Chain(points_m=points, bulges=(0.0, 1.0, 0.0, 1.0), closed=True, **self.surface())]

    def slopes(self) -> list[AnyWall]:
        """Return one or two half-planes, under a part of the discs."""
        walls: list[AnyWall] = []
        for x, y in self.turned((0.0, 1.0), (self.number(0.5, 1.5), self.number(0.5, 1.5)))[: self.rng.choice((1, 2))]:
            away = -HALF_ROOM_M / math.hypot(x, y)
            walls.append(Wall(point_m=(away * x, away * y), normal=(x, y), **self.surface()))
        return walls

    def bar(self) -> AnyWall:
        points = [(self.number(-2.0, 2.0), self.number(-2.0, 2.0)) for _ in range(self.rng.choice((2, 2, 3)))]
        bulges = tuple(self.rng.choice((0.0, 0.5, 1.0, -0.5)) for _ in points[1:]) if self.rng.random() < 0.4 else ()
        thick = self.rng.choice((0.0, 0.125, 0.25))
        return Chain(points_m=points, bulges=bulges, half_width_m=thick, **self.surface())

    def island(self) -> AnyWall:
        x, y = self.number(-1.5, 1.5), self.number(-1.5, 1.5)
        corners = ((0.0, 0.0), (self.number(0.5, 1.0), 0.0), (self.number(0.25, 0.5), self.number(0.5, 1.0)))
        bulges = self.rng.choice(((), (0.4, 0.0, -0.25), (0.0, 0.25, 0.25)))
        solid, thick = self.rng.random() < 0.5, self.rng.choice((0.0, 0.0, 0.125))
        points = [(x + dx, y + dy) for dx, dy in corners]
        return Chain(points_m=points, bulges=bulges, closed=True, solid=solid, half_width_m=thick, **self.surface())

    def post(self) -> AnyWall:
        place, radius = (self.number(-2.0, 2.0), self.number(-2.0, 2.0)), self.rng.choice((0.0, 0.25, 0.5, 1.0))
        return Ring(centre_m=place, radius_m=radius, half_width_m=self.rng.choice((0.0, 0.0, 0.125)), **self.surface())

    def cut(self) -> AnyWall:
        """Return a half-plane across a corner of the room."""
        normal = cmath.rect(1.0, self.rng.uniform(0.0, math.tau))
        if self.on_grid:
            normal = self.rng.choice((3 + 4j, -4 + 3j, 1 + 1j, -1 + 1j, -1 - 1j))
        away = -HALF_ROOM_M * self.rng.uniform(0.8, 1.2) / abs(normal)
        point = (away * normal.real, away * normal.imag)
        return Wall(point_m=point, normal=(normal.real, normal.imag), **self.surface())

    # Discs ------------------------------------------------------------------------------------------------------------

    def discs(self, walls: Sequence[AnyWall]) -> list[Disc]:
        """Return discs in free places; the first can be moved by impacts."""
        count, found = self.rng.choice((1, 1, 2, 2, 3, 3, 4, 6, 8)), list[Disc]()
        begins_lying = self.law is Law.GRAVITY and bool(walls) and isinstance(walls[0], Wall)
        lie = begins_lying and self.rng.random() < 0.3
        while len(found) < count:
            self.lies = lie and self.rng.random() < 0.7
            disc = self.disc(walls, found)
            if disc is None and found:
                break
            if disc is None:
                raise SceneError([])  # no room for a single disc: draw the walls again
            found.append(disc)
        self.rng.shuffle(found)
        return found

    def disc(self, walls: Sequence[AnyWall], others: Sequence[Disc]) -> Disc | None:
        """Return a disc in a free place; None where none was found."""
        rng = self.rng
        radius = rng.choice((0.25, 0.5)) if self.on_grid else rng.choice((0.2, rng.uniform(0.05, 0.5)))
        half = HALF_ROOM_M + (MARGIN_M if rng.random() < 0.1 else -radius)
        for _ in range(MOST_PLACES):
            x, y = (self.number(-half, half) for _ in "xy")
            if self.lies and isinstance(walls[0], Wall):  # touching the surface, to rounding
                gap = _gap(walls[0], x, y, radius)
                x, y = x - gap * walls[0].normal[0], y - gap * walls[0].normal[1]
            is_free = all(math.dist((x, y), other.position_m) >= radius + other.radius_m for other in others)
            if is_free and all(_gap(wall, x, y, radius) >= 0.0 for wall in walls[self.lies :]):
                return Disc(position_m=(x, y), radius_m=radius, **self.motion(radius, first=not others))
        return None

    def motion(self, radius_m: float, *, first: bool) -> dict[str, Any]:
        """Return mass, velocity or path, spin and inertia of a disc."""
        rng = self.rng
        if not first and rng.random() < 0.15:
            return {"mass_kg": math.inf}
        if not first and self.can_drive and rng.random() < 0.2:
            spin = {"spin_rad_s": self.number(-2.0, 2.0) / radius_m} if self.turns else {}
            return {"mass_kg": math.inf, "driven": True, **self.path(0.5), **spin}
        mass = rng.choice((1.0, 1.0, math.exp(rng.uniform(-2.0, 2.0)), 10.0 ** rng.uniform(-MOST_MASS, MOST_MASS)))
        fields: dict[str, Any] = {"mass_kg": 2.0 ** rng.randint(-2, 2) if self.on_grid else mass}
        if rng.random() < 0.85:
            fields["velocity_m_s"] = self.vector(rng.choice((1.0, 3.0, 3.0)))
        if self.turns:
            fields["inertia_factor"] = rng.choice((0.5, 0.5, 0.4, 1.0, 1e-3, math.inf))
            if math.isfinite(fields["inertia_factor"]) and rng.random() < 0.6:
                fields["spin_rad_s"] = self.number(-3.0, 3.0) / radius_m
        return fields


def _gap(wall: AnyWall, x: float, y: float, radius_m: float) -> float:
    """Return the distance of a disc's rim from a wall, in metres; below 0 where they overlap."""
    if isinstance(wall, Wall):
        return (x - wall.point_m[0]) * wall.normal[0] + (y - wall.point_m[1]) * wall.normal[1] - radius_m
    outline = wall.outline
    if isinstance(wall, Chain) and wall.solid and outline.does_enclose(x, y):
        return -radius_m
    return outline.compute_gap(x, y, radius_m)


def _in_units(scene: Scene, units: Units) -> Scene:
    """Return a scene in other units, and moved; its bodies are checked again."""
    ox, oy = units.offset_m
    converted = convert_units(scene, 1.0 / units.length, 1.0 / units.time)
    discs = []
    for disc in converted.discs:
        x, y = disc.position_m
        discs.append(Disc(**{**dict(disc), "position_m": (x + ox, y + oy), "mass_kg": disc.mass_kg * units.mass}))
    walls = [type(wall)(**dict(move_wall(wall, ox, oy))) for wall in converted.walls]
    return Scene(**{**dict(converted), "discs": discs, "walls": walls})
