"""Impulses of an impact: restitution along the normal, and which branch of friction holds."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest

from carom.core import primitives


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
