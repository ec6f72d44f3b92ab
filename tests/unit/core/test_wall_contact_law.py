"""The law of two frictions at a wall has one solution, which the core finds."""

import itertools
import random
from collections.abc import Iterator
from fractions import Fraction

import pytest
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
