"""Times of fall of the core are those of exact rational arithmetic, and lower bounds are below them."""

import math
import random
from collections.abc import Callable
from fractions import Fraction

import pytest
from tests.cases import each, release_after
from tests.unit.core import fall_oracle as oracle
from tests.unit.core.fall_cases import (
    ENCOUNTERS,
    FEATURES,
    Encounter,
    Fall,
    draw_fall,
    draw_free,
    draw_graze,
    draw_near_miss,
    draw_past_an_end,
    draw_whole_number_arc,
)

from carom.core.exact_quartic import find_closings
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import Arc, Face, Mover
from carom.core.wall_parts import Pair

core = pytest.importorskip("tests.core_fall_functions")

NEVER = math.inf


def compute_disc_time(case: Encounter) -> float:
    found: float = core.disc_fall_time(case.disc, case.fixed, case.acceleration, case.leaving)
    return found


def compute_feature_time(case: Fall) -> float:
    numbers = build_feature_row(case.feature, 0)
    found: float = core.feature_fall_time(numbers, case.disc, case.acceleration, case.leaving)
    return found


def is_near(found: float, exact: float, ulps: int, error_s: float = 0.0) -> bool:
    return found == exact or abs(found - exact) <= ulps * math.ulp(exact) + error_s


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


MAKERS: list[Callable[[random.Random], Fall]] = [
    *(lambda rnd, kind=kind: draw_fall(rnd, kind) for kind in FEATURES),
    draw_past_an_end,
    draw_whole_number_arc,
]


@each("count, seed", release_after(1, [(16, 3), (1500, 4)]))
@each("make", MAKERS)
def test_fall_time_onto_a_wall_feature_is_exact(make: Callable[[random.Random], Fall], count: int, seed: int) -> None:
    """Fall times onto faces, vertices and arcs match rational arithmetic, to the bit or to 4 ulp."""
    rnd = random.Random(seed)
    for _ in range(count):
        case = make(rnd)
        found, right, arc = compute_feature_time(case), oracle.find_feature_times(case), case.feature
        # 4 ulp for faces, and for an arc that a disc reaches from the side: the time at which it enters the sector is a
        # quotient of pairs. To the bit for circles, except for the rounding of their place and reach to pairs.
        from_side = isinstance(arc, Arc) and arc.inside and arc.sector is not None
        ulps = 4 if from_side or isinstance(arc, Face) else 0
        errors_s = [
            oracle.estimate_arc_time_error(case, arc, exact) if isinstance(arc, Arc) and exact < NEVER else 0.0
            for exact in right
        ]
        near = [is_near(found, exact, ulps, error_s) for exact, error_s in zip(right, errors_s, strict=True)]
        assert not right or any(near), (case, found, right)


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


# The stages -----------------------------------------------------------------------------------------------------------


def count_decisions(make: Callable[[random.Random], Encounter], count: int) -> tuple[int, int, int]:
    rnd = random.Random(6)
    core.decided()
    for _ in range(count):
        compute_disc_time(make(rnd))
    counts: tuple[int, int, int] = core.decided()
    return counts


def test_floats_decide_most_random_misses() -> None:
    """Floats decide over 80% of randomly moving discs; pairs decide the rest, and the exact solver none."""
    floats, pairs, exact = count_decisions(draw_free, 1000)
    assert floats > 800
    assert floats + pairs == 1000
    assert exact == 0


@each("make", [draw_near_miss, draw_graze])
def test_near_grazes_rarely_need_the_exact_solver(make: Callable[[random.Random], Encounter]) -> None:
    """No near miss, and less than 40% of the grazes, need the exact solver."""
    _, _, exact = count_decisions(make, 1000)
    assert exact < 400 if make is draw_graze else exact == 0


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


@each("kind", FEATURES)
def test_ruled_out_feature_is_not_met_before_the_bound(kind: str) -> None:
    """A feature that `misses_feature` rules out within a time is not met before that time."""
    rnd, ruled_out = random.Random(10), 0
    for _ in range(100):
        case = draw_fall(rnd, kind)._replace(leaving=None)
        numbers, time = build_feature_row(case.feature, 0), compute_feature_time(case)
        for within in (0.01, 1.0, NEVER, time * (1 + 2.0**-40), time * 0.5):
            if core.misses_feature(numbers, case.disc, case.acceleration, within):
                assert time >= within
                ruled_out += 1
    assert ruled_out > 30
