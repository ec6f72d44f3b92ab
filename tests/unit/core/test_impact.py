"""Impulses of an impact: restitution along the normal, and which branch of friction holds."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest
from tests.lengths import each

from carom.core import primitives


@each(
    ("slip", "expected"), [(0.0, 0.0), (3.0, 1.0), (-3.0, -1.0), (6.0, 2.0), (-6.0, -2.0), (9.0, 2.0), (-1e300, -2.0)]
)
def test_friction_sticks_until_coulombs_bound_and_then_slides(slip: float, expected: float) -> None:
    """Yielding by 3, pressed by 4 with coefficient 1/2: a third of the slip, but 2 at most, either way."""
    assert primitives.tangential_impulse(0.5, 0.0, slip, 3.0, 4.0) == expected


def test_tangential_restitution_asks_for_so_much_more_within_the_same_bound() -> None:
    """With b = 1 twice the impulse turns the slip round; with b = -1 there is none."""
    assert primitives.tangential_impulse(10.0, 1.0, 3.0, 3.0, 4.0) == 2.0
    assert primitives.tangential_impulse(0.25, 1.0, 3.0, 3.0, 4.0) == 1.0
    assert primitives.tangential_impulse(10.0, -1.0, 3.0, 3.0, 4.0) == 0.0


def test_without_a_push_nothing_rubs() -> None:
    """An impact that rounding has turned into a separation has no friction, of whatever sign its slip."""
    assert (
        primitives.tangential_impulse(1e19, 0.0, 5.0, 3.0, 0.0)
        == primitives.tangential_impulse(1e19, 0.0, -5.0, 3.0, 0.0)
        == 0.0
    )


def test_two_discs_rub_in_units_of_an_impulse_over_their_distance() -> None:
    """Centres 5 apart along (3, 4), the second passing at 5 across: slip 5, and it yields by 6, so T = 5/6, g = 1/6."""
    # u = 5 t, with t = (-4, 3)/5; from the first, which rests, the slip is -u.t.
    assert primitives.pair_tangential_impulse(10.0, 0.0, 3.0, 4.0, -4.0, 3.0, 0.0, 6.0, -1.0) == pytest.approx(-1 / 6)
    assert primitives.pair_tangential_impulse(10.0, 0.0, 3.0, 4.0, -4.0, 3.0, 25.0, 6.0, -1.0) == 0.0
    assert primitives.pair_tangential_impulse(0.125, 0.0, 3.0, 4.0, -4.0, 3.0, 0.0, 6.0, -1.0) == -0.125


def test_two_discs_that_do_not_approach_give_each_other_nothing() -> None:
    """An impact never pulls: 0 for what separates, slides past, or has coinciding centres."""
    for u in ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
        assert primitives.normal_impulse(1.0, 0.0, *u, 1.0, 1.0) == 0.0
    assert primitives.normal_impulse(0.0, 0.0, 1.0, 1.0, 1.0, 1.0) == 0.0


def test_impulses_have_the_law_of_impact() -> None:
    """In fractions the approach and the slip turn into -e and -b times themselves, or Coulomb's."""
    rng, slid = random.Random(7), 0
    for _ in range(500):
        dx, dy, ux, uy, surface = (rng.gauss(0.0, 1.0) * 10 ** rng.uniform(-3, 3) for _ in range(5))
        w, c, e, f, b = 10 ** rng.uniform(-3, 3), rng.uniform(1, 3), rng.random(), rng.choice((0.1, 1e9)), rng.random()
        d2 = Fraction(dx) ** 2 + Fraction(dy) ** 2
        along = Fraction(dx) * Fraction(ux) + Fraction(dy) * Fraction(uy)
        g = primitives.normal_impulse(dx, dy, ux, uy, w, e)
        assert g == pytest.approx(float(min((1 + Fraction(e)) * along / (d2 * Fraction(w)), Fraction(0))), rel=1e-12)
        slip = Fraction(dy) * Fraction(ux) - Fraction(dx) * Fraction(uy) + Fraction(surface)
        stick, most = (1 + Fraction(b)) * slip / (d2 * Fraction(c)), Fraction(f) * Fraction(-g)
        slid += abs(stick) > most
        found = primitives.pair_tangential_impulse(f, b, dx, dy, ux, uy, surface, c, g)
        assert found == pytest.approx(float(max(min(stick, most), -most)), rel=1e-9)
    assert 100 < slid < 500
