"""Certified runs of damped scenes: closed forms of 60 digits, PIC, and impacts at the very end."""

from __future__ import annotations

import math

import pytest
from mpmath import mp, mpf
from tests.stage import disc_at, staged, wall_at
from tests.validation.mpmath_runs import outside

from carom import certify
from carom.solvers.certified.result import Ending


@pytest.mark.parametrize("damping", [1e-9, 0.5, 30.0])
def test_a_bounce_is_within_its_radii_of_60_digits(damping: float) -> None:
    """A disc comes to a wall after -log(1 - c s)/c, and everything after it is in closed form."""
    disc, wall = disc_at(0.0, 0.0, -40.0, 3.0, r=0.5), wall_at(-1.5, 0.0, 1.0, 0.0)
    certified = certify(staged("bounce", disc, wall, wall_restitution=0.7, damping_per_s=damping, duration_s=0.9))
    with mp.workdps(60):
        c, s, e = mpf(damping), mpf(1) / 40, mpf(0.7)
        end = (1 - mp.exp(-c * mpf(0.9))) / c
        met, left, kept = -mp.log1p(-c * s) / c, 1 - c * s, mp.exp(-c * mpf(0.9))
        truth = {
            "time_s": [met],
            "velocity_first_before": [-40 * left, 3 * left],
            "velocity_first_after": [40 * e * left, 3 * left],
        }
        for name, parts in truth.items():
            assert outside(certified.trace.impacts[name], certified.radii[name], parts) == [], name
        places, velocities = (-1 + 40 * e * (end - s), 3 * end), (40 * e * kept, 3 * kept)
        assert outside(certified.trace.final_position_m, certified.final_position_radius_m, places) == []
        assert outside(certified.trace.final_velocity_m_s, certified.final_velocity_radius_m_s, velocities) == []


def test_an_impact_at_the_end_is_told_to_the_last_bit() -> None:
    """A wall is met after 4 log 2 seconds, which is no float64: of scenes that end at floats about it, some have it."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    with mp.workdps(60):
        met = 4 * mp.log(2)
        for ends_s in (math.nextafter(float(met), 0.0), float(met), math.nextafter(float(met), 9.0)):
            scene = staged("end", disc, wall, damping_per_s=0.25, duration_s=ends_s)
            certified = certify(scene)
            assert certified.ending is Ending.COMPLETED
            assert len(certified) == (mpf(ends_s) >= met)


def test_a_wall_just_out_of_reach_is_not_met() -> None:
    """A disc of 1 m/s gets 2 m far in all time: never to a wall that is exactly as far away."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    assert len(certify(staged("never", disc, wall, damping_per_s=0.5, duration_s=1000.0))) == 0
