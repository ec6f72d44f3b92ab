"""A scene in Drake: a continuous plant of spheres on planar joints, and its simulator."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom.engines.api import (
    AdapterError,
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    oriented_contact,
    wall_body,
)
from carom_adapters.drake.limits import check_inputs


def _import_modules() -> Any:  # Drake's modules under short names
    from pydrake import geometry, math
    from pydrake.multibody import plant, tree
    from pydrake.systems import analysis, framework

    # For each half-space, Drake warns that deformable bodies do not support half-spaces, although there are no
    # deformable bodies.
    logging.getLogger("drake").setLevel(logging.ERROR)
    return SimpleNamespace(geometry=geometry, math=math, plant=plant, tree=tree, analysis=analysis, framework=framework)


class DrakeWorld:
    """One continuous `MultibodyPlant` of spheres on planar joints, and its simulator."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        check_inputs(scene, settings)
        drake = self._drake = _import_modules()
        scheme = settings.get("integration_scheme")
        if scheme is not None and scheme not in (schemes := drake.analysis.GetIntegrationSchemes()):
            raise AdapterError(f"Drake: integration_scheme must be one of {', '.join(schemes)}, got {scheme!r}")
        self._requested_settings = dict(settings)
        self._clock = StepClock(float(settings["dt_s"]))
        self._body_number: dict[Any, int] = {}
        builder = drake.framework.DiagramBuilder()
        # Drake's usual function, AddMultibodyPlantSceneGraph, is not used, since this function leaks 95 kB of memory.
        self._plant, _ = drake.plant.AddMultibodyPlant(drake.plant.MultibodyPlantConfig(time_step=0.0), builder)
        self._plant.mutable_gravity_field().set_gravity_vector([*scene.gravity_m_s2, 0.0])
        joints = [self._add_disc(scene, i) for i in range(len(scene.discs))]
        for k, wall in enumerate(scene.half_planes()):
            pose = drake.geometry.HalfSpace.MakePose([*wall.normal, 0.0], [*wall.point_m, 0.0])
            self._add_shape(self._plant.world_body(), pose, drake.geometry.HalfSpace(), wall_body(k))
        self._plant.Finalize()
        self._diagram = builder.Build()
        self._simulator = drake.analysis.Simulator(self._diagram)
        if scheme is not None:
            drake.analysis.ResetIntegratorFromFlags(self._simulator, str(scheme), self._clock.dt_s)
        if "target_accuracy" in settings:
            self._simulator.get_mutable_integrator().set_target_accuracy(float(settings["target_accuracy"]))
        self._context = self._plant.GetMyMutableContextFromRoot(self._simulator.get_mutable_context())
        self._position = np.array([disc.position_m for disc in scene.discs], dtype=np.float64)
        self._movable = [i for i, joint in enumerate(joints) if joint is not None]
        for joint, disc in zip(joints, scene.discs, strict=True):
            if joint is not None:
                joint.set_translation(self._context, disc.position_m)
                joint.set_translational_velocity(self._context, disc.velocity_m_s)
        self._simulator.Initialize()
        #: The greatest force of each contact in the last step, and the contact's normal when this force acted.
        self._step_contacts: dict[tuple[int, int], tuple[float, tuple[float, float]]] = {}
        self._has_monitor = False

    def _add_disc(self, scene: Scene, i: int) -> Any:
        """Add a disc and return its joint; None for an immovable disc, which is part of the world."""
        drake, disc = self._drake, scene.discs[i]
        ball = drake.geometry.Sphere(disc.radius_m)
        if disc.immovable:
            self._add_shape(self._plant.world_body(), drake.math.RigidTransform([*disc.position_m, 0.0]), ball, i)
            return None
        inertia = drake.tree.SpatialInertia.SolidSphereWithMass(disc.mass_kg, disc.radius_m)
        body = self._plant.AddRigidBody(f"disc {i}", inertia)
        self._add_shape(body, drake.math.RigidTransform(), ball, i)
        world = self._plant.world_body().body_frame()
        return self._plant.AddJoint(drake.tree.PlanarJoint(f"plane {i}", world, body.body_frame(), damping=[0, 0, 0]))

    def _add_shape(self, body: Any, pose: Any, shape: Any, number: int) -> None:
        drake = self._drake
        properties = drake.geometry.ProximityProperties()
        stiffness = self._requested_settings.get("point_stiffness")
        drake.geometry.AddContactMaterial(
            dissipation=0.0,
            point_stiffness=None if stiffness is None else float(stiffness),
            friction=drake.plant.CoulombFriction(0.0, 0.0),
            properties=properties,
        )
        geometry = self._plant.RegisterCollisionGeometry(body, pose, shape, f"body {number}", properties)
        self._body_number[geometry] = number

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings as Drake reports them.

        ``point_stiffness`` is the default for bodies without a stiffness of their own.
        """
        integrator = self._simulator.get_integrator()
        shipped = self._drake.geometry.SceneGraphConfig().default_proximity_properties.point_stiffness
        return {
            # Releases up to 1.35 have no default stiffness. Up to release 1.35, a plant computes the stiffness from
            # gravity and masses.
            **({} if shipped is None else {"point_stiffness": shipped}),
            "integration_scheme": _format_scheme(integrator),
            **self._requested_settings,
            "target_accuracy": integrator.get_target_accuracy(),
        }

    def advance(self, steps: int) -> None:
        """Take steps.

        Within each step, Drake's integrator takes as many steps of its own as its error control requires.
        """
        for _ in range(steps):
            self._step_contacts = {}
            self._clock.count(1)
            self._simulator.AdvanceTo(self._clock.now_s)

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts that a monitor found in the integrator's steps.

        A contact can begin and end within a step, so the state at the end of the step may not show the contact. The
        first observation creates the monitor, so that timed runs, which are not observed, have no monitor.
        """
        if not self._has_monitor:
            self._has_monitor = True
            self._simulator.set_monitor(self._record_contacts)
        position, velocity = self._position.copy(), np.zeros_like(self._position)
        count = len(self._movable)
        position[self._movable] = self._plant.GetPositions(self._context).reshape(count, 3)[:, :2]
        velocity[self._movable] = self._plant.GetVelocities(self._context).reshape(count, 3)[:, :2]
        return Observation(position, velocity, tuple(self._read_contacts()))

    def _record_contacts(self, _root: Any) -> Any:
        results = self._plant.get_contact_results_output_port().Eval(self._context)
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            force, pair = float(np.linalg.norm(info.contact_force())), info.point_pair()
            bodies = (self._body_number[pair.id_B], self._body_number[pair.id_A])
            if force > self._step_contacts.get(bodies, (0.0, None))[0]:
                nx, ny, _ = pair.nhat_BA_W  # Drake's normal points from B to A
                self._step_contacts[bodies] = (force, (float(nx), float(ny)))
        return self._drake.framework.EventStatus.DidNothing()

    def _read_contacts(self) -> list[Contact]:
        at_s, contacts = self._clock.step_began_s, []
        for (b, a), (_, normal) in self._step_contacts.items():
            # The impulse is the integral of the force over time. The impulse is None here, because Drake reports the
            # force only at single instants.
            contacts.append(replace(oriented_contact(b, a, at_s, normal, 0.0), impulse_n_s=None))
        return contacts

    def close(self) -> None:
        """Drop the references to the simulator, so that its memory is freed."""
        self._simulator.clear_monitor()
        del self._context, self._simulator, self._diagram, self._plant


def _format_scheme(integrator: Any) -> str:
    """Return an integrator's name in `GetIntegrationSchemes`, such as ``runge_kutta3`` for `RungeKutta3Integrator`."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", type(integrator).__name__.removesuffix("Integrator")).lower()
