"""Reads a pickled `pymunk.Space` as a scene. The unpickler accepts only plain types and types of pymunk."""

from __future__ import annotations

import io
import math
import pickle
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from carom.engines.api import AdapterError, Disc, Imported, Scene, Wall, one_coefficient, wall_towards

if TYPE_CHECKING:
    import pymunk

Point = tuple[float, float]

#: Types that a pickled space may contain, by module and name. Reading these types runs no code except `__setstate__` of
#: pymunk.
_ADMITTED = {
    ("pymunk.space", "Space"),
    ("pymunk.body", "Body"),
    ("pymunk.vec2d", "Vec2d"),
    ("pymunk.shape_filter", "ShapeFilter"),
    ("pymunk.transform", "Transform"),
    ("pymunk.bb", "BB"),
    *(("pymunk.shapes", name) for name in ("Circle", "Segment", "Poly")),
    *(
        ("pymunk.constraints", name)
        for name in (
            "PinJoint",
            "SlideJoint",
            "PivotJoint",
            "GrooveJoint",
            "DampedSpring",
            "DampedRotarySpring",
            "RotaryLimitJoint",
            "RatchetJoint",
            "GearJoint",
            "SimpleMotor",
        )
    ),
    # Functions and types by which the two oldest pickle protocols store objects and some containers.
    ("copyreg", "_reconstructor"),
    *(("builtins", name) for name in ("object", "tuple", "list", "dict", "set", "frozenset")),
}


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        # Pickle protocols below 3 use names of Python 2, which are translated before the check.
        known = {"__builtin__": "builtins", "copy_reg": "copyreg"}.get(module, module)
        if (known, name) not in _ADMITTED:
            raise AdapterError(
                f"the file contains {module}.{name}, which is neither a type of pymunk nor a plain type; reading stops"
            )
        return super().find_class(known, name)


def read_scene(content: bytes, name: str, duration_s: float) -> Imported:
    """Read the discs and walls of a pickled space, and list everything in the space that scenes do not support.

    Raises:
        AdapterError: The file is not a pickle of a space, or contains a type that is not accepted.
        SceneError: The supported part of the space is not a valid scene: there is no disc, or bodies overlap.
    """
    import pymunk

    try:
        space = _Unpickler(io.BytesIO(content)).load()
    except AdapterError:
        raise
    except Exception as error:  # invalid bytes can cause any exception in the unpickler and in pymunk
        raise AdapterError(f"the file is not a pickle of a pymunk.Space: {type(error).__name__}: {error}") from error
    if not isinstance(space, pymunk.Space):
        raise AdapterError(f"the file contains a {type(space).__name__} instead of a pymunk.Space")
    return _Reading(space).build_scene(name, duration_s)


class _Reading:
    """Reads a space. Discs are read first, since their positions determine which face of a body becomes a wall."""

    def __init__(self, space: pymunk.Space) -> None:
        self.space = space
        self.dropped: list[str] = []
        self.discs: list[tuple[pymunk.Circle, Disc]] = []
        self.walls: list[tuple[pymunk.Shape, Wall]] = []

    def build_scene(self, name: str, duration_s: float) -> Imported:
        import pymunk

        for k, shape in enumerate(self.space.shapes):
            if isinstance(shape, pymunk.Circle) and self._can_keep(shape, k):
                self._read_circle(shape, k)
        for k, shape in enumerate(self.space.shapes):
            if not isinstance(shape, pymunk.Circle) and self._can_keep(shape, k):
                self._read_wall(shape, k)
        self._report_unsupported_parts()
        return Imported(
            Scene(
                name=name,
                discs=[disc for _, disc in self.discs],
                walls=[wall for _, wall in self.walls],
                gravity_m_s2=tuple(self.space.gravity),
                duration_s=duration_s,
                **self._find_coefficients("restitution", "elasticity", 1.0),
                **self._find_coefficients("friction", "friction", math.inf),
            ),
            tuple(self.dropped),
        )

    def _can_keep(self, shape: pymunk.Shape, k: int) -> bool:
        """Whether a scene can contain a shape. Add an unsupported shape to the list of dropped parts."""
        body, label = shape.body, f"shape {k}, a {type(shape).__name__}"
        if body is None or shape.sensor:
            self.dropped.append(f"{label}: {'it has no body' if body is None else 'a sensor, which exerts no force'}")
        elif body.body_type == body.KINEMATIC and (body.velocity.length > 0 or body.angular_velocity != 0):
            self.dropped.append(f"{label}: its kinematic body moves by itself")
        elif body.body_type == body.DYNAMIC and len(body.shapes) > 1:
            self.dropped.append(f"{label}: its body has {len(body.shapes)} shapes")
        else:
            return True
        return False

    def _read_circle(self, shape: pymunk.Circle, k: int) -> None:
        body = shape.body
        assert body is not None  # noqa: S101 - `_can_keep` has checked this
        place = tuple(body.local_to_world(shape.offset))
        if body.body_type != body.DYNAMIC:
            self.discs.append((shape, Disc(position_m=place, radius_m=shape.radius, mass_kg=math.inf)))
            return
        if shape.offset != body.center_of_gravity:
            self.dropped.append(f"shape {k}, a Circle: its centre is not the centre of gravity of its body")
            return
        factor = body.moment / (body.mass * shape.radius**2)
        if 1.0 < factor < math.inf:
            self.dropped.append(f"shape {k}, a Circle: its moment of inertia, {factor:g} m r^2, is reduced to m r^2")
            factor = 1.0
        spin = body.angular_velocity
        if math.isinf(factor) and spin != 0.0:
            self.dropped.append(f"shape {k}, a Circle: its spin is ignored, since its moment of inertia is infinite")
            spin = 0.0
        disc = Disc(
            position_m=place,
            velocity_m_s=tuple(body.velocity),
            radius_m=shape.radius,
            mass_kg=body.mass,
            spin_rad_s=spin,
            inertia_factor=factor,
        )
        self.discs.append((shape, disc))

    def _read_wall(self, shape: pymunk.Shape, k: int) -> None:
        body, label = shape.body, f"shape {k}, a {type(shape).__name__}"
        assert body is not None  # noqa: S101 - `_can_keep` has checked this
        if body.body_type == body.DYNAMIC:
            self.dropped.append(f"{label}: it moves, and only discs can move in scenes")
            return
        wall = wall_towards([disc for _, disc in self.discs], _list_faces(shape))
        if wall is None:
            reason = "no half-plane can replace it: no face has all discs in front of it"
            self.dropped.append(f"{label}: {reason}")
            return
        self.walls.append((shape, wall))
        self.dropped.append(f"{label}: only its face towards the discs is kept, without its ends")

    def _find_coefficients(self, name: str, attribute: str, limit: float) -> dict[str, float]:
        """Return the coefficients of two discs, and of a disc and a wall: products of the bodies' coefficients."""
        of_discs = [float(getattr(shape, attribute)) for shape, _ in self.discs]
        of_walls = [float(getattr(shape, attribute)) for shape, _ in self.walls]
        pairs = [a * b for k, a in enumerate(of_discs) for b in of_discs[k + 1 :]]
        walled = [a * b for a in of_discs for b in of_walls]
        pair = one_coefficient(f"{name} of pairs of discs", pairs or [a * a for a in of_discs], limit, self.dropped)
        walls = one_coefficient(f"{name} of discs with walls", walled or [pair], limit, self.dropped)
        return {name: pair, f"wall_{name}": walls}

    def _report_unsupported_parts(self) -> None:
        space = self.space
        for constraint in space.constraints:
            self.dropped.append(f"a {type(constraint).__name__}")
        if space.damping != 1.0:
            self.dropped.append(f"the damping of the space, {space.damping:g}")
        for k, (shape, _) in enumerate(self.discs):
            self.dropped += [f"disc {k}: {reason}" for reason in _list_unsupported_properties(shape)]


def _list_unsupported_properties(shape: pymunk.Circle) -> Iterator[str]:
    """Yield properties of a disc that scenes do not support."""
    body, passing = shape.body, type(shape.filter)()
    if shape.filter != passing:
        yield f"its filter, {shape.filter}"
    if shape.surface_velocity != (0.0, 0.0):
        yield "its surface velocity"
    if body is not None and (body.force.length > 0 or body.torque != 0):
        yield "the force or torque on its body"


def _list_faces(shape: pymunk.Shape) -> Iterator[tuple[Point, Point]]:
    """Yield a point and the outward normal of each face of a segment or a polygon, in world coordinates."""
    import pymunk

    body = shape.body
    if body is None:
        return
    if isinstance(shape, pymunk.Segment):
        corners = [body.local_to_world(shape.a), body.local_to_world(shape.b)]
    elif isinstance(shape, pymunk.Poly):
        corners = [body.local_to_world(corner) for corner in shape.get_vertices()]  # counterclockwise
    else:
        return
    radius = float(shape.radius)
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        along = b - a
        if along.length == 0.0:
            continue
        nx, ny = along.y / along.length, -along.x / along.length
        yield (a.x + radius * nx, a.y + radius * ny), (nx, ny)
