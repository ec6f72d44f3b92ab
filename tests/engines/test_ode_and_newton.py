"""Unexpected behaviour of ODE and of Newton's XPBD."""

from typing import Any

import pytest
from tests.cases import each
from tests.hazards.measures import DT_S, build_head_on_scene, measure_restitution
from tests.hazards.spread import build_starts

from carom.engines.api import Adapter

#: Starts of each scene.
STARTS = 8


def test_ode_step_below_32_bits_moves_nothing(ode: Adapter) -> None:
    """A step of 1e-300 s, which a bisection may request, neither fails nor moves a disc."""
    scene = build_head_on_scene(5.0)
    world: Any = ode.prepare(scene, ode.profiles["located"].settings(DT_S))
    before = world.observe().position_m
    world.cut(1e-300)
    world.advance(1)
    assert (world.observe().position_m == before).all()
    world.close()


@each("restitution", [0.0, 0.5, 1.0])
def test_newton_needs_enable_restitution(newton: Adapter, restitution: float) -> None:
    """Discs rebound with the scene's restitution; without `enable_restitution` with less than 0.1."""
    for start in build_starts(build_head_on_scene(5.0), STARTS):
        scene = start.model_copy(update={"restitution": restitution})
        assert measure_restitution(newton, scene, "default") == pytest.approx(restitution, abs=1e-5)
        assert 0.0 < measure_restitution(newton, scene, "default", enable_restitution=False) < 0.1


def run_bare_impact(speed_m_s: float, phase: float) -> tuple[float, float]:
    """Return the velocities of two discs of 1 kg without Carom, of which one struck the other at rest."""
    import newton
    import numpy as np
    import warp

    builder, dt_s = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0)), 1 / 60
    for x, velocity in ((-1.0 - speed_m_s * dt_s * (8 + phase), speed_m_s), (0.0, 0.0)):
        at = warp.transform((x, 0.0, 0.0), warp.quat_identity())
        body = builder.add_body(xform=at, mass=1.0, inertia=np.eye(3) * 0.1, lock_inertia=True)
        builder.body_qd[body] = warp.spatial_vector(velocity, 0.0, 0.0, 0.0, 0.0, 0.0)
        shape = builder.ShapeConfig(density=0.0, restitution=1.0, mu=0.0)
        shape.gap = 0.0
        builder.add_shape_sphere(body, radius=0.5, cfg=shape)
    model = builder.finalize(device="cpu")
    pipeline = newton.CollisionPipeline(model)
    contacts, now, then = pipeline.contacts(), model.state(), model.state()
    solver = newton.solvers.SolverXPBD(model, enable_restitution=True)
    for _ in range(20):
        now.clear_forces()
        pipeline.collide(now, contacts, dt=dt_s)
        solver.step(now, then, None, contacts, dt_s)
        now, then = then, now
    first, second = now.body_qd.numpy()[:, 0].tolist()
    return first, second


@each("speed_m_s, least, most", [(4e-4, 4e-5, 5e-5), (1e-3, 4e-5, 5e-5), (1e-2, -1e-5, 1e-5)])
@pytest.mark.usefixtures("newton")
def test_bare_newton_loses_momentum_in_slow_impacts(speed_m_s: float, least: float, most: float) -> None:
    """In bare Newton slow impacts lose up to 0.04 to 0.05 mm/s of momentum over 32 phases; at 10 mm/s none."""
    lost = [speed_m_s - sum(run_bare_impact(speed_m_s, k / 32)) for k in range(32)]
    assert least <= max(lost) < most


@pytest.mark.usefixtures("newton")
def test_newton_plane_that_faces_down_is_not_rotated() -> None:
    """Newton's shape of the plane z = 2 facing down has no rotation, so the adapter gives walls rotated."""
    import newton

    builder = newton.ModelBuilder()
    shape = builder.add_shape_plane((0.0, 0.0, -1.0, 2.0))
    assert list(builder.shape_transform[shape])[3:] == [0.0, 0.0, 0.0, 1.0]
