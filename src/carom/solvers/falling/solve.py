"""Event-driven PIC under gravity: scene -> trace."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.falling.run import BallisticRun
from carom.trace import Trace, impact_array

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.solvers.request import Request

__all__ = ["solve_pic_ballistic"]


def solve_pic_ballistic(scene: Scene, request: Request) -> Trace:
    """Run a scene with gravity by event-driven PIC."""
    run = BallisticRun(scene)
    outcome, samples = request.carry_out(run)
    begin, end = request.window_s
    kept = [k for k, impact in enumerate(run.log.records) if request.keep and begin <= impact.time_s <= end]
    ambiguous = set(run.log.ambiguous)
    return Trace(
        method="pic",
        scene=scene,
        impacts=impact_array(run.log.records[k] for k in kept),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        ambiguous=tuple(place for place, k in enumerate(kept) if k in ambiguous),
        samples=samples,
        counts=run.counts,
        impacts_per_disc=run.impacts_per_disc(),
        notes=run.notes,
    )
