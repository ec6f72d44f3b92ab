"""Scenes of a file in a release of pymunk, MuJoCo, DART or Newton, bare: ``python THIS FOLDER ENGINE SCENES``.

At 32 phases of the step, as JSON: of each scene and phase, places and velocities at the end, and how often the velocity
of a disc turns by more than a hundredth from one step to the next.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

folder, engine, scenes = sys.argv[1:]
sys.path.insert(0, folder)
PHASES, FAR = 32, 100.0

#: x, y and velocity of each disc.
State = list[list[float]]
#: What takes a step, and what reads the state.
World = tuple[Callable[[], object], Callable[[], State]]


def pymunk(scene: dict[str, Any], places: list[list[float]], dt: float) -> World:
    """Build discs as circles and walls as segments 100 m long and thick, as shipped."""
    import pymunk

    space = pymunk.Space()
    bodies = []
    for disc, (x, y) in zip(scene["discs"], places, strict=True):
        body = pymunk.Body(disc["mass_kg"], math.inf)
        vx, vy = disc["velocity_m_s"]
        body.position, body.velocity = (x, y), (vx, vy)
        shape = pymunk.Circle(body, disc["radius_m"])
        shape.elasticity, shape.friction = math.sqrt(scene["restitution"]), 0.0  # the two of a pair are multiplied
        space.add(body, shape)
        bodies.append(body)
    for wall in scene["walls"]:
        (x, y), (nx, ny) = wall["point_m"], wall["normal"]
        middle = (x - FAR * nx, y - FAR * ny)
        first, second = [(middle[0] - side * FAR * ny, middle[1] + side * FAR * nx) for side in (-1, 1)]
        line = pymunk.Segment(space.static_body, first, second, FAR)
        line.elasticity, line.friction = scene["wall_restitution"] / math.sqrt(scene["restitution"]), 0.0
        space.add(line)
    return lambda: space.step(dt), lambda: [[*body.position, *body.velocity] for body in bodies]


def mujoco(scene: dict[str, Any], places: list[list[float]], dt: float) -> World:
    """Build discs as free spheres and walls as planes, with a contact of -1000 that the coefficient damps."""
    mujoco: Any = import_module("mujoco")  # without types

    def contact(restitution: float) -> str:
        # Of a linear oscillator that is let go when it is back: damping over that at which it no longer swings.
        log = math.log(restitution) if restitution else -math.inf
        ratio = -log / math.hypot(math.pi, log) if restitution else 1.0
        return f'solref="-1000 {-2 * ratio * math.sqrt(1000):.17g}" condim="1"'

    bodies = "".join(
        f'<body><freejoint/><geom type="sphere" size="{disc["radius_m"]}" mass="{disc["mass_kg"]}" '
        f"{contact(scene['restitution'])}/></body>"
        for disc in scene["discs"]
    ) + "".join(
        f'<geom type="plane" size="0 0 1" pos="{wall["point_m"][0]} {wall["point_m"][1]} 0" '
        f'zaxis="{wall["normal"][0]} {wall["normal"][1]} 0" priority="1" {contact(scene["wall_restitution"])}/>'
        for wall in scene["walls"]
    )
    option = f'<option timestep="{dt!r}" gravity="0 0 0"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{bodies}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    for k, (disc, place) in enumerate(zip(scene["discs"], places, strict=True)):
        data.qpos[7 * k : 7 * k + 2] = place
        data.qvel[6 * k : 6 * k + 2] = disc["velocity_m_s"]

    def read() -> State:
        rows = zip(data.qpos.reshape(-1, 7), data.qvel.reshape(-1, 6), strict=True)
        return [[*map(float, place[:2]), *map(float, velocity[:2])] for place, velocity in rows]

    return lambda: mujoco.mj_step(model, data), read


def dart(scene: dict[str, Any], places: list[list[float]], dt: float) -> World:
    """Build discs as spheres on slides and walls as planes, as shipped."""
    dartpy: Any = import_module("dartpy")

    def bouncing(node: Any, coefficient: float) -> None:
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.getDynamicsAspect().setRestitutionCoeff(coefficient)
        node.getDynamicsAspect().setFrictionCoeff(0.0)

    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(dt)
    own = math.sqrt(scene["restitution"])  # the two of a pair are multiplied
    discs = []
    for k, (disc, place) in enumerate(zip(scene["discs"], places, strict=True)):
        skeleton = dartpy.dynamics.Skeleton(f"disc {k}")
        _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
        bouncing(body.createShapeNode(dartpy.dynamics.SphereShape(disc["radius_m"])), own)
        body.setMass(disc["mass_kg"])
        world.addSkeleton(skeleton)
        skeleton.setPositions(place)
        skeleton.setVelocities(disc["velocity_m_s"])
        discs.append(skeleton)
    for k, wall in enumerate(scene["walls"]):
        skeleton = dartpy.dynamics.Skeleton(f"wall {k}")
        offset = sum(x * n for x, n in zip(wall["point_m"], wall["normal"], strict=True))
        plane = dartpy.dynamics.PlaneShape([*wall["normal"], 0.0], offset)
        bouncing(skeleton.createWeldJointAndBodyNodePair()[1].createShapeNode(plane), scene["wall_restitution"] / own)
        skeleton.setMobile(False)
        world.addSkeleton(skeleton)
    return world.step, lambda: [[*map(float, disc.getPositions()), *map(float, disc.getVelocities())] for disc in discs]


def newton(scene: dict[str, Any], places: list[list[float]], dt: float) -> World:
    """Build discs as spheres of XPBD on the processor, with its restitution turned on and a `gap` of 0; no walls."""
    import numpy as np
    import warp

    warp.config.log_level = warp.LOG_ERROR
    import newton

    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    shape = builder.ShapeConfig(density=0.0, restitution=scene["restitution"], mu=0.0, gap=0.0)
    for disc, (x, y) in zip(scene["discs"], places, strict=True):
        at, inertia = warp.transform((x, 0.0, y), warp.quat_identity()), 0.4 * disc["mass_kg"] * disc["radius_m"] ** 2
        body = builder.add_body(xform=at, mass=disc["mass_kg"], inertia=np.eye(3) * inertia, lock_inertia=True)
        builder.body_qd[body] = warp.spatial_vector(
            disc["velocity_m_s"][0], 0.0, disc["velocity_m_s"][1], 0.0, 0.0, 0.0
        )
        builder.add_shape_sphere(body, radius=disc["radius_m"], cfg=shape)
    model = builder.finalize(device="cpu")
    pipeline = newton.CollisionPipeline(model)
    contacts, solver = pipeline.contacts(), newton.solvers.SolverXPBD(model, enable_restitution=True)
    states = [model.state(), model.state()]

    def step() -> None:
        states[0].clear_forces()
        pipeline.collide(states[0], contacts)
        solver.step(states[0], states[1], None, contacts, dt)
        states.reverse()

    def read() -> State:
        now = states[0]
        rows: State = np.hstack([now.body_q.numpy()[:, (0, 2)], now.body_qd.numpy()[:, (0, 2)]]).tolist()
        return rows

    return step, read


def run_scene(scene: dict[str, Any], phase: float) -> dict[str, Any]:
    """Run a scene in which each disc is set back by a part of its first step."""
    dt = 1 / scene["frame_rate_hz"]
    moved = [
        [x - phase * dt * v for x, v in zip(disc["position_m"], disc["velocity_m_s"], strict=True)]
        for disc in scene["discs"]
    ]
    build = {"pymunk": pymunk, "mujoco": mujoco, "dart": dart, "newton": newton}[engine]
    step, read = build(scene, moved, dt)
    last, turns = read(), 0
    for _ in range(round(scene["duration_s"] / dt) + 1):
        step()
        now = read()
        pairs = zip(last, now, strict=True)
        turns += sum(math.dist(before[2:], after[2:]) > 0.01 * math.hypot(*before[2:]) for before, after in pairs)
        last = now
    return {"end": last, "turns": turns}


found = {
    scene["name"]: [run_scene(scene, k / PHASES) for k in range(PHASES)]
    for scene in json.loads(Path(scenes).read_text())
}
sys.stdout.write(json.dumps(found) + "\n")
