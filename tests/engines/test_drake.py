"""What Drake does that a user would not expect, asked of Drake; the right answers are laws of mechanics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from carom import Disc, Scene
from carom.adapter import Adapter, AdapterError, Observation

Drive = Callable[..., list[Observation]]


@pytest.fixture
def drake(named: Callable[[str], Adapter]) -> Adapter:
    """The adapter."""
    return named("drake")


def _head_on(closing: float, restitution: float = 1.0, away_s: float = 0.5) -> Scene:
    """Stage two equal discs, some seconds from each other."""
    gap = away_s * closing
    return Scene(
        name="hazard",
        discs=(
            Disc(position_m=(-0.5 - gap / 2, 0), velocity_m_s=(closing / 2, 0), radius_m=0.5),
            Disc(position_m=(0.5 + gap / 2, 0), velocity_m_s=(-closing / 2, 0), radius_m=0.5),
        ),
        restitution=restitution,
        duration_s=2 * away_s,
    )


def test_contacts_are_over_before_the_step_is(drake: Adapter, drive: Drive) -> None:
    """Discs that part are apart: at no end of a step do they overlap, and yet the impact is told, by a monitor."""
    scene = _head_on(4.0)
    seen = drive(drake, scene, 1 / 60)
    gaps = [math.dist(*one.position_m) - 1.0 for one in seen]
    assert min(gaps) > 0
    assert [len(one.contacts) for one in seen].count(1) == 1


def test_there_is_no_restitution_but_that_of_an_elastic_impact(drake: Adapter) -> None:
    """A scene with another one is refused."""
    with pytest.raises(AdapterError, match="restitution"):
        drake.prepare(_head_on(1.0, restitution=0.5), drake.profiles["tuned"].settings(1 / 60))


def test_a_contact_lasts_as_long_as_half_a_swing_of_its_spring(drake: Adapter, drive: Drive) -> None:
    """Two springs in a row turn half of a mass round in pi sqrt(m / k): 3.1 ms as shipped."""
    dt_s = 1e-4
    fine = {"target_accuracy": 1e-7}
    seen = drive(drake, _head_on(4.0, away_s=0.02), dt_s, "default", **fine)
    lasted = sum(bool(one.contacts) for one in seen) * dt_s
    assert lasted == pytest.approx(math.pi * math.sqrt(1.0 / 1e6), abs=2 * dt_s)
    assert np.abs(seen[-1].velocity_m_s[:, 0]) == pytest.approx([2, 2], rel=1e-3)
