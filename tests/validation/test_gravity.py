"""Uniform gravity: closed forms, conserved quantities, symmetries, and every way in which motion can end."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.random_scenes import draw_scene
from tests.scene_builders import disc_at, drive_on_legs, require_value, staged, wall_at

from carom import Chain, Outcome, Scene, compare, solve_pic, solve_pic_framewise, solve_pit
from carom.catalogue import catalogue
from carom.errors import InputError
from carom.model.trace import Mode

G = 9.81


def build_ball_scene(
    height_m: float = 1.0, restitution: float = 1.0, *, drift_m_s: float = 0.0, duration_s: float = 10.0
) -> Scene:
    """Return a ball of 0.125 m at a height above a floor; `drift_m_s` is its speed along it."""
    return staged(
        "ball",
        disc_at(0, height_m + 0.125, drift_m_s, 0, r=0.125),
        wall_at(0, 0, 0, 1),
        wall_restitution=restitution,
        gravity_m_s2=(0, -G),
        duration_s=duration_s,
    )


# The bouncing ball ----------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_elastic_ball_is_exact_over_1e5_bounces() -> None:
    """The n-th bounce is at (2 n + 1) sqrt(2 h/g) to 1e-13, and the energy is constant to 1e-12."""
    impacts = solve_pic(build_ball_scene(drift_m_s=0.3, duration_s=1e9), max_impacts=100_000).impacts
    exact = (2 * np.arange(100_000) + 1) * math.sqrt(2 / G)
    assert np.max(np.abs(impacts["time_s"] / exact - 1)) <= 1e-13
    energy = np.sum(impacts["velocity_first_after"] ** 2, axis=1)
    assert np.max(np.abs(energy / energy[0] - 1)) <= 1e-12


@each("restitution", [0.0, 0.5, 1.0])
@each("height", [0.0, 1e-17])
def test_ball_on_the_floor_rests_without_impacts(height: float, restitution: float) -> None:
    """A ball that touches the floor at speed 0 rests from the start, without an impact, at any restitution."""
    scene = build_ball_scene(height, restitution)
    for solve in (solve_pic, solve_pic_framewise):
        trace = solve(scene)
        assert require_value(trace.modes)["after"].tolist() == [Mode.REST]
        assert (trace.contact_s, trace.outcome, len(trace.impacts)) == (0.0, Outcome.COMPLETED, 0)


def test_disc_slides_down_a_vertical_wall_without_impact() -> None:
    """A disc that touches a vertical wall falls along it to the end of the scene without an impact."""
    scene = staged("slide", disc_at(0.5, 0), wall_at(0, 0, 1, 0), gravity_m_s2=(0, -8), duration_s=2)
    trace = solve_pic(scene)
    assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 0)
    assert trace.final_position_m.tolist() == [[0.5, -16.0]]


def test_ball_meets_a_rising_floor_at_the_relative_speed() -> None:
    """After a bounce at 1 s a ball meets a floor that rises from 1.5 s on, at a relative speed of sqrt(3) m/s."""
    floor = wall_at(0.0, 0.0, 0.0, 1.0, **drive_on_legs((0.0, (0.0, 0.0)), (1.5, (0.0, 1.0))))
    impacts = solve_pic(staged("rises", disc_at(0.0, 1.5), floor, gravity_m_s2=(0.0, -2.0), duration_s=2.5)).impacts
    assert impacts["time_s"].tolist() == pytest.approx([1.0, 1.5 + math.sqrt(0.75)], rel=1e-15)
    assert impacts["velocity_first_after"][1, 1] == pytest.approx(1 + math.sqrt(3.0), rel=1e-15)


def test_ball_bounces_from_face_to_face_of_a_chain() -> None:
    """After two bounces on the floor of a chain a ball meets its side, and only its speed onto that side reverses."""
    bodies = disc_at(-2.5, 1.75, 1), Chain(points_m=[(-9, 0), (0, 0), (0, 9)])
    trace = solve_pic(staged("corner", *bodies, gravity_m_s2=(0.0, -10.0), duration_s=2.25))
    assert trace.impacts["time_s"].tolist() == [0.5, 1.5, 2.0]
    assert trace.impacts["velocity_first_after"].tolist() == [[1.0, 5.0], [1.0, 5.0], [-1.0, 0.0]]


def test_bounces_in_a_wedge_end_with_an_outcome() -> None:
    """A ball that bounces ever lower between two slopes ends the run as CORNER or STANDSTILL."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        scene = staged(
            "wedge",
            disc_at(rng.uniform(-1, 1), 3, rng.uniform(-2, 2), 0),
            wall_at(0, 0, 1, 1.3),
            wall_at(0, 0, -1, 2),
            wall_restitution=0.8,
            gravity_m_s2=(0, -G),
            duration_s=1000.0,
        )
        trace = solve_pic(scene, max_impacts=20_000)
        assert trace.outcome in {Outcome.CORNER, Outcome.STANDSTILL}


def test_inelastic_stack_ends_at_a_standstill() -> None:
    """A heavy disc that falls on a light one on the floor ends the run as STANDSTILL, with a note that says why."""
    bodies = disc_at(0, 0.5, r=0.25), disc_at(0, 1.25, r=0.25, m=100.0), wall_at(0, 0, 0, 1)
    laws = {"restitution": 0.5, "wall_restitution": 0.5, "gravity_m_s2": (0, -G)}
    trace = solve_pic(staged("stack", *bodies, duration_s=20, **laws), max_impacts=20_000)
    assert trace.outcome is Outcome.STANDSTILL
    assert "faster than floats can resolve" in trace.notes[0]
    assert np.all(np.diff(trace.impacts["time_s"]) >= 0)


# An immovable disc ----------------------------------------------------------------------------------------------------


def build_disc_on_disc_scene(height_m: float, restitution: float) -> Scene:
    """Return a disc above an immovable one."""
    falls, laws = disc_at(0, 0.75 + height_m, r=0.25), {"restitution": restitution, "gravity_m_s2": (0, -G)}
    return staged("on top", disc_at(0, 0, m=math.inf), falls, **laws, duration_s=10.0)


def test_ball_bounces_on_an_immovable_disc_like_on_a_floor() -> None:
    """On the vertical axis an immovable disc gives the bounce times of a floor, and rest at the same limit."""
    elastic = solve_pic(build_disc_on_disc_scene(1.0, 1.0))
    assert elastic.impacts["time_s"] == pytest.approx((2 * np.arange(11) + 1) * math.sqrt(2 / G), rel=1e-14)
    trace = solve_pic(build_disc_on_disc_scene(1.0, 0.5))
    assert trace.outcome is Outcome.AT_REST
    # t0 + 2 v0/g (e + e^2 + ...), with v0 = g t0; it ends where hops go below rounding
    assert trace.end_time_s == pytest.approx(3 * math.sqrt(2 / G), rel=1e-7)
    assert solve_pic(build_disc_on_disc_scene(0.0, 1.0)).outcome is Outcome.AT_REST


# Many discs -----------------------------------------------------------------------------------------------------------


@each("numbers", release_after(1, [range(12), *(range(k, k + 50) for k in range(12, 212, 50))]))
def test_free_fall_of_all_discs_changes_no_impact(numbers: range) -> None:
    """Without walls, gravity adds g t to velocities and g t^2/2 to positions and changes no impact."""
    met = 0
    for number in numbers:
        scene, pull = draw_scene("gas", number, immovable=False), np.random.default_rng(number).uniform(-20.0, 20.0, 2)
        bare = {"walls": (), "duration_s": 1.0}
        floating = solve_pic(scene.model_copy(update=bare), max_impacts=6)
        falling = solve_pic(scene.model_copy(update=bare | {"gravity_m_s2": tuple(pull.tolist())}), max_impacts=6)
        assert falling.impacts[["first", "second"]].tolist() == floating.impacts[["first", "second"]].tolist()
        met += len(floating.impacts)
        # Six impacts let a rounding grow some thousandfold: each turns the path by the error over a gap of a radius.
        time, end = floating.impacts["time_s"], floating.end_time_s
        assert falling.impacts["time_s"] == pytest.approx(time, abs=1e-11)
        gained = floating.impacts["velocity_first_after"] + time[:, None] * pull
        assert falling.impacts["velocity_first_after"] == pytest.approx(gained, rel=1e-12, abs=1e-10)
        assert falling.final_position_m == pytest.approx(floating.final_position_m + pull * (end**2 / 2), abs=1e-10)
    assert met > len(numbers)


# PIT: the sampling error alone ----------------------------------------------------------------------------------------


def test_gravity_scenes_have_complete_known_answers() -> None:
    """Each catalogue scene of the group gravity has a known number of impacts and a known final position."""
    known = [entry.known for entry in catalogue().values() if entry.group == "gravity"]
    assert all(one.count is not None and one.final_position_m is not None for one in known)


@each("rate", [7.0, 60.0, 1000.0])
def test_pit_bounces_at_the_first_frame_in_the_floor(rate: float) -> None:
    """PIT finds the first bounce at the first frame at or after sqrt(2 h/g), with the speed g t of that frame."""
    trace = solve_pit(build_ball_scene(1.0, 1.0), frame_rate_hz=rate)
    frame = math.ceil(math.sqrt(2 / G) * rate)
    impact = trace.impacts[0]
    assert impact["time_s"] == frame / rate
    assert impact["velocity_first_after"][1] == pytest.approx(G * frame / rate, rel=1e-13)


def test_pit_reports_one_impact_of_discs_that_fall_on_together() -> None:
    """After a head-on impact with restitution 0, PIT counts no further impact from the rounding of the approach."""
    for angle in np.arange(1, 13) / 10:
        cos, sin = math.cos(angle), math.sin(angle)
        discs = disc_at(0.0, 0.0, 3.0 * cos, 3.0 * sin), disc_at(1.5 * cos, 1.5 * sin)
        scene = staged("pair", *discs, gravity_m_s2=(0.3, -1.0), restitution=0.0, duration_s=1.0)
        assert len(solve_pit(scene).impacts) == 1, angle


def test_pit_runs_all_frames_of_a_resting_ball() -> None:
    """PIT has no resting contact: for a ball on the floor it runs all 60 frames to the end."""
    trace = solve_pit(build_ball_scene(0.0, 0.5, duration_s=1.0))
    assert trace.outcome is Outcome.COMPLETED
    assert trace.counts["frames"] == 60


# The integrator's error, and the collision's -----------------------------------------------------------------------


@each("velocity_first", [True, False])
@each("refinement", [1, 4, 16])
def test_euler_error_in_free_fall_is_half_a_step_of_speed(refinement: int, *, velocity_first: bool) -> None:
    """Euler's rule with the new velocity ends g dt t/2 too low, with the old one as much too high."""
    scene = catalogue()["gravity/free-fall"].scene
    steps = round(scene.duration_s * scene.frame_rate_hz) * refinement
    dt = scene.duration_s / steps
    pull = np.array(scene.gravity_m_s2)
    position, velocity = np.array(scene.discs[0].position_m), np.array(scene.discs[0].velocity_m_s)
    for _ in range(steps):
        old, velocity = velocity, velocity + pull * dt
        position = position + (velocity if velocity_first else old) * dt
    reference = solve_pic(scene)
    euler = replace(
        reference, method="Euler", dt_s=dt, final_position_m=position[None], final_velocity_m_s=velocity[None]
    )
    score = compare(reference, euler, sampling=solve_pit(scene, frame_rate_hz=1 / dt))
    expected = np.hypot(*pull) * dt * scene.duration_s / 2
    assert score.total.final_position * scene.discs[0].radius_m == pytest.approx(expected, rel=1e-11)
    sign = 1 if velocity_first else -1
    assert (position - reference.final_position_m[0]) @ pull == pytest.approx(sign * expected * np.hypot(*pull))
    assert score.total.final_velocity <= 4 * steps * 2.0**-53  # a rounding a step, of speeds below 4 times the start's


def test_pit_impact_of_a_falling_pair_is_that_without_gravity() -> None:
    """Gravity acts equally on both discs of a pair, so PIT's impact has the time of a floating pair."""
    entry = catalogue()["gravity/falling-pair"]
    falling, floating = entry.scene, entry.scene.model_copy(update={"gravity_m_s2": (0.0, 0.0)})
    for rate in (30.0, 60.0, 250.0):
        with_gravity, without = (solve_pit(scene, frame_rate_hz=rate).impacts for scene in (falling, floating))
        assert with_gravity["time_s"].tolist() == without["time_s"].tolist()
        gained = np.array(falling.gravity_m_s2) * with_gravity["time_s"][0]
        for name in ("velocity_first_after", "velocity_second_after"):
            assert with_gravity[name][0] == pytest.approx(without[name][0] + gained, abs=1e-13)


# The door -------------------------------------------------------------------------------------------------------------


def test_contact_duration_is_refused_under_gravity() -> None:
    """The TC model does not support gravity, so a contact duration above 0 is refused with that reason."""
    with pytest.raises(InputError, match=r"contact_duration_s must be 0 in a scene with gravity, got 0.1"):
        solve_pic(build_ball_scene(), contact_duration_s=0.1)
