"""Instants as pairs of floats: after 1e5 bounces a clock of one float is too coarse to tell where a disc is.

A pair is normalised, ``high + low`` with ``high`` the nearest float, so two instants compare as tuples do.
"""

from __future__ import annotations

import math

from carom.core import primitives

Instant = tuple[float, float]

START: Instant = (0.0, 0.0)
NEVER: Instant = (math.inf, 0.0)


def after(instant: Instant, wait_s: float) -> Instant:
    """Return the instant `wait_s` seconds after another, `NEVER` for infinity, and where that overflows."""
    total, rest = primitives.two_sum(instant[0], wait_s)
    return primitives.two_sum(total, instant[1] + rest) if total < math.inf else NEVER


def between(earlier: Instant, later: Instant) -> float:
    """Return the seconds from one instant to another."""
    return (later[0] - earlier[0]) + (later[1] - earlier[1])
