"""Description of a cross-check before it runs: planned runs, and omitted runs with reasons.

No engine is run, only PIC and PIT.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from carom.comparator.shifted_scenes import solve_shifted_references
from carom.engines.registry import EngineInfo
from carom.execution import time_saved
from carom.execution.job import Job
from carom.execution.phases import generate_phases
from carom.execution.scene_reference import solve_reference
from carom.model.scene import Scene
from carom.model.trace import Trace, resolve_profile
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit
from carom.studies.cross_check.plan import Plan
from carom.support.formatting import format_count, format_instant, format_number
from carom.support.limits import MOST_DISCS_DRAWN

#: Largest number of frames for which PIT is run to describe the work that PIT skips.
MOST_FRAMES = 1_000_000


def explain(plan: Plan) -> Iterator[str]:
    """Yield lines that describe the plan of a cross-check."""
    options, run = plan.options, list(plan.methods.infos.values())
    for scene in plan.scenes:
        jobs = [job for job in plan.jobs if job.scene is scene]
        steps = options.list_steps(scene)
        reference = solve_reference(scene)
        walls = format_count(len(scene.walls), "wall") if scene.walls else "no walls"
        bodies = f"{format_count(len(scene.discs), 'disc')}, {walls}, {scene.duration_s:g} s"
        needs = ", ".join(sorted(need.value for need in scene.needs)) or "no special features"
        skipped = [] if isinstance(reference, str) else list(_list_skipped(scene, reference, steps[0]))
        summary = f"; skipped: {', '.join(skipped)}" if skipped else ""
        yield f"{scene.name}: {bodies}, requires {needs}{summary}"
        if isinstance(reference, str):
            yield f"  not run: {reference}"
            continue
        plain = "running event by event" if time_saved.is_closed_form(reference) else "predicting all pairs again"
        saved = _describe_saving(time_saved.measure_pic_saving(scene, reference), plain)
        yield f"  PIC: {describe_pic(scene, reference)}{saved}"
        for dt_s in sorted({job.dt_s for job in jobs}, reverse=True):
            saved = _describe_saving(time_saved.measure_pit_saving(scene, dt_s), "the plain loop")
            yield f"  PIT at {format_instant(dt_s)}: {describe_pit(scene, dt_s)}{saved}"
        yield f"  engines: {_describe_engines(scene, reference, steps[0])}"
        yield f"  states: {_describe_samples(scene, drawn=options.samples)}"
        if options.phases:
            shifted = solve_shifted_references(reference, steps[0], generate_phases(options.phases, options.seed))
            why = "shifts that change the scene's impacts are omitted"
            yield f"  phases: {len(shifted)} of {options.phases} at {format_instant(steps[0])}; {why}"
        for info in run:
            profile_names = plan.profiles if info.profiles else plan.profiles[-1:]
            for profile in dict.fromkeys(resolve_profile(info.name, one) for one in profile_names):
                planned = [job for job in jobs if (job.engine, job.profile) == (info.name, profile)]
                name = planned[0].method.label if planned else f"{info.name} {profile}"
                yield f"  {name}: {_describe_runs(planned, plan, info, profile, len(steps))}"
    yield from (f"{info.name} is not available: {info.unavailable}" for info in plan.engines if info not in run)


def _list_skipped(scene: Scene, reference: Trace, dt_s: float) -> Iterator[str]:
    """Yield the work that methods skip with this step size."""
    if time_saved.is_closed_form(reference):
        yield "event queue"
        yield "grid"
    if not scene.walls:
        yield "wall tests"
    steps, needed = scene.step_count(dt_s), _count_needed_steps(scene, reference, dt_s)
    counts = solve_pit(scene, frame_rate_hz=1.0 / dt_s).counts if steps <= MOST_FRAMES else {}
    if unseen := counts.get("frames", 0) - counts.get("frames_looked_at", 0):
        yield f"{unseen} of {counts['frames']} frames of PIT"
    if needed < steps:
        yield f"engine steps after step {needed} of {steps}"


def _count_needed_steps(scene: Scene, reference: Trace, dt_s: float) -> int:
    """Return the number of steps after which all discs fly freely, according to PIC.

    Return the number of all steps if forces act, if no impact occurs, or if later impacts would follow within twice the
    duration.
    """
    steps, times = scene.step_count(dt_s), reference.impacts["time_s"]
    if _list_forces(scene) or not len(times) or not _is_last_impact(scene, reference):
        return steps
    return min(steps, math.ceil(float(times[-1]) / dt_s) + 1)


def _list_forces(scene: Scene) -> list[str]:
    """Return the names of the forces that change velocities between impacts."""
    forces = {
        "gravity": any(scene.gravity_m_s2),
        "damping": scene.damping_per_s,
        "the table": scene.table_deceleration_m_s2,
    }
    return [name for name, acts in forces.items() if acts]


def describe_pic(scene: Scene, trace: Trace) -> str:
    """Describe which variant of PIC solves a scene, and how many impacts and predictions it computes."""
    predicted = format_count(trace.counts.get("predictions", 0), "prediction")
    impacts = f"{format_count(len(trace.impacts), 'impact')} in {predicted}"
    walls = "" if scene.walls else ", no walls to test"
    if scene.damping_per_s:
        undamped = describe_pic(scene.undamped, trace)
        return f"in transformed time, where damped discs move in straight lines: {undamped}"
    if scene.gravity_m_s2 != (0.0, 0.0) or scene.table_deceleration_m_s2:
        return f"event-driven along parabolas, with a grid of cells{walls}: {impacts}"
    if not time_saved.is_closed_form(trace):
        return f"event-driven, with a grid of cells{walls}: {impacts}"
    return f"closed form for two discs, without event queue or grid{walls}: {impacts}"


def describe_pit(scene: Scene, dt_s: float) -> str:
    """Describe how many frames and pairs PIT tests. If PIT would run for too long, give only the number of frames."""
    frames = scene.step_count(dt_s)
    if frames > MOST_FRAMES:
        return f"{frames} frames"
    counts = solve_pit(scene, frame_rate_hz=1.0 / dt_s).counts
    plain = counts["frames"] * time_saved.count_tests_per_frame(scene)
    looked_at = f"{counts['frames_looked_at']} of {counts['frames']} frames are tested"
    if counts["frames_looked_at"] < counts["frames"]:
        looked_at += ", because no pair can touch at the other frames"
    return f"{looked_at}; {counts['pair_tests']} pairs are tested, instead of {plain} without skipping"


def _describe_saving(saved: time_saved.SkippedTime | None, plain: str) -> str:
    """Describe how much time skipping saves; empty if the measurement would take too long."""
    if saved is None:
        return ""
    takes = f"{plain} takes {format_number(saved.ratio)} times as long"
    return f"; it takes {format_number(1e3 * saved.with_skipping_s, 3)} ms, and {takes}"


def _describe_engines(scene: Scene, reference: Trace, dt_s: float) -> str:
    steps = scene.step_count(dt_s)
    full_run = f"run for all {steps} steps at {format_instant(dt_s)}"
    if forces := _list_forces(scene):
        ends = ""
        if reference.contact_s < math.inf:
            until = format_number(reference.contact_s, 4)
            ends = f", and the comparison with PIC ends at {until} s, when a disc {reference.contact_of_disc}"
        return f"{full_run}: {forces[0]} changes velocities between impacts{ends}"
    until = "all discs fly freely"
    if not _is_last_impact(scene, reference):
        return f"{full_run}, or until {until}: PIC finds later impacts within twice the duration"
    if not len(reference.impacts):
        return f"stopped once {until}, because no discs meet in PIC"
    last_s = float(reference.impacts["time_s"][-1])
    needed = _count_needed_steps(scene, reference, dt_s)
    last = f"PIC's last impact at {format_number(last_s, 4)} s"
    return f"stopped once {until} after {last}, which is in step {needed} of {steps} at {format_instant(dt_s)}"


def _is_last_impact(scene: Scene, reference: Trace) -> bool:
    longer = scene.model_copy(update={"duration_s": 2.0 * scene.duration_s})
    later = solve_pic(longer, max_impacts=len(reference.impacts) + 1)
    return len(later.impacts) == len(reference.impacts) and bool(np.isfinite(reference.final_position_m).all())


def _describe_samples(scene: Scene, *, drawn: bool) -> str:
    if not drawn:
        return "not kept, because no report is written"
    if len(scene.discs) > MOST_DISCS_DRAWN:
        return f"not kept, because no picture shows more than {MOST_DISCS_DRAWN} discs"
    return "kept for runs at the largest step size, because only these runs are drawn"


def _describe_runs(planned: Sequence[Job], plan: Plan, info: EngineInfo, profile: str, steps: int) -> str:
    """Describe the step sizes with which a profile is run, and state why other step sizes are skipped."""
    if not planned:
        is_duplicate = profile in info.profiles
        return f"skipped: {'another profile has the same settings' if is_duplicate else 'no such profile'}"
    refused = {job.dt_s: answer.reason for job in planned if (answer := plan.methods.find_job_refusal(job)) is not None}
    if len(refused) == len(planned) and len(set(refused.values())) == 1:
        return f"skipped: {refused[planned[0].dt_s]}"
    left_out = [f"skipped at {format_instant(dt_s)}: {reason}" for dt_s, reason in refused.items()]
    runs = ", ".join(format_number(job.dt_s, 6) for job in planned if job.dt_s not in refused)
    if runs and len(planned) < steps:
        runs += " s only, which is the largest step size; --dt adds smaller ones"
    elif runs:
        runs += " s"
    return "; ".join([f"run at {runs}", *left_out] if runs else left_out)
