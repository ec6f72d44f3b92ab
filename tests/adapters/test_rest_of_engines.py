"""Discs that bounce out, roll on and are held: what each engine makes of it, from eight starts each."""

import importlib
import itertools
import math
from typing import Any

import numpy as np
import pytest
from tests.adapters.falling_balls import (
    RADIUS_M,
    STARTS,
    G,
    build_floor_scene,
    list_hopping_balls,
    measure_speeds_at_rest,
)
from tests.cases import each, release_after
from tests.scene_builders import Finish, Named, disc_at, require_value

from carom import Disc
from carom.engines.api import Adapter, AdapterError, Observation, Setting

RATES_HZ = [60.0, 240.0]


@each(
    "name, rate_hz, e, share",
    [
        *release_after(0, itertools.product(("mujoco", "pybullet", "pymunk"), RATES_HZ, (0.0, 0.5, 0.9), (0.01,))),
        *(
            pytest.param(name, 60.0, e, 1e-3, marks=pytest.mark.engines)
            for name in ("cannon", "jolt", "p2", "box2d3", "rapier", "rapier2d")
            for e in ((0.0, 0.5, 0.9) if name in {"box2d3", "rapier", "rapier2d"} else (0.5,))
        ),
    ],
)
def test_ball_comes_to_rest_with_tuned_settings(
    named: Named, name: str, rate_hz: float, e: float, share: float
) -> None:
    """After its bounces a ball moves by at most 1 % (optional engines 0.1 %) of what it falls in a step."""
    for speeds in measure_speeds_at_rest(named(name), "tuned", rate_hz, e):
        assert float(np.abs(speeds).max()) <= share * G / rate_hz


@pytest.mark.engines
@each("name, threshold", [("planck", "velocityThreshold"), ("physx", "bounceThresholdVelocity")])
def test_tuned_planck_and_physx_hop_for_ever_without_a_threshold(named: Named, name: str, threshold: str) -> None:
    """At 60 steps per second all balls keep hopping; with a bounce threshold of three steps' fall none does."""
    assert all(list_hopping_balls(measure_speeds_at_rest(named(name), "tuned", 60.0), 60.0))
    assert not any(speeds.any() for speeds in measure_speeds_at_rest(named(name), "tuned", 60.0, **{threshold: 0.5}))


@pytest.mark.long
@each("rate_hz", RATES_HZ)
def test_box2d_hops_when_tuned_and_rests_with_its_resting_profile(box2d: Adapter, rate_hz: float) -> None:
    """Tuned Box2D keeps hopping from all starts; with the profile `resting` no ball moves."""
    assert all(list_hopping_balls(measure_speeds_at_rest(box2d, "tuned", rate_hz), rate_hz))
    assert not any(speeds.any() for speeds in measure_speeds_at_rest(box2d, "resting", rate_hz))


@each("e", [0.0, 0.3, 0.6])
def test_resting_profile_of_box2d_keeps_the_first_bounce(named: Named, e: float) -> None:
    """The first bounce with the profile `resting` equals the tuned one, and returns e of the speed."""
    box2d, height, rate_hz = named("box2d"), 1.0, 240.0
    scene = build_floor_scene(Disc(position_m=(0, RADIUS_M + height), radius_m=RADIUS_M), 1.0, e=e)
    after = {}
    for profile in ("tuned", "resting"):
        world = box2d.prepare(scene, box2d.profiles[profile].settings(1 / rate_hz))
        world.advance(round(math.sqrt(2.0 * height / G) * rate_hz) + 2)
        after[profile] = float(world.observe().velocity_m_s[0, 1])
        world.close()
    assert after["resting"] == pytest.approx(after["tuned"], abs=1e-5 * math.sqrt(2.0 * G * height))
    assert after["resting"] == pytest.approx(e * math.sqrt(2.0 * G * height), abs=3.0 * G / rate_hz)


@pytest.mark.long
@each("e, lasts", [(0.5, False), (0.9, True)])
def test_default_box2d_hops_for_ever_at_high_restitution(named: Named, e: float, lasts: bool) -> None:
    """At e = 0.9 a ball in default Box2D hops on at ``g dt / (1 - e)``, more than 1 m/s; at e = 0.5 not."""
    speeds = measure_speeds_at_rest(named("box2d"), "default", 60.0, e)
    assert {float(of_start.max()) > 1.0 for of_start in speeds} == {lasts}


@pytest.mark.long
def test_pybullet_multibodies_hop_for_ever_below_a_threshold(named: Named) -> None:
    """PyBullet's multibodies hop on if the restitution threshold is below 1.25 steps' fall, as by default."""
    pybullet, own = named("pybullet"), {"useMaximalCoordinates": False}
    assert all(list_hopping_balls(measure_speeds_at_rest(pybullet, "default", 60.0), 60.0))
    for rate_hz in RATES_HZ:
        for threshold in (0.0, 1.25 * G / rate_hz):
            changes = own | {"restitutionVelocityThreshold": threshold}
            assert all(list_hopping_balls(measure_speeds_at_rest(pybullet, "tuned", rate_hz, **changes), rate_hz))
        changes = own | {"restitutionVelocityThreshold": 2.5 * G / rate_hz}
        assert not any(speeds.any() for speeds in measure_speeds_at_rest(pybullet, "tuned", rate_hz, **changes))


def _run_rolling_disc(
    finish: Finish, engine: Adapter, profile: str, speed: float, seconds: float, **changes: Setting
) -> Observation:
    """Return where a disc is, at 60 steps per second, that starts in rolling."""
    disc = Disc(position_m=(0, RADIUS_M), velocity_m_s=(speed, 0), radius_m=RADIUS_M, spin_rad_s=-speed / RADIUS_M)
    return finish(engine, build_floor_scene(disc, seconds, friction=0.5), 1 / 60, profile, **changes)


@each("name", ["mujoco", "pybullet", "pymunk"])
def test_slowly_rolling_disc_keeps_rolling(named: Named, finish: Finish, name: str) -> None:
    """A disc that rolls at 5 to 10 mm/s has the right position after 10 s, to 0.1 %."""
    for speed in np.linspace(0.005, 0.01, STARTS).tolist():
        end = _run_rolling_disc(finish, named(name), "default", speed, 10.0)
        assert end.position_m[0, 0] == pytest.approx(10.0 * speed, rel=1e-3)


def test_box2d_sleep_stops_slowly_rolling_discs(named: Named, finish: Finish) -> None:
    """With sleeping allowed Box2D stops a disc slower than 1 cm/s after 0.5 s; profiles keep it awake."""
    for speed in np.linspace(0.005, 0.0085, STARTS).tolist():
        end = _run_rolling_disc(finish, named("box2d"), "default", speed, 10.0, sleepingAllowed=True)
        assert end.position_m[0, 0] == pytest.approx(0.5 * speed, rel=0.01)
        assert end.velocity_m_s[0, 0] == 0.0
        awake = _run_rolling_disc(finish, named("box2d"), "default", speed, 10.0)
        assert awake.position_m[0, 0] == pytest.approx(10.0 * speed, rel=0.01)


@pytest.mark.engines
@each(
    "name, sleeps, fastest",
    [("rapier", "can_sleep", 0.06), ("rapier2d", "canSleep", 0.06), ("box2d3", "enableSleep", 0.045)],
)
def test_default_sleep_stops_slowly_sliding_discs(
    named: Named, finish: Finish, name: str, sleeps: str, fastest: float
) -> None:
    """With sleep enabled an engine stops a slowly sliding disc after 0.5 s; profiles keep it awake."""
    for speed in np.linspace(0.005, fastest, STARTS).tolist():
        scene = build_floor_scene(Disc(position_m=(0, RADIUS_M), velocity_m_s=(speed, 0), radius_m=RADIUS_M), 10.0)
        asleep = finish(named(name), scene, 1 / 60, "default", **{sleeps: True}).position_m[0, 0]
        assert asleep == pytest.approx(0.5 * speed, rel=0.05)
        awake = finish(named(name), scene, 1 / 60, "default").position_m[0, 0]
        assert awake == pytest.approx(10.0 * speed, rel=1e-3)


@pytest.mark.long
@each(
    "name, profile, slip",
    [
        ("box2d", "default", -0.005),
        ("box2d", "tuned", 0.0),
        ("mujoco", "tuned", -0.0028),
        ("pybullet", "default", 0.0),
        ("pymunk", "default", 0.0),
    ],
)
def test_slip_of_rolling_discs_is_as_documented(
    named: Named, finish: Finish, name: str, profile: str, slip: float
) -> None:
    """Default Box2D rolls with a slip of 0.5 %, tuned MuJoCo 0.28 %, and the others without slip."""
    for speed in np.linspace(1.5, 3.0, STARTS).tolist():
        end = _run_rolling_disc(finish, named(name), profile, speed, 2.0)
        found = (end.velocity_m_s[0, 0] + RADIUS_M * require_value(end.spin_rad_s)[0]) / speed
        assert found == pytest.approx(slip, abs=1e-4)


@pytest.mark.long
def test_pybullet_default_damping_slows_rolling_discs(named: Named, finish: Finish) -> None:
    """PyBullet's own damping leaves a rolling disc a third of its speed after 10 s; the profile sets it to 0."""
    for speed in np.linspace(1.75, 2.25, STARTS).tolist():
        damping = {"linearDamping": 0.04, "angularDamping": 0.04}
        end = _run_rolling_disc(finish, named("pybullet"), "default", speed, 10.0, **damping)
        assert 0.3 < end.velocity_m_s[0, 0] / speed < 0.4
        undamped = _run_rolling_disc(finish, named("pybullet"), "default", speed, 10.0)
        assert undamped.velocity_m_s[0, 0] == pytest.approx(speed, rel=1e-9)


@pytest.mark.long
@each(
    "name, profile, least, most",
    [
        ("mujoco", "default", 1.5e-3, 10e-3),
        ("mujoco", "tuned", 5e-6, 25e-6),
        ("pymunk", "default", 0.0, 1e-15),
        ("pybullet", "default", 0.0, 1e-15),
        ("box2d", "default", 0.0, 1e-15),
    ],
)
def test_discs_held_by_friction_creep_in_mujoco(
    named: Named, finish: Finish, name: str, profile: str, least: float, most: float
) -> None:
    """On slopes that friction holds, only MuJoCo creeps: by 1.5 to 10 mm/s, or micrometres when tuned."""
    for fall in np.linspace(0.1, 0.28, STARTS).tolist():
        disc = Disc(position_m=(0, RADIUS_M), radius_m=RADIUS_M, inertia_factor=math.inf)
        end = finish(named(name), build_floor_scene(disc, 2.5, fall=fall, friction=0.3), 1 / 240, profile)
        assert least <= abs(end.position_m[0, 0]) / 2.5 <= most


@pytest.mark.long
@each("profile", ["default", "tuned"])
def test_pybullet_rolling_resistance_follows_the_law(named: Named, finish: Finish, profile: str) -> None:
    """Rolling resistance leaves ``v - c g t / (1 + k)``, from 8 speeds; a disc that stopped stays at rest."""
    for speed, resists in zip(np.linspace(1.5, 3.0, STARTS), np.linspace(0.01, 0.2, STARTS), strict=True):
        disc = disc_at(0, RADIUS_M, speed, r=RADIUS_M, spin_rad_s=-speed / RADIUS_M)
        law = {"wall_rolling_resistance": float(resists)}
        scene = build_floor_scene(disc, 1.0, friction=0.5).model_copy(update=law)
        end = finish(named("pybullet"), scene, 1 / 240, profile)
        assert end.velocity_m_s[0, 0] == pytest.approx(speed - resists * G / 1.5, abs=2e-4)
        slow = scene.model_copy(update={"duration_s": 1.5 * speed / (resists * G) + 1.0})
        assert abs(finish(named("pybullet"), slow, 1 / 240, profile).velocity_m_s[0, 0]) < 2e-4


def test_pybullet_refuses_rolling_resistance_with_unequal_radii(named: Named) -> None:
    """A wall has one rolling torque for all discs, so discs of unequal radii are refused with their radii."""
    discs = [Disc(position_m=(3.0 * k, 0.5 + 0.1 * k), radius_m=0.5 + 0.1 * k) for k in range(2)]
    scene = build_floor_scene(discs[0], 1.0, friction=0.5)
    scene = scene.model_copy(update={"discs": tuple(discs), "wall_rolling_resistance": 0.1})
    with pytest.raises(AdapterError, match=r"radii are 0\.5 to 0\.6 m"):
        named("pybullet").prepare(scene, named("pybullet").profiles["tuned"].settings(1 / 60))


RATE_HZ = 240.0
#: As shipped, and what makes its friction most exact.
EXACT = 'cone="elliptic" noslip_iterations="20" integrator="implicitfast"'
OPTIONS = {"shipped": "", "exact": EXACT}


def measure_mujoco_speed(
    options: str, friction: float, resists: float, seconds: float, *, tangent: float, speed: float
) -> float:
    """Return how fast a disc (k = 1/2) is along a slope that begins rolling; `friction[2]` is in metres, c R."""
    engine: Any = importlib.import_module("mujoco")
    long, moment = math.hypot(1.0, tangent), 0.5 * RADIUS_M**2
    model = engine.MjModel.from_xml_string(f"""
<mujoco><option timestep="{1 / RATE_HZ}" gravity="{G * tangent / long} {-G / long} 0" {options}/><worldbody>
  <geom type="plane" size="0 0 1" zaxis="0 1 0" condim="6" friction="{friction} 0 {resists * RADIUS_M}" priority="1"
    solref="-1000 {-2 * math.sqrt(1000)}"/>
  <body pos="0 {RADIUS_M} 0"><inertial pos="0 0 0" mass="1" diaginertia="{moment} {moment} {moment}"/>
    <freejoint/><geom type="sphere" size="{RADIUS_M}"/></body></worldbody></mujoco>""")
    data = engine.MjData(model)
    data.qvel[0], data.qvel[5] = speed, -speed / RADIUS_M
    engine.mj_step(model, data, nstep=round(seconds * RATE_HZ))
    return float(data.qvel[0])


@pytest.mark.long
@each("options, least, most", [("shipped", 1.2, 5.6), ("exact", 0.15, 3.4)])
def test_mujoco_slips_where_friction_and_resistance_should_hold(options: str, least: float, most: float) -> None:
    """On slopes that the law holds with friction 0.8 and resistance 2 % above the slope, MuJoCo's disc slips."""
    for tangent in np.linspace(0.3, 0.79, STARTS).tolist():
        slipped = measure_mujoco_speed(OPTIONS[options], 0.8, 1.02 * tangent, 2.0, tangent=tangent, speed=0.0)
        assert least < slipped < most


@pytest.mark.long
@each("options, least, most", [("shipped", 0.70, 0.96), ("exact", 0.93, 1.001)])
def test_mujoco_rolling_resistance_is_weaker_than_the_law(options: str, least: float, most: float) -> None:
    """MuJoCo's rolling resistance is a part of c g / (1 + k), and a smaller part for larger resistance."""
    speeds, resistances = np.linspace(1.5, 2.9, STARTS).tolist(), np.linspace(0.01, 0.15, STARTS).tolist()
    parts = []
    for speed, resists in zip(speeds, resistances, strict=True):
        left = measure_mujoco_speed(OPTIONS[options], 0.5, resists, 1.0, tangent=0.0, speed=speed)
        parts.append((speed - left) / (resists * G / 1.5))
    assert all(least < part < most for part in parts)
    assert parts[-1] < parts[0]
