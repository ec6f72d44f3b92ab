"""Scoring pass: measures the errors of all methods on a scene with smaller and smaller steps, up to a time limit."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.job import Answer, Job, Method, Progress
from carom.execution.journal import MemoryJournal
from carom.execution.methods import Methods
from carom.execution.pool import Pool
from carom.execution.score_jobs import Measures, estimate_steps, score_jobs
from carom.report import formatting
from carom.studies.bench.timing_pass import At


@dataclass
class ScoringPass:
    """Scores the jobs of one scene.

    Attributes:
        jobs: Every job of the scene.
        methods: Descriptions of the jobs' methods.
        budget_s: Time limit of the pass, in seconds. The largest step size is always run.
        pool: Pool of worker processes, which is not closed.
        notes: Journal of results, to which new results are added.
        progress: Function that is called with the number of finished jobs, the number of all jobs, and a description.
        before: Number of finished jobs of other scenes.
        total: Number of jobs of all scenes.
    """

    jobs: Sequence[Job]
    methods: Methods
    budget_s: float
    pool: Pool
    notes: MemoryJournal[JobKey, Measures]
    progress: Progress
    before: int
    total: int

    def run(self) -> tuple[dict[JobKey, Answer[Measures]], dict[At, str]]:
        """Return the results, and the reasons for missing results by method and step size.

        All methods run with a step size before any method runs with a smaller step size. A method is omitted if its
        expected run time exceeds the remaining time. The best profile of each engine is chosen first, so that every
        engine gets the smallest step size that the time limit permits.
        """
        results: dict[JobKey, Answer[Measures]] = {}
        unscored: dict[At, str] = {}
        started, step_s = time.perf_counter(), 0.0
        levels = sorted({job.refinement for job in self.jobs})
        for level in levels:
            at_level = formatting.group_by((job.method, job) for job in self.jobs if job.refinement == level)
            left_s = self.budget_s - (time.perf_counter() - started)
            chosen: list[Job] = []
            steps = 0.0
            for method in self._rank_methods(at_level, results):
                method_jobs = at_level[method]
                more_steps = sum(estimate_steps(job) for job in method_jobs if self._is_missing(job))
                if more_steps and step_s * (steps + more_steps) > left_s:
                    beyond = f"the {self.budget_s:.0f} s for scoring this scene are used up; raise --budget"
                    unscored[method, method_jobs[0].dt_s] = beyond
                    continue
                steps += more_steps
                chosen += method_jobs
            began = time.perf_counter()
            step = formatting.format_step(min(job.dt_s for method_jobs in at_level.values() for job in method_jobs))
            progress = self._build_progress(len(results), left_s, step)
            results.update(score_jobs(chosen, self.pool, self.notes, progress, refusal=self.methods.find_job_refusal))
            if steps:
                step_s = (time.perf_counter() - began) / steps
        return results, unscored

    def _build_progress(self, done: int, left_s: float, step: str) -> Progress:
        """Return a progress function that adds the step size and the remaining time to each description."""
        until_s = time.perf_counter() + left_s

        def show(done_at_level: int, _all: int, description: str) -> None:
            left = formatting.format_time_left(until_s - time.perf_counter())
            self.progress(self.before + done + done_at_level, self.total, f"scoring {description} at {step}{left}")

        return show

    def _is_missing(self, job: Job) -> bool:
        return build_job_key(job) not in self.notes.entries and self.methods.find_job_refusal(job) is None

    def _rank_methods(
        self, methods: Mapping[Method, Sequence[Job]], results: Mapping[JobKey, Answer[Measures]]
    ) -> list[Method]:
        """Return the best profile of each engine, then the second best profile of each engine, and so on.

        Profiles are ranked by their numbers of missed and invented impacts, and then by their errors with the smallest
        step size that has run.
        """

        def severity(method: Method) -> tuple[int, float]:
            found = [job for job in self.jobs if job.method == method and build_job_key(job) in results]
            finest = min((job.dt_s for job in found), default=math.inf)
            values = [results[build_job_key(job)].value for job in found if job.dt_s == finest]
            measured = [value for value in values if value is not None]
            errors = [value.total.velocity for value in measured]
            lost_count = sum(value.missed + value.spurious for value in measured)
            return lost_count, math.inf if any(map(math.isnan, errors)) else max(errors, default=math.inf)

        ranked = sorted(methods, key=severity)
        place = {method: [m for m in ranked if m.engine == method.engine].index(method) for method in ranked}
        return sorted(ranked, key=place.__getitem__)
