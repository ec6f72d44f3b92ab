"""Hand-written loops, one per engine, as a user of the engine writes them.

The loops use the settings of the profile `tuned`.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Mapping
from typing import Any

from carom.engines.api import Scene

#: Two functions: one makes a number of steps, the other releases the engine's resources.
Loop = tuple[Callable[[int], object], Callable[[], object]]


def _pymunk(scene: Scene, dt_s: float) -> Loop:
    pymunk: Any = importlib.import_module("pymunk")
    space = pymunk.Space()
    space.iterations, space.collision_bias = 20, 1.0
    for disc in scene.discs:
        body = pymunk.Body(disc.mass_kg, math.inf)
        body.position, body.velocity = disc.position_m, disc.velocity_m_s
        shape = pymunk.Circle(body, disc.radius_m)
        shape.elasticity = 1.0
        space.add(body, shape)

    def loop(steps: int) -> None:
        step = space.step
        for _ in range(steps):
            step(dt_s)

    return loop, lambda: None


def _pybullet(scene: Scene, dt_s: float) -> Loop:
    bullet: Any = importlib.import_module("pybullet")
    client = bullet.connect(bullet.DIRECT)
    bullet.setPhysicsEngineParameter(
        fixedTimeStep=dt_s,
        contactERP=0,
        contactSlop=0,
        restitutionVelocityThreshold=0,
        deterministicOverlappingPairs=1,
        solverResidualThreshold=0,
        numSolverIterations=50,
        physicsClientId=client,
    )
    for disc in scene.discs:
        shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=disc.radius_m, physicsClientId=client)
        body = bullet.createMultiBody(
            disc.mass_kg, shape, basePosition=[*disc.position_m, 0], useMaximalCoordinates=1, physicsClientId=client
        )
        bullet.changeDynamics(
            body,
            -1,
            restitution=1,
            lateralFriction=0,
            linearDamping=0,
            contactProcessingThreshold=0,
            physicsClientId=client,
        )
        bullet.resetBaseVelocity(body, [*disc.velocity_m_s, 0], physicsClientId=client)

    def loop(steps: int) -> None:
        step = bullet.stepSimulation
        for _ in range(steps):
            step(client)

    return loop, lambda: bullet.disconnect(client)


def _mujoco(scene: Scene, dt_s: float) -> Loop:
    mujoco: Any = importlib.import_module("mujoco")
    bodies = "".join(
        f'<body pos="{disc.position_m[0]} {disc.position_m[1]} 0">'
        f'<inertial pos="0 0 0" mass="{disc.mass_kg}" diaginertia="1 1 1"/>'
        '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
        f'<geom type="sphere" size="{disc.radius_m}" condim="1" solref="0 {-2 / dt_s}"'
        ' solimp="0.9999 0.9999 0.001 0.5 2"/></body>'
        for disc in scene.discs
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt_s}" gravity="0 0 0" integrator="Euler" jacobian="dense" tolerance="0">'
        f'<flag autoreset="disable" speculative="enable"/></option><worldbody>{bodies}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[:] = [v for disc in scene.discs for v in disc.velocity_m_s]
    return lambda steps: mujoco.mj_step(model, data, nstep=steps), lambda: None


def _box2d(scene: Scene, dt_s: float) -> Loop:
    box2d: Any = importlib.import_module("Box2D")
    world = box2d.b2World(gravity=(0, 0))
    world.continuousPhysics = False
    scale = 2.0**20
    for disc in scene.discs:
        velocity = (disc.velocity_m_s[0] * scale, disc.velocity_m_s[1] * scale)
        body = world.CreateDynamicBody(position=disc.position_m, linearVelocity=velocity, fixedRotation=True)
        body.CreateCircleFixture(radius=disc.radius_m, density=1, friction=0, restitution=1)

    def loop(steps: int) -> None:
        step, scaled_s = world.Step, dt_s / scale
        for _ in range(steps):
            step(scaled_s, 50, 0)

    return loop, lambda: None


#: For each adapter, a function that builds a scene and returns its loop.
LOOPS: Mapping[str, Callable[[Scene, float], Loop]] = {
    "pymunk": _pymunk,
    "pybullet": _pybullet,
    "mujoco": _mujoco,
    "box2d": _box2d,
}
