"""Thresholds of all verdicts and grades."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom.engines.api.checks import MANTISSA_BITS


@dataclass(frozen=True)
class Thresholds:
    """The smallest error that counts, for each kind of fault.

    Attributes:
        rounding: Rounding error of times over the scene's duration, of velocities over the scene's speed, and of
            positions over the scene's reach. The solvers reproduce known answers with at most this error.
        rounding_32: The same error for a method that declares 32-bit floats: a hundred units in the last place.
        close: Largest error of grade *close*: for a time, divided by a step; for a velocity, divided by the cost of
            sampling. For an error of a hundredth of a step, a sampling method would have to check a hundred times per
            step. So a close method solves for the instant, or cuts its steps.
        phases: Number of evenly spread phases of a step at which PIT is run for the cost of sampling. At one of these
            phases, each impact is found at most a sixteenth of a step before the latest possible instant. Misses are
            noticed if they occur at more than a sixteenth of all phases.
        ratio_known: Rounding error of the ratio of an error to the cost of sampling, in a run whose only errors are
            those of sampling. An error of 1e-13 was observed in 64 bits.
        ratio_known_32: This rounding error for a method that declares 32-bit floats: 5e-4 was observed.
        direction_rad: Smallest error of a direction that gets a verdict: a degree, which is just visible in a picture.
        energy: Energy error over the energy at the start. Rounding causes 1e-13 in float64 engines and 1e-7 in float32
            engines, both far below a millionth.
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
        """Return the rounding error in floats of 32 or 64 bits."""
        return {32: self.rounding_32, 64: self.rounding}[float_bits]

    def ratio_known_of(self, float_bits: int) -> float:
        """Return the rounding error of the ratio of an error to the cost of sampling, in floats of 32 or 64 bits."""
        return {32: self.ratio_known_32, 64: self.ratio_known}[float_bits]

    def time_rounding_of(self, float_bits: int, duration_s: float, dt_s: float) -> float:
        """Return the rounding error of a time, in seconds. In a run with steps, it is at most the limit of *close*."""
        rounding_s = self.rounding_of(float_bits) * duration_s
        return min(rounding_s, self.close * dt_s) if dt_s else rounding_s

    def place_rounding_of(self, float_bits: int, steps: float) -> float:
        """Return a position's rounding error over the scene's extent. Each step adds half a unit in the last place."""
        return self.rounding_of(float_bits) + 0.5 * steps * 2.0 ** -MANTISSA_BITS[float_bits]


THRESHOLDS = Thresholds()
