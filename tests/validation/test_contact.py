"""Contact against closed forms: friction and rolling resistance from next to nothing to a million."""

import math
from itertools import product

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Disc, Outcome, Scene, solve_pic

G = 10.0


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


SIZES = [10.0**power for power in (-300, -12, -6, -2, -1, 0, 2, 6)]


def build_floor_scene(disc: Disc, duration_s: float = 1.0, **laws: float) -> Scene:
    return staged("floor", disc, wall_at(0, 0, 0, 1), gravity_m_s2=(0.0, -G), duration_s=duration_s, **laws)


@each("friction, resists", [*product(SIZES, [0.0]), *product([1e-6, 0.3, 1e6], SIZES)])
def test_slide_to_roll_matches_the_closed_form_for_extreme_friction(friction: float, resists: float) -> None:
    """A disc sliding at 3 m/s matches the closed form to 1e-12 for friction and resistance of 1e-300 to 1e6."""
    # Without resistance it rolls at 2 m/s after v/(f g (1 + 1/k)). Where resistance exceeds friction it never rolls.
    k = 0.5
    laws = {"wall_restitution": 0.0, "wall_friction": friction, "wall_rolling_resistance": resists}
    ends = solve_pic(build_floor_scene(disc_at(0.0, 0.5, 3.0), **laws))
    turned = max(0.0, friction - resists) * G / k  # of the rim, a second
    slid = min(1.0, 3.0 / (friction * G + turned))
    u, left = 3.0 - friction * G * slid, 1.0 - slid
    slower = resists * G / (1.0 + k) if resists < friction else friction * G
    rolled = min(left, u / slower) if slower else left
    way = 3.0 * slid - 0.5 * friction * G * slid**2 + u * rolled - 0.5 * slower * rolled**2
    assert ends.outcome is Outcome.COMPLETED
    assert ends.final_position_m[0, 0] == pytest.approx(way, rel=1e-12)
    assert ends.final_velocity_m_s[0, 0] == pytest.approx(u - slower * rolled, rel=1e-12, abs=1e-12)


@each("lost", [1e-2, pytest.param(1e-4, marks=pytest.mark.release)])
def test_ball_with_high_restitution_rests_at_the_sum_of_its_hops(lost: float) -> None:
    """A ball with restitution e near 1 comes to rest at the sum of the series of its hops, to 1e-9."""
    # That is t (1 + e)/(1 - e) for a first fall of t, after thousands of bounces.
    e, height = 1.0 - lost, 1e-4
    rests = math.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)
    scene = build_floor_scene(disc_at(0.0, 0.5 + height), 1.1 * rests, wall_restitution=e)
    ends = solve_pic(scene, max_impacts=10**7)
    assert ends.outcome is Outcome.COMPLETED
    assert ends.contact_s == pytest.approx(rests, rel=1e-9)
    assert not ends.final_velocity_m_s.any()
