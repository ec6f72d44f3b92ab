"""What cutting steps at the engine's own contact test is worth."""

import math

import numpy as np
import pytest
from tests.adapters.engine_scenes import scale_tolerance
from tests.cases import each
from tests.scene_builders import Named, disc_at, staged

from carom import Chain, solve_pic
from carom.catalogue import catalogue
from carom.engines.api import Adapter, CuttableWorld
from carom.execution.observation.engine_run import observe_run


@each("dt_s", [1 / 10, 1 / 60])
def test_located_impact_does_not_depend_on_the_step(engine: Adapter, dt_s: float) -> None:
    """At steps of 1/10 and 1/60 s the located impact is at 0.42 s, after fewer than 60 probes."""
    found = observe_run(engine, catalogue()["classics/oblique-3-4-5"].scene, "located", dt_s)
    # Its own sum of up to 75 steps, each rounded at 1 s or 4 m.
    near = scale_tolerance(engine, 75 * float(np.spacing(4.0)))
    assert found.impacts["time_s"].tolist() == pytest.approx([0.42], abs=near)
    assert found.counts["probes"] < 60 * len(found.impacts)


@each("half_width_m", [0.0, 0.1])
def test_located_impact_with_an_edge_has_its_exact_time(engine: Adapter, half_width_m: float) -> None:
    """A disc bounces off a thin or thick edge at the instant at which it touches the edge."""
    edge = Chain(points_m=[(0.0, -5.0), (0.0, 5.0)], half_width_m=half_width_m)
    scene = staged("edge", disc_at(-2.0, 0.0, 3.0, 1.0), edge, duration_s=1.0)
    found = observe_run(engine, scene, "located", 1 / 60)
    near = scale_tolerance(engine, 1e-12)
    assert found.impacts["time_s"].tolist() == pytest.approx([(1.5 - half_width_m) / 3.0], abs=near)
    np.testing.assert_allclose(found.final_velocity_m_s, [(-3.0, 1.0)], rtol=0, atol=near)


def test_located_profile_still_tunnels_between_two_steps(engine: Adapter) -> None:
    """A disc that passes its target within one step is missed by the located profile, too."""
    scene = staged("through", disc_at(-0.5, 0, 60, r=0.05), disc_at(0, 0, r=0.05), duration_s=0.1)
    assert len(solve_pic(scene).impacts) == 1
    assert len(observe_run(engine, scene, "located", 1 / 60).impacts) == 0


def test_mujoco_detects_shallow_contacts_only_of_listed_pairs(named: Named) -> None:
    """MuJoCo's broad phase misses overlaps below 32-bit rounding, unless the pairs are listed in the model."""
    mujoco, scene = named("mujoco"), catalogue()["classics/box"].scene
    disc = scene.discs[0]
    depths = []
    for listed in (False, True):
        world = mujoco.prepare(scene, {**mujoco.profiles["located"].settings(1 / 60), "listed_pairs": listed})
        assert isinstance(world, CuttableWorld)
        height, end_s = 1.6 - disc.radius_m, (1.6 - disc.radius_m - disc.position_m[1]) / disc.velocity_m_s[1]
        low, high = end_s * (1 - 1e-5), end_s * (1 + 1e-5)
        start = world.save()
        for _ in range(60):
            middle = (low + high) / 2
            world.restore(start)
            world.cut(middle)
            world.advance(1)
            low, high = (low, middle) if world.touching() else (middle, high)
        depths.append(disc.position_m[1] + disc.velocity_m_s[1] * high - height)
        world.close()
    assert 1e-9 < depths[0] < 1e-6
    assert depths[1] < 4 * math.ulp(1.6)
