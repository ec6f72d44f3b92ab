"""The impact law on arrays, by which others are scored, against the law in rational numbers."""

from __future__ import annotations

import random

import numpy as np
import pytest
from tests.validation.rough_impacts import worst_of_impact
from tests.validation.test_friction_law import ULPS, drawn_pair

from carom import DiscArrays
from carom.physics.impact_law import resolve_impact
from carom.physics.rough_impact import ContactFrictions, RoughBodies, resolve_rough_impact
from carom.trace import IMPACT_DTYPE, SPIN_DTYPE


def bodies_of(start: DiscArrays) -> list[RoughBodies]:
    """Return the two discs of a start, each as the one body of an array."""
    return [
        RoughBodies(
            start.velocity_m_s[k : k + 1],
            start.surface_speed_m_s[k : k + 1],
            start.mass_kg[k : k + 1],
            start.inertia[k : k + 1],
        )
        for k in (0, 1)
    ]


@pytest.mark.parametrize("count", [100, pytest.param(3_000, marks=pytest.mark.long)])
def test_impacts_as_arrays_are_those_of_the_exact_law(count: int) -> None:
    """Every velocity and surface speed is the exact law's to a few units in the last place of the greatest speed."""
    rng, worst = random.Random(11), 0.0
    for _ in range(count):
        start = drawn_pair(rng)
        one, two = bodies_of(start)
        line = (start.position_m[1] - start.position_m[0])[None]
        normal = line / np.hypot(*line[0])
        e, *grip = (np.array([x]) for x in (start.restitution, start.friction, start.tangential_restitution))
        first, second = resolve_rough_impact(one, two, normal, e, ContactFrictions(*grip))
        impact, spins = np.zeros(1, IMPACT_DTYPE), np.zeros(1, SPIN_DTYPE)
        impact["second"], impact["normal"] = 1, normal[0]
        for name, before, after, radius in (
            ("first", one, first, start.radius_m[0]),
            ("second", two, second, start.radius_m[1]),
        ):
            impact[f"velocity_{name}_before"], impact[f"velocity_{name}_after"] = before.velocity[0], after.velocity[0]
            spins[f"{name}_before"], spins[f"{name}_after"] = before.rim[0] / radius, after.rim[0] / radius
        spins["first_before"], spins["second_before"] = start.spins
        worst = max(worst, worst_of_impact(start, impact[0], spins[0]))
    assert 0.5 < worst < ULPS


def test_without_friction_the_velocities_are_the_smooth_ones_to_the_bit() -> None:
    """Spins then change nothing, and are not changed."""
    rng = random.Random(12)
    nothing = np.zeros(1)
    for _ in range(200):
        start = drawn_pair(rng)
        one, two = bodies_of(start)
        line, e = (start.position_m[1] - start.position_m[0])[None], np.array([start.restitution])
        first, second = resolve_rough_impact(one, two, line, e, ContactFrictions(nothing, nothing))
        smooth = resolve_impact(one.velocity, one.mass, two.velocity, two.mass, line, e)
        assert np.array_equal(first.velocity, smooth[0])
        assert np.array_equal(second.velocity, smooth[1])
        assert first.rim == one.rim
        assert second.rim == two.rim
