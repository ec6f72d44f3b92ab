"""Times of fall onto a half-plane and a fixed disc against exact arithmetic, and which root in each degenerate case."""

import math
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf, sqrt
from tests.cases import each

from carom.core import primitives

core_functions = pytest.importorskip("tests.core_functions")

DIGITS = 80


def compute_ulp_error(found: float, exact: Any) -> float:
    """Return the distance from the exact value in units of its last place."""
    return float(abs(mpf(found) - exact)) / math.ulp(float(exact))


def compute_exact_descent_time(gap: Any, speed: Any, pull: Any) -> Any:
    """Return the earliest t > 0 at which ``gap + speed t + pull t^2/2`` closes, gap > 0; None where it never does."""
    if pull == 0:
        return -gap / speed if speed < 0 else None
    d = speed * speed - 2 * pull * gap
    if d <= 0:
        return None
    root = sqrt(d)
    times = [t for t in ((-speed - root) / pull, (-speed + root) / pull) if t > 0 and speed + pull * t < 0]
    return min(times, default=None)


@given(st.floats(0.5, 2), st.floats(0.5, 2), st.integers(-(2**20), 2**20).filter(bool))
def test_descent_time_distinguishes_a_hit_from_a_near_miss(pull: float, speed: float, nudge: int) -> None:
    """Hit or miss is decided correctly for an apex that is off the wall by 2^-80 to 2^-60 of its height."""
    mp.dps = DIGITS
    apex = Fraction(speed) ** 2 / (2 * Fraction(pull))
    gap = apex * (1 + Fraction(nudge, 2**80))
    high = float(gap)
    low = float(gap - Fraction(high))
    found = core_functions.descent_time((high, low), (-speed, 0.0), (pull, 0.0))
    exact = compute_exact_descent_time(mpf(high) + mpf(low), -mpf(speed), mpf(pull))
    assert (found == math.inf) == (exact is None)
    if exact is not None:
        assert compute_ulp_error(found, exact) <= 8


@each(
    "gap, speed, pull, time",
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
def test_descent_time_is_exact_in_degenerate_cases(gap: float, speed: float, pull: float, time: float) -> None:
    """Touching, leaving, grazing and resting paths each have one exact time, without any tolerance."""
    assert core_functions.descent_time((gap, 0.0), (speed, 0.0), (pull, 0.0)) == time


@each(
    "y, vx, vy, leaving, time",
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
def test_fall_time_in_contact_with_an_immovable_disc(
    y: float, vx: float, vy: float, leaving: float | None, time: float
) -> None:
    """A disc in contact with an immovable one gets the exact time of its next touch: 0, 1 s or infinity."""
    # The lowest power of the gap that is not zero decides whether the gap opens.
    found = primitives.disc_fall_time(0, y, vx, vy, 0.5, 0, 0, 1, 0, -8, leaving)
    assert found == time
