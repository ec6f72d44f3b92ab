"""Geometric series of step sizes, and the default series of a scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.errors import InputError

if TYPE_CHECKING:
    from carom.model.scene import Scene

#: Smallest step size of a scene's default series, as a fraction of a frame, and number of step sizes in the series.
FINEST = 60 / 10_000
STEPS = 6


def compute_geometric_steps(coarsest_s: float, finest_s: float, count: int) -> tuple[float, ...]:
    """Return step sizes that are evenly spread on a logarithmic axis.

    If both ends are whole numbers of steps per second, the others are rounded to whole numbers of steps per second.

    Raises:
        InputError: An end is not a positive number, or there are fewer than two steps.
    """
    for name, value in (("the largest step size", coarsest_s), ("the smallest step size", finest_s)):
        if not 0 < value < math.inf:
            raise InputError(f"{name} must be a positive number of seconds, got {value}")
    if count < 2:
        raise InputError(f"a series needs at least two step sizes, got {count}")
    coarsest_s, finest_s = max(coarsest_s, finest_s), min(coarsest_s, finest_s)
    rates = [(1 / coarsest_s) * (coarsest_s / finest_s) ** (k / (count - 1)) for k in range(count)]
    ends = rates[0], rates[-1]
    if all(round(rate) >= 1 and abs(rate - round(rate)) < 1e-9 * rate for rate in ends):
        rates = [float(round(rate)) for rate in rates]
        return tuple(1.0 / rate for rate in dict.fromkeys(rates))
    return (coarsest_s, *(1.0 / rate for rate in rates[1:-1]), finest_s)


def compute_default_steps(scene: Scene) -> tuple[float, ...]:
    """Return a scene's default series of step sizes."""
    frame_s = 1.0 / scene.frame_rate_hz
    return compute_geometric_steps(frame_s, frame_s * FINEST, STEPS)
