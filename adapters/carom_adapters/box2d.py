"""Adapter of Box2D 2.3 (pybox2d): impulse-based, two-dimensional, 32-bit floats."""

from __future__ import annotations

import importlib
import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.adapter import (
    AdapterError,
    Capabilities,
    Contact,
    ContactTimes,
    Disc,
    Engine,
    Observation,
    Profile,
    Scene,
    Setting,
    require_sound,
    require_supported,
    wall_body,
)

if TYPE_CHECKING:
    from carom.adapter import World

__all__ = ["Box2dAdapter", "adapter"]

#: Attributes of `b2World`, by pybox2d's own names.
WORLD_SETTINGS = ("warmStarting",)

#: Arguments of `b2World.Step`; ``sleepingAllowed`` of every body (`b2World.allowSleeping` is without effect in pybox2d
#: 2.3.10); ``sweep``, one of
#: `SWEEPS`; ``velocity_scale`` (see `_tuned`); and ``polygon_radius_m``, the skin of a wall's shape.
OTHER_SETTINGS = (
    "velocityIterations",
    "positionIterations",
    "sleepingAllowed",
    "sweep",
    "velocity_scale",
    "polygon_radius_m",
)

#: Box2D's continuous detection: none; as shipped (every disc is swept against what can't move); or for a scene with a
#: disc that moves by more than its radius in a step, which is then swept against all others, too (a "bullet").
SWEEPS = ("none", "shipped", "fast")

#: Below these Box2D asserts, or makes no sense of them.
LEAST = {"velocityIterations": 1, "positionIterations": 0, "velocity_scale": 1.0, "polygon_radius_m": 0.0}

#: b2_maxTranslation is 2 m: a body that would move farther in one step is slowed down to that. A millionth below it, a
#: body is not slowed down, and what was slowed down can be told from it.
LONGEST_MOVE_M = 2.0 * (1 - 2.0**-20)

#: `b2WorldManifold` makes up a normal for points that are closer than b2_epsilon, 1.2e-7; and `b2PolygonShape` joins
#: corners closer than half of b2_linearSlop, 2.5e-3, so a wall is never made smaller than this.
SMALLEST_RADIUS_M = 1e-6
SMALLEST_WALL_M = 0.1

#: Powers of ten between which masses, their quotients, and impulses at scaled velocities stay inside 32-bit floats
#: (1e-38 to 1e38); Box2D takes a mass that is not above 0 for 1 kg.
SMALLEST_MASS_KG = 1e-20
LARGEST_MASS_KG = 1e20

#: Times the velocity scale (2**20) and squared, this comes to 1e36.
LARGEST_SPEED_M_S = 1e12

#: Far below the square root of the largest 32-bit float, 1.8e19: contacts compare squared distances.
LARGEST_COORDINATE_M = 1e9

#: b2_velocityThreshold, compiled in: contacts that close at no more than this are made inelastic.
THRESHOLD_M_S = 1.0

#: See `_tuned`.
VELOCITY_SCALE = 2.0**20

#: Relative rounding of a 32-bit float.
ROUNDING = 2.0**-23

#: Collision categories of the shapes that a disc has for other discs, and for walls.
AMONG_DISCS, BEFORE_WALLS = 0x0001, 0x0002

Point = tuple[float, float]


def _rectangle(normal: Point, size: float) -> list[Point]:
    """Return the corners of a rectangle below the origin, one face along the wall, ``2 size`` wide and `size` deep.

    Box2D has no half-plane. Through an edge fast discs pass, and a polygon's face is as deep as it is made.
    """
    nx, ny = normal
    return [((a * ny - b * nx) * size, (-a * nx - b * ny) * size) for a, b in ((1, 0), (-1, 0), (-1, 1), (1, 1))]


def _reach(scene: Scene, dt_s: float) -> tuple[Point, float]:
    """Return the middle of the scene, and how far from it any point of a disc can be at any time of the scene, metres.

    No impact adds energy, so no disc is ever faster than if it alone had all the energy of the scene, or than gravity
    makes it besides.
    """
    x, y = zip(*(disc.position_m for disc in scene.discs), strict=True)
    centre = (min(x) / 2 + max(x) / 2, min(y) / 2 + max(y) / 2)
    start = max(math.dist(disc.position_m, centre) + disc.radius_m for disc in scene.discs)
    movable = [disc for disc in scene.discs if not disc.immovable]
    lightest = min((disc.mass_kg for disc in movable), default=1.0)
    fastest = math.hypot(*(math.sqrt(d.mass_kg / lightest) * math.hypot(*d.velocity_m_s) for d in movable))
    duration_s = scene.duration_s + dt_s
    # What one disc gains by falling, impacts may pass on to a lighter one.
    gained = math.hypot(*scene.gravity_m_s2) * duration_s * math.sqrt(sum(d.mass_kg / lightest for d in movable))
    return centre, start + (fastest + gained) * duration_s


def _require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse what Box2D would assert on, or silently get wrong.

    Raises:
        AdapterError: A setting has an unknown name, or a step or mass is beyond 32-bit floats.
    """
    require_sound("Box2D", scene, settings, (*WORLD_SETTINGS, *OTHER_SETTINGS), LEAST)
    if settings.get("sweep", "shipped") not in SWEEPS:
        raise AdapterError(f"Box2D: sweep must be one of {', '.join(SWEEPS)}, got {settings['sweep']!r}")
    dt_s = float(settings["dt_s"])
    if not 1e-12 <= dt_s <= 1e12:  # scaled, still inside 32-bit floats
        raise AdapterError(f"Box2D: dt_s must lie in 1e-12 to 1e12, got {dt_s}")
    for i, disc in enumerate(scene.discs):
        if not (disc.immovable or SMALLEST_MASS_KG <= disc.mass_kg <= LARGEST_MASS_KG):
            limits = f"{SMALLEST_MASS_KG:g} to {LARGEST_MASS_KG:g}"
            raise AdapterError(f"Box2D: discs[{i}].mass_kg must lie in {limits} or be inf, got {disc.mass_kg}")


def _imported() -> Any:  # untyped: a SWIG module without stubs
    with warnings.catch_warnings():
        # Its SWIG types have no __module__, of which CPython warns; as an error the warning would end the process.
        warnings.simplefilter("ignore")
        return importlib.import_module("Box2D")


class Box2dWorld:
    """One `b2World`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        _require_usable(scene, settings)
        require_supported("Box2D", scene, Box2dAdapter.capabilities, float(settings["dt_s"]))
        self._box2d = _imported()
        self._asked = dict(settings)
        self._scale = float(settings.get("velocity_scale", 1.0))
        self._iterations = (int(settings["velocityIterations"]), int(settings["positionIterations"]))
        self._start_s, self._steps, self._dt_s = 0.0, 0, float(settings["dt_s"])
        gx, gy = scene.gravity_m_s2
        self._world = self._box2d.b2World(gravity=(gx * self._scale**2, gy * self._scale**2))
        for name in WORLD_SETTINGS:
            if name in settings:
                setattr(self._world, name, settings[name])
        self._sweep = str(settings.get("sweep", "shipped"))
        fast = any(self._is_fast(disc) for disc in scene.discs)
        self._world.continuousPhysics = self._sweep == "shipped" or (self._sweep == "fast" and fast)
        self._bodies: list[Any] = []
        self._walls: list[Any] = []
        self._movable: list[Any] = []
        self._solved: list[tuple[Any, Any, Point, float]] = []
        self._normals: dict[tuple[int, int], Point] = {}
        self._listener: Any = None
        for i, disc in enumerate(scene.discs):
            self._add_disc(scene, i, disc.immovable)
        centre, reach = _reach(scene, self._dt_s)
        for k in range(len(scene.walls)):
            self._add_wall(scene, k, centre, reach)

    def _is_fast(self, disc: Disc) -> bool:
        return math.hypot(*disc.velocity_m_s) * self._dt_s > disc.radius_m

    def _add_disc(self, scene: Scene, i: int, immovable: bool) -> None:
        box2d, disc = self._box2d, scene.discs[i]
        if immovable:
            body = self._world.CreateStaticBody(position=disc.position_m)
        else:
            vx, vy = disc.velocity_m_s
            body = self._world.CreateDynamicBody(
                position=disc.position_m,
                linearVelocity=(vx * self._scale, vy * self._scale),
                fixedRotation=True,
                allowSleep=bool(self._asked.get("sleepingAllowed", True)),
                bullet=self._sweep == "fast" and self._is_fast(disc),
            )
            self._movable.append(body)
        # Box2D takes the larger of two restitutions. Where the walls' is the smaller one, a disc needs a shape for
        # other discs and one, of no restitution, for walls.
        both = [(AMONG_DISCS | BEFORE_WALLS, scene.restitution)]
        apart = [(AMONG_DISCS, scene.restitution), (BEFORE_WALLS, 0.0)]
        for category, restitution in apart if scene.walls and scene.wall_restitution < scene.restitution else both:
            body.CreateFixture(
                shape=box2d.b2CircleShape(radius=disc.radius_m),
                density=1.0,
                friction=0.0,
                restitution=restitution,
                categoryBits=category,
                maskBits=category,
            )
        if not immovable:  # after the shapes, which would give it a mass of their own
            body.massData = box2d.b2MassData(mass=disc.mass_kg, center=(0, 0), I=1.0)
        body.userData = i
        self._bodies.append(body)

    def _add_wall(self, scene: Scene, k: int, centre: Point, reach: float) -> None:
        (px, py), (nx, ny) = scene.walls[k].point_m, scene.walls[k].normal
        # The point of the wall nearest to the scene, so that the numbers around it are small.
        along = (px - centre[0]) * ny - (py - centre[1]) * nx
        gap = abs((px - centre[0]) * nx + (py - centre[1]) * ny)
        size = max(2.0 * (reach + gap), SMALLEST_WALL_M)
        smallest = min(disc.radius_m for disc in scene.discs)
        if not size * ROUNDING < smallest:
            raise AdapterError(
                f"Box2D: a disc may get {reach:.3g} m far, and 32-bit floats round a wall of that length by more than "
                f"the smallest radius, {smallest:.3g} m; shorten duration_s, or take walls or heavy fast discs out"
            )
        shape = self._box2d.b2PolygonShape(vertices=_rectangle((nx, ny), size))
        if "polygon_radius_m" in self._asked:
            shape.radius = float(self._asked["polygon_radius_m"])
        body = self._world.CreateStaticBody(position=(px - along * ny, py + along * nx))
        body.CreateFixture(
            shape=shape,
            friction=0.0,
            restitution=scene.wall_restitution,
            categoryBits=BEFORE_WALLS,
            maskBits=BEFORE_WALLS,
        )
        body.userData = wall_body(k)
        self._walls.append(body)

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings; what Box2D tells (all but the arguments of `Step`) is read back from it."""
        read: dict[str, Setting] = {name: bool(getattr(self._world, name)) for name in WORLD_SETTINGS}
        velocity, position = self._iterations
        read |= {
            "dt_s": self._dt_s,
            "velocityIterations": velocity,
            "positionIterations": position,
            "velocity_scale": self._scale,
            "sleepingAllowed": all(body.sleepingAllowed for body in self._movable)
            and bool(self._asked.get("sleepingAllowed", True)),
            "sweep": self._sweep,
            "continuousPhysics": bool(self._world.continuousPhysics),
            "polygon_radius_m": float(
                self._walls[0].fixtures[0].shape.radius if self._walls else self._asked.get("polygon_radius_m", 0.0)
            ),
        }
        return read

    def advance(self, steps: int) -> None:
        """Call `b2World.Step` this many times, and nothing else."""
        step, dt_s, (velocity, position) = self._world.Step, self._dt_s / self._scale, self._iterations
        self._solved.clear()
        for _ in range(steps):
            step(dt_s, velocity, position)
        self._steps += steps

    def observe(self) -> Observation:
        """Read every body, and what Box2D told its listener of the contacts that it solved.

        Box2D looks for contacts and then moves the bodies, so those of step k (from 0) stand at ``k dt_s``. The first
        look sets the listener up: a world that is only timed has none.
        """
        if self._listener is None:
            self._listen()
        position = np.array([tuple(body.position) for body in self._bodies], dtype=np.float64)
        velocity = np.array([tuple(body.linearVelocity) for body in self._bodies], dtype=np.float64) / self._scale
        contacts = self._contacts()
        self._solved.clear()
        return Observation(position, velocity, contacts, self._warning(velocity))

    def _listen(self) -> None:
        solved, normals = self._solved, self._normals

        class Listener(self._box2d.b2ContactListener):  # type: ignore[misc, name-defined] # made at run time
            def PreSolve(self, contact: Any, _old: Any) -> None:  # noqa: N802 - Box2D's name
                manifold = contact.worldManifold  # held on to: its normal is a view into it
                normals[contact.fixtureA.body.userData, contact.fixtureB.body.userData] = tuple(manifold.normal)

            def PostSolve(self, contact: Any, impulse: Any) -> None:  # noqa: N802 - Box2D's name
                # By now the bodies have moved on, and the manifold's normal with them.
                pair = (contact.fixtureA.body.userData, contact.fixtureB.body.userData)
                solved.append((*pair, normals[pair], sum(impulse.normalImpulses)))

        self._listener = Listener()
        self._world.contactListener = self._listener

    def _contacts(self) -> tuple[Contact, ...]:
        at_s = self._start_s + (self._steps - 1) * self._dt_s
        found = []
        for a, b, normal, impulse in self._solved:
            if impulse <= 0:  # Box2D tells of a contact for as long as it lasts
                continue
            # From A to B, and a unit vector to 32 bits only.
            sign = -1.0 if a < 0 or 0 <= b < a else 1.0
            scale = sign / math.hypot(*normal)
            first, second = (a, b) if sign > 0 else (b, a)
            found.append(Contact(first, second, at_s, (normal[0] * scale, normal[1] * scale), impulse / self._scale))
        return tuple(found)

    def _warning(self, velocity: Any) -> str:
        # Made so fast by an impact, it is too late to refuse.
        fastest = float(np.hypot(*velocity.T).max())
        if fastest * self._dt_s > LONGEST_MOVE_M:
            return f"Box2D moves a body by at most {LONGEST_MOVE_M:g} m a step, and slowed one down to {fastest:g} m/s"
        return ""

    def cut(self, dt_s: float) -> None:
        """Take steps of another length from here on."""
        self._start_s += self._steps * self._dt_s
        self._steps, self._dt_s = 0, dt_s

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that Box2D finds in contact in a step of no length, which moves and solves nothing."""
        self._world.Step(0.0, 0, 0)
        found = set()
        for contact in self._world.contacts:
            if contact.touching:
                low, high = sorted((contact.fixtureA.body.userData, contact.fixtureB.body.userData))
                found.add((high, low) if low < 0 else (low, high))
        return frozenset(found)

    def save(self) -> object:
        """Return positions and velocities, which with these settings are all of a state."""
        bodies = [(body, tuple(body.position), tuple(body.linearVelocity)) for body in self._movable]
        return (self._start_s + self._steps * self._dt_s, bodies)

    def restore(self, state: Any) -> None:
        """Put positions and velocities back."""
        self._start_s, bodies = state
        self._steps = 0
        for body, position, velocity in bodies:
            body.position, body.linearVelocity = position, velocity

    def close(self) -> None:
        """Let go of the world; its memory goes with the last reference."""
        self._world.contactListener = None
        del self._bodies, self._movable, self._walls, self._listener, self._world


def _default(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        # What Box2D's manual suggests (section 2.4, "Simulating the world").
        "velocityIterations": 8,
        "positionIterations": 3,
        # As shipped, a body below 1 cm/s is put to rest after half a second: that is damping.
        "sleepingAllowed": False,
    }


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        # Contacts that close at less than 1 m/s are made inelastic, by a constant that is compiled in
        # (b2_velocityThreshold). In a world that runs this many times faster, for as much less time, the limit is
        # 1e-6 m/s. A power of two, so that scaling is exact.
        "velocity_scale": VELOCITY_SCALE,
        "velocityIterations": 50,
        # Bodies that overlap are not pushed apart.
        "positionIterations": 0,
        # A swept disc is stopped 3 b2_linearSlop (1.5 cm) inside the other, at any step, so that only fast ones gain.
        "sweep": "fast",
        # As shipped, a polygon has a skin of 1 cm.
        "polygon_radius_m": 0.0,
    }


def _no_ccd(dt_s: float) -> dict[str, Setting]:
    return {**_tuned(dt_s), "sweep": "none"}


class Box2dAdapter:
    """Box2D as it is shipped (`default`), or made to solve overlaps alone (`tuned`)."""

    name = "box2d"
    engine = Engine("Box2D", module="Box2D", distribution="Box2D", install="pip install 'carom[box2d]'")
    capabilities = Capabilities(
        gravity=True,
        restitution=(0.0, 1.0),
        restitution_combine="maximum",
        contact_times=ContactTimes.STEP,
        continuous_detection=True,
        max_speed_m_s=LARGEST_SPEED_M_S,
        max_coordinate_m=LARGEST_COORDINATE_M,
        max_move_m=LONGEST_MOVE_M,
        min_radius_m=SMALLEST_RADIUS_M,
        float_bits=32,
        restitution_threshold_m_s=THRESHOLD_M_S / VELOCITY_SCALE,
    )
    profiles: Mapping[str, Profile] = {
        "default": Profile(
            "What a user of Box2D gets: all as shipped (contacts below 1 m/s are inelastic), but frictionless, awake "
            "and with the scene's restitution.",
            _default,
            capabilities=replace(capabilities, restitution_threshold_m_s=THRESHOLD_M_S),
        ),
        "tuned": Profile(
            "The most exact fixed-step settings known, from Carom's own measurements: slow contacts bounce, overlaps "
            "are never pushed apart, and fast discs are swept.",
            _tuned,
        ),
        "located": Profile(
            "The tuned settings without sweeping, each step cut at the instant from which on Box2D's own contact test "
            "finds an overlap (Carom's own bisection).",
            _no_ccd,
            located=True,
        ),
        "no-ccd": Profile("The tuned settings without continuous detection: no disc is swept.", _no_ccd),
    }

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Build a world.

        Raises:
            AdapterError: The scene or a setting is outside what Box2D can do.
        """
        return Box2dWorld(scene, settings)


adapter = Box2dAdapter()
