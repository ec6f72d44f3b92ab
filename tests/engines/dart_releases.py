"""A release of DART without Carom, at 32 phases of the step, as JSON: ``python dart_releases.py FOLDER``.

``row``: of five equal discs in a line, how far the velocities at the end are from the exchanged ones, over the fastest.
``box``: how often the velocity of a disc turns in a box. ``leans``: by how much the normal of a contact of two spheres
that meet off centre leaves the plane at most. ``head_on`` and ``cradle``: as `row`, of these scenes of `classics`.
``ladder`` and ``bank``: how often velocities turn in them.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

sys.path.insert(0, sys.argv[1])
import dartpy  # of the folder

STEP, PHASES = 1 / 60, 32


def build_world(
    discs: list[tuple[tuple[float, float], tuple[float, float], float]],
    phase: float,
    walls: tuple[tuple[tuple[float, float], float], ...] = (),
    masses: tuple[float, ...] = (),
    coefficients: tuple[float, float] = (1.0, 1.0),
) -> tuple[Any, list[Any]]:
    """Return a world of spheres on slides, each set back by a part of its first step, and of planes.

    A wall is its normal and its position along that; masses are 1 kg by default. The coefficients are those of discs
    and walls, which DART multiplies.
    """
    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(STEP)
    skeletons = []
    for k, ((x, y), (vx, vy), radius) in enumerate(discs):
        skeleton = dartpy.dynamics.Skeleton(f"disc {k}")
        _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
        frictionless(body.createShapeNode(dartpy.dynamics.SphereShape(radius)), coefficients[0])
        body.setMass(masses[k] if masses else 1.0)
        world.addSkeleton(skeleton)
        skeleton.setPositions([x - phase * STEP * vx, y - phase * STEP * vy])
        skeleton.setVelocities([vx, vy])
        skeletons.append(skeleton)
    for k, (normal, offset) in enumerate(walls):
        wall = dartpy.dynamics.Skeleton(f"wall {k}")
        plane = dartpy.dynamics.PlaneShape([*normal, 0.0], offset)
        frictionless(wall.createWeldJointAndBodyNodePair()[1].createShapeNode(plane), coefficients[1])
        wall.setMobile(False)
        world.addSkeleton(wall)
    return world, skeletons


def frictionless(node: Any, coefficient: float) -> None:
    """Let a shape bounce with a coefficient, and without friction."""
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.getDynamicsAspect().setRestitutionCoeff(coefficient)
    node.getDynamicsAspect().setFrictionCoeff(0.0)


def measure_row_error(phase: float) -> float:
    """Return how far off the velocities of `classics/sorting` end, over the fastest."""
    velocities = (2.5, 1.6, 0.5, -0.8, -1.9)
    places = (0.0, 0.65, 1.9, 2.45, 3.9)
    world, discs = build_world([((x, 0.0), (v, 0.0), 0.1) for x, v in zip(places, velocities, strict=True)], phase)
    return measure_velocity_error(world, discs, 1.75, sorted(velocities)) / 2.5


def count_box_turns(phase: float) -> int:
    """Return in how many steps the velocity of the disc of `classics/box` turns."""
    walls = (((1.0, 0.0), 0.0), ((-1.0, 0.0), -2.4), ((0.0, 1.0), 0.0), ((0.0, -1.0), -1.6))
    return count_turns(*build_world([((0.7, 0.5), (5.3, 3.7), 0.2)], phase, walls), 2.5)


def count_turns(world: Any, discs: list[Any], seconds: float) -> int:
    """Return how often the velocity of a disc turns from a step to the next."""
    count = 0
    for _ in range(round(seconds / STEP)):
        before = [tuple(disc.getVelocities()) for disc in discs]
        world.step()
        moved = zip(before, discs, strict=True)
        count += sum(math.dist(old, disc.getVelocities()) > 0.01 * math.hypot(*old) for old, disc in moved)
    return count


def measure_velocity_error(world: Any, discs: list[Any], seconds: float, wanted: list[float]) -> float:
    """Return how far the velocities end from those that are wanted, along x."""
    for _ in range(round(seconds / STEP)):
        world.step()
    return float(max(math.dist(disc.getVelocities(), (v, 0.0)) for disc, v in zip(discs, wanted, strict=True)))


def measure_head_on_error(phase: float) -> float:
    """Return how far off discs of 1 and 3 kg part with half of the 6 m/s that they close at, over the fastest."""
    discs = [((-3.04, 0.0), (4.0, 0.0), 0.2), ((1.72, 0.0), (-2.0, 0.0), 0.3)]
    return (
        measure_velocity_error(
            *build_world(discs, phase, masses=(1.0, 3.0), coefficients=(0.5**0.5, 1.0)), 1.5, [-2.75, 0.25]
        )
        / 4.0
    )


def measure_cradle_error(phase: float) -> float:
    """Return how far the first velocity of `classics/cradle-gaps` is from the last disc's at the end, over itself."""
    places = (0.0, 1.08, 1.5, 2.06, 2.54)
    world, discs = build_world([((x, 0.0), (0.0 if x else 2.0, 0.0), 0.125) for x in places], phase)
    return measure_velocity_error(world, discs, 1.5, [0.0, 0.0, 0.0, 0.0, 2.0]) / 2.0


def count_ladder_turns(phase: float) -> int:
    """Return how often the disc of `classics/restitution-ladder` turns."""
    walls = (((1.0, 0.0), 0.0), ((-1.0, 0.0), -1.7))
    return count_turns(*build_world([((0.6, 0.0), (11.0, 0.3), 0.1)], phase, walls, coefficients=(1.0, 0.8)), 3.0)


def count_bank_turns(phase: float) -> int:
    """Return how often velocities turn in `classics/bank-shot`."""
    discs = [((-1.36, 1.22), (4.0, -3.0), 0.2), ((2.317284844477174, 2.1379636333578804), (0.0, 0.0), 0.2)]
    return count_turns(*build_world(discs, phase, (((0.0, 1.0), 0.0),)), 1.75)


def measure_lean(phase: float) -> float:
    """Return how far the normal of two spheres that meet off centre leaves the plane at most."""
    world, _ = build_world([((-0.6, 0.0), (1.0, 0.0), 0.5), ((0.6, 0.2), (-1.0, 0.0), 0.5)], phase)
    most = 0.0
    for _ in range(30):
        world.step()
        result = world.getLastCollisionResult()  # kept: until 6.19 its contacts are gone with it
        most = max([most, *(abs(float(contact.normal[2])) for contact in result.getContacts())])
    return most


phases = [k / PHASES for k in range(PHASES)]
measures = {
    "row": measure_row_error,
    "box": count_box_turns,
    "leans": measure_lean,
    "head_on": measure_head_on_error,
    "cradle": measure_cradle_error,
    "ladder": count_ladder_turns,
    "bank": count_bank_turns,
}
found = {name: [*map(measure, phases)] for name, measure in measures.items()}
sys.stdout.write(json.dumps(found) + "\n")
