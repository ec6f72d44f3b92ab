"""Times of the frames of a PIT run. At each frame, PIT checks for overlap."""

from __future__ import annotations

import math
from typing import NamedTuple

from carom.errors import InputError
from carom.model.sizes import count_steps
from carom.solvers.units import Units


class FrameClock(NamedTuple):
    """Times of frames: frame k, counted from 0, is at ``k * step_s / rate_hz``.

    Either the length of a frame (`step_s`) or the number of frames per second (`rate_hz`) is given. The field that is
    not given is 1, so that each time is rounded only once.
    """

    step_s: float = 1.0
    rate_hz: float = 1.0

    def convert_units(self, units: Units) -> FrameClock:
        """Return the same clock in other units of time.

        The units of time are powers of two times a second, so nothing is rounded.
        """
        if self.rate_hz != 1.0:
            return FrameClock(rate_hz=units.to_seconds(self.rate_hz))
        return FrameClock(step_s=units.from_seconds(self.step_s))

    @property
    def frame_s(self) -> float:
        """Length of a frame, in seconds."""
        return self.step_s / self.rate_hz

    def time_s(self, frame: int) -> float:
        """Return the time of a frame, in seconds from the start."""
        return frame * self.step_s / self.rate_hz

    def count_frames_before(self, time_s: float) -> int:
        """Return the number of frames before a time. A frame at this time (within rounding errors) is not counted.

        Raises:
            InputError: The time is not a finite number of seconds, 0 or more.
        """
        if not 0.0 <= time_s < math.inf:
            raise InputError(f"time_s must be a finite number of seconds, 0 or more, got {time_s}")
        return count_steps(time_s, self.frame_s)
