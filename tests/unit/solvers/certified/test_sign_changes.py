"""Where polynomials of balls fall through zero, against polynomials made of their roots."""

import random
from collections.abc import Iterator
from fractions import Fraction

import pytest
from flint import arb, ctx
from tests.cases import each, release_after

from carom.solvers.certified.ball_arithmetic import ball
from carom.solvers.certified.sign_changes import build_squared_gap_powers, find_falls


@pytest.fixture(autouse=True)
def working_precision() -> Iterator[None]:
    with ctx.workprec(128):
        yield


def expand_roots(roots: list[Fraction], leading: int = 1) -> list[arb]:
    """Return the polynomial of these roots, lowest power first."""
    powers = [Fraction(leading)]
    for root in roots:
        powers = [a - root * b for a, b in zip([Fraction(0), *powers], [*powers, Fraction(0)], strict=True)]
    return list(map(ball, powers))


@each("seed", release_after(50, range(200)))
def test_falls_of_a_quartic_contain_their_roots(seed: int) -> None:
    """The falls of a quartic are found in order, as certain, and each contains its root to 2^-60."""
    rng = random.Random(seed)
    roots = [Fraction(rng.gauss(0.5, 1.0)) for _ in range(3)]
    roots.append(roots[0] + Fraction(rng.choice((1e-12, -1e-6, 1.0))))
    leading = rng.choice((1, -1))
    falls = list(find_falls(expand_roots(roots, leading)))
    down = sorted(roots)[::2] if leading > 0 else sorted(roots)[1::2]
    ahead = [root for root in down if root > 0]
    assert all(fall.certain for fall in falls)
    assert len(falls) == len(ahead)
    for fall, root in zip(falls, ahead, strict=True):
        assert fall.time.overlaps(ball(root))
        assert fall.time.rad() < arb(2) ** -60


def test_falls_of_parabolas_and_lines_contain_their_roots() -> None:
    """The falls of 75 parabolas and 25 lines are certain and contain their positive falling roots."""
    for seed in range(100):
        rng = random.Random(seed)
        roots = [Fraction(rng.gauss(0.5, 1.0))]
        roots += [roots[0] + Fraction(rng.choice((1e-9, -1e-3, 1.0)))] if seed < 75 else []
        leading = rng.choice((1, -1))
        down = sorted(roots)[0 if leading > 0 else 1 :: 2] if seed < 75 else roots[: leading < 0]
        falls, ahead = list(find_falls(expand_roots(roots, leading))), [root for root in down if root > 0]
        assert [fall.certain for fall in falls] == [True] * len(ahead), seed
        assert all(fall.time.overlaps(ball(root)) for fall, root in zip(falls, ahead, strict=True))


def test_touch_of_zero_is_uncertain_and_a_later_fall_is_certain() -> None:
    """For (t - 1)^2 (t - 3) (t - 4), the touch at 1 is uncertain and the fall at 3 is certain."""
    first, second = find_falls(expand_roots([Fraction(1), Fraction(1), Fraction(3), Fraction(4)]))
    assert not first.certain
    assert first.time.overlaps(arb(1))
    assert first.time.rad() < arb(2) ** -40
    assert second.certain
    assert second.time.overlaps(arb(3))


def test_zero_gap_at_the_start_is_decided_by_the_next_power() -> None:
    """A gap that is 0 at the start and opens has only later falls; one that closes has an uncertain fall at 0."""
    roots = [Fraction(0), Fraction(2), Fraction(3), Fraction(4)]
    opens = list(find_falls(expand_roots(roots, -1)))
    assert [(float(fall.time), fall.certain) for fall in opens] == [(2.0, True), (4.0, True)]
    closes = list(find_falls(expand_roots(roots)))
    assert [(float(fall.time), fall.certain) for fall in closes] == [(0.0, False), (3.0, True)]


def test_fall_of_an_almost_flat_gap_is_narrow() -> None:
    """The fall of a gap with tiny lowest powers is certain and known to 2^-60 of its time."""
    # It is that of a disc whose bounces on a circle have left a gap of 1e-25 and a speed of 1e-11 of those to come.
    (fall,) = find_falls([arb(2.4e-32), arb(-4.7e-17), arb(-2.2e-7), arb(2.2e-8), arb(-1.3e-8)])
    assert fall.certain
    assert fall.time.rad() < fall.time * arb(2) ** -60


def test_wide_balls_give_few_uncertain_falls() -> None:
    """Where balls decide nothing, fewer than ten falls are returned, and the first is uncertain."""
    powers = build_squared_gap_powers((arb(0), arb(1)), (arb(1), arb(0)), (arb(0), arb(-1)), arb(1))
    falls = list(find_falls([power + arb(0, 1e-3) for power in powers]))
    assert 1 <= len(falls) < 10
    assert not falls[0].certain


def test_root_of_a_gap_that_may_open_for_ever_is_not_certain() -> None:
    """A gap of ``1 + t + a t^2`` with a from -0.001 to 0.001 has no fall before 2 s, and no certain one after it."""
    powers = [arb(1), arb(1), arb(0, 1e-3)]
    assert list(find_falls(powers, 2.0)) == []
    assert not any(fall.certain for fall in find_falls(powers, 1e6))
