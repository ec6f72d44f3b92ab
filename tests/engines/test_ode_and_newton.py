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


@pytest.mark.usefixtures("newton")
def test_newton_plane_that_faces_down_is_not_rotated() -> None:
    """Newton's shape of the plane z = 2 facing down has no rotation, so the adapter gives walls rotated."""
    import newton

    builder = newton.ModelBuilder()
    shape = builder.add_shape_plane((0.0, 0.0, -1.0, 2.0))
    assert list(builder.shape_transform[shape])[3:] == [0.0, 0.0, 0.0, 1.0]
