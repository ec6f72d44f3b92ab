"""Free fall by each engine's documented integrator, and a bounce under gravity."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.adapters.engine_scenes import scale_tolerance
from tests.cases import each, release_after
from tests.scene_builders import Finish, Named, disc_at, require_value, staged, wall_at

from carom import Disc, Scene
from carom.engines.api import Adapter
from carom.execution.adapter_profile import load_supported_adapter
from carom.execution.job import Job, Method, UnsupportedError
from carom.execution.observation.engine_run import observe_run

G = (0.5, -9.81)

#: Positions moved before velocities within a step, as Chipmunk documents of `cpSpaceStep`; the others are
#: semi-implicit: Bullet's `btDiscreteDynamicsWorld`, MuJoCo's "Euler", Box2D's `b2Island::Solve`.
POSITION_FIRST = {"pymunk"}


def _build_falling_scene(velocity: tuple[float, float] = (1.0, 3.0)) -> Scene:
    disc = Disc(position_m=(0.25, 2.0), velocity_m_s=velocity, radius_m=0.5, mass_kg=3.0)
    return staged("fall", disc, disc_at(9, 9, m=math.inf), gravity_m_s2=G, duration_s=1.0)


@each("profile", ["default", "tuned", "located"])
def test_free_fall_follows_the_documented_integrator(engine: Adapter, finish: Finish, profile: str) -> None:
    """After n steps a disc is at x0 + n dt v0 + g dt^2 n(n -+ 1)/2, minus where positions are updated first."""
    assert engine.capabilities.gravity
    scene, dt_s, n = _build_falling_scene(), 1 / 64, 64
    end = finish(engine, scene, dt_s, profile)
    falls = n * (n - 1) / 2 if engine.name in POSITION_FIRST else n * (n + 1) / 2
    disc = scene.discs[0]
    position = np.array(disc.position_m) + n * dt_s * np.array(disc.velocity_m_s) + np.array(G) * dt_s**2 * falls
    velocity = np.array(disc.velocity_m_s) + n * dt_s * np.array(G)
    # Sums of 64 steps, each rounded at no more than 8 m or 8 m/s.
    rounding = scale_tolerance(engine, n * float(np.spacing(8.0)))
    np.testing.assert_allclose(end.position_m[0], position, rtol=0, atol=rounding)
    np.testing.assert_allclose(end.velocity_m_s[0], velocity, rtol=0, atol=rounding)
    assert end.velocity_m_s[1].tolist() == [0, 0]


def test_drop_bounces_at_the_time_of_free_fall(engine: Adapter) -> None:
    """A disc dropped by h hits the floor after sqrt(2 h / g) and three times that, to 8 steps of 1/500 s."""
    height, g = 1.0, 9.81
    scene = staged("drop", disc_at(0, 0.5 + height), wall_at(0, 0, 0, 1), gravity_m_s2=(0, -g), duration_s=2.0)
    dt_s, fall_s = 1 / 500, math.sqrt(2 * height / g)
    trace = observe_run(engine, scene, "tuned", dt_s)
    # An impact is found up to a step late, and stamped up to one step later. An integrator of first order is off by
    # another half step in a fall. A bounce at a depth of g t dt keeps as much of the fall's energy again.
    assert trace.impacts["time_s"][:2].tolist() == pytest.approx([fall_s, 3 * fall_s], abs=8 * dt_s)
    # Where the parabolas before and after meet, which are the engine's own.
    assert require_value(trace.effective_time_s)[:2].tolist() == pytest.approx([fall_s, 3 * fall_s], abs=8 * dt_s)


@each("profile", ["default", "tuned"])
@each("starts", release_after(1, [1, 16]))
def test_landing_with_restitution_zero_is_dated_at_the_touch(engine: Adapter, profile: str, starts: int) -> None:
    """At e = 0 an impact is within two steps of the touch: noticed one step late, and acting in the next."""
    dt_s = 1 / 60
    for height in np.linspace(1.0, 2.0, starts).tolist():
        bodies, laws = (disc_at(0, 0.5 + height), wall_at(0, 0, 0, 1)), {"wall_restitution": 0, "duration_s": 2.0}
        scene = staged("landing", *bodies, gravity_m_s2=(0, -9.81), **laws)
        trace = observe_run(engine, scene, profile, dt_s)
        assert abs(require_value(trace.effective_time_s)[0] - math.sqrt(2 * height / 9.81)) < 2 * dt_s


def _build_drop_scene() -> Scene:
    """An elastic disc that falls half a metre to the floor, and comes back for ever."""
    return staged("drop", disc_at(0, 0.7, r=0.2), wall_at(0, 0, 0, 1), gravity_m_s2=(0, -9.81), duration_s=2.6)


def test_located_bounces_gain_or_lose_up_to_g_dt(engine: Adapter) -> None:
    """Located runs gain speed where positions move first, otherwise lose it, by at most g dt a bounce."""
    if engine.name == "box2d":
        pytest.skip("Box2D adds the speed of the step after the bounce, which is what the fall before has lost")
    dt_s = 1 / 60
    runs = {name: observe_run(engine, _build_drop_scene(), name, dt_s) for name in ("tuned", "located")}
    speeds = {name: run.impacts["velocity_first_after"][:, 1] for name, run in runs.items()}
    rounding = 64 * float(np.spacing(4.0))
    # MuJoCo's greatest impedance is 0.9999 (mjMAXIMP), which leaves a ten-thousandth of a step's gravity to the bounce.
    assert np.abs(np.diff(speeds["tuned"])).max() <= (1 - 0.9999) * 9.81 * dt_s + rounding
    gained = np.diff(speeds["located"]) * (1 if engine.name in POSITION_FIRST else -1)
    assert len(gained) >= 3
    assert np.all(gained > rounding)
    assert np.all(gained <= 9.81 * dt_s + rounding)


def test_located_profile_is_refused_for_falls_onto_fixed_bodies(engine: Adapter) -> None:
    """The located profile is unsupported for falls onto fixed bodies, with the speed error as reason."""
    job = Job(_build_drop_scene(), Method(engine.name, "located"), 1 / 60)
    with pytest.raises(UnsupportedError, match=r"gains or loses up to g dt \(0\.164 m/s\)"):
        load_supported_adapter(job)
    load_supported_adapter(replace(job, method=Method(engine.name, "tuned")))
    post = disc_at(0, -1, m=math.inf)
    onto_post = _build_drop_scene().model_copy(update={"walls": (), "discs": (*_build_drop_scene().discs, post)})
    with pytest.raises(UnsupportedError, match="this profile ends steps at impacts"):
        load_supported_adapter(replace(job, scene=onto_post))


def test_impact_of_two_falling_discs_is_located_to_rounding(engine: Adapter) -> None:
    """If only falling discs collide, a located run is allowed, and its impact has the time without gravity."""
    discs = [disc_at(-1, 0, 1, r=0.25), disc_at(1, 0.1, -1, r=0.25)]
    scene = staged("pair", *discs, gravity_m_s2=(0, -9.81), duration_s=1.5)
    job = Job(scene, Method(engine.name, "located"), 1 / 60)
    trace = observe_run(load_supported_adapter(job), scene, "located", 1 / 60)
    # The centres are 0.5 apart where they meet, 0.1 of it across, and close at 2 m/s from 2 apart.
    meeting_s = (2 - math.sqrt(0.5**2 - 0.1**2)) / 2
    assert trace.impacts["time_s"].tolist() == pytest.approx([meeting_s], abs=scale_tolerance(engine, 1e-12))


@each("profile", ["default", "tuned"])
@each("starts", release_after(1, [1, 16]))
def test_gravity_adds_only_g_t_to_an_impact_of_two_discs(engine: Adapter, profile: str, starts: int) -> None:
    """Two falling discs have the impact of a run without gravity, with velocities that differ only by g t."""
    dt_s = 1 / 60
    for part in range(starts):
        discs = [disc_at(-1 - part * dt_s / starts, 0, 1, r=0.25), disc_at(1, 0.2, -1, r=0.25)]
        still, falling = (
            observe_run(engine, staged("pair", *discs, gravity_m_s2=pull, duration_s=1.5), profile, dt_s)
            for pull in ((0.0, 0.0), G)
        )
        at_s, falls_s = (require_value(trace.effective_time_s)[0] for trace in (still, falling))
        # Some 60 steps, each rounded at 16 m or m/s at most; the instant is a quotient by the speed of closing, 2 m/s.
        rounding = scale_tolerance(engine, 64 * float(np.spacing(16.0)))
        assert falls_s == pytest.approx(at_s, abs=rounding)
        for field in ("first_before", "second_before", "first_after", "second_after"):
            name = f"velocity_{field}"
            fallen = still.impacts[0][name] + np.array(G) * at_s
            # |G| is below 10: so much of the instant's rounding, and that of two velocities.
            np.testing.assert_allclose(falling.impacts[0][name], fallen, rtol=0, atol=12 * rounding)


def _build_head_on_scene() -> Scene:
    discs = [disc_at(0, 0, 2), disc_at(1.5, 0, -1)]
    return staged("head-on", *discs, duration_s=1.0)


def test_spring_contact_of_many_steps_is_one_impact(named: Named) -> None:
    """MuJoCo's default spring acts for pi / sqrt(k) s; its steps are one impact with the outer velocities."""
    mujoco, dt_s = named("mujoco"), 1 / 1000
    scene = _build_head_on_scene()
    world = mujoco.prepare(scene, mujoco.profiles["default"].settings(dt_s))
    in_contact = 0
    for _ in range(scene.step_count(dt_s)):
        world.advance(1)
        in_contact += bool(world.observe().contacts)
    world.close()
    assert in_contact > 0.9 * math.pi / math.sqrt(1000) / dt_s  # the contact's half period: 99 steps
    (impact,) = observe_run(mujoco, scene, "default", dt_s).impacts
    assert impact["velocity_first_before"].tolist() == [2, 0]
    assert impact["velocity_second_before"].tolist() == [-1, 0]
    # Equal masses exchange velocities; the spring's first-order integration loses a thousandth.
    assert impact["velocity_first_after"][0] == pytest.approx(-1, abs=3e-3)
    assert impact["velocity_second_after"][0] == pytest.approx(2, abs=3e-3)


def test_overlap_without_impulse_is_no_impact(engine: Adapter) -> None:
    """Discs that overlap at one boundary only, while separating, exchange nothing and have no impact."""
    # Nearest at 0.47 s; the only boundary inside the overlap is later than that, when they separate already.
    dt_s, speed, offset = 0.1, 3.0, 0.99
    scene = staged("deep graze", disc_at(-0.47 * speed, 0, speed), disc_at(0, offset), duration_s=1.0)
    # The chord lasts 2 sqrt(1 - offset^2) / speed = 0.094 s around 0.47 s: of 0.4, 0.5 and 0.6 s it holds 0.5 s.
    half_chord_s = math.sqrt(1 - offset**2) / speed
    assert 0.47 - half_chord_s > 0.4
    assert 0.47 < 0.5 < 0.47 + half_chord_s
    profile = "no-ccd" if "no-ccd" in engine.profiles else "tuned"
    trace = observe_run(engine, scene, profile, dt_s)
    assert len(trace.impacts) == 0
    assert trace.final_velocity_m_s[1].tolist() == [0, 0]


def test_two_contacts_in_one_step_are_two_impacts(engine: Adapter) -> None:
    """A disc that strikes two others in one step has two impacts, one after the other."""
    scene = staged("one into two", disc_at(-1.5, 0, 3), disc_at(0, 0.51), disc_at(0, -0.51), duration_s=1.0)
    trace = observe_run(engine, scene, "tuned", 1 / 60)
    first, second = trace.impacts[:2]  # in whichever order the engine takes them
    assert {int(first["second"]), int(second["second"])} == {1, 2}
    assert first["first"] == second["first"] == 0
    assert first["time_s"] == second["time_s"]
    # Both struck discs are pushed along their own normals, up and to the right, and down and to the right.
    for impact in (first, second):
        assert abs(impact["velocity_second_after"][1]) > 0.5
        assert (impact["velocity_second_after"][1] > 0) == (impact["second"] == 1)
    # Between the two, the striker has the velocity that the first has left it.
    assert first["velocity_first_before"].tolist() == [3, 0]
    np.testing.assert_allclose(first["velocity_first_after"], second["velocity_first_before"], rtol=0, atol=1e-6)


def test_impact_velocities_are_those_of_free_flight(engine: Adapter) -> None:
    """The velocities before and after an impact are the initial and the final ones of the scene."""
    for profile in ("default", "tuned", "located"):
        trace = observe_run(engine, _build_head_on_scene(), profile, 1 / 240)
        (impact,) = trace.impacts
        assert impact["velocity_first_before"].tolist() == [2, 0]
        assert impact["velocity_second_before"].tolist() == [-1, 0]
        after = [impact["velocity_first_after"].tolist(), impact["velocity_second_after"].tolist()]
        assert after == trace.final_velocity_m_s.tolist()
