"""A scene in ODE: spheres in a hash space, run step by step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from carom.engines.api import (
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    oriented_contact,
    pair_of,
    wall_body,
)
from carom_adapters.ode.limits import LEAST_STEP_S, STEPPERS, check_inputs


class OdeWorld:
    """One world of ODE with spheres in a hash space. No force turns the spheres or moves them out of the plane."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        check_inputs(scene, settings)
        from panda3d import core, ode

        self._ode: Any = ode
        self._clock = StepClock(float(settings["dt_s"]))
        self._world, self._space, self._group = ode.OdeWorld(), ode.OdeHashSpace(), ode.OdeJointGroup()
        self._world.setGravity(*scene.gravity_m_s2, 0.0)
        if "cfm" in settings:
            self._world.setCfm(float(settings["cfm"]))
        if "erp" in settings:
            self._world.setErp(float(settings["erp"]))
        if "quick_step_iterations" in settings:
            self._world.setQuickStepNumIterations(int(settings["quick_step_iterations"]))
        self._stepper = str(settings.get("stepper", STEPPERS[0]))
        self._step: Any = getattr(self._world, self._stepper)
        self._surfaces = {
            False: self._build_surface(scene.restitution),
            True: self._build_surface(scene.wall_restitution),
        }
        self._geoms: dict[int, Any] = {}
        self._body_number: dict[int, int] = {}
        self._bodies: list[Any] = []
        self._start_position_m = np.array([disc.position_m for disc in scene.discs], dtype=np.float64)
        for i, disc in enumerate(scene.discs):
            geom = ode.OdeSphereGeom(self._space, disc.radius_m)
            body = None if disc.immovable else self._build_body(disc.mass_kg, disc.radius_m)
            self._bodies.append(body)
            if body is None:
                geom.setPosition(*disc.position_m, 0.0)
            else:
                geom.setBody(body)
                self._set_state(body, disc.position_m, disc.velocity_m_s)
            self._register(geom, i)
        for k, wall in enumerate(scene.half_planes()):
            (nx, ny), (x, y) = wall.normal, wall.point_m
            self._register(ode.OdePlaneGeom(self._space, core.LVecBase4f(nx, ny, 0.0, nx * x + ny * y)), wall_body(k))
        #: Contacts of the last step: the joint, the numbers of its two bodies, and the normal from the second body to
        #: the first.
        self._met: list[tuple[Any, int, int, tuple[float, float]]] = []

    def _register(self, geom: Any, number: int) -> None:
        self._geoms[number], self._body_number[geom.getId().this] = geom, number

    def _build_surface(self, restitution: float) -> Any:
        surface = self._ode.OdeSurfaceParameters()  # by default, surfaces have no friction, and bounce at any speed
        surface.setMode(self._ode.OdeSurfaceParameters.MFContactBounce)
        surface.setBounce(restitution)
        return surface

    def _build_body(self, mass_kg: float, radius_m: float) -> Any:
        body, mass = self._ode.OdeBody(self._world), self._ode.OdeMass()
        mass.setSphereTotal(mass_kg, radius_m)
        body.setMass(mass)
        return body

    @staticmethod
    def _set_state(body: Any, position: Any, velocity: Any) -> None:
        body.setPosition(float(position[0]), float(position[1]), 0.0)
        body.setLinearVel(float(velocity[0]), float(velocity[1]), 0.0)

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings as ODE reports them, and the name of the stepper."""
        return {
            "dt_s": self._clock.dt_s,
            "cfm": self._world.getCfm(),
            "erp": self._world.getErp(),
            "quick_step_iterations": self._world.getQuickStepNumIterations(),
            "stepper": self._stepper,
        }

    def _add_contact_joints(self, _: Any, first: Any, second: Any) -> None:
        """Create a joint for each contact of two geoms. ODE calls this function for each pair of near geoms."""
        a, b = self._body_number[first.getId().this], self._body_number[second.getId().this]
        if all(k < 0 or self._bodies[k] is None for k in (a, b)):
            return
        contacts = self._ode.OdeUtil.collide(first, second, 1)
        for k in range(contacts.getNumContacts()):
            contact_geom, contact = contacts.getContactGeom(k), self._ode.OdeContact()
            contact.setGeom(contact_geom)
            contact.setSurface(self._surfaces[a < 0 or b < 0])
            joint = self._ode.OdeContactJoint(self._world, self._group, contact)
            joint.attach(first.getBody(), second.getBody())
            joint.setFeedback()
            nx, ny, _nz = contact_geom.getNormal()
            self._met.append((joint, a, b, (nx, ny)))

    def advance(self, steps: int) -> None:
        """Take steps. Each step releases the joints of the previous step, finds contacts, and solves them."""
        for _ in range(steps):
            self._release_joints()
            self._space.collide("", self._add_contact_joints)
            self._step(max(self._clock.dt_s, LEAST_STEP_S))
        self._clock.count(steps)

    def _release_joints(self) -> None:
        self._met = []
        self._group.empty()

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts that the last step found and solved at its start."""
        position, velocity = self._start_position_m.copy(), np.zeros_like(self._start_position_m)
        for i, body in enumerate(self._bodies):
            if body is not None:
                position[i], velocity[i] = _to_plane(body.getPosition()), _to_plane(body.getLinearVel())
        return Observation(position, velocity, tuple(self._read_contacts()))

    def _read_contacts(self) -> list[Contact]:
        contacts = []
        for joint, a, b, normal in self._met:
            feedback = joint.getFeedback()
            # Force on one of the two bodies, or on the movable body if only one body can move.
            fx, fy, _ = feedback.getForce1()
            impulse = abs(fx * normal[0] + fy * normal[1]) * self._clock.dt_s
            if impulse > 0.0:  # if the bodies separate, the contact has no effect
                contacts.append(oriented_contact(b, a, self._clock.step_began_s, normal, impulse))
        return contacts

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by ODE's own collision detection."""
        pairs = set()

        def collect_pair(_: Any, first: Any, second: Any) -> None:
            if self._ode.OdeUtil.collide(first, second, 1).getNumContacts():
                pairs.add(pair_of(self._body_number[first.getId().this], self._body_number[second.getId().this]))

        self._space.collide("", collect_pair)
        return frozenset(pair for pair in pairs if pair[0] >= 0)

    def save(self) -> object:
        """Return positions and velocities, the complete state, since nothing turns."""
        states = [
            None if body is None else (_to_plane(body.getPosition()), _to_plane(body.getLinearVel()))
            for body in self._bodies
        ]
        return (self._clock.now_s, states)

    def restore(self, state: Any) -> None:
        """Restore positions and velocities."""
        time_s, states = state
        self._clock.restart(time_s)
        for body, body_state in zip(self._bodies, states, strict=True):
            if body is not None:
                self._set_state(body, *body_state)

    def close(self) -> None:
        """Release joints, geoms, bodies, space and world, since Panda3D does not free them by itself."""
        self._release_joints()
        for geom in self._geoms.values():
            geom.destroy()
        for body in self._bodies:
            if body is not None:
                body.destroy()
        self._group.destroy()
        self._space.destroy()
        self._world.destroy()


def _to_plane(vector: Any) -> tuple[float, float]:
    x, y, _ = vector
    return float(x), float(y)
