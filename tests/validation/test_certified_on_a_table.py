"""Certified runs on a table that slows discs down: closed forms, and PIC on drawn tables."""

from __future__ import annotations

from mpmath import mp, mpf
from tests.stage import disc_at, staged, wall_at
from tests.validation.mpmath_runs import outside

from carom import certify
from carom.solvers.certified.result import Degenerate


def test_a_bounce_and_the_stop_after_it_are_within_their_radii_of_60_digits() -> None:
    """A disc that comes at an angle is braked, bounces, and is braked on: v^2 falls by 2 a s, and that stops it."""
    disc, wall = disc_at(0.0, 0.0, 1.5, -2.0, r=0.25), wall_at(0.0, -1.0, 0.0, 1.0)
    scene = staged("bank", disc, wall, wall_restitution=0.8, table_deceleration_m_s2=0.7, duration_s=9.0)
    certified = certify(scene)
    with mp.workdps(60):
        a, e = mpf(0.7), mpf(0.8)
        way = mpf(0.75) * mpf(2.5) / 2  # at 2.5 m/s, of which 2 are towards the wall
        left = mp.sqrt(mpf(2.5) ** 2 - 2 * a * way)
        met = (mpf(2.5) - left) / a
        after = (left * mpf(3) / 5, e * left * 4 / 5)
        speed = mp.sqrt(after[0] ** 2 + after[1] ** 2)
        on = speed**2 / (2 * a)
        place = (way * 3 / 5 + on * after[0] / speed, -mpf(0.75) + on * after[1] / speed)
        assert outside(certified.trace.impacts["time_s"], certified.radii["time_s"], [met]) == []
        assert outside(certified.trace.final_position_m, certified.final_position_radius_m, place) == []
        name = "velocity_first_after"
        assert outside(certified.trace.impacts[name], certified.radii[name], after) == []
    assert certified.trace.final_velocity_m_s.tolist() == [[0.0, 0.0]]


def test_a_disc_that_stops_where_it_would_touch_is_named() -> None:
    """Its way, v^2/(2 a), is exactly as long as the gap: a touch at speed 0, which no precision tells from a miss."""
    disc, wall = disc_at(0.0, 0.0, 2.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    degeneracy = certify(staged("touch", disc, wall, table_deceleration_m_s2=1.0, duration_s=5.0)).degeneracy
    assert degeneracy is not None
    assert degeneracy.kind is Degenerate.GRAZE
