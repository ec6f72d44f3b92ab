"""The time of impact is right whatever the size of the numbers: tiny, huge, and both in one pair."""

import math
from typing import Any

import numpy as np
import pytest
from benchmarks.time_of_impact import CLASSES, pairs_of_class
from flint import arb
from numpy.typing import NDArray
from tests.cases import each, release_after
from tests.unit.core.exact_time import compute_exact_time, compute_ulp_error

from carom import time_of_impact

Array = NDArray[np.float64]

#: Bits in which sums and products of four floats of any size are exact: four times 2,098, the bits from the least
#: float to the greatest, and twice more for their sums and squares.
EXACT = 20_000
LENGTHS, SPEEDS = [0, 1, 4, 5, 6, 9], [2, 3, 7, 8]


def compute_times(columns: Array) -> Array:
    """Return the times of ten columns, in the order of `pair_time`'s arguments."""
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = columns
    pairs = [np.stack(pair, axis=-1) for pair in ((x1, y1), (vx1, vy1), (x2, y2), (vx2, vy2))]
    return np.asarray(time_of_impact(pairs[0], pairs[1], r1, pairs[2], pairs[3], r2))


def draw_pairs_of_any_size(count: int, seed: int, least: float, most: float) -> Array:
    """Return columns of pairs, each number drawn from all magnitudes between two powers of ten.

    Numbers drawn blindly seldom make a hit, so four of five second discs aim at the first, more or less.
    """
    rng = np.random.default_rng(seed)

    def sizes(*shape: int) -> Array:
        drawn: Array = 10.0 ** rng.uniform(least, most, (*shape, count)) * rng.choice([-1.0, 1.0], (*shape, count))
        return drawn

    p1, v1, p2, v2 = np.zeros((2, count)), np.zeros((2, count)), sizes(2), sizes(2)
    p2[rng.random((2, count)) < 0.15] = 0.0
    kind = np.arange(count) % 5
    with np.errstate(all="ignore"):
        aim = -p2 / np.abs(p2).max(axis=0) * np.abs(v2[0])
        aim[0, kind == 1] *= 1 + 10.0 ** rng.uniform(-17, 0, count)[kind == 1]
        aim[0, kind == 2] += v2[0, kind == 2]
    v2 = np.where(kind == 3, v2, aim)
    p1[:, kind == 4], v1[:, kind == 4] = sizes(2)[:, kind == 4], sizes(2)[:, kind == 4]
    r1, r2 = np.abs(sizes(2))
    columns: Array = np.array([*p1, *v1, r1, *p2, *v2, r2])
    kept: Array = columns[:, np.isfinite(columns).all(axis=0) & (r1 > 0) & (r2 > 0)]
    return kept


def assert_right(row: Array, found: float) -> bool:
    """Assert that a time is the exact one to 2 units in the last place; return whether there is an impact."""
    exact = compute_exact_time(row, EXACT)
    if exact is None or exact >= arb(2) ** 1024:
        assert found == math.inf
        return False
    assert found == 0.0 if exact == 0 else compute_ulp_error(found, exact) <= 2.0
    return True


def assert_all_right(columns: Array) -> None:
    found = compute_times(columns)
    hits = sum(assert_right(row, time) for row, time in zip(columns.T, found.tolist(), strict=True))
    assert hits >= len(found) // 10  # or the classes would try nothing
    scalar = [time_of_impact(row[:2], row[2:4], row[4], row[5:7], row[7:9], row[9]) for row in columns.T]
    assert scalar == found.tolist()


SPANS = [(-320.0, 307.9), (-150.0, 150.0), (-60.0, 60.0), (-25.0, 25.0)]


@each("seeds", [1, pytest.param(50, marks=pytest.mark.release)])
@each("least, most", SPANS)
def test_time_is_right_for_numbers_of_any_size(least: float, most: float, seeds: int) -> None:
    """For numbers of all magnitudes in one pair, hit or miss is exact and a time is within 2 ulp."""
    for seed in range(1, 1 + seeds):
        assert_all_right(draw_pairs_of_any_size(80, seed, least, most))


@each("name", CLASSES)
@each("length, speed", release_after(2, [(500, 0), (-900, -900), (-500, 0), (0, 500), (0, -500), (900, 900)]))
def test_scaling_by_powers_of_two_scales_times_exactly(name: str, length: int, speed: int) -> None:
    """Scaling lengths or speeds by powers of two scales each time by exactly the same power."""
    columns = pairs_of_class(name, 60, 3)
    plain = compute_times(columns)
    columns[LENGTHS] = np.ldexp(columns[LENGTHS], length)
    columns[SPEEDS] = np.ldexp(columns[SPEEDS], speed)
    assert np.array_equal(compute_times(columns), np.ldexp(plain, length - speed))
    assert np.isfinite(plain).any()


@each(
    "pair, time_s",
    [
        # Products overflow: the second disc rises by 1e-10 of its radius a second.
        (((0.0, 0.0), (0.0, 0.0), 1e160, (3e160, 1e160), (-1e160, 1e150), 1e160), 3 - math.sqrt(3)),
        # The difference of coordinates overflows: 2e308 m less two radii of 1e307 m, at 1e307 m/s.
        (((-1e308, 0.0), (0.0, 0.0), 1e307, (1e308, 0.0), (-1e307, 0.0), 1e307), 18.0),
        # A far disc overlaps by 2^-53 of the contact distance when it passes.
        (((0.0, 0.0), (0.0, 0.0), 0.5, (2.0**30, 1 - 2.0**-53), (-1.0, 0.0), 0.5), 2.0**30 - math.sqrt(2.0**-52)),
        # Far or fast discs approach each other symmetrically.
        (((-(2.0**1000), 0.0), (1.0, 0.0), 1.0, (2.0**1000, 0.0), (-1.0, 0.0), 1.0), 2.0**1000),
        (((0.0, -3.0), (0.0, 2.0**1000), 1.0, (0.0, 3.0), (0.0, -(2.0**1000)), 1.0), 2.0**-999),
    ],
)
def test_time_is_found_at_the_limits_of_floats(pair: tuple[Any, ...], time_s: float) -> None:
    """Discs meet at the known time, in the scalar and the array form, though intermediate results overflow."""
    found = time_of_impact(*pair)
    assert found == pytest.approx(time_s, rel=1e-9)
    assert time_of_impact(*([part] for part in pair)) == [found]
