"""The motion of a disc in contact: that one answer holds, and what infinitely many bounces leave of its slip."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import pytest
from mpmath import mp, mpf
from tests.lengths import long_after

from carom.physics.contact_law import Press, left_of_slip, rates, slip_ends


def exact_rates(
    press: tuple[Fraction, Fraction, Fraction, Fraction], slip: Fraction
) -> list[tuple[Fraction, Fraction, bool]]:
    """Return every answer that Coulomb's inclusion admits, branch by branch, in fractions."""
    normal, along, friction, ratio = press
    found = []
    for sign in (1, 0, -1):
        most = friction * normal
        force = sign * most if sign else along / (1 + ratio)
        rate = along - force * (1 + ratio)
        holds = sign == 0
        fits = abs(force) <= most if holds else slip * sign > 0 or (slip == 0 and rate * sign > 0)
        if fits and not (holds and slip != 0):
            found.append((along - force, -force * ratio, holds))
    return found


def test_exactly_one_branch_of_coulombs_law_holds() -> None:
    """Of 5,000 contacts in small fractions each has one answer, and it is the one that is given."""
    rng = random.Random(1)
    for _ in range(5000):
        normal, ratio = Fraction(rng.randint(1, 8), rng.choice([1, 2, 4])), Fraction(rng.choice([0, 1, 2, 4]))
        along, friction = Fraction(rng.randint(-8, 8), 4), Fraction(rng.randint(0, 8), 8)
        slip = Fraction(rng.choice([0, 0, 1, -1, 3]), 2)
        (expected,) = exact_rates((normal, along, friction, ratio), slip)
        press = Press(*map(float, (normal, along, friction, ratio)))
        found = rates(press, float(slip))
        assert found.holds == expected[2], press
        assert (found.along, found.rim) == pytest.approx([float(part) for part in expected[:2]], rel=1e-15, abs=1e-15)


def test_at_the_steepest_slope_that_holds_a_roll_both_branches_agree() -> None:
    """With a = f P (1 + 1/k) rolling and slipping give the same rates."""
    press = Press(8.0, 6.0, 0.25, 2.0)
    assert rates(press, 0.0)[:2] == rates(press, 1e-300)[:2] == (4.0, -4.0)


def test_a_slip_ends_when_it_falls() -> None:
    """One of 3 m/s that falls by 6 m/s^2 ends after half a second; one that grows, or is 0, never does."""
    assert slip_ends(3.0, -6.0) == slip_ends(-3.0, 6.0) == 0.5
    assert slip_ends(3.0, 6.0) == slip_ends(0.0, -6.0) == slip_ends(3.0, 0.0) == math.inf


def slip_after_stepping(press: Press, slip: float, approach: float, restitution: float) -> mpf:
    """Bounce until nothing is left at 50 digits; return the slip then."""
    with mp.workdps(50):
        s, w, e = mpf(slip), mpf(approach), mpf(restitution)
        give = 1 + mpf(press.inverse_inertia_ratio)
        while w > mpf(10) ** -45:
            most = mpf(press.friction) * (1 + e) * w * give
            s = mpf(0) if abs(s) <= most else s - mp.sign(s) * most
            w *= e
            s += mpf(press.along_m_s2) * 2 * w / mpf(press.normal_m_s2)
        return s


@pytest.mark.parametrize("landings", long_after(1, [30, 150]))
def test_what_is_left_of_a_slip_is_what_stepping_through_the_bounces_leaves(landings: int) -> None:
    """Of landings those whose slip keeps its sign agree to rounding; of the others next to nothing is left.

    Theirs is no more than what hops can give: the closed form says 0, for bounces as small as a clock can tell.
    """
    rng, slid = random.Random(2), 0
    for _ in range(landings):
        press = Press(rng.uniform(1, 10), rng.uniform(-5, 5), rng.uniform(0, 0.8), rng.choice([0.0, 1.0, 2.0, 2.5]))
        slip, approach, e = rng.uniform(-4, 4), 10 ** rng.uniform(-3, 0.5), rng.uniform(0.05, 0.9)
        exact = slip_after_stepping(press, slip, approach, e)
        found = left_of_slip(press, slip, approach, e)
        if found:
            slid += 1
            assert found == pytest.approx(float(exact), rel=1e-13, abs=1e-14)
        else:
            hop = 2.0 * abs(press.along_m_s2) * e / press.normal_m_s2
            assert abs(float(exact)) <= hop * approach / (1.0 - e)
    assert landings / 5 < slid < landings - 2


def test_a_slip_that_is_gone_stays_gone() -> None:
    """Bounces do nothing to a disc that rolls already."""
    assert left_of_slip(Press(10.0, 0.0, 0.3, 2.0), 0.0, 1.0, 0.5) == 0.0
