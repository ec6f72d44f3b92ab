"""The motion of a disc in contact: that one answer holds, and what infinitely many bounces leave of its slip."""

import itertools
import math
import random
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import pytest
from mpmath import mp, mpf
from tests.cases import each, release_after

core_functions = pytest.importorskip("tests.core_functions")


class Press(NamedTuple):
    """`Press` of wall_contact_law.h."""

    normal: float
    along: float
    friction: float
    inverse_inertia_ratio: float
    rolling_resistance: float = 0.0


def rates(press: Press, slip: float, rim: float = 0.0) -> tuple[float, float, bool, bool]:
    found = core_functions.contact_rates(press, slip, rim)
    return found["along"], found["rim"], bool(found["sticks"]), bool(found["blocks"])


def admitted(
    s1: Fraction, q1: Fraction, most: tuple[Fraction, Fraction], y: Fraction, signs: tuple[int, int]
) -> set[tuple[Fraction, Fraction]]:
    """Return every s and q that the inclusion of two frictions admits: each of nine branches is tried, in fractions."""
    found = set()
    for of_slip, of_rim in itertools.product((0, 1, -1), repeat=2):
        # Sliding, f is F with the slip's sign, turning h is H with the rim's; what is held is 0.
        f, h = of_slip * most[0], of_rim * most[1]
        if not of_slip and not of_rim:
            f = s1 - q1
            h = q1 / y - f
        elif not of_slip:
            f = (s1 - h * y) / (1 + y)
        elif not of_rim:
            h = q1 / y - f
        s, q = s1 - f * (1 + y) - h * y, q1 - (f + h) * y
        fits = abs(f) <= most[0] and abs(h) <= most[1]
        for value, branch, sign in ((s, of_slip, signs[0]), (q, of_rim, signs[1])):
            fits &= branch == sign if sign else value * branch > 0 if branch else value == 0
        if fits:
            found.add((s, q))
    return found


def problems(count: int) -> Iterator[tuple[Fraction, Fraction, tuple[Fraction, Fraction], Fraction, tuple[int, int]]]:
    """Draw problems in small numbers that floats hold exactly, so that equality is as common as the rest."""
    rng = random.Random(1)

    def drawn() -> Fraction:
        return Fraction(rng.randint(-6, 6), rng.choice((1, 2, 4)))

    for _ in range(count):
        most = (abs(drawn()), abs(drawn()))
        signs = (rng.choice((0, 0, 1, -1)), rng.choice((0, 0, 1, -1)))
        yield drawn(), drawn(), most, Fraction(rng.choice((1, 2, 4, 8, 2000)), 2), signs


@each("count", release_after(1, [150, 20_000]))
def test_exactly_one_branch_of_two_frictions_holds_and_is_the_one_that_is_given(count: int) -> None:
    """Each problem has one answer in fractions, and `share_frictions` gives it; what is held at 0 is exact."""
    for s1, q1, most, y, signs in problems(count):
        ((slip, rim),) = admitted(s1, q1, most, y, signs)
        by = core_functions.share_frictions(float(s1), float(q1), tuple(map(float, most)), float(y), signs)
        f, turning = Fraction(by["friction"]), Fraction(by["turning"])
        found = float(s1 - f - turning * y), float(q1 - turning * y)
        assert found == pytest.approx((float(slip), float(rim)), rel=1e-14, abs=1e-14), (s1, q1, most, y, signs)
        assert not by["sticks"] or slip == 0
        assert not by["blocks"] or rim == 0


@each("count", release_after(1, [150, 20_000]))
def test_rates_are_those_of_the_law_of_two_frictions(count: int) -> None:
    """Rates of contacts are the law's to rounding, and what is reported as held is held."""
    for a, _, most, y, signs in problems(count):
        ((slip, rim),) = admitted(a, Fraction(0), most, y, signs if most[1] else (signs[0], 0))
        press = Press(1.0, float(a), float(most[0]), float(y), float(most[1]))
        along, turning, sticks, blocks = rates(press, float(signs[0]), float(signs[1]))
        assert (along + turning, turning) == pytest.approx((float(slip), float(rim)), rel=1e-14, abs=1e-14)
        assert not sticks or (signs[0] == 0 and slip == 0)
        assert not blocks or (signs[1] == 0 and rim == 0)


def test_a_disc_that_does_not_turn_is_held_up_to_friction() -> None:
    """With 1/k = 0 there is one friction, whatever the other's coefficient."""
    assert rates(Press(10.0, 3.0, 0.3, 0.0, 5.0), 0.0) == (0.0, 0.0, True, False)
    assert rates(Press(10.0, 4.0, 0.3, 0.0, 5.0), 0.0) == (1.0, 0.0, False, False)


def test_at_the_steepest_slope_that_holds_a_roll_both_branches_agree() -> None:
    """With a = f P (1 + 1/k) rolling and slipping give the same rates."""
    press = Press(8.0, 6.0, 0.25, 2.0)
    assert rates(press, 0.0)[:2] == rates(press, 1e-300)[:2] == (4.0, -4.0)


def test_a_speed_is_zero_after_its_share_of_the_rate() -> None:
    """One of 3 m/s that falls by 6 m/s^2 ends after half a second; one that grows, or is 0, never does."""
    assert core_functions.time_to_zero(3.0, -6.0) == core_functions.time_to_zero(-3.0, 6.0) == 0.5
    assert {core_functions.time_to_zero(*row) for row in ((3.0, 6.0), (0.0, -6.0), (3.0, 0.0))} == {math.inf}


def slip_after_stepping(press: Press, slip: float, approach: float, restitution: float) -> mpf:
    """Bounce until nothing is left at 50 digits; return the slip then."""
    with mp.workdps(50):
        s, w, e = mpf(slip), mpf(approach), mpf(restitution)
        give = 1 + mpf(press.inverse_inertia_ratio)
        while w > mpf(10) ** -45:
            most = mpf(press.friction) * (1 + e) * w * give
            s = mpf(0) if abs(s) <= most else s - mp.sign(s) * most
            w *= e
            s += mpf(press.along) * 2 * w / mpf(press.normal)
        return s


@each("landings", release_after(1, [20, 150]))
def test_what_is_left_of_a_slip_is_what_stepping_through_the_bounces_leaves(landings: int) -> None:
    """Of landings those whose slip keeps its sign agree to rounding; of the others next to nothing is left."""
    rng, slid = random.Random(2), 0
    for _ in range(landings):
        press = Press(rng.uniform(1, 10), rng.uniform(-5, 5), rng.uniform(0, 0.8), rng.choice([0.0, 1.0, 2.0, 2.5]))
        slip, approach, e = rng.uniform(-4, 4), 10 ** rng.uniform(-3, 0.5), rng.uniform(0.05, 0.9)
        exact = slip_after_stepping(press, slip, approach, e)
        found = core_functions.slip_after_bounces(press, slip, approach, e)
        if found:
            slid += 1
            assert found == pytest.approx(float(exact), rel=1e-13, abs=1e-14)
        else:
            hop = 2.0 * abs(press.along) * e / press.normal
            assert abs(float(exact)) <= hop * approach / (1.0 - e)
    assert landings / 5 < slid < landings - 2


def test_a_slip_that_is_gone_stays_gone() -> None:
    """Bounces do nothing to a disc that rolls already."""
    assert core_functions.slip_after_bounces(Press(10.0, 0.0, 0.3, 2.0), 0.0, 1.0, 0.5) == 0.0
