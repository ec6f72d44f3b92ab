"""What adapters declare: thresholds, limits, and defaults that are the engine's own."""

from dataclasses import replace

import pytest
from tests.adapters.shipped_settings import OF_ALL, assert_default_is_shipped, measure_largest_difference
from tests.cases import each
from tests.engines.shipped_settings import OF_ENGINES
from tests.scene_builders import Finish, Named, disc_at, staged

from carom import Scene
from carom.engines.api import Adapter, AdapterError, Observation, unsupported_reason
from carom.execution.adapter_profile import capabilities_of


def _build_head_on_scene(closing_m_s: float, restitution: float = 1.0) -> Scene:
    """Two equal discs that close at this speed and touch halfway through the scene."""
    gap = 0.5
    discs = disc_at(0, 0, closing_m_s / 2), disc_at(1 + gap, 0, -closing_m_s / 2)
    return staged("head-on", *discs, restitution=restitution, duration_s=2 * gap / closing_m_s)


def _measure_restitution(end: Observation, closing_m_s: float) -> float:
    return float(end.velocity_m_s[1, 0] - end.velocity_m_s[0, 0]) / closing_m_s


@each("name, profile", [("pybullet", "default"), ("box2d", "default"), ("box2d", "tuned")])
def test_contacts_below_the_restitution_threshold_are_inelastic(
    named: Named, finish: Finish, name: str, profile: str
) -> None:
    """A contact bounces just above the declared closing speed, and not below, where it is unsupported."""
    adapter = named(name)
    capabilities = capabilities_of(adapter, profile)
    threshold = capabilities.restitution_threshold_m_s
    found = []
    for closing in (0.9 * threshold, 1.1 * threshold):
        scene = _build_head_on_scene(closing)
        found.append(_measure_restitution(finish(adapter, scene, scene.duration_s / 256, profile), closing))
    # PyBullet as shipped adds up to a few percent to a bounce, and Box2D's positions are corrected.
    assert found[0] < 0.5 < found[1]
    assert "inelastic" in unsupported_reason(_build_head_on_scene(0.9 * threshold), capabilities, 1 / 60)
    assert not unsupported_reason(_build_head_on_scene(1.1 * threshold), capabilities, 1 / 60)
    assert not unsupported_reason(_build_head_on_scene(0.9 * threshold, restitution=0.0), capabilities, 1 / 60)


def test_pybullet_multibody_speed_is_clamped_as_declared(pybullet: Adapter, finish: Finish) -> None:
    """A disc of 200 m/s is clamped to 100 m/s, and unsupported, by default; not with maximal coordinates."""
    capped = capabilities_of(pybullet, "default")
    scene = staged("free", disc_at(0, 0, 200, r=1), duration_s=0.1)
    assert finish(pybullet, scene, 1 / 100, "default").velocity_m_s.tolist() == [[capped.max_speed_m_s, 0]]
    assert finish(pybullet, scene, 1 / 100, useMaximalCoordinates=False).velocity_m_s.tolist() == [[100, 0]]
    assert finish(pybullet, scene, 1 / 100).velocity_m_s.tolist() == [[200, 0]]
    assert "limit is 100 m/s" in unsupported_reason(scene, capped, 1 / 100)
    assert not unsupported_reason(scene, capabilities_of(pybullet, "tuned"), 1 / 100)


@each(
    "name, mass_kg, friction, said",
    [
        ("pybullet", 1.0, 10.1, r"friction is 10\.1, and this method simulates only 0 to 10 exactly"),
        ("mujoco", 1.0, 1e-6, "friction is 1e-06, and this method simulates only 1e-05 to"),
        ("box2d", 1e-30, 0.0, r"discs\[0\]\.mass_kg is 1e-30, and this method simulates"),
        ("mujoco", 1e12, 0.0, r"discs\[0\]\.mass_kg is 1e\+12, and this method simulates"),
    ],
)
def test_numbers_beyond_engine_limits_are_refused_by_name(
    named: Named, name: str, mass_kg: float, friction: float, said: str
) -> None:
    """A number that the engine would clamp or lose is refused with its field and the supported range."""
    adapter = named(name)
    scene = staged("pair", disc_at(0, 0, m=mass_kg), disc_at(3, 0), friction=friction, duration_s=1.0)
    with pytest.raises(AdapterError, match=said):
        adapter.prepare(scene, adapter.profiles["tuned"].settings(1 / 60))


def test_positions_beyond_float_resolution_are_unsupported(engine: Adapter) -> None:
    """A scene whose positions round by more than a disc's radius is reported as unsupported."""
    radius = {32: 1.0, 64: 1e-8}[engine.capabilities.float_bits]
    far = staged("far", disc_at(1e8, 0, r=radius), duration_s=1)
    assert "bit floats round by more" in unsupported_reason(far, replace(engine.capabilities, min_radius_m=0.0), 1 / 60)


@each("name", [*OF_ALL, *(pytest.param(name, marks=pytest.mark.engines) for name in OF_ENGINES)])
def test_default_profile_equals_the_bare_engine(name: str, named: Named) -> None:
    """Default differs from the engine's defaults only in listed values, and ends where the bare engine does."""
    adapter = named(name)
    shipped = (OF_ALL | OF_ENGINES)[name]()
    assert_default_is_shipped(adapter, shipped)
    assert measure_largest_difference(adapter, shipped) <= shipped.roundings
