"""A release of DART without Carom, at 32 phases of the step, as JSON: ``python dart_releases.py FOLDER``.

``row``: of five equal discs in a line, how far the velocities at the end are from the exchanged ones, over the fastest.
``box``: how often the velocity of a disc turns in a box. ``leans``: by how much the normal of a contact of two spheres
that meet off centre leaves the plane at most.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

sys.path.insert(0, sys.argv[1])
import dartpy  # of the folder

STEP, PHASES = 1 / 60, 32


def world_of(
    discs: list[tuple[tuple[float, float], tuple[float, float], float]], phase: float
) -> tuple[Any, list[Any]]:
    """Return a world of spheres on slides, each set back by a part of its first step."""
    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(STEP)
    skeletons = []
    for k, ((x, y), (vx, vy), radius) in enumerate(discs):
        skeleton = dartpy.dynamics.Skeleton(f"disc {k}")
        _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
        elastic(body.createShapeNode(dartpy.dynamics.SphereShape(radius)))
        body.setMass(1.0)
        world.addSkeleton(skeleton)
        skeleton.setPositions([x - phase * STEP * vx, y - phase * STEP * vy])
        skeleton.setVelocities([vx, vy])
        skeletons.append(skeleton)
    return world, skeletons


def elastic(node: Any) -> None:
    """Let a shape bounce without loss or friction."""
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.getDynamicsAspect().setRestitutionCoeff(1.0)
    node.getDynamicsAspect().setFrictionCoeff(0.0)


def row(phase: float) -> float:
    """Return how far off the velocities of `classics/sorting` end, over the fastest."""
    velocities = (2.5, 1.6, 0.5, -0.8, -1.9)
    places = (0.0, 0.65, 1.9, 2.45, 3.9)
    world, discs = world_of([((x, 0.0), (v, 0.0), 0.1) for x, v in zip(places, velocities, strict=True)], phase)
    for _ in range(round(1.75 / STEP)):
        world.step()
    wanted = sorted(velocities)
    return float(max(math.dist(disc.getVelocities(), (v, 0.0)) for disc, v in zip(discs, wanted, strict=True)) / 2.5)


def box(phase: float) -> int:
    """Return in how many steps the velocity of the disc of `classics/box` turns."""
    world, (disc,) = world_of([((0.7, 0.5), (5.3, 3.7), 0.2)], phase)
    for k, (normal, offset) in enumerate((((1, 0), 0.0), ((-1, 0), -2.4), ((0, 1), 0.0), ((0, -1), -1.6))):
        wall = dartpy.dynamics.Skeleton(f"wall {k}")
        elastic(
            wall.createWeldJointAndBodyNodePair()[1].createShapeNode(dartpy.dynamics.PlaneShape([*normal, 0.0], offset))
        )
        wall.setMobile(False)
        world.addSkeleton(wall)
    turns = 0
    for _ in range(round(2.5 / STEP)):
        before = tuple(disc.getVelocities())
        world.step()
        turns += math.dist(before, disc.getVelocities()) > 0.01 * math.hypot(*before)
    return turns


def lean(phase: float) -> float:
    """Return how far the normal of two spheres that meet off centre leaves the plane at most."""
    world, _ = world_of([((-0.6, 0.0), (1.0, 0.0), 0.5), ((0.6, 0.2), (-1.0, 0.0), 0.5)], phase)
    most = 0.0
    for _ in range(30):
        world.step()
        result = world.getLastCollisionResult()  # kept: until 6.19 its contacts are gone with it
        most = max([most, *(abs(float(contact.normal[2])) for contact in result.getContacts())])
    return most


phases = [k / PHASES for k in range(PHASES)]
found = {"row": [*map(row, phases)], "box": [*map(box, phases)], "leans": [*map(lean, phases)]}
sys.stdout.write(json.dumps(found) + "\n")
