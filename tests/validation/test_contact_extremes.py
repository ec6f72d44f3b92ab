"""Contact at its extremes: coefficients from next to nothing to a million, slopes to one rounding at a threshold."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from tests.lengths import each

from carom import Disc, Outcome, Scene, Wall, solve_pic

G, RADIUS_M = 10.0, 0.5
SIZES = [10.0**power for power in (-300, -12, -6, -2, -1, 0, 2, 6)]


def on_a_slope(friction: float, resists: float = 0.0, *, tangent: float = 0.0, along: float = 0.0) -> Scene:
    """Return a disc on the line y = 0 for a second, which slides or lies there; gravity leans by a tangent."""
    long = math.hypot(1.0, tangent)
    return Scene(
        name="extreme",
        discs=[Disc(position_m=(0, RADIUS_M), velocity_m_s=(along, 0), radius_m=RADIUS_M)],
        walls=[Wall(point_m=(0, 0), normal=(0, 1))],
        gravity_m_s2=(G * tangent / long, -G / long),
        wall_restitution=0.0,
        wall_friction=friction,
        wall_rolling_resistance=resists,
        duration_s=1.0,
    )


@each(("friction", "resists"), [*product(SIZES, [0.0]), *product([1e-6, 0.3, 1e6], SIZES)])
def test_a_slide_ends_by_the_closed_form_whatever_the_frictions(friction: float, resists: float) -> None:
    """From 3 m/s a disc is slowed by friction alone until its rim keeps up, or for ever where resistance is more.

    Without resistance it rolls at 2 m/s from v/(f g (1 + 1/k)) on, or slides on where that is later than a second.
    """
    k = 0.5
    ends = solve_pic(on_a_slope(friction, resists, along=3.0))
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
def test_on_both_sides_of_the_steepest_slope_that_rolls_both_laws_agree(friction: float, ulps: int) -> None:
    """At tan = f (1 + 1/k), and one rounding off it, g sin/(1 + k) and g (sin - f cos) are one."""
    tangent = 3.0 * friction
    for _ in range(abs(ulps)):
        tangent = math.nextafter(tangent, ulps * math.inf)
    ends = solve_pic(on_a_slope(friction, tangent=tangent))
    assert ends.outcome is Outcome.COMPLETED
    pull = G * tangent / math.hypot(1.0, tangent) / 1.5
    assert ends.final_velocity_m_s[0, 0] == pytest.approx(pull, rel=1e-12)
    assert ends.final_position_m[0, 0] == pytest.approx(pull / 2.0, rel=1e-12)


@each("resists", [1e-6, 0.1, 1.0, 1e6])
@each("ulps", [-1, 0, 1])
def test_on_both_sides_of_the_steepest_slope_that_holds_a_disc_hardly_moves(resists: float, ulps: int) -> None:
    """At tan = c, and one rounding off it, it is held, or rolls off at a rounding of gravity."""
    tangent = math.nextafter(resists, ulps * math.inf) if ulps else resists
    ends = solve_pic(on_a_slope(2e6, resists, tangent=tangent))
    assert ends.outcome is Outcome.COMPLETED
    assert np.abs(ends.final_velocity_m_s).max() <= 8.0 * 2.0**-52 * G


@pytest.mark.parametrize("lost", [1e-2, *(pytest.param(lost, marks=pytest.mark.long) for lost in (1e-3, 1e-4))])
def test_a_lively_ball_comes_to_rest_at_the_sum_of_its_hops(lost: float) -> None:
    """With e = 1 - lost it hops 2 t e/(1 - e) after its first fall, in thousands of bounces."""
    e, height = 1.0 - lost, 1e-4
    fall = math.sqrt(2.0 * height / G)
    rests = fall * (1.0 + e) / (1.0 - e)
    scene = on_a_slope(0.0).model_copy(
        update={
            "discs": (Disc(position_m=(0, RADIUS_M + height), radius_m=RADIUS_M),),
            "wall_restitution": e,
            "duration_s": 1.1 * rests,
        }
    )
    ends = solve_pic(scene, max_impacts=10**7)
    assert ends.outcome is Outcome.COMPLETED
    assert ends.contact_s == pytest.approx(rests, rel=1e-9)
    assert not ends.final_velocity_m_s.any()


def test_a_ball_that_loses_a_billionth_hops_on() -> None:
    """With e = 1 - 1e-9 its hops are as many in a second as without loss, and as high to a millionth."""
    e, height = 1.0 - 1e-9, 1e-4
    scene = on_a_slope(0.0).model_copy(
        update={"discs": (Disc(position_m=(0, RADIUS_M + height), radius_m=RADIUS_M),), "wall_restitution": e}
    )
    ends = solve_pic(scene)
    fall = math.sqrt(2.0 * height / G)
    count = math.floor((1.0 / fall + 1.0) / 2.0)
    assert len(ends.impacts) == count
    assert ends.impacts["velocity_first_after"][-1, 1] == pytest.approx(G * fall * e**count, rel=1e-9)
