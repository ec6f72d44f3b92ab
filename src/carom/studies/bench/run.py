"""Execution of a bench: first measures the errors of all methods, then their run times while nothing else runs.

The errors of a scene are measured with smaller and smaller steps, up to a time limit.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from carom.catalogue import resolve_scenes
from carom.comparator.shifted_scenes import list_even_phases
from carom.engines.registry import EngineInfo
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.environment import describe_environment
from carom.execution.job import Answer, Job, Method, Progress, no_progress
from carom.execution.journal import MemoryJournal
from carom.execution.methods import Methods, list_methods, select_profiles
from carom.execution.pool import Pool
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.score_jobs import Measures, estimate_steps, score_jobs
from carom.model.scene import Scene
from carom.studies.bench.convergence import fit_order
from carom.studies.bench.options import SERIES_STEPS, BenchPlan, ErrorKind, compute_geometric_steps
from carom.studies.bench.own_methods import EXACT_METHOD, add_own_methods, list_own_methods
from carom.studies.bench.result import Bench, Curve, Point, SceneBench, find_cheapest, find_pareto_front
from carom.studies.bench.timing_pass import At, SceneTiming, TimeScene, TimingKey, build_timing_key
from carom.support import formatting

#: Smallest default step size of a scene, as a fraction of a frame.
FINEST = 60 / 10_000


def measure_work_precision(
    scenes: Sequence[Scene],
    plan: BenchPlan,
    pool: Pool,
    *,
    notes: MemoryJournal[JobKey, Measures] | None = None,
    timings: MemoryJournal[TimingKey, SceneTiming] | None = None,
    progress: Progress = no_progress,
    command: str = "",
) -> Bench:
    """Measure the errors and run times of every method with every step size, and fit orders of convergence.

    Args:
        scenes: Scenes with different names.
        plan: Options of the bench.
        pool: Pool of worker processes for measuring errors, which is closed before run times are measured.
        notes: Journal of measured errors, to which new results are added.
        timings: Journal of measured run times, to which new results are added.
        progress: Function that is called with the number of finished tasks, the number of all tasks, and a description.
        command: The command that the report shows.

    Raises:
        InputError: There is no scene, or two scenes have the same name.
        UnknownNameError: An engine or profile does not exist.
    """
    started = time.perf_counter()
    with pool:  # the processes of the pool end before the timing pass
        infos = select_engines(describe_engines(plan.engines, pool), plan.engines)
        profiles = select_profiles(infos, plan.profiles)
        infos = add_own_methods(infos, plan, pool)
        jobs, methods = _build_jobs(scenes, infos, profiles, plan, pool)
        scored = []
        done = 0
        for scene in scenes:
            scene_jobs, journal = [job for job in jobs if job.scene is scene], notes or MemoryJournal()
            found = _score_scene(scene_jobs, methods, plan.budget_s / 2, pool, journal, progress, done, len(jobs))
            scored.append((scene, scene_jobs, *found))
            done += len(scene_jobs)
    benches = []
    for scene, scene_jobs, results, unscored in scored:
        answers = formatting.group_by(((job.method, job.dt_s), results.get(build_job_key(job))) for job in scene_jobs)
        points = [_build_point(at, found, unscored.get(at, ""), plan.error) for at, found in answers.items()]
        method_steps = [point.at for point in points if not point.reason]
        timing = None
        if plan.timing and method_steps:
            task = TimeScene(scene, tuple(method_steps), plan.rounds, plan.seed, plan.budget_s / 2, progress)
            request = TaskRequest(scene, build_timing_key(scene, method_steps, plan.seed), task)
            with plan.open_local_pool(1) as timing_pool:
                ((_, answer),) = run_tasks([request], timing_pool, timings, one_at_a_time=True)
            timing = answer.value
        if timing is not None:
            clocks, why = dict(timing.timings), dict(timing.untimed)
            points = [replace(p, timing=clocks.get(p.at), untimed=why.get(p.at, "")) for p in points]
        benches.append(_build_scene_bench(scene, points, timing, plan.target))
    return Bench(tuple(benches), plan, describe_environment(infos), command, time.perf_counter() - started)


def _compute_default_steps(scene: Scene) -> tuple[float, ...]:
    frame_s = 1.0 / scene.frame_rate_hz
    return compute_geometric_steps(frame_s, frame_s * FINEST, SERIES_STEPS)


def _build_jobs(
    scenes: Sequence[Scene], infos: Sequence[EngineInfo], profiles: Sequence[str], plan: BenchPlan, pool: Pool
) -> tuple[list[Job], Methods]:
    """Return all jobs whose errors are measured, and the descriptions of their methods.

    PIC runs only at the largest step size, because its error and run time do not depend on the step size. PIC and PIT
    use the requested profiles only if the user requests PIC and PIT by name.
    """
    plain, _ = resolve_scenes(scenes)
    steps = {scene.name: sorted(set(plan.dts or _compute_default_steps(scene)), reverse=True) for scene in plain}
    all_methods = list_methods(infos, profiles, [dt_s for scene_steps in steps.values() for dt_s in scene_steps], pool)
    added = list_own_methods(plan)
    jobs = [
        Job(scene, method, dt_s, refinement, phase)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(steps[scene.name])
        for method in ([added[info.name]] if info.name in added else all_methods.by_engine_and_step[info.name, dt_s])
        if method != EXACT_METHOD or refinement == 0
        for phase in list_even_phases(plan.phases)
    ]
    return jobs, all_methods


def _score_scene(
    jobs: Sequence[Job],
    methods: Methods,
    budget_s: float,
    pool: Pool,
    notes: MemoryJournal[JobKey, Measures],
    progress: Progress,
    before: int,
    total: int,
) -> tuple[dict[JobKey, Answer[Measures]], dict[At, str]]:
    """Run the jobs of one scene. Return the results, and the reasons why methods have no result with a step size.

    All methods run with a step size before any method runs with a smaller step size. A method is omitted if its
    expected run time exceeds the remaining time. The best profile of each engine comes first, so that each engine is
    tested with step sizes as small as the time limit permits.

    Args:
        jobs: Every job of the scene.
        methods: Descriptions of the jobs' methods.
        budget_s: Time limit of the pass, in seconds. The largest step size is always run.
        pool: Pool of worker processes, which is not closed.
        notes: Journal of results, to which new results are added.
        progress: Function that is called with the number of finished jobs, the number of all jobs, and a description.
        before: Number of finished jobs of other scenes.
        total: Number of jobs of all scenes.
    """
    results: dict[JobKey, Answer[Measures]] = {}
    unscored: dict[At, str] = {}
    until_s, step_s = time.perf_counter() + budget_s, 0.0
    for dt_s in sorted({job.dt_s for job in jobs}, reverse=True):
        at_step = formatting.group_by((job.method, job) for job in jobs if job.dt_s == dt_s)
        left_s = until_s - time.perf_counter()
        chosen: list[Job] = []
        steps = 0.0
        for method in _rank_methods(at_step, jobs, results):
            missing = (job for job in at_step[method] if build_job_key(job) not in notes.entries)
            more_steps = sum(estimate_steps(job) for job in missing if methods.find_job_refusal(job) is None)
            if more_steps and step_s * (steps + more_steps) > left_s:
                unscored[method, dt_s] = f"the {budget_s:.0f} s for scoring this scene are used up; raise --budget"
                continue
            steps += more_steps
            chosen += at_step[method]
        began = time.perf_counter()
        show = _build_progress(progress, before + len(results), total, dt_s, until_s)
        results.update(score_jobs(chosen, pool, notes, show, refusal=methods.find_job_refusal))
        if steps:
            step_s = (time.perf_counter() - began) / steps
    return results, unscored


def _build_progress(progress: Progress, before: int, total: int, dt_s: float, until_s: float) -> Progress:
    """Return a progress function that adds the step size and the remaining time to each description."""

    def show(done: int, _all: int, description: str) -> None:
        left = formatting.format_time_left(until_s - time.perf_counter())
        progress(before + done, total, f"scoring {description} at {formatting.format_step(dt_s)}{left}")

    return show


def _rank_methods(
    methods: Iterable[Method], jobs: Sequence[Job], results: Mapping[JobKey, Answer[Measures]]
) -> list[Method]:
    """Return the best profile of each engine, then the second best profile of each engine, and so on.

    Profiles are ranked by their results with the smallest step size so far: first by the number of missed and invented
    impacts, then by the error.
    """

    def severity(method: Method) -> tuple[int, float]:
        found = [job for job in jobs if job.method == method and build_job_key(job) in results]
        finest = min((job.dt_s for job in found), default=math.inf)
        values = [results[build_job_key(job)].value for job in found if job.dt_s == finest]
        measured = [value for value in values if value is not None]
        errors = [value.total.velocity for value in measured]
        lost_count = sum(value.missed + value.spurious for value in measured)
        return lost_count, math.inf if any(map(math.isnan, errors)) else max(errors, default=math.inf)

    ranked = sorted(methods, key=severity)
    place = {method: [m for m in ranked if m.engine == method.engine].index(method) for method in ranked}
    return sorted(ranked, key=place.__getitem__)


def _build_point(at: At, phase_answers: Sequence[Answer[Measures] | None], unscored: str, kind: ErrorKind) -> Point:
    """Combine the results at all phases into the point of one method and step size.

    The result of an omitted job is None.
    """
    method, dt_s = at
    answers = [answer for answer in phase_answers if answer is not None]
    measured = [answer.value for answer in answers if answer.value is not None]
    errors = [error for measures in measured if not math.isnan(error := compute_error(measures, kind))]
    reason = unscored or next((answer.problem for answer in answers if answer.problem), "")
    if not reason:
        reason = next((f"ended early: {m.outcome}" for m in measured if m.outcome != "completed"), "")
    if not reason and all(measures.expected == 0 for measures in measured):
        reason = "the scene has no impact, so there is no error to measure"
    return Point(
        method.engine,
        method.profile,
        dt_s,
        error=max(errors, default=math.nan),
        error_median=statistics.median(errors) if errors else math.nan,
        error_least=min(errors, default=math.nan),
        phases=len(phase_answers),
        expected=sum(measures.expected for measures in measured),
        missed=sum(measures.missed + measures.undecided for measures in measured),
        spurious=sum(measures.spurious for measures in measured),
        reason=reason,
    )


def _build_scene_bench(scene: Scene, points: Sequence[Point], timing: SceneTiming | None, target: float) -> SceneBench:
    curves = []
    for method, curve_points in formatting.group_by((point.method, point) for point in points).items():
        sound = [point for point in curve_points if point.is_correct]
        order = fit_order([point.dt_s for point in sound], [point.error for point in sound])
        cheapest = find_cheapest(curve_points, target)
        curves.append(Curve(method.engine, method.profile, tuple(curve_points), order, cheapest))
    return SceneBench(
        scene,
        tuple(curves),
        find_pareto_front([point for point in points if point.engine != "pic"]),
        find_cheapest(points, target),
        timing.noise if timing else None,
        timing.rounds if timing else 0,
        timing.date if timing else "",
    )


def compute_error(measures: Measures, kind: ErrorKind) -> float:
    """Return a run's error of one kind; NaN if no impact was matched. Missed impacts are counted separately."""
    total, time = measures.total, abs(measures.total.time_s) / measures.duration_s
    both = (time, total.velocity)
    return {
        ErrorKind.IMPACT: math.nan if any(map(math.isnan, both)) else max(both),
        ErrorKind.TIME: time,
        ErrorKind.VELOCITY: total.velocity,
        ErrorKind.DIRECTION: total.direction_rad,
        ErrorKind.POSITION: total.final_position,
    }[kind]
