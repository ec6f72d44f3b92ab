"""World of Box2D: builds the bodies of a scene, takes steps, and reads states and contacts."""

from __future__ import annotations

import importlib
import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from carom.engines.api import (
    Chain,
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    Wall,
    is_fast,
    oriented_contact,
    pair_of,
    reach,
    scaled,
    wall_body,
)
from carom_adapters.box2d.limits import LARGEST_TURN_RAD, LONGEST_MOVE_M, WORLD_SETTINGS, require_usable
from carom_adapters.box2d.walls import build_chain_shapes, build_wall_rectangle
from carom_adapters.shared.legs import Driven, Legs, find_first_velocity
from carom_adapters.shared.quiet_steps import QuietSteps, to_rows
from carom_adapters.shared.walls import compute_thickness

#: Collision categories of a disc's two shapes: one collides with other discs, and one with walls.
AMONG_DISCS, BEFORE_WALLS = 0x0001, 0x0002

Point = tuple[float, float]


def list_disc_shapes(scene: Scene) -> list[tuple[int, float, float]]:
    """Return collision category, restitution and friction of each circular shape of a disc (one or two shapes).

    Box2D uses the larger of two bodies' restitutions, and the square root of the product of their frictions. If discs
    have a larger restitution than walls, or another friction, a disc needs two shapes. The first shape collides with
    other discs. The second shape collides with walls, and has a restitution of 0 and the walls' friction.
    """
    if scene.walls and (scene.wall_restitution < scene.restitution or scene.wall_friction != scene.friction):
        return [(AMONG_DISCS, scene.restitution, scene.friction), (BEFORE_WALLS, 0.0, scene.wall_friction)]
    return [(AMONG_DISCS | BEFORE_WALLS, scene.restitution, scene.friction)]


def does_sweep(scene: Scene, settings: Mapping[str, Setting], dt_s: float) -> bool:
    """Whether Box2D sweeps bodies in this scene; see `limits.SWEEPS`.

    With "fast", Box2D sweeps bodies if any disc or driven body is fast.
    """
    sweep = settings.get("sweep", "shipped")
    driven = max((body.drive.fastest for body in (*scene.discs, *scene.walls) if body.driven), default=0.0)
    fast = driven * dt_s > min(disc.radius_m for disc in scene.discs) or any(is_fast(one, dt_s) for one in scene.discs)
    return sweep == "shipped" or (sweep == "fast" and fast)


def _import_box2d() -> Any:  # untyped, because the SWIG module has no stubs
    with warnings.catch_warnings():
        # Box2D's SWIG types have no __module__, so CPython warns. If a user has turned warnings into errors, the
        # warning would end the process.
        warnings.simplefilter("ignore")
        return importlib.import_module("Box2D")


class Box2dWorld(QuietSteps):
    """One `b2World`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        require_usable(scene, settings)
        self._box2d = _import_box2d()
        self._requested_settings = dict(settings)
        # Number of time units of the world's clock in a second. A velocity in Box2D is the scene's velocity divided by
        # `_time`.
        self._time = 1.0 / float(settings.get("velocity_scale", 1.0))
        scene = scaled(scene, time=self._time)
        self._iterations = (int(settings["velocityIterations"]), int(settings["positionIterations"]))
        self.size_without_warning = min(LONGEST_MOVE_M, LARGEST_TURN_RAD) / float(settings["dt_s"])
        self._clock = StepClock(float(settings["dt_s"]) * self._time)
        self._world = self._box2d.b2World(gravity=scene.gravity_m_s2)
        for name in WORLD_SETTINGS:
            if name in settings:
                setattr(self._world, name, settings[name])
        self._sweep = str(settings.get("sweep", "shipped"))
        self._world.continuousPhysics = does_sweep(scene, settings, self._clock.dt_s)
        self._bodies: list[Any] = []
        self._walls: list[Any] = []
        self._thin_walls: list[Any] = []  # shapes of walls whose only thickness is Box2D's skin
        self._chains: set[int] = set()
        self._movable: list[Any] = []
        self._driven: list[Any] = []
        self._legs = Legs[Any]()
        self._belts = {wall_body(k): wall.surface_speed_m_s for k, wall in enumerate(scene.walls)}
        self._turns = scene.arrays.turns
        self._solved_contacts: list[tuple[Any, Any, Point, float, float]] = []
        self._normals: dict[int, Point] = {}
        self._listener: Any = None
        self._table = self._world.CreateStaticBody() if scene.table_deceleration_m_s2 else None
        for i in range(len(scene.discs)):
            self._add_disc(scene, i)
        centre, radius = reach(scene, self._clock.dt_s)
        for k, wall in enumerate(scene.walls):
            if isinstance(wall, Wall):
                place, corners = build_wall_rectangle(scene, wall, centre, radius)
                self._add_wall(scene, k, place, [self._box2d.b2PolygonShape(vertices=corners)], 0.0)
            elif isinstance(wall, Chain):
                self._chains.add(wall_body(k))
                self._add_wall(scene, k, (0.0, 0.0), build_chain_shapes(self._box2d, wall, settings), wall.half_width_m)
            else:
                self._add_wall(
                    scene, k, wall.centre_m, [self._box2d.b2CircleShape(radius=compute_thickness(scene, wall))]
                )
        if any(self._belts.values()):  # only a contact listener can set the speed of a conveyor
            self._listen()

    def _add_disc(self, scene: Scene, i: int) -> None:
        box2d, disc = self._box2d, scene.discs[i]
        if disc.immovable:
            body = self._create_held_body(disc.position_m, disc, disc.spin_rad_s)
        else:
            body = self._world.CreateDynamicBody(
                position=disc.position_m,
                linearVelocity=disc.velocity_m_s,
                angularVelocity=disc.spin_rad_s,
                linearDamping=scene.damping_per_s,
                angularDamping=scene.damping_per_s,
                fixedRotation=not (self._turns and math.isfinite(disc.inertia_factor)),
                allowSleep=bool(self._requested_settings.get("sleepingAllowed", True)),
                bullet=self._sweep == "fast" and is_fast(disc, self._clock.dt_s),
            )
            self._movable.append(body)
        for category, restitution, friction in list_disc_shapes(scene):
            body.CreateFixture(
                shape=box2d.b2CircleShape(radius=disc.radius_m),
                density=1.0,
                friction=friction,
                restitution=restitution,
                categoryBits=category,
                maskBits=category,
            )
        if not disc.immovable:  # set the mass last, since new shapes change the mass
            # Box2D sets the inverse inertia of a body that does not turn to 0.
            inertia = 1.0 if body.fixedRotation else disc.inertia_factor * disc.mass_kg * disc.radius_m**2
            body.massData = box2d.b2MassData(mass=disc.mass_kg, center=(0, 0), I=inertia)
            if scene.table_deceleration_m_s2:
                force = scene.table_deceleration_m_s2 * disc.mass_kg
                self._world.CreateFrictionJoint(
                    bodyA=self._table, bodyB=body, localAnchorA=disc.position_m, maxForce=force
                )
        body.userData = i
        self._bodies.append(body)

    def _create_held_body(self, place: Point, scene_body: Driven, spin: float = 0.0) -> Any:
        """Return a body that impacts do not move: a body at rest or a driven body."""
        if not scene_body.driven:
            return self._world.CreateStaticBody(position=place)
        velocity = find_first_velocity(scene_body)
        body = self._world.CreateKinematicBody(position=place, linearVelocity=velocity, angularVelocity=spin)
        self._driven.append(body)
        self._legs.add(body, scene_body)
        return body

    def _add_wall(
        self, scene: Scene, k: int, place: Point, shapes: list[Any], half_width_m: float | None = None
    ) -> None:
        body = self._create_held_body(place, scene.walls[k])
        for number, shape in enumerate(shapes):
            fixture = body.CreateFixture(
                shape=shape,
                friction=scene.wall_friction,
                restitution=scene.wall_restitution,
                categoryBits=BEFORE_WALLS,
                maskBits=BEFORE_WALLS,
            )
            fixture.userData = number
            if half_width_m is None:  # a circle, which has no skin
                continue
            # Box2D copies shapes, and a copied chain has the default skin. So the adapter sets the skin of the copy.
            skin = float(self._requested_settings.get("polygon_radius_m", fixture.shape.radius))
            fixture.shape.radius = skin + half_width_m
            if not half_width_m:
                self._thin_walls.append(fixture.shape)
        body.userData = wall_body(k)
        self._walls.append(body)

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings as Box2D reports them, and the arguments of `Step`."""
        read: dict[str, Setting] = {name: bool(getattr(self._world, name)) for name in WORLD_SETTINGS}
        velocity, position = self._iterations
        read |= {
            "dt_s": self._clock.dt_s / self._time,
            "velocityIterations": velocity,
            "positionIterations": position,
            "velocity_scale": 1.0 / self._time,
            "sleepingAllowed": all(body.sleepingAllowed for body in self._movable)
            and bool(self._requested_settings.get("sleepingAllowed", True)),
            "sweep": self._sweep,
            "continuousPhysics": bool(self._world.continuousPhysics),
            "polygon_radius_m": float(
                self._thin_walls[0].radius
                if self._thin_walls
                else self._requested_settings.get("polygon_radius_m", 0.0)
            ),
            "chains": bool(self._requested_settings.get("chains", False)),
        }
        return read

    def advance(self, steps: int) -> None:
        """Call `b2World.Step` `steps` times. Between steps, set the prescribed velocities of driven bodies."""
        step, dt_s, iterations = self._world.Step, self._clock.dt_s, self._iterations
        self._solved_contacts.clear()
        for count, changes in self._legs.split_steps(steps, self._clock):
            for body, velocity in changes:
                body.linearVelocity = velocity
            for _ in range(count):
                step(dt_s, *iterations)

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts that Box2D has reported to the listener.

        Box2D finds contacts and then moves the bodies, so a contact of step k (counted from 0) has the time ``k dt_s``.
        The first observation creates the listener, so that timed runs, which are not observed, have no listener.
        """
        if self._listener is None:
            self._listen()
        numbers = to_rows(self.read())
        contacts = self._read_contacts()
        self._solved_contacts.clear()
        observation = Observation(
            numbers[:, :2], numbers[:, 2:4], contacts, spin_rad_s=numbers[:, 4] if self._turns else None
        )
        warning = self._find_warning(observation)
        return replace(observation, warning=warning) if warning else observation

    def read(self) -> list[float]:
        """Return position, velocity and spin of each disc.

        Velocities and spins are per second of the scene, not per unit of Box2D's time.
        """
        time, turns = self._time, self._turns
        numbers: list[float] = []
        for body in self._bodies:
            p, v = body.position, body.linearVelocity
            numbers += (p.x, p.y, v.x * time, v.y * time, body.angularVelocity * time if turns else 0.0)
        return numbers

    def has_contacts(self) -> bool:
        """Whether an impulse acted at a contact in the last step."""
        return any(push[3] > 0 for push in self._solved_contacts)

    def _listen(self) -> None:
        solved, normals, belts = self._solved_contacts, self._normals, self._belts
        has_belts = any(belts.values())

        class Listener(self._box2d.b2ContactListener):  # type: ignore[misc, name-defined] # made at run time
            def PreSolve(self, contact: Any, _old: Any) -> None:  # noqa: N802 - Box2D's name
                manifold = contact.worldManifold  # keeps the manifold alive, since its normal is a view
                normals[hash(contact)] = tuple(manifold.normal)  # the hash is the address of Box2D's own contact
                if has_belts:
                    for fixture in (contact.fixtureA, contact.fixtureB):
                        if belt := belts.get(fixture.body.userData, 0.0):
                            contact.tangentSpeed = -belt  # Box2D's tangent points to the right of the normal

            def PostSolve(self, contact: Any, impulse: Any) -> None:  # noqa: N802 - Box2D's name
                # The bodies have moved since the contact was found, so the manifold's normal has changed.
                pair = (contact.fixtureA.body.userData, contact.fixtureB.body.userData)
                tangential = sum(impulse.tangentImpulses)
                solved.append((*pair, normals[hash(contact)], sum(impulse.normalImpulses), tangential))

        self._listener = Listener()
        self._world.contactListener = self._listener

    def _read_contacts(self) -> tuple[Contact, ...]:
        at_s = self._clock.step_began_s / self._time
        found = []
        for a, b, (nx, ny), impulse, tangential in self._sum_contacts():
            length = math.hypot(nx, ny)  # the normal's length is 1 only to the precision of 32-bit floats
            # Box2D's tangent is its normal turned by -90 degrees.
            along = -tangential * self._time if self._turns else None
            found.append(oriented_contact(a, b, at_s, (nx / length, ny / length), impulse * self._time, along))
        return tuple(found)

    def _sum_contacts(self) -> list[tuple[Any, Any, Point, float, float]]:
        """Return the solved contacts. If a disc touches several edges of one chain, these contacts are summed."""
        # Box2D reports a contact in every step while bodies touch, even if no impulse acts.
        pushes = [push for push in self._solved_contacts if push[3] > 0]
        found = [push for push in pushes if not self._chains & {push[0], push[1]}]
        for pair in dict.fromkeys(push[:2] for push in pushes if self._chains & {push[0], push[1]}):
            of_pair = [push[2:] for push in pushes if push[:2] == pair]
            along_x, along_y = (sum(normal[i] * impulse for normal, impulse, _ in of_pair) for i in (0, 1))
            # Box2D's tangent is its normal turned by -90 degrees.
            across_x = sum(normal[1] * tangential for normal, _, tangential in of_pair)
            across_y = sum(-normal[0] * tangential for normal, _, tangential in of_pair)
            size = math.hypot(along_x, along_y)
            if len(of_pair) == 1 or not size:  # if opposite edges push equally, the sum is 0
                found += [(*pair, *push) for push in of_pair]
                continue
            nx, ny = along_x / size, along_y / size
            x, y = along_x + across_x, along_y + across_y
            found.append((*pair, (nx, ny), x * nx + y * ny, x * ny - y * nx))
        return found

    def _find_warning(self, observation: Observation) -> str:
        # Impacts can make a body too fast. A running scene can't be refused, so the run gets a warning.
        dt_s = self._clock.dt_s / self._time
        fastest = math.hypot(*observation.velocity_m_s.ravel().tolist())  # an upper bound for each disc's speed
        if fastest * dt_s > LONGEST_MOVE_M and (
            (fastest := float(np.hypot(*observation.velocity_m_s.T).max())) * dt_s > LONGEST_MOVE_M
        ):
            return f"Box2D limits motion to {LONGEST_MOVE_M:g} m per step, and slowed a body down to {fastest:g} m/s"
        fastest = 0.0 if observation.spin_rad_s is None else float(np.abs(observation.spin_rad_s).max())
        if fastest * dt_s > LARGEST_TURN_RAD:
            turn = f"{LARGEST_TURN_RAD:g} rad per step"
            return f"Box2D limits rotation to {turn}, and slowed a body down to {fastest:g} rad/s"
        return ""

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s * self._time)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that Box2D finds in contact in a step of length 0. A step of length 0 moves no body."""
        self._world.Step(0.0, 0, 0)
        found = set()
        for contact in self._world.contacts:
            if contact.touching:
                found.add(pair_of(contact.fixtureA.body.userData, contact.fixtureB.body.userData))
        return frozenset(found)

    def save(self) -> object:
        """Return positions, velocities and spins.

        With the settings of the profile `located`, later steps depend only on positions, velocities and spins.
        """
        bodies = [
            (body, tuple(body.position), tuple(body.linearVelocity), body.angularVelocity)
            for body in (*self._movable, *self._driven)
        ]
        return (self._clock.now_s, bodies, self._legs.started)

    def restore(self, state: Any) -> None:
        """Restore positions, velocities and spins."""
        time_s, bodies, self._legs.started = state
        self._clock.restart(time_s)
        for body, position, velocity, spin in bodies:
            body.position, body.linearVelocity, body.angularVelocity = position, velocity, spin

    def close(self) -> None:
        """Drop the references to the world, so that its memory is freed."""
        self._world.contactListener = None
        del self._bodies, self._movable, self._driven, self._legs, self._walls, self._thin_walls, self._table
        del self._listener, self._world
