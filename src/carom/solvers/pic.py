"""PIC, predicted instant of collision: advances from impact to impact, without frames.

PIC computes the next impact of each disc, and applies the earliest one at its instant. After an impact, PIC predicts
new impacts only for the discs of this impact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from carom.core import pic
from carom.core.extension import find_extension_notes
from carom.errors import InputError
from carom.model.scene import Scene, to_scene
from carom.model.trace import IMPACT_DTYPE, Trace
from carom.solvers.options import ALWAYS, PLAIN, RunOptions
from carom.solvers.request import advance_run, check_end_time, find_bending_force
from carom.solvers.run import Run, Start, build_trace
from carom.solvers.units import Units
from carom.support.checks import check_count, check_times

#: Numbers of impacts of two discs: in the first row if they don't meet, in the second row if they meet.
_IMPACTS_PER_DISC = np.frombuffer(np.array([[0, 0], [1, 1]]).tobytes(), np.int64).reshape(2, 2)


def start_pic_run(scene: Scene, options: RunOptions = PLAIN, *, all_pairs: bool = False) -> Run:
    """Return a PIC run of a scene, which can be advanced in pieces.

    With `all_pairs`, the next impact of each pair is computed at each event. Computing all pairs is slower, with the
    same result.
    """
    from carom.solvers.event_driven.run import EventDrivenRun  # imported here: scenes of two discs don't need it
    from carom.solvers.units import run_in_ordinary_units

    def make(start: Start, units: Units) -> Run:
        converted = options.convert_units(units)
        if not scene.damping_per_s:
            return build_undamped_run(start, converted)
        from carom.solvers.damped import DampedRun, build_undamped_options

        damping = units.convert_damping(scene.damping_per_s)
        return DampedRun(build_undamped_run(start, build_undamped_options(converted, damping)), damping)

    def build_undamped_run(start: Start, options: RunOptions) -> Run:
        record, window_s, contact_s = options.record, options.window_s, options.contact_duration_s
        return EventDrivenRun(
            start, record=record, window_s=window_s, contact_duration_s=contact_s, all_pairs=all_pairs
        )

    run: Run = run_in_ordinary_units(scene.undamped, make)
    return run


def solve_pic(
    scene: Scene | str,
    *,
    max_impacts: int | None = None,
    until_s: float | None = None,
    record: str = "all",
    window_s: tuple[float, float] = ALWAYS,
    sample_times_s: Sequence[float] = (),
    contact_duration_s: float = 0.0,
    progress: Callable[[int, float], None] | None = None,
) -> Trace:
    """Run a scene by PIC, the method with which Carom compares all other methods.

    Args:
        scene: The scene, or its name in the catalogue.
        max_impacts: Stop after this many impacts; None for no limit.
        until_s: Stop at this time instead of the scene's duration.
        record: "all" or "none": which impacts the trace contains. The impacts of each disc are counted in both cases.
        window_s: Start and end, in seconds, of the time in which impacts are recorded.
        sample_times_s: Ascending times, in seconds, at which the trace contains all positions.
        contact_duration_s: Contact time of the TC model, in seconds. `EventDrivenRun` explains this model, which
            prevents an endless series of impacts in a finite time. 0 turns the model off.
        progress: Function called from time to time with the number of impacts and the time so far.

    Returns:
        The trace. If the run ended early, the final state is the state at the last impact.

    Raises:
        InputError: An option is outside its range, or is not supported with gravity or damping.

    Examples:
        >>> trace = carom.solve_pic("paper/missed")
        >>> [float(time_s) for time_s in trace.impacts["time_s"]]
        [0.425]
    """
    scene = to_scene(scene)
    options = RunOptions.of(record, window_s, contact_duration_s)
    force = find_bending_force(scene)
    if options.contact_duration_s and force:
        raise InputError(f"contact_duration_s must be 0 in a scene with {force}, got {options.contact_duration_s}")
    end_s = scene.duration_s if until_s is None else check_end_time(scene, until_s)
    if max_impacts is not None:
        max_impacts = check_count("max_impacts", max_impacts)
    samples_s = check_times("sample_times_s", sample_times_s)
    is_plain = max_impacts != 0 and not samples_s and progress is None and options == PLAIN
    is_lone_pair = len(scene.discs) == 2 and not scene.walls and not force and not scene.arrays.driven
    if is_plain and is_lone_pair and not scene.arrays.turns:
        trace = _solve_two_discs(scene, end_s)
        if trace is not None:
            return trace
    run = start_pic_run(scene, options)
    outcome, samples = advance_run(run, end_s, max_impacts, samples_s, progress)
    return build_trace(
        run,
        "pic",
        scene,
        outcome,
        samples=samples,
        settings={"contact_duration_s": options.contact_duration_s} if options.contact_duration_s else {},
        impacts_per_disc=run.impacts_per_disc(),
    )


def _solve_two_discs(scene: Scene, end_s: float) -> Trace | None:
    """Solve a scene of two discs without walls by formulas. Return None if the formulas don't apply to the scene."""
    first, second = scene.discs
    solution = pic.solve_two_discs(first, second, scene.restitution, end_s)
    if solution is None:
        return None
    impacts = np.frombuffer(solution[0], IMPACT_DTYPE)
    position_m, velocity_m_s = np.frombuffer(solution[1]).reshape(2, 2, 2)
    return Trace(
        method="pic",
        scene=scene,
        impacts=impacts,
        final_position_m=position_m,
        final_velocity_m_s=velocity_m_s,
        end_time_s=end_s,
        counts={"impacts": len(impacts), "predictions": len(impacts) + 1},
        impacts_per_disc=_IMPACTS_PER_DISC[len(impacts)],
        notes=find_extension_notes(),
    )
