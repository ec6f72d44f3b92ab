"""What is driven in engines beyond the four of the extras: a disc leaves it at twice its velocity less its own."""

from __future__ import annotations

import numpy as np
import pytest
from tests.adapters.staged import at_a_paddle
from tests.engines.staged import PHASES, Finish, Named

#: Of engines and profiles, what of a velocity of 4 m/s is rounding.
ROUNDING_M_S = {
    ("planck", "default"): 1e-14,
    ("planck", "tuned"): 1e-14,
    ("box2d3", "default"): 2e-6,
    ("box2d3", "tuned"): 2e-6,
    ("rapier2d", "default"): 2e-6,
    ("rapier2d", "tuned"): 2e-6,
    ("rapier", "default"): 2e-6,
    ("rapier", "tuned"): 2e-6,
    ("jolt", "default"): 2e-6,
    ("jolt", "tuned"): 2e-6,
    ("physx", "default"): 2e-6,
    ("physx", "tuned"): 2e-6,
    ("havok", "tuned"): 2e-2,  # a bounce loses 9.81 m/s^2 times the step, in units of 1/16 m
    ("p2", "tuned"): 2e-6,
    ("cannon", "tuned"): 1e-14,
    ("matter", "tuned"): 1e-13,
}


@pytest.mark.parametrize("disc", [False, True])
@pytest.mark.parametrize(("name", "profile"), ROUNDING_M_S)
def test_what_is_driven_returns_a_disc_at_twice_its_velocity(
    name: str, profile: str, named: Named, finish: Finish, *, disc: bool
) -> None:
    """An edge and a disc at -1 m/s send a disc of 2 m/s back at -4 m/s, 2 V - v, at each of sixteen starts."""
    for phase in PHASES:
        seen = finish(named(name), at_a_paddle(phase, disc=disc), 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-4.0, 0.0), rtol=0, atol=ROUNDING_M_S[name, profile])
