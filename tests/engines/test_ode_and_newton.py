"""What ODE and Newton's XPBD do that a user would not expect, by laws of mechanics, their manual and their tests."""

import unittest
from typing import Any

import pytest
from tests.cases import each
from tests.hazards.measures import DT_S, build_head_on_scene, measure_restitution
from tests.hazards.spread import build_starts

from carom import Disc, Scene, Wall
from carom.engines.api import Adapter

#: Starts of each scene.
STARTS = 8


def build_heap_scene() -> Scene:
    """Thirty discs stacked edge to edge fall on a floor: contacts that share discs."""
    return Scene(
        name="heap",
        discs=[Disc(position_m=(x, y), radius_m=0.5) for x in range(6) for y in range(2, 7)],
        walls=[Wall(point_m=(0, 0), normal=(0, 1))],
        gravity_m_s2=(0.0, -9.81),
        restitution=0.5,
        wall_restitution=0.5,
        duration_s=1.0,
    )


@each("mass_kg", [1.0, 10.0, 100.0])
def test_ode_softness_follows_its_manual(ode: Adapter, mass_kg: float) -> None:
    """ODE solves J v + CFM / h λ = c for J v = c: impulses are right over 1 + CFM / (h Σ 1/m)."""
    softness = 1e-5 / DT_S / (2 / mass_kg)
    expected = 2 / (1 + softness) - 1
    for scene in build_starts(build_head_on_scene(5.0, mass_kg=mass_kg), STARTS):
        assert measure_restitution(ode, scene, "default") == pytest.approx(
            expected, rel=1e-5
        )  # some roundings of 32 bits


def test_ode_heap_stays_in_the_plane_to_the_bit(ode: Adapter) -> None:
    """After 60 steps of a heap of 30 discs in ODE all third coordinates and velocities are exactly 0."""
    world: Any = ode.prepare(build_heap_scene(), ode.profiles["default"].settings(DT_S))
    world.advance(60)
    assert all(body.getPosition()[2] == 0.0 == body.getLinearVel()[2] for body in world._bodies)  # noqa: SLF001 - ODE's own
    world.close()


def test_ode_step_below_32_bits_moves_nothing(ode: Adapter) -> None:
    """A step of 1e-300 s, which a bisection may request, neither fails nor moves a disc."""
    scene = build_head_on_scene(5.0)
    world: Any = ode.prepare(scene, ode.profiles["located"].settings(DT_S))
    before = world.observe().position_m
    world.cut(1e-300)
    world.advance(1)
    assert (world.observe().position_m == before).all()
    world.close()


@pytest.mark.parametrize(
    ("case", "settings"),
    [
        ("test_free_fall", {}),
        ("test_momentum_conservation", {}),
        ("test_restitution", {"iterations": 10, "enable_restitution": True}),
        ("test_restitution", {"enable_restitution": True}),
    ],
)
@pytest.mark.usefixtures("newton")
def test_newtons_own_verification_passes(case: str, settings: dict[str, Any]) -> None:
    """Newton's own tests of fall, momentum and bounce heights pass on the CPU."""
    import warp
    from newton.solvers import SolverXPBD
    from newton.tests import test_physics_verification as own

    more = {"uses_generalized_coords": False} if case == "test_momentum_conservation" else {}
    solver = lambda model: SolverXPBD(model, angular_damping=0.0, **settings)  # noqa: E731 - as Newton's tests have it
    getattr(own, case)(unittest.TestCase(), warp.get_device("cpu"), solver, **more)


@each("restitution", [0.0, 0.5, 1.0])
def test_newton_needs_enable_restitution(newton: Adapter, restitution: float) -> None:
    """Discs rebound with the scene's restitution; without `enable_restitution` with less than 0.1."""
    for start in build_starts(build_head_on_scene(5.0), STARTS):
        scene = start.model_copy(update={"restitution": restitution})
        assert measure_restitution(newton, scene, "default") == pytest.approx(restitution, abs=1e-5)
        assert 0.0 < measure_restitution(newton, scene, "default", enable_restitution=False) < 0.1


def test_newton_discs_stay_in_the_plane_to_the_bit(newton: Adapter) -> None:
    """Discs that fall into a slanted corner in Newton stay in the plane, to the bit."""
    scene = Scene(
        name="corner",
        discs=[Disc(position_m=(x, y), radius_m=0.3) for x in (1, 2, 3) for y in (1, 2, 3)],
        walls=[Wall(point_m=(0, 0), normal=(0.6, 0.8)), Wall(point_m=(4, 0), normal=(-0.8, 0.6))],
        gravity_m_s2=(0.0, -9.81),
        duration_s=1.0,
    )
    world: Any = newton.prepare(scene, newton.profiles["default"].settings(DT_S))
    world.advance(60)
    assert (world._state.body_q.numpy()[:, 1] == 0.0).all()  # noqa: SLF001 - Newton's own
    assert (world._state.body_qd.numpy()[:, 1] == 0.0).all()  # noqa: SLF001
    world.close()


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


@pytest.mark.parametrize(("speed_m_s", "least", "most"), [(4e-4, 4e-5, 5e-5), (1e-3, 4e-5, 5e-5), (1e-2, -1e-5, 1e-5)])
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
