"""Behaviour of engines from npm except Planck, compared with mechanics."""

import numpy as np
import pytest
from tests.cases import each
from tests.engines.impact_scenes import build_oblique_scene, list_starts, velocities_after_oblique
from tests.hazards.measures import build_head_on_scene
from tests.scene_builders import Drive, Finish, Named

from carom import Disc, Scene

DT_S = 1 / 60


@each("name, limit_m_s", [("box2d3", 400), ("jolt", 500), ("rapier2d", 400), ("rapier", 400)])
def test_default_engines_limit_speeds_with_a_warning(name: str, limit_m_s: float, named: Named, finish: Finish) -> None:
    """A disc that should leave at 600 m/s has the engine's speed limit, and the adapter warns; tuned has none."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(300.3, 0), radius_m=3, mass_kg=1000)
    light = Disc(position_m=(10, 0), radius_m=3, mass_kg=1)
    for scene in list_starts(Scene(name="sling", discs=[heavy, light], duration_s=0.1, frame_rate_hz=240)):
        end = finish(named(name), scene, 1 / 240, "default")
        assert end.velocity_m_s[1, 0] == pytest.approx(limit_m_s, rel=1e-5)
        assert f"{limit_m_s:g} m/s" in end.warning
        tuned = finish(named(name), scene, 1 / 240, "tuned")
        assert tuned.velocity_m_s[1, 0] == pytest.approx(2 * 1000 * 300.3 / 1001, rel=1e-5)


def test_jolt_cast_gives_right_velocities_and_loses_its_step(named: Named, finish: Finish) -> None:
    """After an oblique impact velocities are right to 0.1 %, but the rest of the step is lost and discs lag."""
    for scene in list_starts(build_oblique_scene()):
        end = finish(named("jolt"), scene, DT_S, "swept")
        np.testing.assert_allclose(end.velocity_m_s, velocities_after_oblique(), atol=5e-3)
        before_s = -scene.discs[0].position_m[0] / 5.0
        flight_s = scene.step_count(DT_S) * DT_S - before_s
        lag_m = np.array(velocities_after_oblique()) * flight_s + [[0, 0], [0.8, 0.6]] - end.position_m
        late_s = float((lag_m[1] * velocities_after_oblique()[1]).sum()) / 4.0**2
        assert -1e-5 < late_s < DT_S


def test_cannon_warns_of_a_limited_impulse(named: Named, drive: Drive) -> None:
    """An impulse above cannon's maximum of 1e6 N s is reported as a warning; a smaller one is not."""

    def warned(mass_kg: float) -> bool:
        looks = drive(named("cannon"), build_head_on_scene(5.0, mass_kg=mass_kg), DT_S, "tuned")
        return any("an impulse was cut" in look.warning for look in looks)

    assert warned(1e6)
    assert not warned(1e4)
