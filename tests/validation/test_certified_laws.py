"""Certified runs that are damped, on a table that slows discs, or at a tie of stick and slide: closed forms."""

import math
from fractions import Fraction

from mpmath import mp, mpf
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation.mpmath_runs import find_outside_radii

from carom import certify, solve_pic
from carom.catalogue import catalogue
from carom.comparator.horizon import Horizon
from carom.execution.scene_reference import build_reference
from carom.solvers.certified.result import Degenerate, Ending


def test_certified_reference_of_a_landing_ball_is_scored_up_to_contact() -> None:
    """The requested reference of a landing ball is a certified run that covers the whole scene."""
    trace = solve_pic(catalogue()["gravity/ladder"].scene.model_copy(update={"duration_s": 5.0}))
    reference = build_reference(trace, is_requested=True, time_budget_s=1e6)  # however slow the machine is
    assert reference.trace.method == "certified"
    assert reference.horizon_s == reference.trace.contact_s < reference.trace.end_time_s == 5.0
    assert isinstance(reference.certified, Horizon)
    assert reference.certified.covers_the_scene


def test_impact_at_the_end_of_a_scene_is_decided_to_the_last_bit() -> None:
    """An impact at 4 log 2 s occurs only in scenes whose end, a neighbouring float, is not earlier."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    with mp.workdps(60):
        met = 4 * mp.log(2)
        for ends_s in (math.nextafter(float(met), 0.0), float(met), math.nextafter(float(met), 9.0)):
            scene = staged("end", disc, wall, damping_per_s=0.25, duration_s=ends_s)
            certified = certify(scene)
            assert certified.ending is Ending.COMPLETED
            assert len(certified) == (mpf(ends_s) >= met)


def test_damped_disc_never_reaches_a_wall_at_its_limit() -> None:
    """A damped disc of 1 m/s moves less than 2 m in any time, so it never meets a wall exactly 2 m away."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    assert len(certify(staged("never", disc, wall, damping_per_s=0.5, duration_s=1000.0))) == 0


def test_bounce_and_stop_on_a_table_match_the_closed_form() -> None:
    """On a decelerating table a bounce and the stop after it are within their radii of the 60-digit closed form."""
    disc, wall = disc_at(0.0, 0.0, 1.5, -2.0, r=0.25), wall_at(0.0, -1.0, 0.0, 1.0)
    scene = staged("bank", disc, wall, wall_restitution=0.8, table_deceleration_m_s2=0.7, duration_s=9.0)
    certified = certify(scene)
    with mp.workdps(60):
        a, e = mpf(0.7), mpf(0.8)
        way = mpf(0.75) * mpf(2.5) / 2  # at 2.5 m/s, of which 2 are towards the wall
        left = mp.sqrt(mpf(2.5) ** 2 - 2 * a * way)
        met = (mpf(2.5) - left) / a
        after = [left * mpf(3) / 5, e * left * 4 / 5]
        speed = mp.sqrt(after[0] ** 2 + after[1] ** 2)
        on = speed**2 / (2 * a)
        place = [way * 3 / 5 + on * after[0] / speed, -mpf(0.75) + on * after[1] / speed]
        impacts, radii = certified.trace.impacts, certified.radii
        assert find_outside_radii(impacts["time_s"], radii["time_s"], [met]) == []
        assert find_outside_radii(impacts["velocity_first_after"], radii["velocity_first_after"], after) == []
        assert find_outside_radii(certified.trace.final_position_m, certified.final_position_radius_m, place) == []
    assert certified.trace.final_velocity_m_s.tolist() == [[0.0, 0.0]]


def test_disc_that_stops_at_a_wall_is_a_graze() -> None:
    """A disc whose stopping distance v^2/(2 a) equals the gap to a wall ends the certified run as a graze."""
    disc, wall = disc_at(0.0, 0.0, 2.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    degeneracy = certify(staged("touch", disc, wall, table_deceleration_m_s2=1.0, duration_s=5.0)).degeneracy
    assert require_value(degeneracy).kind is Degenerate.GRAZE


def test_exact_tie_of_stick_and_slide_is_certified() -> None:
    """At |s| = 3 f (1 + e) w_n both branches are equal, so the run completes; dyadic numbers make this exact."""
    # With velocity (9/4, -1), f = 1/2 and e = 1/2 the disc rolls: (3/2, 1/2) with spin -3/2, since T = f (1 + e) w_n =
    # 3/4.
    disc, laws = disc_at(0, 2, 2.25, -1.0, r=1), {"wall_friction": 0.5, "wall_restitution": 0.5}
    scene = staged("floor", disc, wall_at(0.0, 0.0, 0.0, 1.0), **laws, duration_s=2.0)
    found = certify(scene, digits=30)
    assert found.ending is Ending.COMPLETED
    assert found.trace.impacts["velocity_first_after"].tolist() == [[1.5, 0.5]]
    assert require_value(found.trace.spins).tolist() == [(0.0, 0.0, -1.5, 0.0)]
    assert require_value(found.spin_radii)["first_after"].max() < 1e-15
    assert [len(row) for row in found.decimals] == [6]
    assert Fraction(found.decimals[0][-1]) == Fraction(-3, 2)
