"""World of DART: builds the skeletons of a scene, takes steps, and reads states and contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from carom.engines.api import (
    AdapterError,
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    factored_restitutions,
    flattened,
    oriented_contact,
    pair_of,
    wall_body,
)
from carom_adapters.dart.limits import DETECTORS, FASTEST_BOUNCE_M_S, MIXING, check_inputs


class DartWorld:
    """One `World` of spheres that do not turn. Each sphere moves on a joint that allows two translations."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        check_inputs(scene, settings)
        import dartpy

        self._dart: Any = dartpy
        self._scene = scene
        self._clock = StepClock(float(settings["dt_s"]))
        self._world = dartpy.simulation.World()
        self._world.setGravity([*scene.gravity_m_s2, 0.0])
        self._world.setTimeStep(self._clock.dt_s)
        self._solver: Any = self._world.getConstraintSolver()
        if "collision_detector" in settings:
            self._set_detector(str(settings["collision_detector"]))
        if "split_impulse" in settings and hasattr(self._solver, "setSplitImpulseEnabled"):  # DART 6.20 or later
            self._solver.setSplitImpulseEnabled(bool(settings["split_impulse"]))
        self._discs: list[Any] = []
        # DART multiplies the restitutions of two bodies.
        of_disc, of_wall = factored_restitutions(scene)
        for i, disc in enumerate(scene.discs):
            self._add_disc(i, disc.radius_m, None if disc.immovable else disc.mass_kg, of_disc)
        for k, wall in enumerate(scene.half_planes()):
            normal = np.array([*wall.normal, 0.0])
            plane = dartpy.dynamics.PlaneShape(normal, float(normal[:2] @ wall.point_m))
            skeleton = dartpy.dynamics.Skeleton(f"wall {k}")
            self._add_shape(skeleton.createWeldJointAndBodyNodePair()[1], plane, wall_body(k), of_wall)
            skeleton.setMobile(False)
            self._world.addSkeleton(skeleton)
        self._set_states([(disc.position_m, disc.velocity_m_s) for disc in scene.discs])

    def _set_detector(self, name: str) -> None:
        if hasattr(self._world, "setCollisionDetector"):
            self._world.setCollisionDetector(getattr(self._dart.simulation.CollisionDetectorType, name))
            return
        kinds = self._dart.collision  # up to release 6.19, the detector is an object that belongs to the solver
        kind = next((kind for kind in dir(kinds) if kind.upper() == f"{name}COLLISIONDETECTOR"), None)
        if kind is None:
            raise AdapterError(f"this release of dartpy has no collision detector named {name}; choose another")
        self._solver.setCollisionDetector(getattr(kinds, kind)())

    def _add_disc(self, i: int, radius_m: float, mass_kg: float | None, restitution: float) -> None:
        skeleton = self._dart.dynamics.Skeleton(f"disc {i}")
        _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
        self._add_shape(body, self._dart.dynamics.SphereShape(radius_m), i, restitution)
        if mass_kg is None:
            skeleton.setMobile(False)
        else:
            body.setMass(mass_kg)
        self._world.addSkeleton(skeleton)
        self._discs.append(skeleton)

    def _add_shape(self, body: Any, shape: Any, number: int, restitution: float) -> None:
        """Add a body's shape. The shape's name is the body's number, which identifies the bodies of a contact."""
        node = body.createShapeNode(shape)
        node.setName(str(number))
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.getDynamicsAspect().setRestitutionCoeff(restitution)
        node.getDynamicsAspect().setFrictionCoeff(0.0)

    def _set_states(self, states: Any) -> None:
        for skeleton, (position, velocity) in zip(self._discs, states, strict=True):
            skeleton.setPositions(position)
            skeleton.setVelocities(velocity)

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings as DART reports them. For a release without split impulses, `split_impulse` is False."""
        told_by = self._world if hasattr(self._world, "getCollisionDetector") else self._solver
        detector = type(told_by.getCollisionDetector()).__name__.upper()
        return {
            "dt_s": self._world.getTimeStep(),
            "collision_detector": next(name for name in DETECTORS if detector.startswith(name)),
            "split_impulse": getattr(self._solver, "isSplitImpulseEnabled", lambda: False)(),
        }

    def advance(self, steps: int) -> None:
        """Take steps."""
        step = self._world.step
        for _ in range(steps):
            step()
        self._clock.count(steps)

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts that the last step solved.

        DART finds contacts and then moves the bodies, so a contact of step k (counted from 0) has the time ``k dt_s``.
        """
        position = np.array([skeleton.getPositions() for skeleton in self._discs])
        velocity = np.array([skeleton.getVelocities() for skeleton in self._discs])
        contacts = tuple(self._read_contacts())
        return Observation(position, velocity, contacts, self._find_warning(velocity, contacts))

    def _read_contacts(self) -> list[Contact]:
        contacts = []
        # the reference keeps the contacts alive: up to release 6.19, DART frees them together with the result
        result = self._world.getLastCollisionResult()
        for contact in result.getContacts():
            nx, ny, nz = map(float, contact.normal)  # DART's normal points from the second object to the first
            normal, impulse = (nx, ny), math.hypot(*contact.force) * self._clock.dt_s
            # up to release 6.19, spheres are meshes by default, and normals of their contacts lean out of the plane
            if nz != 0.0:
                normal, impulse = flattened(normal, impulse)
            if impulse == 0.0:  # without an impulse, a contact changes no velocity
                continue
            a, b = self._read_pair(contact)
            contacts.append(oriented_contact(b, a, self._clock.step_began_s, normal, impulse))
        return contacts

    def _read_pair(self, contact: Any) -> tuple[int, int]:
        first, second = contact.collisionObject1, contact.collisionObject2
        return int(first.getShapeFrame().getName()), int(second.getShapeFrame().getName())

    def _find_warning(self, velocity: Any, contacts: tuple[Contact, ...]) -> str:
        # Impacts can make a body too fast. A running scene can't be refused, so the run gets a warning.
        scene = self._scene
        for contact in contacts:
            first, second = contact.first, contact.second
            of_wall = second < 0
            relative = (0.0 if of_wall else velocity[second]) - velocity[first]
            inverse_mass = 1 / scene.discs[first].mass_kg + (0.0 if of_wall else 1 / scene.discs[second].mass_kg)
            closed = (contact.impulse_n_s or 0.0) * inverse_mass - float(relative @ contact.normal)
            bounce = closed * (scene.wall_restitution if of_wall else scene.restitution)
            if bounce > FASTEST_BOUNCE_M_S * (1 + 4 * MIXING):
                limit_text = f"DART separates bodies at {FASTEST_BOUNCE_M_S:g} m/s at most"
                return f"{limit_text}, but two bodies must separate at {bounce:g} m/s"
        return ""

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s)
        self._world.setTimeStep(dt_s)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by DART's own collision detector."""
        collision = self._dart.collision
        result = collision.CollisionResult()
        self._world.checkCollision(collision.CollisionOption(), result)
        return frozenset(
            pair_of(*self._read_pair(contact)) for contact in result.getContacts() if contact.penetrationDepth > 0.0
        )

    def save(self) -> object:
        """Return positions and velocities, the complete state."""
        states = [(skeleton.getPositions(), skeleton.getVelocities()) for skeleton in self._discs]
        return (self._clock.now_s, states)

    def restore(self, state: Any) -> None:
        """Restore positions and velocities."""
        time_s, states = state
        self._clock.restart(time_s)
        self._set_states(states)

    def close(self) -> None:
        """Drop the references to the world, so that its memory is freed."""
        del self._discs, self._world
