"""Contact against references without modes: many small steps, closed forms, and conservation laws."""

import math
from itertools import product

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.checker.small_steps import Ends, run_small_steps
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation import contact_scenes

from carom import Outcome, Scene, certify, solve_pic
from carom.catalogue import find_scenes

G = 10.0


@each("seeds", release_after(1, [range(3), *(range(k, k + 100) for k in range(0, 1000, 100))]))
def test_pic_agrees_with_small_steps_on_random_contact_scenes(seeds: range) -> None:
    """PIC agrees with small time steps on random scenes of one to three discs in contact."""
    assert [
        said
        for seed in seeds
        if (said := contact_scenes.check_scene(contact_scenes.draw_contact_scene(seed))) not in contact_scenes.RIGHT
    ] == []


@each("seed, refined", release_after(1, [(8, 1), (961, contact_scenes.REFINED)]))
def test_small_steps_with_less_gravity_are_detected(seed: int, refined: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small steps with 5 % less gravity contradict PIC, also in scene 961, which has 96 impacts."""

    def lighter(scene: Scene, steps: int, until_s: float) -> Ends:
        return run_small_steps(Scene(**{**dict(scene), "gravity_m_s2": (0.0, -0.95 * G)}), steps, until_s)

    monkeypatch.setattr(contact_scenes, "run_small_steps", lighter)
    monkeypatch.setattr(contact_scenes, "REFINED", refined)
    assert contact_scenes.check_scene(contact_scenes.draw_contact_scene(seed)) not in contact_scenes.RIGHT


@each("regain", [-0.5, 0.0, 0.5, 1.0])
def test_inelastic_landing_slides_on_with_the_returned_slip(regain: float) -> None:
    """After a landing with restitution 0 the slip -b s that friction returns is slowed at 3 m/s^2."""
    # The disc loses (1 + b)/3 of its 1 m/s in the impact and ends at 2/3 m/s, in PIC and in certified runs.
    scene = staged(
        "gives back",
        disc_at(0.0, 5.5, 1.0),
        wall_at(0.0, 0.0, 0.0, 1.0),
        gravity_m_s2=(0.0, -G),
        wall_friction=0.1,
        wall_restitution=0.0,
        wall_tangential_restitution=regain,
        duration_s=3.0,
    )
    speed, slides = 1.0 - (1.0 + regain) / 3.0, abs(regain) / 3.0
    rate = math.copysign(1.0, regain)
    way = 1.0 + speed * slides + rate * slides**2 / 2 + (2.0 - slides) * (speed + rate * slides)
    for trace in (solve_pic(scene), certify(scene).trace):
        assert trace.outcome is Outcome.COMPLETED
        assert trace.final_position_m[0].tolist() == pytest.approx([way, 0.5], rel=1e-14)
        assert trace.final_velocity_m_s[0].tolist() == pytest.approx([2 / 3, 0.0], rel=1e-14)


def build_landing_scene(regain: float, friction: float) -> Scene:
    """A disc that bounces, at 1 m/s and without spin, on a wall whose friction is enough for its slip in no time."""
    return staged(
        f"held in its landing {regain}",
        disc_at(0.0, 0.6, 1.0),
        wall_at(0.0, 0.0, 0.0, 1.0),
        gravity_m_s2=(0.0, -G),
        wall_friction=friction,
        wall_restitution=0.5,
        wall_tangential_restitution=regain,
        duration_s=3.0,
    )


@each("regain", [-1.0, -0.5, 0.5, 1.0])
def test_large_friction_leaves_two_thirds_of_the_speed_after_landing(regain: float) -> None:
    """With friction 1e19 a disc rolls on after its bounces with two thirds of its speed and the matching spin."""
    trace = solve_pic(build_landing_scene(regain, 1e19))
    assert trace.outcome is Outcome.COMPLETED
    assert trace.final_velocity_m_s[0].tolist() == pytest.approx([2 / 3, 0.0], rel=1e-12)
    assert require_value(trace.final_spin_rad_s)[0] == pytest.approx(-2 / 3 / 0.5, rel=1e-12)


def test_momentum_about_the_wall_grows_by_gravity_alone() -> None:
    """``u - k R w`` grows only by gravity's component along the wall, through bounces, sliding and rolling."""
    for scene in (entry.scene for entry in find_scenes(["contact"])):
        turns = not math.isinf(scene.discs[0].inertia_factor)
        one_plane = len(scene.walls) == 1 and scene.arrays.has_half_planes
        falls = scene.gravity_m_s2 != (0.0, 0.0)
        if len(scene.discs) > 1 or not (one_plane and turns and falls) or scene.wall_rolling_resistance:
            continue  # rolling resistance changes it
        (_, _, nx, ny), disc = scene.arrays.half_planes()[0], scene.discs[0]
        k, a = disc.inertia_factor, scene.gravity_m_s2[0] * ny - scene.gravity_m_s2[1] * nx
        begun = disc.velocity_m_s[0] * ny - disc.velocity_m_s[1] * nx - k * disc.radius_m * disc.spin_rad_s
        for part in (0.1, 0.3, 0.55, 0.8, 1.0):
            trace = solve_pic(scene, until_s=part * scene.duration_s)
            (vx, vy), spins = trace.final_velocity_m_s[0], trace.final_spin_rad_s
            spin = 0.0 if spins is None else spins[0]
            momentum = vx * ny - vy * nx - k * disc.radius_m * spin
            assert momentum == pytest.approx(begun + a * part * scene.duration_s, abs=1e-13), scene.name


# Coefficients from next to nothing to a million, slopes to one rounding at a threshold --------------------------------

RADIUS_M = 0.5
SIZES = [10.0**power for power in (-300, -12, -6, -2, -1, 0, 2, 6)]


def build_slope_scene(
    friction: float,
    resists: float = 0.0,
    *,
    tangent: float = 0.0,
    along: float = 0.0,
    height: float = 0.0,
    e: float = 0.0,
    duration_s: float = 1.0,
) -> Scene:
    """Return a disc on, or above, the line y = 0, which slides, rests or bounces; gravity leans by a tangent."""
    long = math.hypot(1.0, tangent)
    return staged(
        "extreme",
        disc_at(0, RADIUS_M + height, along, r=RADIUS_M),
        wall_at(0, 0, 0, 1),
        gravity_m_s2=(G * tangent / long, -G / long),
        wall_restitution=e,
        wall_friction=friction,
        wall_rolling_resistance=resists,
        duration_s=duration_s,
    )


@each("friction, resists", [*product(SIZES, [0.0]), *product([1e-6, 0.3, 1e6], SIZES)])
def test_slide_to_roll_matches_the_closed_form_for_extreme_friction(friction: float, resists: float) -> None:
    """A disc sliding at 3 m/s matches the closed form to 1e-12 for friction and resistance of 1e-300 to 1e6."""
    # Without resistance it rolls at 2 m/s after v/(f g (1 + 1/k)). Where resistance exceeds friction it never rolls.
    k = 0.5
    ends = solve_pic(build_slope_scene(friction, resists, along=3.0))
    turned = max(0.0, friction - resists) * G / k  # of the rim, a second
    slid = min(1.0, 3.0 / (friction * G + turned))
    u, left = 3.0 - friction * G * slid, 1.0 - slid
    slower = resists * G / (1.0 + k) if resists < friction else friction * G
    rolled = min(left, u / slower) if slower else left
    way = 3.0 * slid - 0.5 * friction * G * slid**2 + u * rolled - 0.5 * slower * rolled**2
    assert ends.outcome is Outcome.COMPLETED
    assert ends.final_position_m[0, 0] == pytest.approx(way, rel=1e-12)
    assert ends.final_velocity_m_s[0, 0] == pytest.approx(u - slower * rolled, rel=1e-12, abs=1e-12)


@each("friction", [1e-6, 0.1, 0.25, 1.0, 1e6])
@each("ulps", [-1, 0, 1])
def test_rolling_and_sliding_agree_at_the_steepest_rolling_slope(friction: float, ulps: int) -> None:
    """At tan = f (1 + 1/k), and one float to either side, rolling and sliding give the same motion to 1e-12."""
    tangent = 3.0 * friction
    for _ in range(abs(ulps)):
        tangent = math.nextafter(tangent, ulps * math.inf)
    ends = solve_pic(build_slope_scene(friction, tangent=tangent))
    assert ends.outcome is Outcome.COMPLETED
    pull = G * tangent / math.hypot(1.0, tangent) / 1.5
    assert ends.final_velocity_m_s[0, 0] == pytest.approx(pull, rel=1e-12)
    assert ends.final_position_m[0, 0] == pytest.approx(pull / 2.0, rel=1e-12)


@each("resists", [1e-6, 0.1, 1.0, 1e6])
@each("ulps", [-1, 0, 1])
def test_disc_stays_at_rest_at_the_steepest_holding_slope(resists: float, ulps: int) -> None:
    """At tan = c, and one float to either side, rolling resistance leaves the disc at most rounding of speed."""
    tangent = math.nextafter(resists, ulps * math.inf) if ulps else resists
    ends = solve_pic(build_slope_scene(2e6, resists, tangent=tangent))
    assert ends.outcome is Outcome.COMPLETED
    assert np.abs(ends.final_velocity_m_s).max() <= 8.0 * 2.0**-52 * G


@each("lost", [1e-2, *(pytest.param(lost, marks=pytest.mark.release) for lost in (1e-3, 1e-4))])
def test_ball_with_high_restitution_rests_at_the_sum_of_its_hops(lost: float) -> None:
    """A ball with restitution e near 1 comes to rest at the sum of the series of its hops, to 1e-9."""
    # That is t (1 + e)/(1 - e) for a first fall of t, after thousands of bounces.
    e, height = 1.0 - lost, 1e-4
    fall = math.sqrt(2.0 * height / G)
    rests = fall * (1.0 + e) / (1.0 - e)
    scene = build_slope_scene(0.0, height=height, e=e, duration_s=1.1 * rests)
    ends = solve_pic(scene, max_impacts=10**7)
    assert ends.outcome is Outcome.COMPLETED
    assert ends.contact_s == pytest.approx(rests, rel=1e-9)
    assert not ends.final_velocity_m_s.any()


def test_ball_with_restitution_1_minus_1e_9_keeps_bouncing() -> None:
    """With e = 1 - 1e-9 a ball bounces as often in a second as without loss, and its speed falls as e^n."""
    e, height = 1.0 - 1e-9, 1e-4
    ends = solve_pic(build_slope_scene(0.0, height=height, e=e))
    fall = math.sqrt(2.0 * height / G)
    count = math.floor((1.0 / fall + 1.0) / 2.0)
    assert len(ends.impacts) == count
    assert ends.impacts["velocity_first_after"][-1, 1] == pytest.approx(G * fall * e**count, rel=1e-9)
