"""What adapters declare and observe: positions, velocities, spins, steps and motion on legs."""

import importlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.adapters import bare_impacts
from tests.adapters.engine_scenes import scale_tolerance
from tests.adapters.shipped_settings import OF_ALL, assert_default_is_shipped, measure_largest_difference
from tests.cases import each
from tests.engines.shipped_settings import OF_ENGINES
from tests.scene_builders import Drive, Finish, Named, disc_at, staged

from carom import Disc, Scene
from carom.engines.api import Adapter, AdapterError, Observation, StepClock, unsupported_reason
from carom.execution.adapter_profile import capabilities_of
from carom.model.walls import Leg
from carom_adapters.shared.legs import Legs


def _build_head_on_scene(closing_m_s: float, restitution: float = 1.0) -> Scene:
    """Two equal discs that close at this speed and touch halfway through the scene."""
    gap = 0.5
    discs = disc_at(0, 0, closing_m_s / 2), disc_at(1 + gap, 0, -closing_m_s / 2)
    return staged("head-on", *discs, restitution=restitution, duration_s=2 * gap / closing_m_s)


def _measure_restitution(end: Observation, closing_m_s: float) -> float:
    return float(end.velocity_m_s[1, 0] - end.velocity_m_s[0, 0]) / closing_m_s


@each(
    "name, throw, expected",
    [
        ("pymunk", bare_impacts.pymunk, 0.5 * 0.8),
        ("pybullet", bare_impacts.pybullet, 0.5 * 0.8),
        ("box2d", bare_impacts.box2d, max(0.5, 0.8)),
    ],
)
def test_engines_combine_restitutions_as_documented(
    named: Named, name: str, throw: Callable[[bare_impacts.Thrown], bare_impacts.Left], expected: float
) -> None:
    """Of restitutions 0.5 and 0.8 pymunk and PyBullet use the product, and Box2D the larger."""
    named(name)
    for given in ((0.5, 0.8), (0.8, 0.5)):
        _, leaves, _ = throw(bare_impacts.Thrown(velocity=(0.0, -2.0), restitutions=given))
        assert leaves / 2.0 == pytest.approx(expected, abs=1e-6)  # half a dozen roundings of 32 bits


def test_mujoco_has_no_restitution_coefficient(named: Named) -> None:
    """No attribute of MuJoCo's model is named restitution: its contacts are springs and dampers."""
    named("mujoco")
    assert not [name for name in dir(importlib.import_module("mujoco").MjModel) if "restitution" in name]


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


@each("profile", ["default", "tuned"])
def test_engines_without_a_threshold_bounce_at_1_mm_per_s(engine: Adapter, finish: Finish, profile: str) -> None:
    """Without a declared threshold, discs that close at 1 mm/s rebound with restitution 1."""
    if capabilities_of(engine, profile).restitution_threshold_m_s > 1e-3:
        pytest.skip("declares a threshold above that")
    scene = _build_head_on_scene(1e-3)
    restitution = _measure_restitution(finish(engine, scene, scene.duration_s / 1024, profile), 1e-3)
    # MuJoCo as shipped has a spring of period 0.2 s, which steps of 1 s can't follow: any bounce will do there.
    if not (engine.name == "mujoco" and profile == "default"):
        assert restitution == pytest.approx(1, abs=scale_tolerance(engine, 1e-8))


def test_pybullet_multibody_speed_is_clamped_as_declared(pybullet: Adapter, finish: Finish) -> None:
    """A disc of 200 m/s is clamped to 100 m/s, and unsupported, by default; not with maximal coordinates."""
    capped = capabilities_of(pybullet, "default")
    scene = staged("free", disc_at(0, 0, 200, r=1), duration_s=0.1)
    assert finish(pybullet, scene, 1 / 100, "default").velocity_m_s.tolist() == [[capped.max_speed_m_s, 0]]
    assert finish(pybullet, scene, 1 / 100, useMaximalCoordinates=False).velocity_m_s.tolist() == [[100, 0]]
    assert finish(pybullet, scene, 1 / 100).velocity_m_s.tolist() == [[200, 0]]
    assert "limit is 100 m/s" in unsupported_reason(scene, capped, 1 / 100)
    assert not unsupported_reason(scene, capabilities_of(pybullet, "tuned"), 1 / 100)


def test_box2d_motion_limit_is_reported(named: Named, drive: Drive) -> None:
    """A disc made faster than 2 m a step is moved by 2 m, with a warning; such a start is refused."""
    box2d, dt_s = named("box2d"), 1 / 10
    limit = box2d.capabilities.max_move_m
    # A heavy disc at 1.6 m a step throws a light one forward at nearly twice its speed.
    thrown = staged("thrown", disc_at(0, 0, 16, r=5, m=1000), disc_at(7, 0, r=1), duration_s=1.0)
    assert not unsupported_reason(thrown, box2d.capabilities, dt_s)
    seen = drive(box2d, thrown, dt_s)
    assert f"limits motion to {limit:g} m per step" in seen[-1].warning
    moved = np.abs(np.diff([state.position_m[1, 0] for state in seen])).max()
    assert moved == pytest.approx(limit, rel=1e-6)
    fast = staged("fast", disc_at(0, 0, 21, r=1), duration_s=1)
    assert "moves discs by at most 2 m" in unsupported_reason(fast, box2d.capabilities, dt_s)
    with pytest.raises(AdapterError, match="moves discs by at most 2 m"):
        box2d.prepare(fast, box2d.profiles["tuned"].settings(dt_s))


def test_declared_float_width_is_the_actual_one(engine: Adapter) -> None:
    """The engine holds 0.1 as the nearest float of the declared width, and of no other width."""
    scene = staged("tenth", disc_at(0.1, 0, 0.1, r=1), duration_s=1)
    world = engine.prepare(scene, engine.profiles["tuned"].settings(1 / 60))
    start = world.observe()
    world.close()
    other = {32: np.float64, 64: np.float32}[engine.capabilities.float_bits]
    for value in (start.position_m[0, 0], start.velocity_m_s[0, 0]):
        assert value == {32: np.float32, 64: np.float64}[engine.capabilities.float_bits](0.1)
        assert value != other(0.1)


@each("mass_kg", [1e-120, 1e-30, 1e30, 1e120])
def test_mass_beyond_declared_limits_is_unsupported(engine: Adapter, mass_kg: float) -> None:
    """A mass outside the declared limits is reported as unsupported, with the mass and the field."""
    capabilities = engine.capabilities
    discs = [disc_at(x, 0.0, m=mass_kg) for x in (0.0, 3.0)]
    reason = unsupported_reason(staged("pair", *discs, duration_s=1.0), capabilities, 1 / 60)
    within = capabilities.min_mass_kg <= mass_kg <= capabilities.max_mass_kg
    assert reason == "" if within else reason.startswith(f"discs[0].mass_kg is {mass_kg:g}, and this method simulates")


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


# Starts of the legs of engines' driven bodies -------------------------------------------------------------------------


def test_steps_are_split_only_while_legs_are_pending() -> None:
    """Steps are taken one at a time while a leg may begin, and the rest, or all without legs, in one call."""
    legs = Legs[str]()
    assert [*legs.split_steps(5, StepClock(1.0))] == [(5, ())]
    path = (Leg(from_s=0.0, velocity_m_s=(1.0, 0.0)), Leg(from_s=2.0, velocity_m_s=(0.0, 1.0)))
    legs.add("paddle", Disc(position_m=(0.0, 0.0), radius_m=1.0, mass_kg=float("inf"), driven=True, legs=path))
    clock = StepClock(1.0)
    turn = [("paddle", (0.0, 1.0))]
    assert [*legs.split_steps(5, clock)] == [(1, []), (1, []), (1, turn), (2, [])]
    assert clock.now_s == 5.0
