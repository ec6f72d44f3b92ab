"""Algorithm 2: PIC from frame to frame."""

from __future__ import annotations

import math

import pytest
from tests.lengths import each
from tests.stage import line

from carom.errors import InputError
from carom.solvers.reference.algorithm_2 import solve_pic_framewise


def test_all_impacts_of_one_frame_are_carried_out() -> None:
    """Three impacts in a single frame all happen, each at its own instant."""
    scene = line(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0))
    trace = solve_pic_framewise(scene, frame_rate_hz=0.1)
    assert trace.counts["frames"] == 1
    assert trace.impacts["time_s"].tolist() == [1.0, 2.0, 3.0]


@each("rate", [1.0, 0.5, 0.25])
def test_an_impact_on_a_frame_instant_happens_once(rate: float) -> None:
    """An impact exactly at a frame instant, be it the last one, is neither lost nor doubled."""
    scene = line(0.0, 5.0, velocities=(1.0, 0.0), duration_s=4.0)
    trace = solve_pic_framewise(scene, frame_rate_hz=rate)
    assert trace.impacts["time_s"].tolist() == [4.0]


def test_the_frame_rate_is_the_scenes_own_unless_given() -> None:
    """Without a rate the scene's is taken, and the trace tells the frame length."""
    scene = line(0.0, velocities=(1.0,), duration_s=2.0)
    assert solve_pic_framewise(scene).dt_s == 1 / 60
    assert solve_pic_framewise(scene).counts["frames"] == 120
    assert solve_pic_framewise(scene, frame_rate_hz=8.0).dt_s == 0.125


@each("rate", [0.0, -60.0, math.nan, math.inf])
def test_a_rate_that_is_no_positive_number_is_refused(rate: float) -> None:
    """A frame rate of zero, less, infinity or NaN is refused by name and value."""
    with pytest.raises(InputError, match=f"frame_rate_hz must be a positive number, got {rate}"):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=rate)


def test_a_rate_too_low_to_have_a_frame_length_is_refused() -> None:
    """A frame that would last longer than the largest float is refused, not raised as an overflow."""
    with pytest.raises(InputError, match="frame_rate_hz must be between 1.49e-154 and 6.7e153".replace("+", "[+]")):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=1e-310)
