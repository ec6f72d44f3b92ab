"""Scoring pass: measures the errors of all methods on a scene with smaller and smaller steps, up to a time limit."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence

from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.job import Answer, Job, Method, Progress
from carom.execution.journal import MemoryJournal
from carom.execution.methods import Methods
from carom.execution.pool import Pool
from carom.execution.score_jobs import Measures, estimate_steps, score_jobs
from carom.studies.bench.timing_pass import At
from carom.support import formatting


def score_scene(
    jobs: Sequence[Job],
    methods: Methods,
    budget_s: float,
    pool: Pool,
    notes: MemoryJournal[JobKey, Measures],
    progress: Progress,
    before: int,
    total: int,
) -> tuple[dict[JobKey, Answer[Measures]], dict[At, str]]:
    """Run the jobs of one scene. Return their results, and for each method and step size without a result the reason.

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
                beyond = f"the {budget_s:.0f} s for scoring this scene are used up; raise --budget"
                unscored[method, dt_s] = beyond
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
