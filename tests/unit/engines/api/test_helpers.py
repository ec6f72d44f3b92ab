"""Functions that adapters share: limits of speed, and how far discs can move."""

import math
from dataclasses import replace

import pytest
from tests.scene_builders import disc_at, staged, wall_at

from carom.engines.api import (
    Capabilities,
    is_fast,
    reach,
    unsupported_reason,
)


def test_speed_limits_apply_to_the_fastest_leg() -> None:
    """Limits on speed and on motion per step are compared with the fastest leg of a driven disc."""
    legs = [{"from_s": 0.0, "velocity_m_s": (1.0, 0.0)}, {"from_s": 0.5, "velocity_m_s": (0.0, 30.0)}]
    mallet = disc_at(0, 0, m=math.inf, driven=True, legs=legs)
    scene = staged("mallet", mallet, disc_at(9, 0), duration_s=1.0)
    able = Capabilities(driven_discs=True, legs=True)
    assert unsupported_reason(scene, able, 0.1) == ""
    assert "a disc moves at 30 m/s" in unsupported_reason(scene, replace(able, max_speed_m_s=29.0), 0.1)
    assert "moves 3 m in a step" in unsupported_reason(scene, replace(able, max_move_m=2.0), 0.1)
    assert is_fast(scene.discs[0], 0.02)
    assert not is_fast(scene.discs[0], 0.01)


def test_reach_includes_rotational_energy() -> None:
    """Friction can set a spinning disc in motion, so `reach` counts the energy of rotation."""
    bodies = disc_at(0.0, 1.0, r=1.0, spin_rad_s=6.0), wall_at(0.0, 0.0, 0.0, 1.0)
    scene = staged("top", *bodies, wall_friction=1.0, duration_s=10.0)
    # m v^2 / 2 = k m (R w)^2 / 2 at most, with k = 1/2.
    assert reach(scene, 0.0)[1] == pytest.approx(1.0 + 6.0 * math.sqrt(0.5) * 10.0, rel=1e-15)
