"""The exact solver of quartics: falls are distinguished from rises and grazes, and the powers are those given."""

from __future__ import annotations

import math

from tests.lengths import each

from carom.core.exact_quartic import find_falls, solve_quartic


def polynomial(*roots: int) -> list[int]:
    """Return the coefficients of the product of ``t - root``, the lowest power first."""
    p = [1]
    for root in roots:
        p = [(p[k - 1] if k else 0) - root * (p[k] if k < len(p) else 0) for k in range(len(p) + 1)]
    return p


@each(
    "roots, times",
    [
        ((1, 2, 3, 4), [1.0, 3.0]),
        ((1, 1, 3, 4), [3.0]),  # a graze first
        ((1, 1, 1, 4), [1.0]),  # a threefold root is a crossing
        ((1, 1, 2, 2), []),  # two grazes
        ((1, 2, 3, 3), [1.0]),  # a graze from below is no fall
        ((-1, 1, 2, 3), [2.0]),  # below 0 at first: it rises at 1
        ((-1, 1, 2, 2), []),
        ((-1, -2, 3, 4), [3.0]),
        ((-1, -2, -3, -4), []),
        ((3, 3, 3, 3), []),
        ((2, 2), []),
        ((1000, 1001), [1000.0]),
    ],
)
def test_falls_are_told_from_rises_and_grazes(roots: tuple[int, ...], times: list[float]) -> None:
    """Only a root of odd multiplicity is a crossing, and every other one of these is a fall."""
    assert list(find_falls(polynomial(*roots))) == times


def test_instants_are_counted_from_the_begin_and_by_index() -> None:
    """Falls at 1 and 3 s: from 0.5 s on after 0.5 and 2.5 s, then never. The gap is below 0 from 1 to 2 s."""
    powers = [[(float(power), 1.0)] for power in polynomial(1, 2, 3, 4)]
    assert [solve_quartic(powers, 0.5, False, index) for index in range(3)] == [0.5, 2.5, math.inf]
    assert [solve_quartic(powers, begin, False, -1) for begin in (0.5, 1.0, 1.5)] == [1.0, 0.0, -1.0]


def test_a_gap_that_is_closed_and_does_not_open_closes_now() -> None:
    """At 2.5 s the gap opens and at 1.5 s it still closes; where it is said to be closed, that alone counts."""
    powers = [[(float(power), 1.0)] for power in polynomial(1, 2, 3, 4)]
    assert solve_quartic(powers, 2.5, True, 0) == solve_quartic(powers, 1.25, True, 0) == 0.0
    assert solve_quartic(powers, 1.75, True, 0) > 0.0
