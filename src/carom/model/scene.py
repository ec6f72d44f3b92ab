"""Validated, immutable classes of scenes and discs."""

from __future__ import annotations

import math
from collections.abc import Generator
from enum import StrEnum
from typing import Annotated, Self

import numpy as np
from pydantic import AfterValidator, Field, Strict

from carom.errors import InputError, Problem, SceneError
from carom.model.disc_arrays import DiscArrays, Material
from carom.model.overlap import find_overlaps
from carom.model.prescribed_motion import Drive
from carom.model.sizes import count_steps, find_span_problems
from carom.model.walls import AnyWall, Chain, Leg, Ring, Wall, build_drive, find_leg_problems
from carom.support import hooks
from carom.support.display import Drawn
from carom.support.escaping import format_value
from carom.support.fields import (
    Coefficient,
    Inertia,
    Mass,
    Model,
    NonNegative,
    Number,
    Positive,
    SignedCoefficient,
    Vector,
)

__all__ = ["Chain", "Disc", "Need", "Ring", "Scene", "Wall", "to_scene"]

#: Fields about friction that both a scene and its arrays have.
_OF_FRICTION = ("friction", "wall_friction", "tangential_restitution", "wall_tangential_restitution")


def _require_disc(discs: tuple[Disc, ...]) -> tuple[Disc, ...]:
    if not discs:
        raise ValueError("must hold at least one disc")
    return discs


class Need(StrEnum):
    """A feature that a method must support to run a scene. The value of a member is the feature's name in reports."""

    WALLS = "walls"
    SEGMENTS = "walls of straight edges"
    ARCS = "walls of arcs, or circles around a disc"
    POSTS = "circles hit from outside"
    WALL_MATERIALS = "walls with their own restitution or friction"
    IMMOVABLE = "immovable discs"
    DRIVEN_WALLS = "driven walls"
    DRIVEN_DISCS = "driven discs"
    LEGS = "driven bodies whose velocity changes"
    BELTS = "walls with a moving surface"
    EDGE_BELTS = "edges or circles with a moving surface"
    RESTITUTION = "restitution below 1"
    GRAVITY = "gravity"
    DAMPING = "damping"
    ROLLING_RESISTANCE = "rolling resistance"
    TABLE_FRICTION = "a table that slows discs down"
    SPIN = "spinning discs"
    FRICTION = "friction"
    TANGENTIAL_RESTITUTION = "tangential restitution"


class Disc(Model):
    """A circular rigid body.

    Attributes:
        position_m: Centre at time 0, in metres.
        velocity_m_s: Velocity at time 0, in metres per second.
        radius_m: Radius, in metres, above 0.
        mass_kg: Mass, in kilograms, above 0. Impacts don't move a disc with ``inf`` (in JSON the string ``"inf"``).
        driven: Whether the disc moves with prescribed velocity and spin, which impacts don't change. A driven disc must
            have infinite mass.
        legs: Velocities of a driven disc, each with the time at which it begins; replaces `velocity_m_s`.
        spin_rad_s: Spin at time 0, counterclockwise, in radians per second.
        inertia_factor: Moment of inertia divided by mass times radius squared, above 0 and up to 1: 1/2 for a uniform
            disc, 2/5 for a sphere, 1 for a hoop. A disc with ``inf`` (in JSON the string ``"inf"``) can't turn.

    Examples:
        >>> disc = carom.Disc(position_m=(0.0, 0.0), velocity_m_s=(4.0, 0.0), radius_m=0.25)
        >>> disc.mass_kg
        1.0
    """

    left_out = ("driven", "legs", "spin_rad_s", "inertia_factor")

    position_m: Vector
    velocity_m_s: Vector = (0.0, 0.0)
    radius_m: Positive
    mass_kg: Mass = 1.0
    driven: Annotated[bool, Strict()] = False
    legs: tuple[Leg, ...] = ()
    spin_rad_s: Number = 0.0
    inertia_factor: Inertia = 0.5

    def model_post_init(self, _context: object, /) -> None:
        """Refuse fields that contradict each other.

        Raises:
            SceneError: A disc of infinite mass moves or spins, but is not driven. A disc of infinite inertia spins. A
                driven disc has a finite mass. The legs are invalid, or a disc with legs is not driven.
        """
        problems = list(find_leg_problems(self.legs, self.velocity_m_s)) if self.legs else []
        if self.legs and not self.driven:
            problems.append(Problem(("legs",), "need driven = true: only a driven disc has legs"))
        is_fixed = self.immovable and not self.driven
        if self.driven and not self.immovable:
            problems.append(Problem(("driven",), f"needs mass_kg = inf: impacts move a disc of {self.mass_kg:g} kg"))
        if is_fixed and self.velocity_m_s != (0.0, 0.0):
            message = (
                f"must be (0, 0) for an immovable disc (mass_kg = inf), got {self.velocity_m_s}; "
                "set driven = true for a disc with a prescribed motion"
            )
            problems.append(Problem(("velocity_m_s",), message))
        if self.spin_rad_s != 0.0 and (is_fixed or (math.isinf(self.inertia_factor) and not self.driven)):
            cause = "an immovable disc (mass_kg = inf)" if is_fixed else "a disc that can't turn (inertia_factor = inf)"
            problems.append(Problem(("spin_rad_s",), f"must be 0 for {cause}, got {self.spin_rad_s}"))
        if problems:
            raise SceneError(problems)

    @property
    def immovable(self) -> bool:
        """Whether the disc has infinite mass, so that no impact changes its motion."""
        return math.isinf(self.mass_kg)

    @property
    def drive(self) -> Drive:
        """The path of a driven disc."""
        return build_drive(self.legs, self.velocity_m_s)


class Scene(Drawn, Model):
    """Discs, walls and coefficients of the physical laws. Scenes are immutable. Scenes with equal fields are equal.

    Attributes:
        name: Name of the scene in reports.
        description: Free text for a reader, one or two sentences.
        discs: At least one disc.
        walls: Half-planes, chains of straight edges and arcs, and circles; none by default.
        restitution: Coefficient of restitution of every pair of discs, 0 to 1.
        wall_restitution: Coefficient of restitution between any disc and any wall, 0 to 1.
        friction: Coulomb's coefficient of friction of every pair of discs, 0 or more.
        wall_friction: Coulomb's coefficient of friction between any disc and any wall, 0 or more.
        tangential_restitution: Tangential restitution of two discs, -1 to 1. If friction is strong enough, an impact
            multiplies the tangential relative velocity of the touching surfaces by minus this value. The value 0 ends
            this sliding, and 1 reverses it.
        wall_tangential_restitution: Tangential restitution between any disc and any wall, -1 to 1.
        gravity_m_s2: Uniform acceleration of every movable disc, in metres per second squared.
        damping_per_s: Rate c of linear damping, in 1/s, 0 or more: between impacts, velocities and spins of all discs
            decrease as ``exp(-c t)``. The rate must be 0 in a scene with gravity. See `docs/theory/damping.md`.
        wall_rolling_resistance: Coefficient c of rolling resistance between any disc and any wall, 0 or more. If a disc
            of radius R presses on a wall with the force P, a torque of up to ``c P R`` resists its rotation. On the
            steepest slope on which a disc stays at rest, c is the tangent of the slope's angle. Rolling resistance
            needs gravity, and `wall_tangential_restitution` must be 0. See `docs/theory/contact.md`.
        table_deceleration_m_s2: Deceleration of discs that slide on a horizontal table, in metres per second squared.
            A scene with a table is seen from above, and can't have gravity, damping, spin, friction or driven bodies.
            See `docs/theory/contact.md`.
        duration_s: Duration of the simulation, in seconds, above 0.
        frame_rate_hz: Frames per second. By default, no step is longer than one frame.

    Examples:
        >>> disc = carom.Disc(position_m=(0.0, 0.0), velocity_m_s=(4.0, 0.0), radius_m=0.25)
        >>> wall = carom.Wall(point_m=(3.0, 0.0), normal=(-1.0, 0.0))
        >>> scene = carom.Scene(name="bounce", discs=[disc], walls=[wall], duration_s=1.0)
        >>> float(carom.solve_pic(scene).impacts["time_s"][0])
        0.6875
    """

    left_out = (*_OF_FRICTION, "damping_per_s", "wall_rolling_resistance", "table_deceleration_m_s2")

    # Control characters are refused because names are printed on terminals and in reports.
    name: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
    description: str = ""
    discs: Annotated[tuple[Disc, ...], AfterValidator(_require_disc), Field(json_schema_extra={"minItems": 1})]
    walls: tuple[AnyWall, ...] = ()
    restitution: Coefficient = 1.0
    wall_restitution: Coefficient = 1.0
    friction: NonNegative = 0.0
    wall_friction: NonNegative = 0.0
    tangential_restitution: SignedCoefficient = 0.0
    wall_tangential_restitution: SignedCoefficient = 0.0
    gravity_m_s2: Vector = (0.0, 0.0)
    damping_per_s: NonNegative = 0.0
    wall_rolling_resistance: NonNegative = 0.0
    table_deceleration_m_s2: NonNegative = 0.0
    duration_s: Positive
    frame_rate_hz: Positive = 60.0

    def model_post_init(self, _context: object, /) -> None:
        """Refuse bodies that overlap, sizes that differ too much, and physical laws that can't be combined.

        Raises:
            SceneError: Two discs, or a disc and a wall, overlap by more than rounding errors. The ratio of two sizes is
                larger than `carom.support.limits` allows. Damping, rolling resistance or a table is combined with an
                unsupported feature.
        """
        start = self.arrays
        problems = list(find_span_problems(start, self.gravity_m_s2, self.duration_s))
        problems += self._find_conflicting_laws()
        found, has_more = find_overlaps(start, "discs[{}]", "walls[{}]")
        problems += [Problem(("discs", overlap.disc, "position_m"), overlap.message) for overlap in found]
        if problems:
            raise SceneError(problems, more=has_more)

    def _find_conflicting_laws(self) -> Generator[Problem, None, None]:
        if not (self.damping_per_s or self.wall_rolling_resistance or self.table_deceleration_m_s2):
            return
        falls, sticks = self.gravity_m_s2 != (0.0, 0.0), self.wall_tangential_restitution != 0.0
        conflicts = {
            "damping_per_s": (
                "with gravity" * falls,
                "with a driven body, whose path is not damped" * self.arrays.driven,
            ),
            "wall_rolling_resistance": (
                "with wall_tangential_restitution, which returns the energy that rolling resistance removes" * sticks,
                "without gravity, because only gravity presses discs to walls" * (not falls and not sticks),
            ),
            "table_deceleration_m_s2": (
                "with gravity" * falls,
                "with damping" * (self.damping_per_s > 0.0),
                "with driven bodies, which a table does not slow down" * self.arrays.driven,
                "with friction or spin, which a table changes too" * self.arrays.turns,
            ),
        }
        for name, features in conflicts.items():
            if value := getattr(self, name):
                for feature in filter(None, features):
                    yield Problem((name,), f"must be 0 in a scene {feature}, got {value}")

    # The arrays are in a slot, because copies and pickles of a scene contain only its `__dict__`. A copy may get other
    # discs, and another process builds its own arrays.
    __slots__ = ("_arrays",)

    @property
    def arrays(self) -> DiscArrays:
        """The discs, walls and coefficients of the scene as read-only arrays, the input of every solver."""
        arrays: DiscArrays | None = getattr(self, "_arrays", None)
        if arrays is None:
            arrays = self._build_arrays()
            object.__setattr__(self, "_arrays", arrays)
        return arrays

    def _build_arrays(self) -> DiscArrays:
        discs, belts = self.discs, tuple(wall.surface_speed_m_s for wall in self.walls)
        return DiscArrays.of_valid(
            position_m=np.array([disc.position_m for disc in discs]),
            velocity_m_s=np.array([(disc.legs[0] if disc.legs else disc).velocity_m_s for disc in discs]),
            radius_m=np.array([disc.radius_m for disc in discs]),
            mass_kg=np.array([disc.mass_kg for disc in discs]),
            walls=tuple(
                (*wall.point_m, *wall.normal) if isinstance(wall, Wall) else wall.outline for wall in self.walls
            ),
            wall_materials=self._build_wall_materials(),
            wall_drives=tuple(wall.drive for wall in self.walls) if any(wall.driven for wall in self.walls) else None,
            belts_m_s=belts if any(belts) else None,
            driven_discs=tuple(i for i, disc in enumerate(discs) if disc.driven),
            disc_drives=tuple(disc.drive for disc in discs if disc.driven),
            restitution=self.restitution,
            wall_restitution=self.wall_restitution,
            spin_rad_s=np.array([disc.spin_rad_s for disc in discs]),
            inertia_factor=np.array([disc.inertia_factor for disc in discs]),
            **{name: getattr(self, name) for name in _OF_FRICTION},
        )

    def _build_wall_materials(self) -> tuple[Material, ...] | None:
        scene = Material(self.wall_restitution, self.wall_friction)
        materials = tuple(
            Material(
                scene.restitution if wall.restitution is None else wall.restitution,
                scene.friction if wall.friction is None else wall.friction,
            )
            for wall in self.walls
        )
        return materials if any(material != scene for material in materials) else None

    @property
    def undamped(self) -> Self:
        """The same scene without damping."""
        if not self.damping_per_s:
            return self
        undamped = self.model_copy(update={"damping_per_s": 0.0})
        object.__setattr__(undamped, "_arrays", self.arrays)  # the arrays do not include damping
        return undamped

    @property
    def needs(self) -> frozenset[Need]:
        """Features that a method must support to run this scene."""
        start = self.arrays
        least_wall = min((material.restitution for material in start.materials), default=1.0)
        finite = [wall for wall in self.walls if not isinstance(wall, Wall)]
        around = [self._does_enclose(wall) if isinstance(wall, Ring) else any(wall.bulges) for wall in finite]
        conditions = {
            Need.WALLS: bool(self.walls),
            Need.SEGMENTS: any(isinstance(wall, Chain) and not (wall.bulges and all(wall.bulges)) for wall in finite),
            Need.ARCS: any(around),
            Need.POSTS: any(isinstance(wall, Ring) and not bent for wall, bent in zip(finite, around, strict=True)),
            Need.WALL_MATERIALS: start.wall_materials is not None,
            Need.IMMOVABLE: any(disc.immovable and not disc.driven for disc in self.discs),
            Need.DRIVEN_DISCS: any(disc.driven for disc in self.discs),
            Need.DRIVEN_WALLS: any(wall.driven for wall in self.walls),
            Need.LEGS: any(body.legs for body in (*self.discs, *self.walls)),
            Need.BELTS: start.belts_m_s is not None,
            Need.EDGE_BELTS: any(wall.surface_speed_m_s for wall in finite),
            Need.RESTITUTION: self.restitution < 1 or least_wall < 1,
            Need.GRAVITY: self.gravity_m_s2 != (0.0, 0.0),
            Need.DAMPING: self.damping_per_s > 0.0,
            Need.ROLLING_RESISTANCE: self.wall_rolling_resistance > 0.0,
            Need.TABLE_FRICTION: self.table_deceleration_m_s2 > 0.0,
            Need.SPIN: any(disc.spin_rad_s for disc in self.discs),
            Need.FRICTION: start.has_friction,
            Need.TANGENTIAL_RESTITUTION: (start.has_disc_friction and self.tangential_restitution != 0.0)
            or (start.has_wall_friction and self.wall_tangential_restitution != 0.0),
        }
        return frozenset(need for need, is_needed in conditions.items() if is_needed)

    def _does_enclose(self, ring: Ring) -> bool:
        """Whether a disc starts inside the circle, so that the method must support impacts from inside."""
        return any(math.dist(disc.position_m, ring.centre_m) < ring.radius_m for disc in self.discs)

    def half_planes(self) -> tuple[Wall, ...]:
        """Return the walls, which must all be half-planes.

        Raises:
            InputError: A wall is not a half-plane. The message names the wall.
        """
        planes = tuple(wall for wall in self.walls if isinstance(wall, Wall))
        if len(planes) < len(self.walls):
            number = next(k for k, wall in enumerate(self.walls) if not isinstance(wall, Wall))
            raise InputError(f"wall {number} is not a half-plane; only half-planes are supported here")
        return planes

    def step_count(self, dt_s: float) -> int:
        """Return the number of steps of length `dt_s` that cover the scene's duration, as `count_steps` does.

        Raises:
            InputError: `dt_s` is not a finite number above 0, or more than `carom.support.limits.MOST_STEPS` steps are
                needed.
        """
        return count_steps(self.duration_s, dt_s)


def to_scene(scene: Scene | str) -> Scene:
    """Return the argument if it is a scene, or else the scene of the catalogue with this full name.

    Raises:
        UnknownNameError: The catalogue has no scene of this name. The message contains the nearest name.
        InputError: The argument is neither a scene nor a name.
    """
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, str):
        found: Scene = hooks.find_scene(scene)
        return found
    raise InputError(
        f"scene must be a Scene or the name of one in the catalogue, got {format_value(scene)}",
        hints=["carom.load_scene reads a file"],
    )
