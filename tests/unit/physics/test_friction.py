"""The clip of friction: which of its branches holds, and that the compiled form has its bits."""

from __future__ import annotations

import math
import random

import pytest
from tests.lengths import each

from carom.physics.friction import ContactFriction, pair_tangential_impulse, tangential_impulse


@each(
    ("slip", "expected"), [(0.0, 0.0), (3.0, 1.0), (-3.0, -1.0), (6.0, 2.0), (-6.0, -2.0), (9.0, 2.0), (-1e300, -2.0)]
)
def test_friction_sticks_until_coulombs_bound_and_then_slides(slip: float, expected: float) -> None:
    """Yielding by 3, pressed by 4 with coefficient 1/2: a third of the slip, but 2 at most, either way."""
    assert tangential_impulse(ContactFriction(0.5), slip, 3.0, 4.0) == expected


def test_tangential_restitution_asks_for_so_much_more_within_the_same_bound() -> None:
    """With b = 1 twice the impulse turns the slip round; with b = -1 there is none."""
    assert tangential_impulse(ContactFriction(10.0, 1.0), 3.0, 3.0, 4.0) == 2.0
    assert tangential_impulse(ContactFriction(0.25, 1.0), 3.0, 3.0, 4.0) == 1.0
    assert tangential_impulse(ContactFriction(10.0, -1.0), 3.0, 3.0, 4.0) == 0.0


def test_without_a_push_nothing_rubs() -> None:
    """An impact that rounding has turned into a separation has no friction, of whatever sign its slip."""
    assert (
        tangential_impulse(ContactFriction(1e19), 5.0, 3.0, 0.0)
        == tangential_impulse(ContactFriction(1e19), -5.0, 3.0, 0.0)
        == 0.0
    )


def test_two_discs_rub_in_units_of_an_impulse_over_their_distance() -> None:
    """Centres 5 apart along (3, 4), the second passing at 5 across: slip 5, and it yields by 6, so T = 5/6, g = 1/6."""
    # u = 5 t, with t = (-4, 3)/5; from the first, which rests, the slip is -u.t.
    assert pair_tangential_impulse(ContactFriction(10.0), 3.0, 4.0, -4.0, 3.0, 0.0, 6.0, -1.0) == pytest.approx(-1 / 6)
    assert pair_tangential_impulse(ContactFriction(10.0), 3.0, 4.0, -4.0, 3.0, 25.0, 6.0, -1.0) == 0.0
    assert pair_tangential_impulse(ContactFriction(0.125), 3.0, 4.0, -4.0, 3.0, 0.0, 6.0, -1.0) == -0.125


def test_the_compiled_form_has_the_same_bits() -> None:
    """On random numbers of all sizes, and at the bounds."""
    probe = pytest.importorskip("tests.probe")
    rng = random.Random(11)
    for _ in range(20_000):
        dx, dy, ux, uy, surface = (rng.gauss(0, 1) * 10 ** rng.uniform(-9, 9) for _ in range(5))
        grip = ContactFriction(rng.choice([0.1, 1.0, 1e19]), rng.uniform(-1, 1))
        inverse_effective_mass, push = 10 ** rng.uniform(-9, 9), -(10 ** rng.uniform(-12, 9))
        row = (grip, dx, dy, ux, uy, surface, inverse_effective_mass, push)
        one, other = pair_tangential_impulse(*row), probe.pair_tangential_impulse(*row)
        assert one == other
        assert math.copysign(1.0, one) == math.copysign(1.0, other)
