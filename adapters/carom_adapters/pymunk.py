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
from carom_adapters.pymunk_walls import Post, Shaped, shapes_of_walls

if TYPE_CHECKING:
    import pymunk
    from pymunk import Vec2d

    #: One arbiter's normal, and the impulses along and across it, newton-seconds; of friction None if no disc spins.
    Push = tuple[Vec2d, float, float | None]

Pair = tuple[int, int]

#: Attributes of `pymunk.Space`, by pymunk's own names; what a profile leaves out stays as pymunk ships it.
SPACE_SETTINGS = (
    "iterations",
    "damping",
    "collision_slop",
    "collision_bias",
    "collision_persistence",
    "idle_speed_threshold",
    "sleep_time_threshold",
)

#: Whether the segments of a chain are told of their neighbours (`Segment.set_neighbors`): 1 or 0.
NEIGHBORS = "set_neighbors"
SETTINGS = (*SPACE_SETTINGS, NEIGHBORS)

#: Chipmunk compares squared distances with squared radii, and divides by masses. Between these bounds neither squares
#: nor quotients leave the range of 64-bit floats (1e-308 to 1e308), so that no hit is invented or lost.
LARGEST = 1e100
SMALLEST = 1e-100

#: Below these Chipmunk aborts, or makes no sense of them.
LEAST = dict.fromkeys(SETTINGS, 0.0) | {"iterations": 1, "collision_persistence": 1, "dt_s": SMALLEST}

#: A contact point is off the line of centres by a rounding of its coordinates, and the push on it turns a disc by that
#: over its inertia: of discs 200 radii from the origin, 3e-9 of a spin here.
LEAST_INERTIA_FACTOR = 1e-6

#: Discs of this radius still fit, some way apart, within the greatest coordinates.
LARGEST_RADIUS_M = 1e98

CAPABILITIES = Capabilities(
    segments=True,
    posts=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    belts=True,  # of half-planes: `surface_velocity` is one vector, and an edge runs back on its other side
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


def _usable_step(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Return the step of settings, in seconds, once they and the scene are known to be what pymunk can do."""
    require_sound("pymunk", scene, settings, SETTINGS, LEAST, {"dt_s": LARGEST, NEIGHBORS: 1})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s


class PymunkWorld:
    """One `pymunk.Space`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        import pymunk

        dt_s = _usable_step(scene, settings)
        self._clock = StepClock(dt_s)
        self._arbiters: list[tuple[pymunk.Shape, pymunk.Shape]] | None = None
        self._space = pymunk.Space()
        self._space.gravity = scene.gravity_m_s2
        for name in SPACE_SETTINGS:
            if name in settings:
                setattr(self._space, name, settings[name])
        if scene.damping_per_s:
            self._space.damping = math.exp(-scene.damping_per_s)  # what is kept of a speed in a second
        self._turns = scene.arrays.turns
        self._neighbors = bool(settings.get(NEIGHBORS, 0))
        disc_elasticity, disc_friction, of_walls = factored_walls(scene)
        self._bodies: list[pymunk.Body] = []
        self._movable: list[pymunk.Body] = []
        self._driven: list[pymunk.Body] = []
        self._legs = Legs[pymunk.Body]()
        self._number: dict[pymunk.Shape, int] = {}
        for i, disc in enumerate(scene.discs):
            if disc.immovable:
                body = self._held(disc, disc.spin_rad_s)
            else:
                # An infinite moment for a disc that does not turn, or has nothing to turn it.
                factor = disc.inertia_factor if self._turns else math.inf
                body = pymunk.Body(disc.mass_kg, factor * disc.mass_kg * disc.radius_m**2)
                body.velocity = disc.velocity_m_s
                body.angular_velocity = disc.spin_rad_s
                self._movable.append(body)
            body.position = disc.position_m
            self._space.add(body)
            if scene.table_deceleration_m_s2 and not disc.immovable:
                self._space.add(_table(self._space, body, scene.table_deceleration_m_s2))
            self._add(pymunk.Circle(body, disc.radius_m), disc_elasticity, disc_friction, i)
            self._bodies.append(body)
        for k, (shaped, material) in enumerate(zip(shapes_of_walls(scene, dt_s), of_walls, strict=True)):
            body = self._held(wall := scene.walls[k])
            self._space.add(body)
            if isinstance(shaped, list):
                face = pymunk.Poly(body, shaped)
                if isinstance(wall, Wall) and wall.surface_speed_m_s:
                    face.surface_velocity = _belt(wall)
                self._add(face, *material, wall_body(k))
                continue
            if isinstance(shaped, Post):
                self._add(pymunk.Circle(body, shaped.radius, shaped.centre), *material, wall_body(k))
                continue
            for segment in shaped[0]:
                shape = pymunk.Segment(body, segment.a, segment.b, shaped[1])
                if self._neighbors:
                    shape.set_neighbors(segment.before, segment.after)
                self._add(shape, *material, wall_body(k))

    def _held(self, of: Driven, spin: float = 0.0) -> pymunk.Body:
        """Return a body that no impact moves: it stands, or moves by itself."""
        import pymunk

        if not of.driven:
            return pymunk.Body(body_type=pymunk.Body.STATIC)
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.velocity, body.angular_velocity = first_velocity(of), spin
        self._driven.append(body)
        self._legs.add(body, of)
        return body

    def _add(self, shape: pymunk.Shape, elasticity: float, friction: float, number: int) -> None:
        shape.elasticity, shape.friction = elasticity, friction
        self._space.add(shape)
        self._number[shape] = number

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings of the space, read back."""
        # The space knows no step before it has taken one.
        read: dict[str, Setting] = {"dt_s": self._space.current_time_step or self._clock.dt_s}
        return read | {name: getattr(self._space, name) for name in SPACE_SETTINGS} | {NEIGHBORS: int(self._neighbors)}

    def advance(self, steps: int) -> None:
        """Call `Space.step` this many times; between steps driven bodies are told of their legs."""
        step, dt_s = self._space.step, self._clock.dt_s
        for count in self._legs.stretches(steps):
            for body, velocity in self._legs.begun(self._clock.now_s):
                body.velocity = velocity
            for _ in range(count):
                step(dt_s)
            self._clock.count(count)
        self._arbiters = None

    def observe(self) -> Observation:
        """Read the bodies, and the arbiters that the last step left on them: no callback slows the step down.

        Chipmunk moves the bodies and then looks for contacts, so those of step k (from 0) stand at ``(k + 1) dt_s``.
        """
        impulses: dict[Pair, list[Push]] = {}
        for body in self._movable:
            body.each_arbiter(self._collect, impulses)
        found = [self._contact(pair, told) for pair, told in impulses.items()]
        return Observation(
            vectors(body.position for body in self._bodies),
            vectors(body.velocity for body in self._bodies),
            tuple(found),
            spin_rad_s=np.array([body.angular_velocity for body in self._bodies]) if self._turns else None,
        )

    def _collect(self, arbiter: pymunk.Arbiter, impulses: dict[Pair, list[Push]]) -> None:
        """Note a push, as seen by the body that was asked: it is the arbiter's first."""
        normal = arbiter.normal
        total = -arbiter.total_impulse
        impulse = total.dot(normal)
        if impulse <= 0:  # Chipmunk keeps a contact while the shapes overlap, also when they separate already
            return
        asked, other = arbiter.shapes
        first, second = self._number[asked], self._number[other]
        if 0 <= second < first and other.body is not None and other.body.body_type == other.body.DYNAMIC:
            return  # that one was asked before, and told
        tangential = total.dot(normal.perpendicular()) if self._turns else None
        impulses.setdefault((first, second), []).append((normal, impulse, tangential))

    def _contact(self, pair: Pair, impulses: list[Push]) -> Contact:
        """Return the contact of a pair: several segments of one chain may push at once, and their sum is told."""
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
        """Take steps of another length from here on.

        Chipmunk begins a contact that goes on with its last impulse times the ratio of the two steps, without limit; so
        shapes in contact are taken out and put back, which makes it forget.
        """
        self._clock.cut(dt_s)
        touching = {shape for pair in self._in_contact() for shape in pair}
        # The segments of a chain have one number, and go in the order in which they were made.
        shapes = sorted((shape for shape in self._number if shape in touching), key=self._number.__getitem__)
        if shapes:
            self._space.remove(*shapes)
            self._space.add(*shapes)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of which Chipmunk kept an arbiter in the last step, at whose end it looked."""
        return frozenset(pair_of(self._number[a], self._number[b]) for a, b in self._in_contact())

    def _in_contact(self) -> list[tuple[pymunk.Shape, pymunk.Shape]]:
        if self._arbiters is None:
            found: list[tuple[pymunk.Shape, pymunk.Shape]] = []
            for body in self._movable:
                body.each_arbiter(lambda arbiter: found.append(arbiter.shapes))
            self._arbiters = found
        return self._arbiters

    def save(self) -> object:
        """Return positions, velocities and spins; whatever else a space keeps is of no effect on a tuned one."""
        moving = [*self._movable, *self._driven]
        bodies = [(body, body.position, body.velocity, body.angular_velocity) for body in moving]
        return (self._clock.now_s, bodies, self._legs.told)

    def restore(self, state: Any) -> None:
        """Put positions, velocities and spins back."""
        time_s, bodies, self._legs.told = state
        self._clock.restart(time_s)
        put = object.__setattr__  # pymunk's own is there for types alone, and takes as long as what it calls
        for body, position, velocity, spin in bodies:
            put(body, "position", position)
            put(body, "velocity", velocity)
            if self._turns:
                put(body, "angular_velocity", spin)

    def close(self) -> None:
        """Let go of the space; its memory goes with the last reference."""
        del self._space, self._bodies, self._movable, self._driven, self._legs, self._number


def _table(space: pymunk.Space, body: pymunk.Body, deceleration_m_s2: float) -> pymunk.PivotJoint:
    """Return the joint that holds a body to its place no more strongly than a table does that slows it down."""
    import pymunk

    joint = pymunk.PivotJoint(space.static_body, body, body.position, (0.0, 0.0))
    joint.max_bias, joint.max_force = 0.0, deceleration_m_s2 * body.mass
    return joint


def _belt(wall: Wall) -> tuple[float, float]:
    """Return the `surface_velocity` of a belt, which runs to the left of the normal."""
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


def _code_of_wall(
    wall: Wall | Chain | Ring, shape: Shaped, material: tuple[float, float], settings: Mapping[str, Setting]
) -> list[str]:
    of_wall = f"elasticity={material[0]!r}, friction={material[1]!r}"
    of_wall += f", velocity={first_velocity(wall)!r}" if wall.driven else ""
    if isinstance(wall, Wall) and wall.surface_speed_m_s:
        return [f"add_belt({shape!r}, {_belt(wall)!r}, {of_wall})"]
    if isinstance(shape, list):
        return [f"add_wall({shape!r}, {of_wall})"]
    if isinstance(shape, Post):
        return [f"add_circle({shape.centre!r}, {shape.radius!r}, {of_wall})"]
    told = bool(settings.get(NEIGHBORS, 0))
    return [
        f"add_segment({s.a!r}, {s.b!r}, {shape[1]!r}, {of_wall}"
        + (f", neighbors=({s.before!r}, {s.after!r}))" if told else ")")
        for s in shape[0]
    ]


def _code_of_table(scene: Scene) -> str:
    if not scene.table_deceleration_m_s2:
        return ""
    return f"""        # A table slows it down: a joint that holds it to its place no more strongly than that.
        joint = pymunk.PivotJoint(space.static_body, body, position, (0.0, 0.0))
        joint.max_bias, joint.max_force = 0.0, {scene.table_deceleration_m_s2!r} * mass
        space.add(joint)
"""


def _code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return the space that `PymunkWorld` makes as a program."""
    dt_s, turns = _usable_step(scene, settings), scene.arrays.turns
    elasticity, friction, of_walls = factored_walls(scene)
    lines = []
    for disc in scene.discs:
        moment = (disc.inertia_factor if turns else math.inf) * disc.mass_kg * disc.radius_m**2
        given: dict[str, object] = {} if disc.immovable else {"mass": disc.mass_kg, "moment": moment}
        if not disc.immovable or disc.driven:
            given |= {"velocity": first_velocity(disc), "spin": disc.spin_rad_s}
        lines.append(f"add_disc({disc.position_m!r}, {disc.radius_m!r}{', ' * bool(given)}{arguments(given)})")
    shapes = shapes_of_walls(scene, dt_s)
    walls = list(zip(scene.walls, shapes, strict=True))
    lines += [
        line
        for made, material in zip(walls, of_walls, strict=True)
        for line in _code_of_wall(*made, material, settings)
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


def held_body(velocity, spin=0.0):  # which no impact moves: it stands, or moves by itself
    body = pymunk.Body(body_type=pymunk.Body.STATIC if velocity is None else pymunk.Body.KINEMATIC)
    if velocity is not None:
        body.velocity, body.angular_velocity = velocity, spin
{"        driven.append(body)" + chr(10) if has_legs(scene) else ""}    return body


def add_disc(position, radius, mass=None, moment=0.0, velocity=None, spin=0.0):
    body = held_body(velocity, spin) if mass is None else pymunk.Body(mass, moment)
    body.position = position
    if mass is not None:
        body.velocity, body.angular_velocity = velocity, spin
{_code_of_table(scene)}    add(body, pymunk.Circle(body, radius), elasticity={elasticity!r}, friction={friction!r})
    discs.append(body)


{functions}{bodies}
{end}"""


def _default(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s}


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        # Discs in several contacts at once settle by iteration: a break of ten gains 2e-7 of its energy with the 10
        # iterations that pymunk ships, and 2e-14 with 20.
        "iterations": 20,
        # Chipmunk pushes overlapping bodies apart, on top of the bounce. This is the part of an overlap that is left
        # after a second, so 1 is never.
        "collision_bias": 1.0,
        # A disc that slides over the joint of two segments catches on it, unless each is told of the other.
        NEIGHBORS: 1,
    }


adapter = EngineAdapter(
    name="pymunk",
    # 5.4.1 tells the adapter of no contact, though it bounces; 5.7.0 does.
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
            "What a user of pymunk gets: all as shipped (no damping), with the scene's restitution and friction.",
            _default,
            changed={"elasticity": OF_THE_SCENE, "friction": OF_THE_SCENE, "moment": NOT_TURNED},
        ),
        "tuned": tuned("overlaps are never pushed apart", _tuned),
        "located": located("Chipmunk's own collision test", _tuned),
    },
    world=PymunkWorld,
    code=_code,
    read=scene_of,
)
