"""PIC, predicted instant of collision: event-driven, without frames.

Each disc's next impact is solved for; the earliest of all is carried out at its instant, and only the discs that took
part are predicted again. All impacts come in their order, however many there are between two frames.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.extension import Patience, extension_available, extension_notes
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain import two_discs as plain_two_discs
from carom.trace import Outcome, Samples, Trace

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from carom.scene import Scene
    from carom.solvers.plain.run import AllPairsRun
    from carom.solvers.run import Progress, Run

__all__ = ["pic_run", "solve_pic"]

_ALWAYS = (-math.inf, math.inf)


def pic_run(scene: Scene) -> Run:
    """Return a run of a scene by PIC, of any gravity, that can be taken forward in pieces."""
    if scene.gravity_m_s2 != (0.0, 0.0):
        from carom.solvers.falling.run import BallisticRun

        return BallisticRun(scene)
    return _level_run(scene)


def _level_run(scene: Scene, **options: Any) -> EventDrivenRun | AllPairsRun:
    """Return a run without gravity, in the form that is there; the options are those that both forms have."""
    if extension_available():
        return EventDrivenRun(scene, **options)
    from carom.solvers.plain.run import AllPairsRun

    return AllPairsRun(scene, **options)


def solve_pic(
    scene: Scene,
    *,
    max_impacts: int | None = None,
    until_s: float | None = None,
    record: str = "all",
    window_s: tuple[float, float] = _ALWAYS,
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
    if max_impacts is not None and max_impacts < 0:
        raise InputError(f"max_impacts must be 0 or more, got {max_impacts}")
    end_s = scene.duration_s if until_s is None else until_s
    if not end_s >= 0:
        raise InputError(f"until_s must be 0 or more, got {until_s}")
    if scene.gravity_m_s2 != (0.0, 0.0):
        from carom.solvers.falling.solve import solve_pic_ballistic

        return solve_pic_ballistic(
            scene, end_s, max_impacts, record, window_s, sample_times_s, contact_duration_s, progress
        )
    if (
        len(scene.discs) == 2
        and not scene.walls
        and end_s < math.inf
        and max_impacts != 0
        and record == "all"
        and window_s == _ALWAYS
        and not sample_times_s
        and contact_duration_s == 0.0
        and progress is None
    ):
        return _solve_two_discs(scene, end_s)
    run = _level_run(scene, record=record, window_s=window_s, contact_duration_s=contact_duration_s)
    progress = _patient(progress)
    samples = []
    times = [float(t) for t in sample_times_s if t <= end_s]
    if times != sorted(times):
        raise InputError("sample_times_s must ascend")
    outcome = Outcome.COMPLETED
    for k, time_s in enumerate([*times, end_s]):
        outcome = run.advance_to(time_s, max_impacts, progress)
        if outcome is not Outcome.COMPLETED:
            times = times[:k]
            break
        if k < len(times):
            samples.append(run.positions())
    return Trace(
        method="pic",
        scene=scene,
        impacts=run.log.array(),
        final_position_m=run.positions(),
        final_velocity_m_s=run.velocities(),
        end_time_s=run.time_s,
        outcome=outcome,
        ambiguous=run.log.ambiguous(),
        samples=Samples(np.array(times), np.array(samples).reshape(len(samples), -1, 2)) if sample_times_s else None,
        settings={"contact_duration_s": contact_duration_s} if contact_duration_s else {},
        counts=run.counts,
        impacts_per_disc=run.impacts_per_disc(),
        notes=(*run.notes, *extension_notes()),
    )


def _solve_two_discs(scene: Scene, end_s: float) -> Trace:
    """Run a scene of two discs and no wall: by its closed form, without queue or cells."""
    if extension_available():
        from carom.solvers import two_discs

        solve = two_discs.solve
    else:
        solve = plain_two_discs.solve
    first, second = scene.discs
    solution = np.frombuffer(solve(first, second, scene.restitution, end_s), plain_two_discs.SOLUTION_DTYPE)
    impacts_per_disc = solution["impacts_per_disc"][0]
    count = int(impacts_per_disc[0])
    return Trace(
        method="pic",
        scene=scene,
        impacts=solution["impact"][:count],
        final_position_m=solution["final_position_m"][0],
        final_velocity_m_s=solution["final_velocity_m_s"][0],
        end_time_s=end_s,
        counts={"impacts": count, "predictions": count + 1},
        impacts_per_disc=impacts_per_disc,
        notes=extension_notes(),
    )


def _patient(progress: Progress | None) -> Progress | None:
    """Return the progress to report: where plain Python runs for want of the extension, it warns of a long run."""
    if extension_available():
        return progress
    patience = Patience()

    def look(impacts: int, time_s: float) -> None:
        patience.look()
        if progress is not None:
            progress(impacts, time_s)

    return look
