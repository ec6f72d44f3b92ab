"""Times of impact of two discs, and of a disc and a half-plane, against balls of 600 bits and rational numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest
from benchmarks.time_of_impact import CLASSES, carom_form, pairs_of_class
from flint import arb, ctx
from tests.cases import each, release_after
from tests.unit.core.exact_time import compute_exact_time, compute_ulp_error

from carom.core import primitives

CASES = 500


def assert_right(row: np.ndarray, found: float) -> None:
    exact = compute_exact_time(row)
    if exact is None:
        assert found == math.inf
    elif exact == 0:
        assert found == 0.0
    else:
        assert compute_ulp_error(found, exact) <= 2.0


@each("name, larger", [*((name, 1.0) for name in CLASSES), ("random", 8.0)])
def test_pair_time_is_right_to_2_ulp_in_every_class(name: str, larger: float) -> None:
    """On every class of input, a time is within 2 ulp of the exact one, and no hit or miss is confused."""
    columns = pairs_of_class(name, CASES, 1)
    columns[[4, 9]] *= larger
    for row, found in zip(columns.T, carom_form(columns).tolist(), strict=True):
        assert_right(row, found)


@each("name", CLASSES)
def test_error_free_form_alone_is_right_to_2_ulp(name: str) -> None:
    """The error-free form, used where the plain one is in doubt, is within 2 ulp on every class of input."""
    core_functions = pytest.importorskip("tests.core_functions")
    for row in pairs_of_class(name, 200, 11).T:
        assert_right(row, core_functions.exact_time(*row.tolist()))


def test_array_position_does_not_change_a_time() -> None:
    """The time of a pair has the same bits at any position, array length, stride and memory order."""
    columns = np.concatenate([pairs_of_class(name, 400, 7) for name in CLASSES], axis=1)
    columns = columns[:, np.random.default_rng(7).permutation(columns.shape[1])]
    scalar = [primitives.pair_time(*row) for row in columns.T.tolist()]
    for count in (0, 1, 127, 128, 129, columns.shape[1]):
        assert carom_form(columns[:, :count]).tolist() == scalar[:count]
    assert carom_form(columns[:, ::-3]).tolist() == scalar[::-3]
    assert carom_form(np.asfortranarray(columns)).tolist() == scalar


def compute_signs(row: list[float]) -> tuple[int, int, int]:
    """Return the signs of b, c and D in rational arithmetic."""
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = (Fraction(value) for value in row)
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, c, cross = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach, dx * uy - dy * ux
    d = (ux * ux + uy * uy) * reach * reach - cross * cross
    return (b > 0) - (b < 0), (c > 0) - (c < 0), (d > 0) - (d < 0)


def build_ties(kind: str, count: int) -> list[list[float]]:
    """Return pairs for which b, c or D is exactly 0.

    Return equally many pairs with one number changed by a unit in its last place. The directions follow Pythagorean
    triples, so that all numbers are rational. The first disc has 2^-60 or less of what the second has, so that no
    single float holds position, velocity and radii as one sees them from the other.
    """
    rng = np.random.default_rng(12)
    along, aside = {"graze": (-(2.0**20), 1.0), "touching": (-1.0, 0.0), "sliding": (0.0, 1.0)}[kind]
    rows = []
    for k in range(count):
        m, n = sorted(int(a) for a in rng.choice(60, 2, replace=False) + 1)
        p, q, contact = n * n - m * m, 2 * m * n, n * n + m * m
        x, y, pace = along * p - aside * q, along * q + aside * p, float(rng.integers(1, 100))
        rest = 2.0 ** -int(rng.integers(60, 80))
        first = [-x * rest, -y * rest, -p * pace * rest, -q * pace * rest, contact * rest]
        row = [*first, x, y, p * pace, q * pace, float(contact)]
        if k % 2:
            place = int(rng.choice(np.flatnonzero(row)))
            row[place] = math.nextafter(row[place], math.inf if k % 4 == 1 else -math.inf)
        rows.append(row)
    return rows


@each("rows", release_after(1, [150, 600]))
@each("kind", ["graze", "touching", "sliding"])
def test_ties_are_decided_as_in_rational_arithmetic(kind: str, rows: int) -> None:
    """Where b, c or D is exactly 0 or one rounding from it, hit or miss is that of rational arithmetic."""
    seen = set()
    for row in build_ties(kind, rows):
        b, c, d = signs = compute_signs(row)
        seen.add(signs)
        found = primitives.pair_time(*row)
        if b >= 0 or (c > 0 and d <= 0):
            assert found == math.inf
        elif c <= 0:
            assert found == 0.0
        else:
            assert_right(np.array(row), found)
    assert len(seen) > 2  # ties and both sides of them


def test_ties_of_full_precision_numbers_are_exact() -> None:
    """Touching discs that approach collide at 0 s, and sliding ones never, for numbers that need two floats each."""
    # Relative positions, velocities and radii are sums of two floats of 53 bits each, h + l and k + m. Head-on, ``d =
    # (h + l, 0)`` and ``R = h + l``; sliding, ``d = (h + l, k + m)`` and ``u = (-k - m, h + l)``.
    rng = np.random.default_rng(13)
    for _ in range(500):
        h, k = (float(a) for a in rng.uniform(1, 2, 2))
        low, m = (float(a) for a in rng.uniform(0, 1, 2) * 2.0 ** -rng.integers(54, 62))
        assert primitives.pair_time(-low, 0.0, 0.0, 0.0, low, h, 0.0, -1.0, 0.5, h) == 0.0
        assert primitives.pair_time(-low, -m, m, -low, 9.0, h, k, -k, h, 9.0) == math.inf


@each("gap", ["ordinary", "near", "offset"])
@each("tilted", [False, True])
def test_wall_time_is_right_to_2_ulp(gap: str, tilted: bool) -> None:
    """The time to a wall of any direction is within 2 ulp, also close to the wall and far from the origin."""
    rng = np.random.default_rng(4)
    for _ in range(CASES):
        turn = rng.uniform(0, 2 * math.pi)
        nx, ny = (math.cos(turn), math.sin(turn)) if tilted else (0.0, 1.0)
        qx, qy = rng.uniform(-1, 1, 2) * (1e8 if gap == "offset" else 1.0)
        radius = rng.uniform(0.1, 1.0)
        height = radius * (1 + (10 ** rng.uniform(-16, -6) if gap == "near" else rng.uniform(0.1, 9)))
        x, y = qx + nx * height, qy + ny * height
        vx, vy = rng.normal(size=2)
        arguments = [float(value) for value in (x, y, vx, vy, radius, qx, qy, nx, ny)]
        found = primitives.wall_time(x, y, vx, vy, radius, (qx, qy, nx, ny))
        ctx.prec = 600
        ax, ay, avx, avy, ar, aqx, aqy, anx, any_ = (arb(value) for value in arguments)
        closing, distance = avx * anx + avy * any_, (ax - aqx) * anx + (ay - aqy) * any_ - ar
        if not closing < 0:
            assert found == math.inf
        elif not distance > 0:
            assert found == 0.0
        else:
            assert compute_ulp_error(found, -distance / closing) <= 2.0
