"""Times of fall onto a half-plane and a fixed disc against exact arithmetic, and which root in each degenerate case."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest
from flint import acb, acb_poly, ctx
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf, sqrt
from tests.lengths import each

from carom.core import primitives

probe = pytest.importorskip("tests.probe")

DIGITS = 80
lengths = st.floats(-1e3, 1e3)
speeds = st.floats(-1e2, 1e2)


def pair(value: float) -> tuple[float, float]:
    return (value, 0.0)


def descent(gap: float, speed: float, pull: float) -> float:
    time: float = probe.descent_time(pair(gap), pair(speed), pair(pull))
    return time


def units_off(found: float, exact: Any) -> float:
    """Return the distance from the exact value in units of its last place."""
    return float(abs(mpf(found) - exact)) / math.ulp(float(exact))


def exact_descent(gap: Any, speed: Any, pull: Any) -> Any:
    """Return the earliest t > 0 at which ``gap + speed t + pull t^2/2`` closes, gap > 0; None where it never does."""
    if pull == 0:
        return -gap / speed if speed < 0 else None
    d = speed * speed - 2 * pull * gap
    if d <= 0:
        return None
    root = sqrt(d)
    times = [t for t in ((-speed - root) / pull, (-speed + root) / pull) if t > 0 and speed + pull * t < 0]
    return min(times, default=None)


@given(st.floats(1e-12, 1e3), speeds, st.floats(-20, 20))
def test_a_fall_is_right_to_four_units_in_the_last_place(gap: float, speed: float, pull: float) -> None:
    """The earlier closing root of the quadratic, from apart, is within 4 ulp of the exact one."""
    assume(all(value == 0 or abs(value) > 1e-60 for value in (speed, pull)))
    mp.dps = DIGITS
    exact = exact_descent(mpf(gap), mpf(speed), mpf(pull))
    found = descent(gap, speed, pull)
    if exact is None:
        assert found == math.inf
    else:
        assert units_off(found, exact) <= 4


@given(st.floats(0.5, 2), st.floats(0.5, 2), st.integers(-(2**20), 2**20).filter(bool))
def test_a_path_that_turns_just_before_or_behind_a_ceiling_is_told_apart(pull: float, speed: float, nudge: int) -> None:
    """Hit or miss is right, and so is the time, for an apex as near to the wall as 2^-80 of its height."""
    mp.dps = DIGITS
    apex = Fraction(speed) ** 2 / (2 * Fraction(pull))
    gap = apex * (1 + Fraction(nudge, 2**80))
    high = float(gap)
    low = float(gap - Fraction(high))
    found = probe.descent_time((high, low), pair(-speed), pair(pull))
    exact = exact_descent(mpf(high) + mpf(low), -mpf(speed), mpf(pull))
    assert (found == math.inf) == (exact is None)
    if exact is not None:
        assert units_off(found, exact) <= 8


@each(
    ("gap", "speed", "pull", "time"),
    [
        (0.0, -1.0, 5.0, 0.0),  # touches and approaches: an impact now, whatever pulls it away later
        (0.0, 0.0, -5.0, 0.0),  # touches and is pulled on: resting contact
        (0.0, 0.0, 0.0, math.inf),  # touches and slides
        (0.0, 0.0, 5.0, math.inf),  # touches and is pulled off
        (0.0, 1.0, 5.0, math.inf),
        (0.0, 2.0, -4.0, 1.0),  # thrown up: back after 2 v/g
        (1.0, 0.0, -2.0, 1.0),  # dropped: sqrt(2 h/g)
        (1.0, 0.0, 0.0, math.inf),
        (1.0, 1.0, 0.0, math.inf),
        (1.0, -1.0, 0.0, 1.0),
        (1.0, 1.0, 3.0, math.inf),
        (2.0, -2.0, 1.0, math.inf),  # turns exactly at the wall: D = 0, a graze of zero depth
        (1.5, -2.0, 1.0, 1.0),  # passes the wall and would come back: the earlier root
        (-(2.0**-60), 2.0, -4.0, 1.0),  # a rounding inside and leaving: the later root, where it comes back
        (-1.0, 1.0, -1.0, 1.0),  # inside, and pulled back before it is out: rests where it turns
    ],
)
def test_which_root_it_is_follows_from_signs(gap: float, speed: float, pull: float, time: float) -> None:
    """Touching, leaving, grazing, resting: each case has one answer, and no small number decides it."""
    assert descent(gap, speed, pull) == time


def test_a_falling_disc_lands_on_the_floor_and_on_a_slope() -> None:
    """From 3-4-5: a drop of 4.9 m at 9.8 m/s^2 takes 1 s; on a slope both gap and gravity count along its normal."""
    floor, down = (7.0, 0.0, 0.0, 1.0), (0.0, -9.8)
    time = primitives.wall_fall_time(0.0, 5.9, 3.0, 0.0, 1.0, floor, *down)
    assert time == pytest.approx(1, rel=1e-15)
    slope, gap, pull = (0.0, 0.0, 0.6, 0.8), 2.0, 9.8 * 0.8
    time = primitives.wall_fall_time(0.6 * 3, 0.8 * 3, 0.0, 0.0, 1.0, slope, *down)
    assert time == pytest.approx(math.sqrt(2 * gap / pull), rel=1e-14)


@given(st.floats(1e-6, 1e6), st.floats(-1e6, -1e-6))
def test_the_way_back_is_twice_the_way_up(speed: float, pull: float) -> None:
    """A body that leaves at v comes back after 2 v/g, to an ulp."""
    assert descent(0.0, speed, pull) == pytest.approx(-2 * speed / pull, rel=2**-51)


# An immovable disc ----------------------------------------------------------------------------------------------------


@given(st.floats(-3, 3), st.floats(-3, 4), st.floats(-3, 3), st.floats(-3, 6), st.floats(0.1, 1.5))
def test_the_quartic_agrees_with_all_roots_by_another_method(
    x: float, y: float, vx: float, vy: float, fixed_radius: float
) -> None:
    """The time is the least positive real root as a certified root finder gives it."""
    radius, gx, gy = 0.2, 0.3, -9.8
    assume(math.hypot(x, y) > radius + fixed_radius + 1e-6)
    mp.dps, ctx.prec = DIGITS, 600
    px, py, ux, uy, ax, ay = map(acb, (x, y, vx, vy, gx, gy))
    reach = acb(radius) + acb(fixed_radius)
    quartic = [
        px * px + py * py - reach * reach,
        2 * (px * ux + py * uy),
        ux * ux + uy * uy + px * ax + py * ay,
        ux * ax + uy * ay,
        (ax * ax + ay * ay) / 4,
    ]
    roots = acb_poly(quartic).roots(tol=1e-60)  # balls, none of which meets another
    times = [root.real for root in roots if root.imag.contains(0) and root.real > 0]
    exact = min((mpf(time.str(50, radius=False)) for time in times), default=None)
    found = primitives.disc_fall_time(x, y, vx, vy, radius, 0.0, 0.0, fixed_radius, gx, gy)
    if exact is None:
        assert found == math.inf
    else:
        assert units_off(found, exact) <= 1


def test_a_disc_dropped_on_another_takes_the_time_of_free_fall() -> None:
    """Straight down on an immovable disc, the gap of 4.9 m closes in a second; from aside it never does."""
    assert primitives.disc_fall_time(0, 6.4, 0, 0, 0.5, 0, 0, 1, 0, -9.8) == pytest.approx(1, rel=1e-15)
    assert primitives.disc_fall_time(1.75, 6.4, 0, 0, 0.5, 0, 0, 1, 0, -9.8) == math.inf


@each(
    ("y", "vx", "vy", "leaving", "time"),
    [
        (1.5, 0.0, -1.0, None, 0.0),  # touches and approaches
        (1.5, 0.0, 0.0, None, 0.0),  # rests on top
        (1.5, 5.0, 0.0, None, math.inf),  # touches, too fast along the rim for gravity to hold it: v^2 > g R
        (1.5, 0.0, 4.0, None, 1.0),  # thrown up at v: back after 2 v/g
        (1.5, 0.0, 0.0, 0.0, 0.0),  # has just hit it with restitution 0
        (1.5, 0.0, -1e-17, 0.0, 0.0),  # the same, and what rounding made of its velocity does not count
        (-1.5, 0.0, 0.0, None, math.inf),  # touches from below and falls off
    ],
)
def test_contact_with_an_immovable_disc_is_decided_by_signs(
    y: float, vx: float, vy: float, leaving: float | None, time: float
) -> None:
    """In contact, the lowest power of the gap that is not zero says whether it opens."""
    found = primitives.disc_fall_time(0, y, vx, vy, 0.5, 0, 0, 1, 0, -8, leaving)
    assert found == time
