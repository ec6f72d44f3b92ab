"""What must hold of Carom's adapters beyond the conformance suite, which `test_conformance.py` runs on each of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.adapters.widths import width
from tests.lengths import each
from tests.stage import disc_at, staged

from carom.adapter import Adapter, Observation

Drive = Callable[..., list[Observation]]

#: One impact is a dozen operations on numbers no larger than the speeds here (3 m/s); each may be wrong by half an ulp.
ROUNDING = 12 * float(np.spacing(3.0))


def test_equal_masses_exchange_velocities_head_on_at_any_step(adapter: Adapter, drive: Drive) -> None:
    """Two equal discs that meet head-on leave with each other's velocity, whatever the step."""
    discs = [disc_at(0, 0, 1), disc_at(2.01, 0, -2)]
    scene = staged("head-on", *discs, duration_s=1.0)
    for dt_s in (1 / 60, 1 / 64, 1 / 240):
        end = drive(adapter, scene, dt_s)[-1]
        np.testing.assert_allclose(end.velocity_m_s, [(-2, 0), (1, 0)], rtol=0, atol=width(adapter, ROUNDING))


@each("name, reported_after", [("pymunk", 3), ("pybullet", 4), ("mujoco", 4), ("box2d", 4)])
@each("swapped", [False, True])
def test_contact_is_stamped_with_the_instant_at_which_the_engine_looked(
    named: Callable[[str], Adapter], drive: Drive, name: str, reported_after: int, swapped: bool
) -> None:
    """A contact carries the time of the state in which its overlap was seen, by engines that look first or last."""
    # Touching at 0.3 s: of the boundaries, multiples of 1/8 s, the third (0.375 s) is the first with an overlap.
    dt_s, seen_at_s = 1 / 8, 0.375
    discs = [disc_at(0, 0, 1), disc_at(1.3, 0, m=math.inf)]
    scene = staged("stamp", *discs[::-1] if swapped else discs, duration_s=1.0)
    adapter = named(name)
    seen = drive(adapter, scene, dt_s)
    (step,) = [k for k, observation in enumerate(seen) if observation.contacts]
    (contact,) = seen[step].contacts
    assert step == reported_after
    assert contact.time_s == seen_at_s
    assert (contact.first, contact.second) == (0, 1)
    assert contact.normal == pytest.approx((-1 if swapped else 1, 0), abs=width(adapter, ROUNDING))
    assert contact.impulse_n_s == pytest.approx(2.0, abs=width(adapter, ROUNDING))  # 1 kg turned from 1 m/s to -1 m/s
