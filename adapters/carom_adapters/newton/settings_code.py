"""Writes a scene and settings as a program for Newton, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Scene, Setting
from carom_adapters.newton.limits import OF_THE_SOLVER, SPECULATIVE, check_inputs
from carom_adapters.shared.settings_code import count_steps, format_arguments, format_body_lines, format_comment


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same model as `NewtonWorld`.

    Raises:
        AdapterError: Newton does not support the scene or a setting.
    """
    check_inputs(scene, settings)
    gap = f", gap={float(settings['gap'])!r}" if "gap" in settings else ""
    solver = format_arguments({name: value for name, value in settings.items() if name in OF_THE_SOLVER})
    speculative = f", {SPECULATIVE}={settings[SPECULATIVE]!r}" if SPECULATIVE in settings else ""
    (gx, gy), of_walls = scene.gravity_m_s2, 2.0 * scene.wall_restitution - scene.restitution
    return f"""{format_comment(heading)}
import math

import numpy as np
import warp as wp

wp.config.log_level = wp.LOG_ERROR
import newton

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
builder = newton.ModelBuilder(gravity=({gx!r}, 0.0, {gy!r}))  # discs lie in the plane of x and z, and stay in it
places, moved = [], []


def material(restitution):
    return builder.ShapeConfig(density=0.0, restitution=restitution, mu=0.0{gap})


def add_disc(position, radius, mass=None, velocity=(0.0, 0.0)):
    (x, y), (vx, vy) = position, velocity
    at = wp.transform((x, 0.0, y), wp.quat_identity())
    places.append(position)
    if mass is None:
        builder.add_shape_sphere(-1, xform=at, radius=radius, cfg=material({scene.restitution!r}))
        return
    inertia = np.eye(3) * (0.4 * mass * radius**2)
    body = builder.add_body(xform=at, mass=mass, inertia=inertia, lock_inertia=True)
    builder.body_qd[body] = wp.spatial_vector(vx, 0.0, vy, 0.0, 0.0, 0.0)
    builder.add_shape_sphere(body, radius=radius, cfg=material({scene.restitution!r}))
    moved.append(len(places) - 1)


def add_wall(point, normal):
    (x, y), turn = point, math.atan2(*normal) / 2.0
    at = wp.transform((x, 0.0, y), (0.0, math.sin(turn), 0.0, math.cos(turn)))
    # Two coefficients that meet are averaged.
    builder.add_shape_plane(None, xform=at, width=0.0, length=0.0, cfg=material({of_walls!r}))


{format_body_lines(scene)}
model = builder.finalize(device="cpu")
pipeline = newton.CollisionPipeline(model{speculative})
contacts, solver = pipeline.contacts(), newton.solvers.SolverXPBD(model, {solver})
state, after = model.state(), model.state()
for _ in range(steps):
    state.clear_forces()
    pipeline.collide(state, contacts, dt=dt)
    solver.step(state, after, None, contacts, dt)
    state, after = after, state
ends = {{k: (place, velocity) for k, place, velocity in zip(moved, state.body_q.numpy(), state.body_qd.numpy())}}
for k, (x, y) in enumerate(places):
    (x, _, y, *_), (vx, _, vy, *_) = ends.get(k, ((x, 0.0, y), (0.0, 0.0, 0.0)))
    print(float(x), float(y), float(vx), float(vy), 0.0)
"""
