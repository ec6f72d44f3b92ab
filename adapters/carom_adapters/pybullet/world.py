"""World of Bullet: builds a scene in a client of its own, takes steps, and reads states and contacts."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.engines.api import (
    AdapterError,
    Chain,
    Contact,
    Disc,
    Observation,
    Ring,
    Scene,
    Setting,
    StepClock,
    Wall,
    flattened,
    is_fast,
    oriented_contact,
    pair_of,
    wall_body,
)
from carom_adapters.pybullet.limits import (
    BODY_SETTINGS,
    SHIPPED_SPEED_CLAMP_M_S,
    SHIPPED_SPIN_CLAMP_RAD_S,
    WORLD_SETTINGS,
    require_usable,
)
from carom_adapters.pybullet.model import (
    Point,
    build_dynamics,
    build_structure_key,
    compute_capsule,
    compute_moments,
    compute_resistance,
)
from carom_adapters.shared.legs import Driven, Legs, find_first_velocity
from carom_adapters.shared.quiet_steps import QuietSteps, to_rows
from carom_adapters.shared.walls import compute_thickness, cut_chain, factor_walls, find_walls_in_pieces, sum_contacts

#: Type that `getDynamicsInfo` returns, as its second to last value, for a body with maximal coordinates. A multibody
#: has type 2.
RIGID_BODY = 1

NOT_TURNED = (0.0, 0.0, 0.0, 1.0)

#: The client of the world that was closed last, by a key from `build_structure_key`. The next world reuses this client,
#: since allocating a new client takes longer. Only one client is kept, because a client takes 29 MB.
_KEPT: dict[object, tuple[int, list[int], list[int], dict[int, int]]] = {}


class PybulletWorld(QuietSteps):
    """One PyBullet client, in this process and without a window."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        require_usable(scene, settings)
        self._requested_settings = dict(settings) | build_dynamics(scene, settings)
        self._clock = StepClock(float(settings["dt_s"]))
        self._turns = scene.arrays.turns
        # Cylinders can turn out of the plane. If a sphere is deep inside a box, the normals that the algorithm GJK
        # computes point out of the plane.
        turns_over = settings.get("shape", "sphere") == "cylinder" and bool(settings.get("turn", True))
        self._can_lean = turns_over or any(not isinstance(wall, Wall) for wall in scene.walls)
        self._last_contacts: tuple[Contact, ...] | None = None
        velocity = np.array([disc.velocity_m_s for disc in scene.discs], dtype=np.float64)
        # A disc that already starts at the speed limit has not been slowed down by the limit.
        self._below_clamp = np.abs(velocity) < SHIPPED_SPEED_CLAMP_M_S
        self._spins_below_clamp = np.abs(scene.arrays.spins) < SHIPPED_SPIN_CLAMP_RAD_S
        self._bullet: Any = importlib.import_module("pybullet")  # untyped: PyBullet ships no stubs
        self._get_pose, self._get_velocity = self._bullet.getBasePositionAndOrientation, self._bullet.getBaseVelocity
        if not self._requested_settings.get("useMaximalCoordinates", False):
            self.size_without_warning = min(SHIPPED_SPEED_CLAMP_M_S, SHIPPED_SPIN_CLAMP_RAD_S)
        self._key = build_structure_key(scene, settings)
        self._discs: list[int] = []
        self._movable: list[int] = []
        self._body_number: dict[int, int] = {}
        self._driven: list[tuple[int, Driven]] = []
        self._legs = Legs[tuple[int, float]]()  # each body is stored with its spin
        self._walls_in_pieces = find_walls_in_pieces(scene)
        is_built = False
        if not _KEPT:
            self._client = self._bullet.connect(self._bullet.DIRECT)
            if self._client < 0:
                raise AdapterError("PyBullet returned no client; were all earlier worlds closed?")
        else:
            key, (self._client, discs, movable, number) = _KEPT.popitem()
            is_built = key is not None and key == self._key
            if is_built:
                self._discs, self._movable, self._body_number = discs, movable, number
                # A reused client may still have the step size of a shortened step.
                self._bullet.setPhysicsEngineParameter(fixedTimeStep=self._clock.dt_s, physicsClientId=self._client)
            else:
                self._bullet.resetSimulation(physicsClientId=self._client)  # the first parameter is `flags`
        try:
            if not is_built:
                self._build(scene)
            self._start(scene)
        except BaseException:
            self._bullet.disconnect(self._client)
            raise

    def _start(self, scene: Scene) -> None:
        """Reset every disc to its initial state.

        Contacts need no reset, since Bullet finds contacts again in every step.
        """
        bullet, client = self._bullet, self._client
        for body, disc in zip(self._discs, scene.discs, strict=True):
            if not disc.immovable:
                bullet.resetBasePositionAndOrientation(body, [*disc.position_m, 0.0], NOT_TURNED, client)
                bullet.resetBaseVelocity(body, [*disc.velocity_m_s, 0.0], [0, 0, disc.spin_rad_s], client)
        for body, scene_body in self._driven:
            spin = scene_body.spin_rad_s if isinstance(scene_body, Disc) else 0.0
            bullet.resetBaseVelocity(body, [*find_first_velocity(scene_body), 0.0], [0, 0, spin], client)
            self._legs.add((body, spin), scene_body)
        self._last_contacts = ()

    def _build(self, scene: Scene) -> None:
        bullet, client, settings = self._bullet, self._client, self._requested_settings
        world = {name: settings[name] for name in WORLD_SETTINGS if name in settings}
        bullet.setPhysicsEngineParameter(fixedTimeStep=self._clock.dt_s, physicsClientId=client, **world)
        # Nothing is drawn. Without this shape, Bullet would build a mesh to draw each body, which takes up to 10 ms.
        self._visual = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=[1.0, 1.0, 1.0], physicsClientId=client)
        disc_restitution, disc_friction, of_walls = factor_walls(scene)  # Bullet's default friction is 0.5
        ccd_fraction = float(settings.get("ccd_radius_fraction", 0.0))
        for i, disc in enumerate(scene.discs):
            kind = bullet.GEOM_CYLINDER if settings.get("shape", "sphere") == "cylinder" else bullet.GEOM_SPHERE
            shape = bullet.createCollisionShape(
                kind, radius=disc.radius_m, height=2 * disc.radius_m, physicsClientId=client
            )
            mass = 0.0 if disc.immovable else disc.mass_kg  # in Bullet, a mass of 0 means immovable
            body = self._add(shape, mass, disc.position_m, disc_restitution, disc_friction, driven=disc.driven)
            if disc.driven:
                self._driven.append((body, disc))
            if not disc.immovable:
                self._movable.append(body)
                if (moments := compute_moments(scene, settings, disc)) is not None:
                    # The mass must be set again together with the inertia.
                    bullet.changeDynamics(body, -1, mass=mass, localInertiaDiagonal=moments, physicsClientId=client)
                if ccd_fraction > 0 and is_fast(disc, self._clock.dt_s):
                    swept = ccd_fraction * disc.radius_m
                    bullet.changeDynamics(body, -1, ccdSweptSphereRadius=swept, physicsClientId=client)
            self._discs.append(body)
            self._body_number[body] = i
        for k, (wall, material) in enumerate(zip(scene.walls, of_walls, strict=True)):
            for shape, place, turn in self._build_shapes(scene, wall):
                body = self._add(shape, 0.0, place, *material, turn, driven=wall.driven)
                if resists := compute_resistance(scene, disc_friction):
                    bullet.changeDynamics(body, -1, rollingFriction=resists, physicsClientId=client)
                self._body_number[body] = wall_body(k)
                if wall.driven:
                    self._driven.append((body, wall))
        if self._turns and settings.get("useMaximalCoordinates", False):
            # For a body with maximal coordinates, Bullet applies a changed inertia only at the end of a step. So one
            # step is taken here, in which all bodies are at rest at their initial positions.
            bullet.stepSimulation(client)
        if scene.gravity_m_s2 != (0.0, 0.0):
            bullet.setGravity(*scene.gravity_m_s2, 0.0, physicsClientId=client)

    def _build_shapes(self, scene: Scene, wall: Wall | Chain | Ring) -> list[tuple[int, Point, Sequence[float]]]:
        """Return a wall's shapes with their positions and rotations: a plane, a sphere, or a capsule for each piece."""
        bullet, client = self._bullet, self._client
        if isinstance(wall, Wall):
            normal = [*wall.normal, 0.0]
            plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=normal, physicsClientId=client)
            return [(plane, wall.point_m, NOT_TURNED)]
        radius = compute_thickness(scene, wall)
        if isinstance(wall, Ring):
            sphere = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
            return [(sphere, wall.centre_m, NOT_TURNED)]
        shapes: list[tuple[int, Point, Sequence[float]]] = []
        for length, middle, turn in (compute_capsule(a, b) for a, b in cut_chain(wall)):
            capsule = bullet.createCollisionShape(
                bullet.GEOM_CAPSULE, radius=radius, height=length, physicsClientId=client
            )
            shapes.append((capsule, middle, turn))
        return shapes

    def _add(
        self,
        shape: int,
        mass: float,
        position: Point,
        restitution: float,
        friction: float,
        turn: Sequence[float] = NOT_TURNED,
        *,
        driven: bool = False,
    ) -> int:
        bullet, client, settings = self._bullet, self._client, self._requested_settings
        body: int = bullet.createMultiBody(
            mass,
            shape,
            self._visual,
            basePosition=[*position, 0.0],
            baseOrientation=turn,
            # With maximal coordinates, a body without a mass can't move. A multibody without a mass can move.
            useMaximalCoordinates=bool(settings.get("useMaximalCoordinates", False)) and not driven,
            physicsClientId=client,
        )
        dynamics = {name: settings[name] for name in BODY_SETTINGS if name in settings}
        # -1 means the base of the body. A body without links has only a base.
        bullet.changeDynamics(
            body, -1, restitution=restitution, lateralFriction=friction, physicsClientId=client, **dynamics
        )
        return body

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings in use. Some settings are read from PyBullet, and the others are as requested."""
        world = self._bullet.getPhysicsEngineParameters(self._client)
        body = self._bullet.getDynamicsInfo((self._movable or self._discs)[0], -1, self._client)
        return self._requested_settings | {
            "dt_s": world["fixedTimeStep"],
            "numSolverIterations": world["numSolverIterations"],
            "lateralFriction": body[1],
            "useMaximalCoordinates": body[10] == RIGID_BODY,
        }

    def advance(self, steps: int) -> None:
        """Call `stepSimulation` `steps` times. Between steps, set the prescribed velocities of driven bodies."""
        step, client = self._bullet.stepSimulation, self._client
        for count, changes in self._legs.split_steps(steps, self._clock):
            for (body, spin), velocity in changes:
                self._bullet.resetBaseVelocity(body, [*velocity, 0.0], [0, 0, spin], client)
            for _ in range(count):
                step(client)
        self._last_contacts = None

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts.

        Bullet finds contacts and then moves the bodies, so a contact of step k (counted from 0) has the time ``k
        dt_s``.
        """
        numbers = to_rows(self.read())
        velocity, spin = numbers[:, 2:4], numbers[:, 4] if self._turns else None
        contacts = self._read_step_contacts()
        return Observation(numbers[:, :2], velocity, contacts, self._find_warning(velocity, spin), spin)

    def read(self) -> list[float]:
        """Return position, velocity and spin of each disc."""
        get_pose, get_velocity, client, turns = self._get_pose, self._get_velocity, self._client, self._turns
        numbers: list[float] = []
        for body in self._discs:
            (x, y, _), _ = get_pose(body, client)
            (vx, vy, _), (_, _, spin) = get_velocity(body, client)
            numbers += (x, y, vx, vy, spin if turns else 0.0)
        return numbers

    def has_contacts(self) -> bool:
        """Whether a contact point has a force after the last step."""
        return any(point[9] > 0.0 for point in self._bullet.getContactPoints(physicsClientId=self._client))

    def _find_warning(self, velocity: NDArray[np.float64], spin: NDArray[np.float64] | None) -> str:
        # An impact or a fall can make a body too fast. A running scene can't be refused, so the run gets a warning.
        # Bullet clamps x and y separately.
        if self._requested_settings.get("useMaximalCoordinates", False):
            return ""
        clamped = self._below_clamp & (np.abs(velocity) >= SHIPPED_SPEED_CLAMP_M_S)
        if np.count_nonzero(clamped):  # five times as fast as `any`, and runs after every step
            return (
                f"PyBullet clamps each component of a multibody's velocity to {SHIPPED_SPEED_CLAMP_M_S:g} m/s, and "
                f"disc {int(clamped.any(axis=1).argmax())} has reached this limit"
            )
        if spin is None:
            return ""
        clamped = self._spins_below_clamp & (np.abs(spin) >= SHIPPED_SPIN_CLAMP_RAD_S)
        if clamped.any():
            limit = f"{SHIPPED_SPIN_CLAMP_RAD_S:g} rad/s"
            return (
                f"PyBullet clamps a multibody's spin to {limit}, and disc {int(clamped.argmax())} has reached "
                "this limit"
            )
        return ""

    def _read_step_contacts(self) -> tuple[Contact, ...]:
        if self._last_contacts is None:
            self._last_contacts = sum_contacts(self._read_contacts(), self._walls_in_pieces)
        return self._last_contacts

    def _read_contacts(self) -> list[Contact]:
        at_s = self._clock.step_began_s
        # Bullet solves contacts whose distance is below `contactProcessingThreshold`. By default Bullet solves all
        # contacts.
        solved_below = float(self._requested_settings.get("contactProcessingThreshold", math.inf))
        found = []
        for point in self._bullet.getContactPoints(physicsClientId=self._client):
            body_a, body_b, normal_from_b_to_a, distance, force = point[1], point[2], point[7], point[8], point[9]
            # A contact with a plane still exists after the overlap has ended, and reports the last force.
            if force <= 0 or distance > solved_below:
                continue
            normal, impulse = (normal_from_b_to_a[0], normal_from_b_to_a[1]), force * self._clock.dt_s
            if self._can_lean:
                normal, impulse = flattened(normal, impulse)
            tangential = self._compute_tangential_impulse(point, normal) if self._turns else None
            found.append(
                oriented_contact(
                    self._body_number[body_b], self._body_number[body_a], at_s, normal, impulse, tangential
                )
            )
        return found

    def _compute_tangential_impulse(self, point: Sequence[Any], normal: tuple[float, float]) -> float:
        """Return the impulse of friction on body A, along the normal turned by +90 degrees.

        The normal points from B to A.
        """
        (nx, ny), (force, along), (force_2, along_2) = normal, point[10:12], point[12:14]
        x, y = (force * along[axis] + force_2 * along_2[axis] for axis in (0, 1))
        return float(nx * y - ny * x) * self._clock.dt_s

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s)
        self._bullet.setPhysicsEngineParameter(fixedTimeStep=dt_s, physicsClientId=self._client)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by Bullet's own collision detection, at the present positions."""
        self._read_step_contacts()  # the detection overwrites the contacts of the last step, so they are read before
        self._bullet.performCollisionDetection(self._client)
        found = set()
        for point in self._bullet.getContactPoints(physicsClientId=self._client):
            if point[8] < 0:
                found.add(pair_of(self._body_number[point[1]], self._body_number[point[2]]))
        return frozenset(found)

    def save(self) -> object:
        """Return positions, velocities and spins.

        With the settings of the profile `located`, later steps depend only on positions, velocities and spins.
        """
        bullet, client = self._bullet, self._client
        bodies = [
            (body, bullet.getBasePositionAndOrientation(body, client), bullet.getBaseVelocity(body, client))
            for body in (*self._movable, *(body for body, _ in self._driven))
        ]
        return (self._clock.now_s, bodies, self._legs.started)

    def restore(self, state: Any) -> None:
        """Restore positions, velocities and spins."""
        bullet, client = self._bullet, self._client
        time_s, bodies, self._legs.started = state
        self._clock.restart(time_s)
        for body, place, velocity in bodies:
            bullet.resetBasePositionAndOrientation(body, *place, client)
            bullet.resetBaseVelocity(body, *velocity, client)

    def close(self) -> None:
        """Keep this world's client for the next world. Disconnect the previously kept client, to free its memory."""
        if _KEPT:
            _, (client, *_) = _KEPT.popitem()
            self._bullet.disconnect(client)
        _KEPT[self._key] = (self._client, self._discs, self._movable, self._body_number)
