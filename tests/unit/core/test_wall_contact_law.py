"""The law of two frictions at a wall, and the slip after infinitely many bounces, compared with exact numbers."""

import itertools
import random
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import pytest
from mpmath import mp, mpf
from tests.cases import each, release_after

core_functions = pytest.importorskip("tests.core_functions")


def find_admitted_solutions(
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


def draw_problems(
    count: int,
) -> Iterator[tuple[Fraction, Fraction, tuple[Fraction, Fraction], Fraction, tuple[int, int]]]:
    """Draw problems in small numbers that floats hold exactly, so that equality is as common as the rest."""
    rng = random.Random(1)

    def drawn() -> Fraction:
        return Fraction(rng.randint(-6, 6), rng.choice((1, 2, 4)))

    for _ in range(count):
        most = (abs(drawn()), abs(drawn()))
        signs = (rng.choice((0, 0, 1, -1)), rng.choice((0, 0, 1, -1)))
        yield drawn(), drawn(), most, Fraction(rng.choice((1, 2, 4, 8, 2000)), 2), signs


@each("count", release_after(1, [150, 20_000]))
def test_share_frictions_returns_the_unique_exact_solution(count: int) -> None:
    """`share_frictions` returns the only solution of the two friction laws, to 1e-14."""
    # Exact fractions show that there is only one. A quantity reported as held is exactly 0.
    for s1, q1, most, y, signs in draw_problems(count):
        ((slip, rim),) = find_admitted_solutions(s1, q1, most, y, signs)
        by = core_functions.share_frictions(float(s1), float(q1), tuple(map(float, most)), float(y), signs)
        f, turning = Fraction(by["friction"]), Fraction(by["turning"])
        found = float(s1 - f - turning * y), float(q1 - turning * y)
        assert found == pytest.approx((float(slip), float(rim)), rel=1e-14, abs=1e-14), (s1, q1, most, y, signs)
        assert not by["sticks"] or slip == 0
        assert not by["blocks"] or rim == 0


class Press(NamedTuple):
    """`Press` of wall_contact_law.h."""

    normal: float
    along: float
    friction: float
    inverse_inertia_ratio: float
    rolling_resistance: float = 0.0


def compute_slip_by_stepping(press: Press, slip: float, approach: float, restitution: float) -> mpf:
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
def test_slip_after_bounces_matches_stepping_at_50_digits(landings: int) -> None:
    """The slip after infinitely many bounces equals that of stepping through them at 50 digits, to 1e-13."""
    # Where the result is 0, the exact slip is at most what the tangential acceleration adds during the bounces.
    rng, slid = random.Random(2), 0
    for _ in range(landings):
        press = Press(rng.uniform(1, 10), rng.uniform(-5, 5), rng.uniform(0, 0.8), rng.choice([0.0, 1.0, 2.0, 2.5]))
        slip, approach, e = rng.uniform(-4, 4), 10 ** rng.uniform(-3, 0.5), rng.uniform(0.05, 0.9)
        exact = compute_slip_by_stepping(press, slip, approach, e)
        found = core_functions.slip_after_bounces(press, slip, approach, e)
        if found:
            slid += 1
            assert found == pytest.approx(float(exact), rel=1e-13, abs=1e-14)
        else:
            hop = 2.0 * abs(press.along) * e / press.normal
            assert abs(float(exact)) <= hop * approach / (1.0 - e)
    assert landings / 5 < slid < landings - 2
