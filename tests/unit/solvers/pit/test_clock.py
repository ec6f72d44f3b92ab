"""When PIT looks."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.errors import InputError
from carom.solvers.pit.clock import FrameClock


@given(st.integers(0, 10**6), st.floats(0.01, 1e4))
def test_frame_times_are_correctly_rounded(frame: int, rate: float) -> None:
    """Frame k is at the float nearest to k / rate, or to k times the step."""
    assert FrameClock(rate_hz=rate).time_s(frame) == frame / rate
    assert FrameClock(step_s=rate).time_s(frame) == frame * rate


@given(st.integers(0, 10**6), st.floats(0.01, 1e4))
def test_k_frames_are_before_the_time_of_frame_k(frame: int, rate: float) -> None:
    """The number of frames before the time of frame k is k; just after that time it is k + 1."""
    for clock in (FrameClock(rate_hz=rate), FrameClock(step_s=rate)):
        assert clock.count_frames_before(clock.time_s(frame)) == frame
        assert clock.count_frames_before(clock.time_s(frame) * (1 + 2.0**-50) + clock.frame_s * 2.0**-20) == frame + 1


@each("time_s", [-1.0, math.nan, math.inf])
def test_negative_or_non_finite_time_is_refused(time_s: float) -> None:
    """Counting frames before a negative, infinite or NaN time raises an InputError with the value."""
    with pytest.raises(InputError, match=f"time_s must be a finite number of seconds, 0 or more, got {time_s}"):
        FrameClock(rate_hz=60.0).count_frames_before(time_s)
