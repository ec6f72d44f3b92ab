"""PIC frame by frame: the same impacts as event-driven PIC, found by other means."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.unit.solvers.strategies import line, scenes

from carom.errors import InputError
from carom.scene import Disc, Scene
from carom.solvers.pic import solve_pic
from carom.solvers.plain.framewise import solve_pic_framewise

# Two discs reach one immovable disc one after the other: its clock must not tell the second of the first.
SHARED_PEG = Scene(
    name="shared peg",
    duration_s=3.0,
    discs=[
        Disc(position_m=(0.1, 0.2), radius_m=0.5, mass_kg=math.inf),
        Disc(position_m=(-1.7, 0.3), velocity_m_s=(1.1, 0.1), radius_m=0.3),
        Disc(position_m=(2.9, 0.7), velocity_m_s=(-1.3, -0.17), radius_m=0.3),
    ],
)


@pytest.mark.long
@given(scenes(), st.sampled_from([0.1, 1.0, 7.0, 1 / 0.3, 30.0]))
@example(SHARED_PEG, 7.0)
@settings(deadline=None)
def test_the_impacts_are_those_of_event_driven_pic_to_the_bit(scene: Scene, frame_rate_hz: float) -> None:
    """At any frame rate, both forms of PIC give identical impacts, flags, outcome and final state, bit for bit."""
    event_driven = solve_pic(scene)
    framewise = solve_pic_framewise(scene, frame_rate_hz=frame_rate_hz)
    assert framewise.impacts.tobytes() == event_driven.impacts.tobytes()
    assert framewise.ambiguous == event_driven.ambiguous
    assert framewise.outcome is event_driven.outcome
    np.testing.assert_array_equal(framewise.final_position_m, event_driven.final_position_m)
    np.testing.assert_array_equal(framewise.final_velocity_m_s, event_driven.final_velocity_m_s)


def test_all_impacts_of_one_frame_are_carried_out() -> None:
    """Three impacts in a single frame all happen, each at its own instant."""
    scene = line(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0))
    trace = solve_pic_framewise(scene, frame_rate_hz=0.1)
    assert trace.counts["frames"] == 1
    assert trace.impacts["time_s"].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("rate", [1.0, 0.5, 0.25])
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


@pytest.mark.parametrize("rate", [0.0, -60.0, math.nan, math.inf])
def test_a_rate_that_is_no_positive_number_is_refused(rate: float) -> None:
    """A frame rate of zero, less, infinity or NaN is refused by name and value."""
    with pytest.raises(InputError, match=f"frame_rate_hz must be a positive number, got {rate}"):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=rate)


def test_a_rate_too_low_to_have_a_frame_length_is_refused() -> None:
    """A frame that would last longer than the largest float is refused, not raised as an overflow."""
    with pytest.raises(InputError, match="frame_rate_hz must lie between 1.49e-154 and 6.7e+153".replace("+", "[+]")):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=1e-310)
