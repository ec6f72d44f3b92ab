"""Writes a scene and settings as a program for DART, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Scene, Setting, factored_restitutions
from carom_adapters.dart.limits import check_inputs
from carom_adapters.shared.settings_code import PYTHON_END, count_steps, format_body_lines, format_comment


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same world as `DartWorld`.

    Raises:
        AdapterError: DART does not support the scene or a setting.
    """
    check_inputs(scene, settings)
    of_disc, of_wall = factored_restitutions(scene)
    detector = split = ""
    if "collision_detector" in settings:
        kind = f"dartpy.simulation.CollisionDetectorType.{settings['collision_detector']}"
        detector = f"world.setCollisionDetector({kind})\n"
    if "split_impulse" in settings:
        split = f"world.getConstraintSolver().setSplitImpulseEnabled({bool(settings['split_impulse'])})\n"
    end = PYTHON_END.format(step="world.step()", state="*body.getPositions(), *body.getVelocities(), 0.0")
    return f"""{format_comment(heading)}
import dartpy
import numpy as np

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
world = dartpy.simulation.World()
world.setGravity([{scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0])
world.setTimeStep(dt)
{detector}{split}discs = []


def add_shape(body, shape, restitution):
    node = body.createShapeNode(shape)
    node.createCollisionAspect()
    node.createDynamicsAspect()
    # DART multiplies the coefficients of two bodies.
    node.getDynamicsAspect().setRestitutionCoeff(restitution)
    node.getDynamicsAspect().setFrictionCoeff(0.0)


def add_disc(position, radius, mass=None, velocity=(0.0, 0.0)):  # a sphere on two slides, which does not turn
    skeleton = dartpy.dynamics.Skeleton(f"disc {{len(discs)}}")
    _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
    add_shape(body, dartpy.dynamics.SphereShape(radius), {of_disc!r})
    if mass is None:
        skeleton.setMobile(False)
    else:
        body.setMass(mass)
    world.addSkeleton(skeleton)
    discs.append(skeleton)
    starts.append((position, velocity))


def add_wall(point, normal):
    plane = dartpy.dynamics.PlaneShape(np.array([*normal, 0.0]), float(np.array(normal) @ point))
    skeleton = dartpy.dynamics.Skeleton(f"wall {{world.getNumSkeletons()}}")
    add_shape(skeleton.createWeldJointAndBodyNodePair()[1], plane, {of_wall!r})
    skeleton.setMobile(False)
    world.addSkeleton(skeleton)


starts = []
{format_body_lines(scene)}
for skeleton, (position, velocity) in zip(discs, starts):
    skeleton.setPositions(position)
    skeleton.setVelocities(velocity)
{end}"""
