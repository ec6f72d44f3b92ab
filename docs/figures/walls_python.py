"""Flights of one disc at walls in engines with Python interfaces, for `walls.py`: each in the engine's own calls.

``python docs/figures/walls_python.py ENGINE WAY`` reads flights from standard input and writes where each ends, both as
JSON. All is as shipped except restitution 1, no friction, no damping and no sleep; MuJoCo, which has no restitution, is
given contacts that are over in one step.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from itertools import pairwise
from typing import Any

Flight = dict[str, Any]
End = list[float]

#: A mass is needed, and any will do at a wall.
MASS_KG = 1.0


def pymunk(way: str, flight: Flight) -> End:
    """Segments, each told of its neighbours or not."""
    import pymunk

    space, body = pymunk.Space(), pymunk.Body(MASS_KG, math.inf)
    body.position, body.velocity = flight["position_m"], flight["velocity_m_s"]
    shapes: list[pymunk.Shape] = [pymunk.Circle(body, flight["radius_m"])]
    points = [tuple(point) for point in flight["points_m"]]
    for k, (a, b) in enumerate(pairwise(points)):
        segment = pymunk.Segment(space.static_body, a, b, flight["half_width_m"])
        if way == "neighbours":
            segment.set_neighbors(points[max(k - 1, 0)], points[min(k + 2, len(points) - 1)])
        shapes.append(segment)
    for shape in shapes:
        shape.elasticity = 1.0
    space.add(body, *shapes)
    for _ in range(flight["steps"]):
        space.step(flight["dt_s"])
    return [*body.position, *body.velocity]


def box2d(way: str, flight: Flight) -> End:
    """Edges, or one chain."""
    import Box2D

    world = Box2D.b2World(gravity=(0, 0))
    radius, points = flight["radius_m"], [tuple(point) for point in flight["points_m"]]
    body = world.CreateDynamicBody(
        position=flight["position_m"], linearVelocity=flight["velocity_m_s"], fixedRotation=True, allowSleep=False
    )
    circle = Box2D.b2CircleShape(radius=radius)
    body.CreateFixture(shape=circle, density=MASS_KG / (math.pi * radius**2), restitution=1, friction=0)
    edges = [Box2D.b2EdgeShape(vertices=pair) for pair in pairwise(points)]
    wall = world.CreateStaticBody()
    for shape in [Box2D.b2ChainShape(vertices_chain=points)] if way == "chain" else edges:
        wall.CreateFixture(shape=shape, restitution=1, friction=0)
    for _ in range(flight["steps"]):
        world.Step(flight["dt_s"], 8, 3)  # as the manual suggests
    return [*body.position, *body.linearVelocity]


def mujoco(way: str, flight: Flight) -> End:
    """Capsules or boxes."""
    import mujoco

    half, (x, y), dt = flight["half_width_m"], flight["position_m"], flight["dt_s"]
    geoms = ""
    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        turned = math.degrees(math.atan2(by - ay, bx - ax))
        geoms += (
            f'<geom type="capsule" fromto="{ax} {ay} 0 {bx} {by} 0" size="{half}"/>'
            if way == "capsules"
            else f'<geom type="box" pos="{(ax + bx) / 2} {(ay + by) / 2} 0" euler="0 0 {turned}" '
            f'size="{math.hypot(bx - ax, by - ay) / 2} {half} 1"/>'
        )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt}" gravity="0 0 0"/><default><geom solref="0 {-2 / dt}" '
        f'solimp=".9999 .9999 .001" friction="0 0 0" condim="1"/></default><worldbody>{geoms}<body pos="{x} {y} 0">'
        '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
        f'<geom type="sphere" size="{flight["radius_m"]}" mass="{MASS_KG}"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[:] = flight["velocity_m_s"]
    for _ in range(flight["steps"]):
        mujoco.mj_step(model, data)
    return [x + data.qpos[0], y + data.qpos[1], *data.qvel.tolist()]


def pybullet(way: str, flight: Flight) -> End:
    """Boxes; or boxes, with a swept sphere in the disc, which may be in maximal coordinates."""
    import pybullet as p

    client = p.connect(p.DIRECT)
    p.setTimeStep(flight["dt_s"], physicsClientId=client)

    def add(shape: int, mass: float, position: list[float], turned: float = 0.0, **more: float) -> int:
        facing = p.getQuaternionFromEuler([0, 0, turned])
        of = {"useMaximalCoordinates": int("maximal" in way), "physicsClientId": client}
        body: int = p.createMultiBody(mass, shape, -1, [*position, 0], facing, **of)
        set_up = {"restitution": 1, "lateralFriction": 0, "linearDamping": 0, "angularDamping": 0}
        p.changeDynamics(body, -1, **set_up, **more, physicsClientId=client)
        return body

    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        size = [math.hypot(bx - ax, by - ay) / 2, flight["half_width_m"], 1]
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=size, physicsClientId=client)
        add(shape, 0.0, [(ax + bx) / 2, (ay + by) / 2], math.atan2(by - ay, bx - ax))
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=flight["radius_m"], physicsClientId=client)
    swept = {"ccdSweptSphereRadius": flight["radius_m"] / 2} if "swept" in way else {}
    disc = add(sphere, MASS_KG, flight["position_m"], **swept)
    p.resetBaseVelocity(disc, [*flight["velocity_m_s"], 0], [0, 0, 0], physicsClientId=client)
    for _ in range(flight["steps"]):
        p.stepSimulation(physicsClientId=client)
    x, y, _ = p.getBasePositionAndOrientation(disc, physicsClientId=client)[0]
    vx, vy, _ = p.getBaseVelocity(disc, physicsClientId=client)[0]
    p.disconnect(client)
    return [x, y, vx, vy]


ENGINES: dict[str, Callable[[str, Flight], End]] = {
    "Box2D": box2d,
    "mujoco": mujoco,
    "pybullet": pybullet,
    "pymunk": pymunk,
}

if __name__ == "__main__":
    name, built = sys.argv[1:]
    json.dump([ENGINES[name](built, flight) for flight in json.load(sys.stdin)], sys.stdout)
