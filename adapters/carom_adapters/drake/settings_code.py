"""Writes a scene and settings as a program for Drake, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Scene, Setting
from carom_adapters.drake.limits import check_inputs
from carom_adapters.shared.settings_code import count_steps, format_comment, format_disc


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same plant as `DrakeWorld`.

    Raises:
        AdapterError: Drake does not support the scene or a setting.
    """
    check_inputs(scene, settings)
    lines = [
        format_disc(disc, {} if disc.immovable else {"mass": disc.mass_kg, "velocity": disc.velocity_m_s})
        for disc in scene.discs
    ]
    lines += [f"add_wall({wall.point_m!r}, {wall.normal!r})" for wall in scene.half_planes()]
    scheme = accuracy = ""
    if "integration_scheme" in settings:
        scheme = f"ResetIntegratorFromFlags(simulator, {settings['integration_scheme']!r}, dt)\n"
    if "target_accuracy" in settings:
        accuracy = f"simulator.get_mutable_integrator().set_target_accuracy({float(settings['target_accuracy'])!r})\n"
    stiffness = float(settings["point_stiffness"]) if "point_stiffness" in settings else None
    bodies = "\n".join(lines)
    return f"""{format_comment(heading)}
from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import PlanarJoint, SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
builder = DiagramBuilder()
plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.0), builder)  # continuous: a discrete one has no bounce
plant.mutable_gravity_field().set_gravity_vector([{scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0])
discs, starts = [], []


def add_shape(body, pose, shape):
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=0.0, point_stiffness={stiffness!r}, friction=CoulombFriction(0.0, 0.0), properties=properties
    )
    plant.RegisterCollisionGeometry(body, pose, shape, f"shape {{plant.num_collision_geometries()}}", properties)


def add_disc(position, radius, mass=None, velocity=(0.0, 0.0)):
    starts.append((position, velocity))
    if mass is None:
        add_shape(plant.world_body(), RigidTransform([*position, 0.0]), Sphere(radius))
        discs.append(None)
        return
    body = plant.AddRigidBody(f"disc {{len(discs)}}", SpatialInertia.SolidSphereWithMass(mass, radius))
    add_shape(body, RigidTransform(), Sphere(radius))
    plane = PlanarJoint(f"plane {{len(discs)}}", plant.world_body().body_frame(), body.body_frame(), damping=[0, 0, 0])
    discs.append(plant.AddJoint(plane))


def add_wall(point, normal):
    add_shape(plant.world_body(), HalfSpace.MakePose([*normal, 0.0], [*point, 0.0]), HalfSpace())


{bodies}
plant.Finalize()
diagram = builder.Build()
simulator = Simulator(diagram)
{scheme}{accuracy}context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
for joint, (position, velocity) in zip(discs, starts):
    if joint is not None:
        joint.set_translation(context, position)
        joint.set_translational_velocity(context, velocity)
simulator.Initialize()
for step in range(1, steps + 1):
    simulator.AdvanceTo(step * dt)
for joint, (position, _) in zip(discs, starts):
    if joint is None:
        print(*position, 0.0, 0.0, 0.0)
    else:
        print(*joint.get_translation(context), *joint.get_translational_velocity(context), 0.0)
"""
