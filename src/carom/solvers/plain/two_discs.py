"""A scene of two discs and no wall, solved at one go on plain floats: what runs without the compiled extension."""

from __future__ import annotations

import math
from struct import Struct
from typing import TYPE_CHECKING

import numpy as np

from carom.limits import ORDINARY
from carom.physics.impact_law import pair_push
from carom.physics.pair_time import pair_time
from carom.trace import IMPACT_DTYPE

if TYPE_CHECKING:
    from carom.scene import Disc

__all__ = ["SOLUTION_DTYPE", "solve"]

#: What the bytes of a solution hold; without an impact its row means nothing.
SOLUTION_DTYPE = np.dtype(
    [
        ("impact", IMPACT_DTYPE),
        ("final_position_m", "f8", (2, 2)),
        ("final_velocity_m_s", "f8", (2, 2)),
        ("impacts_per_disc", "i8", 2),
    ]
)

_SOLUTION = Struct("=d2q10d8d2q")


def solve(first: Disc, second: Disc, restitution: float, end: float) -> bytes | None:
    """Return all that becomes of two discs, with the result of the event-driven kernel to the bit.

    They meet once at most.

    Args:
        first: The first disc of a scene without walls and gravity.
        second: The second.
        restitution: Of their impact.
        end: Seconds from the start at which to stop.

    Returns:
        The bytes of a number of `SOLUTION_DTYPE`; None where a number is not of an ordinary size (`carom.limits`).
    """
    (x1, y1), (vx1, vy1), w1 = first.position_m, first.velocity_m_s, 1.0 / first.mass_kg
    (x2, y2), (vx2, vy2), w2 = second.position_m, second.velocity_m_s, 1.0 / second.mass_kg
    numbers = (x1, y1, vx1, vy1, first.radius_m, w1, x2, y2, vx2, vy2, second.radius_m, w2, end)
    if not all(1.0 / ORDINARY <= abs(number) <= ORDINARY or number == 0.0 for number in numbers):
        return None
    before = (vx1, vy1, vx2, vy2)
    normal_x = normal_y = math.nan
    time = pair_time(x1, y1, vx1, vy1, first.radius_m, x2, y2, vx2, vy2, second.radius_m)
    met = time <= end and time != math.inf
    if met:
        if w1 > 0.0:
            x1, y1 = x1 + vx1 * time, y1 + vy1 * time
        if w2 > 0.0:
            x2, y2 = x2 + vx2 * time, y2 + vy2 * time
        dx, dy = x2 - x1, y2 - y1
        push = pair_push(dx, dy, vx2 - vx1, vy2 - vy1, w1 + w2, restitution)
        vx1, vy1 = vx1 + push * w1 * dx, vy1 + push * w1 * dy
        vx2, vy2 = vx2 - push * w2 * dx, vy2 - push * w2 * dy
        distance = math.sqrt(dx * dx + dy * dy)
        normal_x, normal_y = dx / distance, dy / distance
    after = (vx1, vy1, vx2, vy2)
    wait = end - time if met else end
    final = (x1 + vx1 * wait, y1 + vy1 * wait, x2 + vx2 * wait, y2 + vy2 * wait)
    impact = (time if met else math.inf, 0, 1, normal_x, normal_y, *before, *after)
    return _SOLUTION.pack(*impact, *final, *after, met, met)
