"""Two discs and no wall: the closed form, without queue or cells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.physics.impact_law import pair_push
from carom.physics.pair_time import pair_time
from carom.solvers.plain.bodies import require_supported
from carom.trace import ImpactRecord, Outcome, Trace, impact_array

if TYPE_CHECKING:
    from carom.scene import Scene

__all__ = ["solve_two_discs"]

_NO_IMPACT = impact_array([])


def solve_two_discs(scene: Scene, end_s: float, max_impacts: int | None = None) -> Trace:
    """Run a scene of two discs and no wall, with the result of the event-driven kernel to the bit.

    They meet once at most.

    Args:
        scene: Two discs, no wall, no gravity.
        end_s: Seconds from the start at which to stop.
        max_impacts: Stop after this many impacts; None for no limit.
    """
    if scene.gravity_m_s2 != (0.0, 0.0):
        require_supported(scene, "PIC")
    first, second = scene.discs
    (x1, y1), (vx1, vy1), r1 = first.position_m, first.velocity_m_s, first.radius_m
    (x2, y2), (vx2, vy2), r2 = second.position_m, second.velocity_m_s, second.radius_m
    w1, w2 = 1.0 / first.mass_kg, 1.0 / second.mass_kg
    time_s = pair_time(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2) if w1 + w2 > 0.0 else math.inf
    own1 = own2 = 0.0  # the instant that each position is that of
    impacts, count, outcome = _NO_IMPACT, 0, Outcome.COMPLETED
    if time_s <= end_s and max_impacts == 0:
        outcome, end_s = Outcome.MAX_IMPACTS, 0.0
    elif time_s <= end_s:
        if w1 > 0.0:
            x1, y1, own1 = x1 + vx1 * time_s, y1 + vy1 * time_s, time_s
        if w2 > 0.0:
            x2, y2, own2 = x2 + vx2 * time_s, y2 + vy2 * time_s, time_s
        before1, before2, dx, dy = (vx1, vy1), (vx2, vy2), x2 - x1, y2 - y1
        push = pair_push(dx, dy, vx2 - vx1, vy2 - vy1, w1 + w2, scene.restitution)
        vx1, vy1 = vx1 + push * w1 * dx, vy1 + push * w1 * dy
        vx2, vy2 = vx2 - push * w2 * dx, vy2 - push * w2 * dy
        distance = math.sqrt(dx * dx + dy * dy)
        normal, count = (dx / distance, dy / distance), 1
        impacts = impact_array([ImpactRecord(time_s, 0, 1, normal, before1, before2, (vx1, vy1), (vx2, vy2))])
    wait1, wait2 = end_s - own1, end_s - own2
    final = np.array(
        ((x1 + vx1 * wait1, y1 + vy1 * wait1), (x2 + vx2 * wait2, y2 + vy2 * wait2), (vx1, vy1), (vx2, vy2))
    )
    return Trace(
        method="pic",
        scene=scene,
        impacts=impacts,
        final_position_m=final[:2],
        final_velocity_m_s=final[2:],
        end_time_s=end_s,
        outcome=outcome,
        counts={"impacts": count, "predictions": count + 1},
        impacts_per_disc=np.full(2, count),
    )
