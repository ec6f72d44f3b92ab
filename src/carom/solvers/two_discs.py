"""Two discs and no wall: the closed form, without queue or cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.bodies import Bodies, require_supported
from carom.solvers.impact_log import ImpactLog
from carom.trace import Outcome, Trace, impact_array

if TYPE_CHECKING:
    from carom.scene import Scene

__all__ = ["solve_two_discs"]


def solve_two_discs(scene: Scene, end_s: float, max_impacts: int | None = None) -> Trace:
    """Run a scene of two discs and no wall, with the result of the event-driven kernel to the bit.

    They meet once at most; where restitution is 0, rounding can leave them approaching, and then they meet again.

    Args:
        scene: Two discs, no wall, no gravity.
        end_s: Seconds from the start at which to stop.
        max_impacts: Stop after this many impacts; None for no limit.
    """
    require_supported(scene, "PIC")
    bodies, log = Bodies(scene), ImpactLog(scene)
    outcome = Outcome.COMPLETED
    end, now = end_s, 0.0
    while (time_s := bodies.pair_impact_time(0, 1)) <= end_s:
        if max_impacts is not None and len(log.records) >= max_impacts:
            outcome, end = Outcome.MAX_IMPACTS, now
            break
        now = max(now, time_s)
        impact = bodies.collide(0, 1, now)
        log.add(impact, bodies.resolution_s(impact))
        if log.at_standstill:
            outcome, end = Outcome.STANDSTILL, now
            break
    return Trace(
        method="pic",
        scene=scene,
        impacts=impact_array(log.records),
        final_position_m=bodies.positions_at(end),
        final_velocity_m_s=bodies.velocities(),
        end_time_s=end,
        outcome=outcome,
        ambiguous=tuple(log.ambiguous),
        counts={"impacts": len(log.records), "predictions": len(log.records) + 1},
    )
