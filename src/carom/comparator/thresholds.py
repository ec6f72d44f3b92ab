"""Thresholds of all verdicts and grades."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.engines.api.checks import MANTISSA_BITS


@dataclass(frozen=True)
class Thresholds:
    """Limits for errors: a larger error counts as a fault.

    Attributes:
        rounding: Relative rounding error. Errors of times are divided by the scene's duration, errors of velocities by
            its greatest speed, and errors of positions by its largest coordinate. Carom's solvers reproduce known
            results with at most this error.
        rounding_32: Relative rounding error for a method with 32-bit floats: about a hundred units in the last place.
        close: Largest relative error of grade *close*. Time errors are divided by a step, and velocity errors by PIT's
            velocity error. A method that only checks for overlap would need a hundred checks per step to be this
            accurate. So a close method computes the instant of impact, or shortens its steps.
        phases: Number of evenly spread phases of a step at which PIT's errors are measured. At one of 16 phases, PIT is
            within a sixteenth of a step of its largest possible lateness. If PIT misses an impact at more than a
            sixteenth of all phases, PIT also misses the impact at one of these 16.
        ratio_known: Rounding error of the ratio between the run's error and PIT's. In 64-bit floats, errors of 1e-13
            were observed.
        ratio_known_32: Like `ratio_known`, for 32-bit floats. Errors of 5e-4 were observed.
        direction_rad: Largest ignored error of a direction: a degree, which is just visible in a picture.
        energy: Largest ignored energy error, divided by the scene's energy. Rounding causes 1e-13 in float64 engines
            and 1e-7 in float32 engines, both far below a millionth.
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
        """Return the relative rounding error in floats of 32 or 64 bits."""
        return {32: self.rounding_32, 64: self.rounding}[float_bits]

    def ratio_known_of(self, float_bits: int) -> float:
        """Return the rounding error of the ratio between a run's error and PIT's, in floats of 32 or 64 bits."""
        return {32: self.ratio_known_32, 64: self.ratio_known}[float_bits]

    def time_rounding_of(self, float_bits: int, duration_s: float, dt_s: float) -> float:
        """Return the rounding error of a time, in seconds; in a run with steps, at most a hundredth of a step."""
        rounding_s = self.rounding_of(float_bits) * duration_s
        return min(rounding_s, self.close * dt_s) if dt_s else rounding_s

    def place_rounding_of(self, float_bits: int, steps: float) -> float:
        """Return a position's rounding error, divided by the largest coordinate.

        Each step adds half a unit in the last place.
        """
        return self.rounding_of(float_bits) + 0.5 * steps * 2.0 ** -MANTISSA_BITS[float_bits]


THRESHOLDS = Thresholds()
