"""Adapter of pymunk (Chipmunk2D): impulse-based, two-dimensional, 64-bit floats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.engines.api import (
    Capabilities,
    Chain,
    Contact,
    ContactTimes,
    Engine,
    Knob,
    Observation,
    Profile,
    Ring,
    Scene,
    Setting,
    Stamp,
    StepClock,
    Wall,
    oriented_contact,
    pair_of,
    require_sound,
    require_supported,
    wall_body,
)
from carom_adapters.code import arguments, assignments, comment, steps_of
from carom_adapters.engine_adapter import NOT_TURNED, OF_THE_SCENE, EngineAdapter, located, tuned, vectors
from carom_adapters.legs import Driven, Legs, first_velocity, has_legs, legs_by_step, python_end
from carom_adapters.pieces import factored_walls
from carom_adapters.pymunk_space import scene_of
from carom_adapters.pymunk_walls import Post, WallShape, shapes_of_walls

if TYPE_CHECKING:
    import pymunk
    from pymunk import Vec2d

    #: Normal of an arbiter, and its impulses along and across it, newton-seconds. The latter is None if no disc spins.
    ArbiterImpulse = tuple[Vec2d, float, float | None]

Pair = tuple[int, int]

#: Attributes of `pymunk.Space`, by pymunk's own names. Those that a profile omits keep pymunk's defaults.
SPACE_SETTINGS = (
    "iterations",
    "damping",
    "collision_slop",
    "collision_bias",
    "collision_persistence",
    "idle_speed_threshold",
    "sleep_time_threshold",
)

#: Whether the segments of a chain know their neighbours (`Segment.set_neighbors`): 1 or 0.
NEIGHBORS = "set_neighbors"
SETTINGS = (*SPACE_SETTINGS, NEIGHBORS)

#: Chipmunk compares squared distances with squared radii, and divides by masses. Between these bounds squares and
#: quotients stay in the range of 64-bit floats (1e-308 to 1e308), so that no impact is invented or missed.
LARGEST = 1e100
SMALLEST = 1e-100

#: Below these values Chipmunk aborts, or they have no meaning.
LEAST = dict.fromkeys(SETTINGS, 0.0) | {"iterations": 1, "collision_persistence": 1, "dt_s": SMALLEST}

#: A contact point is off the line of centres by the rounding of its coordinates. The impulse there turns a disc,
#: inversely to its inertia: with this factor by 3e-9 of its spin, for discs 200 radii from the origin.
LEAST_INERTIA_FACTOR = 1e-6

#: Several discs of this radius still fit within the largest coordinates.
LARGEST_RADIUS_M = 1e98

CAPABILITIES = Capabilities(
    segments=True,
    posts=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    belts=True,  # half-planes only: `surface_velocity` is one vector, and the far side of an edge runs backwards
    gravity=True,
    damping=True,
    table_friction=True,
    restitution=(0.0, 1.0),
    spin=True,
    min_inertia_factor=LEAST_INERTIA_FACTOR,
    friction=(0.0, LARGEST),
    contact_times=ContactTimes.STEP,
    stamp=Stamp.END,
    max_speed_m_s=LARGEST,
    max_coordinate_m=LARGEST,
    min_radius_m=SMALLEST,
    max_radius_m=LARGEST_RADIUS_M,
    min_mass_kg=SMALLEST,
    max_mass_kg=LARGEST,
)


def _check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Check that pymunk supports a scene and settings, and return the step, seconds."""
    require_sound("pymunk", scene, settings, SETTINGS, LEAST, {"dt_s": LARGEST, NEIGHBORS: 1})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s


class PymunkWorld:
    """One `pymunk.Space` with the bodies of a scene."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        import pymunk

        dt_s = _check_inputs(scene, settings)
        self._clock = StepClock(dt_s)
        self._arbiters: list[tuple[pymunk.Shape, pymunk.Shape]] | None = None
        self._space = pymunk.Space()
        self._space.gravity = scene.gravity_m_s2
        for name in SPACE_SETTINGS:
            if name in settings:
                setattr(self._space, name, settings[name])
        if scene.damping_per_s:
            self._space.damping = math.exp(-scene.damping_per_s)  # the fraction of a speed that is left after a second
        self._turns = scene.arrays.turns
        self._neighbors = bool(settings.get(NEIGHBORS, 0))
        disc_elasticity, disc_friction, wall_materials = factored_walls(scene)
        self._bodies: list[pymunk.Body] = []
        self._movable: list[pymunk.Body] = []
        self._driven: list[pymunk.Body] = []
        self._legs = Legs[pymunk.Body]()
        self._number: dict[pymunk.Shape, int] = {}
        for i, disc in enumerate(scene.discs):
            if disc.immovable:
                body = self._immovable_body(disc, disc.spin_rad_s)
            else:
                # A disc that does not turn, or that nothing can turn, has an infinite moment.
                factor = disc.inertia_factor if self._turns else math.inf
                body = pymunk.Body(disc.mass_kg, factor * disc.mass_kg * disc.radius_m**2)
                body.velocity = disc.velocity_m_s
                body.angular_velocity = disc.spin_rad_s
                self._movable.append(body)
            body.position = disc.position_m
            self._space.add(body)
            if scene.table_deceleration_m_s2 and not disc.immovable:
                self._space.add(_table_joint(self._space, body, scene.table_deceleration_m_s2))
            self._add_shape(pymunk.Circle(body, disc.radius_m), disc_elasticity, disc_friction, i)
            self._bodies.append(body)
        for k, (wall_shape, material) in enumerate(zip(shapes_of_walls(scene, dt_s), wall_materials, strict=True)):
            body = self._immovable_body(wall := scene.walls[k])
            self._space.add(body)
            if isinstance(wall_shape, list):
                face = pymunk.Poly(body, wall_shape)
                if isinstance(wall, Wall) and wall.surface_speed_m_s:
                    face.surface_velocity = _surface_velocity(wall)
                self._add_shape(face, *material, wall_body(k))
                continue
            if isinstance(wall_shape, Post):
                self._add_shape(pymunk.Circle(body, wall_shape.radius, wall_shape.centre), *material, wall_body(k))
                continue
            for segment in wall_shape[0]:
                shape = pymunk.Segment(body, segment.a, segment.b, wall_shape[1])
                if self._neighbors:
                    shape.set_neighbors(segment.before, segment.after)
                self._add_shape(shape, *material, wall_body(k))

    def _immovable_body(self, disc_or_wall: Driven, spin: float = 0.0) -> pymunk.Body:
        """Return a body that no impact moves: static, or kinematic for a driven disc or wall."""
        import pymunk

        if not disc_or_wall.driven:
            return pymunk.Body(body_type=pymunk.Body.STATIC)
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.velocity, body.angular_velocity = first_velocity(disc_or_wall), spin
        self._driven.append(body)
        self._legs.add(body, disc_or_wall)
        return body

    def _add_shape(self, shape: pymunk.Shape, elasticity: float, friction: float, number: int) -> None:
        shape.elasticity, shape.friction = elasticity, friction
        self._space.add(shape)
        self._number[shape] = number

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings of the space, read back."""
        # The space has no time step before its first step.
        read: dict[str, Setting] = {"dt_s": self._space.current_time_step or self._clock.dt_s}
        return read | {name: getattr(self._space, name) for name in SPACE_SETTINGS} | {NEIGHBORS: int(self._neighbors)}

    def advance(self, steps: int) -> None:
        """Call `Space.step` this many times. Between steps, driven bodies get the velocities of their legs."""
        step, dt_s = self._space.step, self._clock.dt_s
        for count in self._legs.step_counts(steps):
            for body, velocity in self._legs.start_due(self._clock.now_s):
                body.velocity = velocity
            for _ in range(count):
                step(dt_s)
            self._clock.count(count)
        self._arbiters = None

    def observe(self) -> Observation:
        """Read the bodies and the arbiters of the last step. No callback is used, which would slow the step down.

        Chipmunk moves the bodies and then tests for contacts, so those of step k (from 0) are at ``(k + 1) dt_s``.
        """
        impulses: dict[Pair, list[ArbiterImpulse]] = {}
        for body in self._movable:
            body.each_arbiter(self._collect_impulse, impulses)
        contacts = [self._build_contact(pair, pair_impulses) for pair, pair_impulses in impulses.items()]
        return Observation(
            vectors(body.position for body in self._bodies),
            vectors(body.velocity for body in self._bodies),
            tuple(contacts),
            spin_rad_s=np.array([body.angular_velocity for body in self._bodies]) if self._turns else None,
        )

    def _collect_impulse(self, arbiter: pymunk.Arbiter, impulses: dict[Pair, list[ArbiterImpulse]]) -> None:
        """Add the impulse of an arbiter. Its first body is the one whose arbiters are being read."""
        normal = arbiter.normal
        total = -arbiter.total_impulse
        impulse = total.dot(normal)
        if impulse <= 0:  # Chipmunk keeps a contact while the shapes overlap, even when they already separate
            return
        own, other = arbiter.shapes
        first, second = self._number[own], self._number[other]
        if 0 <= second < first and other.body is not None and other.body.body_type == other.body.DYNAMIC:
            return  # already added from the other body
        tangential = total.dot(normal.perpendicular()) if self._turns else None
        impulses.setdefault((first, second), []).append((normal, impulse, tangential))

    def _build_contact(self, pair: Pair, impulses: list[ArbiterImpulse]) -> Contact:
        """Return the contact of a pair, with the sum of its impulses: several segments of a chain may act at once."""
        if len(impulses) > 1:
            along = sum((impulse * normal for normal, impulse, _ in impulses[1:]), impulses[0][1] * impulses[0][0])
            across = [
                tangential * normal.perpendicular() for normal, _, tangential in impulses if tangential is not None
            ]
            normal = along.normalized()
            total = sum(across, along)
            impulses = [(normal, total.dot(normal), total.dot(normal.perpendicular()) if across else None)]
        ((normal, impulse, tangential),) = impulses
        return oriented_contact(*pair, self._clock.now_s, (normal.x, normal.y), impulse, tangential)

    def cut(self, dt_s: float) -> None:
        """Set the length of the following steps.

        Chipmunk starts a lasting contact with its last impulse times the ratio of the two steps, without limit. Shapes
        in contact are removed and added again, which resets that impulse.
        """
        self._clock.cut(dt_s)
        touching = {shape for pair in self._in_contact() for shape in pair}
        # The segments of a chain have the same number, and keep the order in which they were created.
        shapes = sorted((shape for shape in self._number if shape in touching), key=self._number.__getitem__)
        if shapes:
            self._space.remove(*shapes)
            self._space.add(*shapes)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs with an arbiter after the last step. Chipmunk tests for contacts at the end of a step."""
        return frozenset(pair_of(self._number[a], self._number[b]) for a, b in self._in_contact())

    def _in_contact(self) -> list[tuple[pymunk.Shape, pymunk.Shape]]:
        if self._arbiters is None:
            shapes: list[tuple[pymunk.Shape, pymunk.Shape]] = []
            for body in self._movable:
                body.each_arbiter(lambda arbiter: shapes.append(arbiter.shapes))
            self._arbiters = shapes
        return self._arbiters

    def save(self) -> object:
        """Return positions, velocities and spins. With tuned settings, nothing else in a space has an effect."""
        moving = [*self._movable, *self._driven]
        bodies = [(body, body.position, body.velocity, body.angular_velocity) for body in moving]
        return (self._clock.now_s, bodies, self._legs.started)

    def restore(self, state: Any) -> None:
        """Restore positions, velocities and spins."""
        time_s, bodies, self._legs.started = state
        self._clock.restart(time_s)
        put = object.__setattr__  # pymunk's own only checks types, and doubles the time
        for body, position, velocity, spin in bodies:
            put(body, "position", position)
            put(body, "velocity", velocity)
            if self._turns:
                put(body, "angular_velocity", spin)

    def close(self) -> None:
        """Drop all references to the space, which frees its memory."""
        del self._space, self._bodies, self._movable, self._driven, self._legs, self._number


def _table_joint(space: pymunk.Space, body: pymunk.Body, deceleration_m_s2: float) -> pymunk.PivotJoint:
    """Return a joint that brakes a body like a table: its force is limited to mass times deceleration."""
    import pymunk

    joint = pymunk.PivotJoint(space.static_body, body, body.position, (0.0, 0.0))
    joint.max_bias, joint.max_force = 0.0, deceleration_m_s2 * body.mass
    return joint


def _surface_velocity(wall: Wall) -> tuple[float, float]:
    """Return the `surface_velocity` of a conveyor wall. A positive speed runs to the left of the normal."""
    nx, ny = wall.normal
    return (-wall.surface_speed_m_s * ny, wall.surface_speed_m_s * nx)


_ADD_WALL = """def add_wall(corners, elasticity, friction, velocity=None):  # a deep polygon has no far side
    body = held_body(velocity)
    add(body, pymunk.Poly(body, corners), elasticity, friction)


"""

_ADD_BELT = """def add_belt(corners, surface_velocity, elasticity, friction, velocity=None):
    body = held_body(velocity)
    face = pymunk.Poly(body, corners)
    face.surface_velocity = surface_velocity
    add(body, face, elasticity, friction)


"""

_ADD_CIRCLE = """def add_circle(centre, radius, elasticity, friction, velocity=None):
    body = held_body(velocity)
    add(body, pymunk.Circle(body, radius, centre), elasticity, friction)


"""

_ADD_SEGMENT = """def add_segment(a, b, radius, elasticity, friction, neighbors=None, velocity=None):
    body = held_body(velocity)
    segment = pymunk.Segment(body, a, b, radius)
    if neighbors:  # so that no disc catches on the joint of two segments
        segment.set_neighbors(*neighbors)
    add(body, segment, elasticity, friction)


"""


def _write_wall(
    wall: Wall | Chain | Ring, shape: WallShape, material: tuple[float, float], settings: Mapping[str, Setting]
) -> list[str]:
    """Return the lines that add a wall."""
    properties = f"elasticity={material[0]!r}, friction={material[1]!r}"
    properties += f", velocity={first_velocity(wall)!r}" if wall.driven else ""
    if isinstance(wall, Wall) and wall.surface_speed_m_s:
        return [f"add_belt({shape!r}, {_surface_velocity(wall)!r}, {properties})"]
    if isinstance(shape, list):
        return [f"add_wall({shape!r}, {properties})"]
    if isinstance(shape, Post):
        return [f"add_circle({shape.centre!r}, {shape.radius!r}, {properties})"]
    has_neighbors = bool(settings.get(NEIGHBORS, 0))
    return [
        f"add_segment({s.a!r}, {s.b!r}, {shape[1]!r}, {properties}"
        + (f", neighbors=({s.before!r}, {s.after!r}))" if has_neighbors else ")")
        for s in shape[0]
    ]


def _write_table(scene: Scene) -> str:
    """Return the lines that brake a disc by the table."""
    if not scene.table_deceleration_m_s2:
        return ""
    return f"""        # A table slows it down: a joint that holds it to its place no more strongly than that.
        joint = pymunk.PivotJoint(space.static_body, body, position, (0.0, 0.0))
        joint.max_bias, joint.max_force = 0.0, {scene.table_deceleration_m_s2!r} * mass
        space.add(joint)
"""


def _write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same space as `PymunkWorld`."""
    dt_s, turns = _check_inputs(scene, settings), scene.arrays.turns
    elasticity, friction, wall_materials = factored_walls(scene)
    lines = []
    for disc in scene.discs:
        moment = (disc.inertia_factor if turns else math.inf) * disc.mass_kg * disc.radius_m**2
        options: dict[str, object] = {} if disc.immovable else {"mass": disc.mass_kg, "moment": moment}
        if not disc.immovable or disc.driven:
            options |= {"velocity": first_velocity(disc), "spin": disc.spin_rad_s}
        lines.append(f"add_disc({disc.position_m!r}, {disc.radius_m!r}{', ' * bool(options)}{arguments(options)})")
    shapes = shapes_of_walls(scene, dt_s)
    walls = list(zip(scene.walls, shapes, strict=True))
    lines += [
        line
        for wall_and_shape, material in zip(walls, wall_materials, strict=True)
        for line in _write_wall(*wall_and_shape, material, settings)
    ]
    set_up = assignments("space", settings, SPACE_SETTINGS)
    if scene.damping_per_s:
        set_up += f"space.damping = {math.exp(-scene.damping_per_s)!r}  # what is kept of a speed in a second\n"
    state = "*body.position, *body.velocity, body.angular_velocity"
    pieces = [[wall] * (1 if isinstance(shape, list | Post) else len(shape[0])) for wall, shape in walls]
    driven = [body for body in (*scene.discs, *(one for each in pieces for one in each)) if body.driven]
    end = python_end(scene, "space.step(dt)", state, legs_by_step(driven, dt_s), "driven[k].velocity = velocity")
    bodies = "\n".join(lines)
    belts = [bool(wall.surface_speed_m_s) for wall in scene.walls]
    plain = (isinstance(shape, list) and not belt for shape, belt in zip(shapes, belts, strict=True))
    functions = (_ADD_WALL if any(plain) else "") + (_ADD_BELT if any(belts) else "")
    functions += _ADD_CIRCLE if any(isinstance(shape, Post) for shape in shapes) else ""
    functions += _ADD_SEGMENT if any(type(shape) is tuple for shape in shapes) else ""
    return f"""{comment(heading)}
from math import inf

import pymunk

dt, steps = {dt_s!r}, {steps_of(scene, settings)}
space = pymunk.Space()
space.gravity = {scene.gravity_m_s2!r}
{set_up}discs = []
{"driven = []" + chr(10) if has_legs(scene) else ""}

def add(body, shape, elasticity, friction):
    # pymunk multiplies the two coefficients of a pair.
    shape.elasticity, shape.friction = elasticity, friction
    space.add(body, shape)


def held_body(velocity, spin=0.0):  # which no impact moves: it is at rest or driven
    body = pymunk.Body(body_type=pymunk.Body.STATIC if velocity is None else pymunk.Body.KINEMATIC)
    if velocity is not None:
        body.velocity, body.angular_velocity = velocity, spin
{"        driven.append(body)" + chr(10) if has_legs(scene) else ""}    return body


def add_disc(position, radius, mass=None, moment=0.0, velocity=None, spin=0.0):
    body = held_body(velocity, spin) if mass is None else pymunk.Body(mass, moment)
    body.position = position
    if mass is not None:
        body.velocity, body.angular_velocity = velocity, spin
{_write_table(scene)}    add(body, pymunk.Circle(body, radius), elasticity={elasticity!r}, friction={friction!r})
    discs.append(body)


{functions}{bodies}
{end}"""


def _default(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s}


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        # Simultaneous contacts are solved by iteration. A break of ten discs gains 2e-7 of its energy with pymunk's
        # default of 10 iterations, and 2e-14 with 20.
        "iterations": 20,
        # Chipmunk pushes overlapping bodies apart, in addition to the bounce. This is the fraction of an overlap that
        # is left after a second, so with 1 bodies are never pushed.
        "collision_bias": 1.0,
        # A disc that slides over the joint of two segments catches on it, unless they know each other.
        NEIGHBORS: 1,
    }


adapter = EngineAdapter(
    name="pymunk",
    # 5.4.1 reports no contacts to the adapter, although it bounces; 5.7.0 does.
    engine=Engine(
        "pymunk",
        module="pymunk",
        distribution="pymunk",
        install="pip install 'carom[pymunk]'",
        oldest="5.7",
        newest_tried="7.3",
    ),
    capabilities=CAPABILITIES,
    knobs={
        "iterations": Knob(1, 100, log=True),
        "collision_bias": Knob(0.0, 1.0),
        "collision_slop": Knob(1e-3, 1e3, log=True),
        "collision_persistence": Knob(1, 10),
    },
    profiles={
        "default": Profile(
            "pymunk's defaults: all as shipped (no damping), with the scene's restitution and friction.",
            _default,
            changed={"elasticity": OF_THE_SCENE, "friction": OF_THE_SCENE, "moment": NOT_TURNED},
        ),
        "tuned": tuned("overlaps are never pushed apart", _tuned),
        "located": located("Chipmunk's own collision test", _tuned),
    },
    world=PymunkWorld,
    code=_write_code,
    read=scene_of,
)
