"""Thresholds of all verdicts and grades."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.engines.api.checks import MANTISSA_BITS


@dataclass(frozen=True)
class Thresholds:
    """The error from which each kind of fault counts.

    Attributes:
        rounding: Times over the scene's duration, velocities over its speed, positions over its reach. The known
            answers are reproduced to this.
        rounding_32: The same for a method that declares 32-bit floats: a hundred of its units in the last place.
        close: Largest error of *close*: of a time as a part of a step, of a velocity as a part of the cost of sampling.
            At a hundredth, a method would have to check a hundred times per step to be as good by sampling: it solves
            for the instant, or cuts its steps.
        phases: Number of phases of a step at which PIT is run for that cost. They are evenly spread. So one of them
            finds each impact within a sixteenth of the latest possible instant, and phases at which PIT misses an
            impact are noticed where they are more than a sixteenth of all.
        ratio_known: How far above 1 rounding brings an error over the cost of sampling in a run that only samples:
            1e-13 was observed in 64 bits.
        ratio_known_32: The same for a method that declares 32-bit floats: 5e-4 was observed.
        direction_rad: A direction wrong by more than this is called wrong: a degree, about what shows in a picture.
        energy: Energy over the energy at the start. Float64 engines drift by 1e-13 and float32 ones by 1e-7 through
            rounding; a millionth is neither.
    """

    rounding: float = 1e-12
    rounding_32: float = 1e-5
    close: float = 0.01
    phases: int = 16
    ratio_known: float = 1e-9
    ratio_known_32: float = 1e-3
    direction_rad: float = math.radians(1.0)
    energy: float = 1e-6

    def rounding_of(self, float_bits: int) -> float:
        """Return the rounding error in floats of 32 or 64 bits, for reports and the conformance suite."""
        return {32: self.rounding_32, 64: self.rounding}[float_bits]

    def ratio_known_of(self, float_bits: int) -> float:
        """Return how far above 1 an error over the cost of sampling is rounding, in floats of 32 or 64 bits."""
        return {32: self.ratio_known_32, 64: self.ratio_known}[float_bits]

    def time_rounding_of(self, float_bits: int, duration_s: float, dt_s: float) -> float:
        """Return the rounding error of a time, seconds; in a run of steps at most what is called close."""
        rounding_s = self.rounding_of(float_bits) * duration_s
        return min(rounding_s, self.close * dt_s) if dt_s else rounding_s

    def place_rounding_of(self, float_bits: int, steps: float) -> float:
        """Return the rounding error of a position, over the scene's extent: each step adds half a unit."""
        return self.rounding_of(float_bits) + 0.5 * steps * 2.0 ** -MANTISSA_BITS[float_bits]


THRESHOLDS = Thresholds()
