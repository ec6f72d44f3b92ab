"""PIC, predicted instant of collision: event-driven, without frames.

Each disc's next impact is solved for; the earliest of all is carried out at its instant, and only the discs that took
part are predicted again. All impacts come in their order, however many there are between two frames.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain.two_discs import solve_two_discs
from carom.solvers.request import Request
from carom.solvers.units import units_of
from carom.trace import Trace

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from carom.scene import Scene

__all__ = ["EventDrivenRun", "solve_pic"]


def solve_pic(
    scene: Scene,
    *,
    max_impacts: int | None = None,
    until_s: float | None = None,
    record: str = "all",
    window_s: tuple[float, float] = (-math.inf, math.inf),
    sample_times_s: Sequence[float] = (),
    contact_duration_s: float = 0.0,
    progress: Callable[[int, float], None] | None = None,
) -> Trace:
    """Run a scene by event-driven PIC, the reference that everything else is held to.

    Args:
        scene: The scene; discs and walls of any number. With gravity, some hundred discs, see `docs/gravity.md`.
        max_impacts: Stop after this many impacts; None for no limit.
        until_s: Stop at this time instead of the scene's duration.
        record: Keep "all" impacts, or "none". How many each disc had is counted always.
        window_s: Keep only impacts reported within these times.
        sample_times_s: Ascending times at which to keep all positions, none by default.
        contact_duration_s: Contact time of the TC model, which ends inelastic collapse; 0 for none.
        progress: Called now and then with the number of impacts so far and the time reached.

    Returns:
        The trace. Its final state is that at the end, or at the last impact where the run ended before.

    Raises:
        InputError: An option is outside its range, or not there under gravity.
    """
    request = Request.checked(
        scene,
        max_impacts=max_impacts,
        until_s=until_s,
        record=record,
        window_s=window_s,
        sample_times_s=sample_times_s,
        contact_duration_s=contact_duration_s,
        progress=progress,
    )
    units = units_of(scene)
    trace = units.trace(_solve(units.scene(scene), request.in_units(units)), scene)
    if request.contact_duration_s:
        trace = replace(trace, settings={"contact_duration_s": request.contact_duration_s})
    return trace


def _solve(scene: Scene, request: Request) -> Trace:
    if scene.gravity_m_s2 != (0.0, 0.0):
        from carom.solvers.falling.solve import solve_pic_ballistic

        return solve_pic_ballistic(scene, request)
    if len(scene.discs) == 2 and not scene.walls and request.is_plain:
        return solve_two_discs(scene, request.end_s, request.max_impacts)
    run = EventDrivenRun(
        scene,
        record="all" if request.keep else "none",
        window_s=request.window_s,
        contact_duration_s=request.contact_duration_s,
    )
    outcome, samples = request.carry_out(run)
    return Trace(
        method="pic",
        scene=scene,
        impacts=run.log.array(),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        ambiguous=run.log.ambiguous(np.array([disc.immovable for disc in scene.discs])),
        samples=samples,
        counts=run.counts,
        impacts_per_disc=run.impacts_per_disc(),
        notes=run.notes,
    )
