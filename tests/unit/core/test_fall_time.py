"""Times of fall of the core, compared with exact rational arithmetic, and their lower bounds."""

import math
import random
from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each, release_after
from tests.unit.core import fall_oracle as oracle
from tests.unit.core.fall_cases import ENCOUNTERS, Encounter

from carom.core.exact_quartic import find_closings
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import Mover
from carom.core.wall_parts import Pair

core = pytest.importorskip("tests.core_fall_functions")
core_functions = pytest.importorskip("tests.core_functions")

NEVER = math.inf


def compute_disc_time(case: Encounter) -> float:
    found: float = core.disc_fall_time(case.disc, case.fixed, case.acceleration, case.leaving)
    return found


def is_near(found: float, exact: float, ulps: int) -> bool:
    return found == exact or abs(found - exact) <= ulps * math.ulp(exact)


@each("count, seed", release_after(1, [(25, 1), (1500, 2)]))
@each("make", ENCOUNTERS)
def test_fall_time_onto_a_fixed_disc_is_exact(
    make: Callable[[random.Random], Encounter], count: int, seed: int
) -> None:
    """The fall time onto a fixed disc equals that of the exact rational solver to the bit."""
    rnd, hits = random.Random(seed), 0
    for _ in range(count):
        case = make(rnd)
        exact = oracle.compute_disc_time(case)
        assert compute_disc_time(case) == exact, case
        hits += exact < NEVER
    assert hits > count // 20


def test_fall_time_onto_a_half_plane_is_exact_to_4_ulp() -> None:
    """The fall time onto a half-plane is within 4 ulp of the exact one, also for a disc that just left it."""
    # A wall that is ruled out for 0.1 s is not met before.
    rnd = random.Random(5)
    for _ in range(300):
        nx, ny = rnd.choice([(0.0, 1.0), (0.6, 0.8), (math.cos(turn := rnd.uniform(0, 6)), math.sin(turn))])
        away = rnd.choice([0.0, rnd.uniform(-0.1, 3), rnd.choice([-1, 1]) * 10 ** rnd.uniform(-17, -1)])
        place, velocity = (nx * (0.5 + away), ny * (0.5 + away)), (rnd.gauss(0, 3), rnd.choice([0.0, rnd.gauss(0, 3)]))
        acceleration = rnd.choice([(0.0, -9.81), (0.0, 0.0), (rnd.gauss(0, 9), rnd.gauss(0, 9))])
        leaving = rnd.choice([None, None, 0.0, abs(rnd.gauss(0, 3))])
        gap, speed, pull = (
            Fraction(x) * Fraction(nx) + Fraction(y) * Fraction(ny) for x, y in (place, velocity, acceleration)
        )
        gap -= Fraction(0.5)
        if leaving is not None:
            gap, speed = Fraction(0), Fraction(leaving)
        exact = oracle.solve_quadratic_time(gap, speed, pull) if leaving is None or pull < 0 else NEVER
        numbers, disc = build_feature_row((0.0, 0.0, nx, ny), 0), Mover.at(place, velocity, 0.5)
        found = core.feature_fall_time(numbers, disc, acceleration, leaving)
        assert is_near(found, exact, 4) or oracle.is_doubtful(gap, speed, pull)
        if leaving is None and core.misses_feature(numbers, disc, acceleration, 0.1):
            assert exact >= 0.1


@given(st.floats(0.5, 2), st.floats(0.5, 2), st.integers(-(2**20), 2**20).filter(bool))
def test_descent_time_distinguishes_a_hit_from_a_near_miss(pull: float, speed: float, nudge: int) -> None:
    """Hit or miss is decided correctly for an apex that is off the wall by 2^-80 to 2^-60 of its height."""
    gap = Fraction(speed) ** 2 / (2 * Fraction(pull)) * (1 + Fraction(nudge, 2**80))
    high = float(gap)
    low = float(gap - Fraction(high))
    found = core_functions.descent_time((high, low), (-speed, 0.0), (pull, 0.0))
    exact = oracle.solve_quadratic_time(Fraction(high) + Fraction(low), -Fraction(speed), Fraction(pull))
    assert is_near(found, exact, 8)


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


# Closings of a polynomial ---------------------------------------------------------------------------------------------


def multiply_polynomials(*factors: list[Fraction]) -> list[Fraction]:
    """Return the product of polynomials, lowest power first."""
    found = [Fraction(1)]
    for factor in factors:
        terms = [Fraction(0)] * (len(found) + len(factor) - 1)
        for i, a in enumerate(found):
            for j, b in enumerate(factor):
                terms[i + j] += a * b
        found = terms
    return found


def to_pairs(powers: list[Fraction]) -> list[Pair]:
    powers = [*powers, *[Fraction(0)] * (5 - len(powers))]
    return [(high := float(power), float(power - Fraction(high))) for power in powers]


def draw_root(rnd: random.Random, kind: str) -> Fraction:
    if kind == "wide":
        return Fraction(rnd.choice([1, 1, 1, -1]) * 10 ** rnd.uniform(-8, 8))
    if kind == "halves":  # nearly half way between two floats
        root = rnd.uniform(0.01, 3)
        return Fraction(root) + Fraction(math.ulp(root)) * Fraction(rnd.uniform(0.25, 0.75))
    return Fraction(rnd.randint(-40, 80), 2 ** rnd.randint(0, 6)) if kind == "dyadic" else Fraction(rnd.uniform(-1, 3))


@each("kind", ["plain", "dyadic", "wide", "near", "complex", "halves"])
@each("count", release_after(1, [15, 400]))
def test_falls_of_a_polynomial_match_the_exact_solver_to_the_bit(kind: str, count: int) -> None:
    """`falls` returns every closing of random polynomials with the bits of the exact solver."""
    rnd = random.Random(7)
    for _ in range(count):
        roots = [draw_root(rnd, kind) for _ in range(4)]
        if kind == "near":
            roots[1] = roots[0] + Fraction(10 ** rnd.uniform(-13, -3))
        factors = [[-root, Fraction(rnd.choice([1, -1]))] for root in roots]
        if kind == "complex":
            factors[:2] = [[roots[0] ** 2 + Fraction(10 ** rnd.uniform(-18, 1)), -2 * roots[0], Fraction(1)]]
        powers = to_pairs(multiply_polynomials(*factors[: rnd.choice([3, 4, 4])]))
        assert core.falls(powers) == list(find_closings([Fraction(high) + Fraction(low) for high, low in powers]))


# Lower bounds ---------------------------------------------------------------------------------------------------------


@each("make", [*ENCOUNTERS[:4], ENCOUNTERS[6]])
def test_lower_bound_is_not_later_than_the_impact(make: Callable[[random.Random], Encounter]) -> None:
    """The lower bound of the fall time is at most the time of impact, for discs that did not just part."""
    rnd = random.Random(9)
    for _ in range(300):
        case = make(rnd)._replace(leaving=None)
        assert core.pair_lower_bound(case.disc, case.fixed, case.acceleration) <= compute_disc_time(case)
