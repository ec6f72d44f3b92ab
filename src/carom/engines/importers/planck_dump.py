"""Reads a world of Planck (Box2D in JavaScript) as a scene, from the JSON that ``Serializer.toJson(world)`` returns."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from typing import Any

from carom.engines.api import Imported, one_coefficient, wall_towards
from carom.errors import InputError, SceneError
from carom.model.scene import Disc, Scene, Wall
from carom.support.limits import MOST_VALUES, count_values

Point = tuple[float, float]

#: Default collision filter of a fixture (a shape of a body). The filters determine which bodies collide.
_FILTER = {"filterGroupIndex": 0, "filterCategoryBits": 0x0001, "filterMaskBits": 0xFFFF}


def parse_dump(content: bytes, name: str, duration_s: float) -> Imported:
    """Read the discs and walls of a dump, and list everything in the dump that scenes do not support.

    Raises:
        InputError: The content is not a dump of Planck.
        SceneError: The supported part of the dump is not a valid scene: there is no disc, or bodies overlap.
    """
    if count_values(content) > MOST_VALUES[".json"]:
        raise InputError(f"it has more than {MOST_VALUES['.json']} values")
    try:
        return _Reading(json.loads(content)).build_scene(name, duration_s)
    except (SceneError, InputError):
        raise
    except RecursionError:
        raise InputError("its JSON is nested too deeply") from None
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"it is not a dump of Planck's Serializer.toJson: {reason}") from None


class _Body:
    """A body of a Planck dump, with its fixtures (shapes)."""

    def __init__(self, entries: Any, reference: Any) -> None:
        self.fields = _resolve(entries, reference)
        self.kind = str(self.fields["type"])
        self.fixtures = [_resolve(entries, fixture) for fixture in self.fields["fixtures"]]
        self.shapes = [_resolve(entries, fixture["shape"]) for fixture in self.fixtures]
        self.moves = self.kind == "dynamic"
        self.driven = self.kind == "kinematic" and (
            _parse_point(self.fields["linearVelocity"]) != (0.0, 0.0) or float(self.fields["angularVelocity"]) != 0.0
        )

    def to_world(self, local: Any) -> Point:
        """Return a point of the body in world coordinates."""
        (x, y), angle = _parse_point(local), float(self.fields["angle"])
        (px, py), c, s = _parse_point(self.fields["position"]), math.cos(angle), math.sin(angle)
        return px + c * x - s * y, py + s * x + c * y


class _Reading:
    """Reads a dump. Discs are read first, since their positions determine which face of a body becomes a wall."""

    def __init__(self, entries: Any) -> None:
        self.world = entries[0]
        self.bodies = [_Body(entries, body) for body in self.world["bodies"]]
        self.joints = [str(_resolve(entries, joint)["type"]) for joint in self.world["joints"]]
        self.dropped: list[str] = []
        self.discs: list[tuple[Any, Disc]] = []
        self.walls: list[tuple[Any, Wall]] = []

    def build_scene(self, name: str, duration_s: float) -> Imported:
        pairs = [
            (body, fixture, shape, f"body {k}, a {shape['type']}")
            for k, body in enumerate(self.bodies)
            for fixture, shape in zip(body.fixtures, body.shapes, strict=True)
        ]
        kept_pairs = [pair for pair in pairs if self._can_keep(*pair)]
        for body, fixture, shape, label in kept_pairs:
            if shape["type"] == "circle":
                self.discs.append((fixture, self._build_disc(body, fixture, shape, label)))
        for body, fixture, shape, label in kept_pairs:
            if shape["type"] != "circle":
                self._read_walls(body, fixture, shape, label)
        self.dropped += [f"a {joint}" for joint in self.joints]
        scene = Scene(
            name=name,
            discs=[disc for _, disc in self.discs],
            walls=[wall for _, wall in self.walls],
            gravity_m_s2=_parse_point(self.world["gravity"]),
            duration_s=duration_s,
            **self._find_coefficients(),
        )
        return Imported(scene, tuple(self.dropped))

    def _can_keep(self, body: _Body, fixture: Any, shape: Any, label: str) -> bool:
        if fixture["isSensor"]:
            self.dropped.append(f"{label}: a sensor, which exerts no force")
        elif body.driven:
            self.dropped.append(f"{label}: its kinematic body moves by itself")
        elif body.moves and len(body.fixtures) > 1:
            self.dropped.append(f"{label}: its body has {len(body.fixtures)} fixtures")
        elif body.moves and shape["type"] != "circle":
            self.dropped.append(f"{label}: it moves, and only discs can move in scenes")
        else:
            return True
        return False

    def _build_disc(self, body: _Body, fixture: Any, shape: Any, label: str) -> Disc:
        if any(fixture[name] != value for name, value in _FILTER.items()):
            self.dropped.append(f"{label}: its filter is ignored")
        place, radius = body.to_world(shape["p"]), float(shape["radius"])
        if not body.moves:
            return Disc(position_m=place, radius_m=radius, mass_kg=math.inf)
        # Box2D gives a body with the density 0 a mass of 1 kg and no moment of inertia, so the body never turns.
        mass = float(fixture["density"]) * math.pi * radius**2
        turns = mass > 0.0 and not body.fields["fixedRotation"]
        spin = float(body.fields["angularVelocity"])
        if spin != 0.0 and not turns:
            self.dropped.append(f"{label}: its spin is ignored, since nothing could change it")
        return Disc(
            position_m=place,
            velocity_m_s=_parse_point(body.fields["linearVelocity"]),
            radius_m=radius,
            mass_kg=mass or 1.0,
            spin_rad_s=spin if turns else 0.0,
            inertia_factor=0.5 if turns else math.inf,
        )

    def _read_walls(self, body: _Body, fixture: Any, shape: Any, label: str) -> None:
        discs, has_wall = [disc for _, disc in self.discs], False
        for faces in _list_face_groups(body, shape):
            if (wall := wall_towards(discs, faces)) is not None:
                has_wall = True
                self.walls.append((fixture, wall))
            else:
                reason = "no half-plane can replace it: no face has all discs in front of it"
                self.dropped.append(f"{label}: {reason}")
        if has_wall:
            self.dropped.append(f"{label}: only its face towards the discs is kept, without its ends and its skin")

    def _find_coefficients(self) -> dict[str, float]:
        """Return the restitution and friction of pairs of discs, and of pairs of a disc and a wall.

        Box2D uses the larger of the restitutions of two bodies, and the square root of the product of their frictions.
        """
        discs, walls = [fixture for fixture, _ in self.discs], [fixture for fixture, _ in self.walls]
        pairs = [*itertools.combinations(discs, 2)] or [(disc, disc) for disc in discs]
        coefficients = {}
        for field, combine, most in (("restitution", max, 1.0), ("friction", lambda a, b: math.sqrt(a * b), math.inf)):
            for name, fixtures in ((field, pairs), (f"wall_{field}", [*itertools.product(discs, walls)])):
                if fixtures:
                    values = [combine(float(a[field]), float(b[field])) for a, b in fixtures]
                    coefficients[name] = one_coefficient(name, values, most, self.dropped)
        return coefficients


def _resolve(entries: Any, reference: Any) -> Any:
    """Return the entry that a reference points to."""
    index = reference["refIndex"]
    if not isinstance(index, int) or not 0 < index < len(entries):
        raise InputError(f"it is not a dump of Planck's Serializer.toJson: a reference to {index!r}")
    return entries[index]


def _parse_point(pair: Any) -> Point:
    return float(pair["x"]), float(pair["y"])


def _list_face_groups(body: _Body, shape: Any) -> Iterator[list[tuple[Point, Point]]]:
    """Yield lists of faces: all faces of a polygon, both sides of an edge, or both sides of each link of a chain."""
    vertices = [shape["vertex1"], shape["vertex2"]] if shape["type"] == "edge" else shape["vertices"]
    corners = [body.to_world(vertex) for vertex in vertices]
    if shape["type"] == "polygon":  # the polygon's vertices are counterclockwise
        yield [face for a, b in zip(corners, [*corners[1:], corners[0]], strict=True) for face in _find_face(a, b)]
        return
    for a, b in itertools.pairwise(corners):
        yield [*_find_face(a, b), *_find_face(b, a)]


def _find_face(a: Point, b: Point) -> Iterator[tuple[Point, Point]]:
    """Yield the face on the right side of the line from a to b: a point, and the unit normal that points right.

    Yield nothing for a line without length.
    """
    x, y = b[0] - a[0], b[1] - a[1]
    length = math.hypot(x, y)
    if length > 0.0:
        yield a, (y / length, -x / length)
