"""Balls that come to rest in engines that are no part of `all`."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from tests.adapters.drops import hops, speeds_at_rest

from carom.adapter import Adapter

Named = Callable[[str], Adapter]


@pytest.mark.parametrize(("name", "threshold"), [("planck", "velocityThreshold"), ("physx", "bounceThresholdVelocity")])
def test_a_ball_hops_for_ever_unless_slow_contacts_are_inelastic(named: Named, name: str, threshold: str) -> None:
    """As tuned, at 60 steps a second, from each of eight starts; with a limit of three steps' fall, from none."""
    assert all(hops(speeds_at_rest(named(name), "tuned", 60.0), 60.0))
    assert not any(speeds.any() for speeds in speeds_at_rest(named(name), "tuned", 60.0, **{threshold: 0.5}))


@pytest.mark.parametrize("name", ["box2d3", "cannon", "jolt", "p2", "rapier", "rapier2d"])
def test_a_ball_comes_to_rest(named: Named, name: str) -> None:
    """As tuned: it is slower than a thousandth of a step's fall."""
    for speeds in speeds_at_rest(named(name), "tuned", 60.0):
        assert float(abs(speeds).max()) <= 1e-3 * 10.0 / 60.0
