"""Balls that come to rest in engines that are no part of `all`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from tests.adapters.drops import RADIUS_M, STARTS, hops, on_a_floor, speeds_at_rest
from tests.engines.staged import Finish

from carom import Disc
from carom.adapter import Adapter

Named = Callable[[str], Adapter]


@pytest.mark.parametrize(("name", "threshold"), [("planck", "velocityThreshold"), ("physx", "bounceThresholdVelocity")])
def test_a_ball_hops_for_ever_unless_slow_contacts_are_inelastic(named: Named, name: str, threshold: str) -> None:
    """As tuned, at 60 steps a second, from each of eight starts; with a limit of three steps' fall, from none."""
    assert all(hops(speeds_at_rest(named(name), "tuned", 60.0), 60.0))
    assert not any(speeds.any() for speeds in speeds_at_rest(named(name), "tuned", 60.0, **{threshold: 0.5}))


@pytest.mark.parametrize(
    ("name", "e"),
    [(name, 0.5) for name in ("cannon", "jolt", "p2")]
    + [(name, e) for name in ("box2d3", "rapier", "rapier2d") for e in (0.0, 0.5, 0.9)],
)
def test_a_ball_comes_to_rest(named: Named, name: str, e: float) -> None:
    """As tuned: it is slower than a thousandth of a step's fall."""
    for speeds in speeds_at_rest(named(name), "tuned", 60.0, e):
        assert float(abs(speeds).max()) <= 1e-3 * 10.0 / 60.0


@pytest.mark.parametrize(
    ("name", "sleeps", "fastest"),
    [("rapier", "can_sleep", 0.06), ("rapier2d", "canSleep", 0.06), ("box2d3", "enableSleep", 0.045)],
)
def test_what_slides_slowly_is_put_to_sleep_as_shipped(
    named: Named, finish: Finish, name: str, sleeps: str, fastest: float
) -> None:
    """On a floor without friction, after half a second, from eight speeds; in every profile it is kept awake."""
    for speed in np.linspace(0.005, fastest, STARTS).tolist():
        scene = on_a_floor(Disc(position_m=(0, RADIUS_M), velocity_m_s=(speed, 0), radius_m=RADIUS_M), 10.0)
        asleep = finish(named(name), scene, 1 / 60, "default", **{sleeps: True}).position_m[0, 0]
        assert asleep == pytest.approx(0.5 * speed, rel=0.05)
        awake = finish(named(name), scene, 1 / 60, "default").position_m[0, 0]
        assert awake == pytest.approx(10.0 * speed, rel=1e-3)
