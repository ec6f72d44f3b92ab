"""Finite walls in compiled code and in plain Python: the same next feature."""

from __future__ import annotations

import math
import random

import pytest
from tests.forms import needs_extension, plain_form

from carom import Chain, Ring
from carom.physics.features import Mover
from carom.solvers.plain.compiled_walls import finite_wall
from carom.solvers.plain.finite_walls import FiniteWall

SHAPES: dict[str, Chain | Ring] = {
    "edges": Chain(points_m=[(-2, -1), (0, 1), (1, -1), (3, 0.5)], half_width_m=0.1),
    "arcs": Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=[0, 1, -0.3, 2.5], closed=True),
    "ring": Ring(centre_m=(0.3, 0.1), radius_m=2.0),
}


@needs_extension
@pytest.mark.parametrize("name", SHAPES)
def test_the_next_feature_is_the_same(name: str) -> None:
    """Instant, feature and gliding of discs drawn by lot, some just off a feature, before a wall that moves."""
    rng = random.Random(name)
    compiled = finite_wall(SHAPES[name].outline)
    with plain_form():
        plain = finite_wall(SHAPES[name].outline)
    assert type(plain) is FiniteWall is not type(compiled)
    plain.features = compiled.features  # the same objects, so that what was left is one of either's
    met = 0
    for _ in range(300):
        velocity, drift = [(rng.uniform(-3, 3), rng.uniform(-3, 3)) for _ in range(2)]
        disc = Mover.at((rng.uniform(-5, 5), rng.uniform(-5, 5)), velocity, rng.choice([0.01, 0.4]), drift)
        last = rng.choice([None, rng.choice(plain.features).feature])
        found = compiled.next_time(disc, last)
        assert found == plain.next_time(disc, last)
        met += math.isfinite(found[0])
    assert met > 50
