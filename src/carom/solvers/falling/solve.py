"""Event-driven PIC under gravity: scene -> trace."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.solvers.falling.run import BallisticRun
from carom.trace import Outcome, Samples, Trace, impact_array

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from carom.scene import Scene

__all__ = ["solve_pic_ballistic"]


def solve_pic_ballistic(
    scene: Scene,
    end_s: float,
    max_impacts: int | None,
    record: str,
    window_s: tuple[float, float],
    sample_times_s: Sequence[float],
    contact_duration_s: float,
    progress: Callable[[int, float], None] | None,
) -> Trace:
    """Run a scene with gravity by event-driven PIC; arguments as those of `carom.solvers.pic.solve_pic`.

    Raises:
        InputError: An option is outside its range, or a contact duration is asked for.
    """
    if record not in {"all", "none"}:
        raise InputError(f"record must be 'all' or 'none', got {record!r}")
    if contact_duration_s != 0:
        raise InputError(f"contact_duration_s must be 0 in a scene with gravity, got {contact_duration_s}")
    times = [float(t) for t in sample_times_s if t <= end_s]
    if times != sorted(times):
        raise InputError("sample_times_s must ascend")
    run = BallisticRun(scene)
    samples = []
    outcome = Outcome.COMPLETED
    for time_s in [*times, None]:
        outcome = run.advance_to(end_s if time_s is None else time_s, max_impacts, progress)
        if outcome is not Outcome.COMPLETED:
            break
        if time_s is not None:
            samples.append(run.positions())
    kept = [
        k for k, impact in enumerate(run.log.records) if record == "all" and window_s[0] <= impact.time_s <= window_s[1]
    ]
    ambiguous = set(run.log.ambiguous())
    return Trace(
        method="pic",
        scene=scene,
        impacts=impact_array(run.log.records[k] for k in kept),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        ambiguous=tuple(place for place, k in enumerate(kept) if k in ambiguous),
        samples=Samples(np.array(times[: len(samples)]), np.array(samples).reshape(len(samples), -1, 2))
        if len(sample_times_s)
        else None,
        counts=run.counts,
        impacts_per_disc=run.impacts_per_disc(),
        notes=run.notes,
    )
