"""Runs and scores many jobs. Only the numbers of each score are kept, not the traces.

The worker that runs a job also computes the score. Each score is stored in a journal as soon as it is available.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from carom.comparator import Errors, compare
from carom.execution.adapter_profile import load_supported_adapter
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.job import Answer, Job, JobTask, Progress, no_progress
from carom.execution.journal import Journal, JournalEntry, MemoryJournal
from carom.execution.observation.engine_run import observe_run
from carom.execution.pool import Pool
from carom.execution.scene_reference import require_reference, shift_to_phase, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks

#: Number of references that a worker caches. A few references are enough, since the jobs of a batch are sorted by scene
#: and phase.
REFERENCES_KEPT = 8


@dataclass(frozen=True)
class Measures:
    """The numbers of a score, see `carom.comparator.Score`.

    Attributes:
        total: The largest error of each kind, measured against the reference.
        expected: Number of impacts of the reference.
        matched: Number of impacts found.
        missed: Number of impacts missed.
        spurious: Number of impacts invented.
        undecided: Number of impacts so close to the end of the run that the engine may not have reported them yet.
        duration_s: Duration of the scene, in seconds. Errors of times are divided by this duration.
        outcome: Outcome of the run, the name of a `carom.model.trace.Outcome`.
    """

    total: Errors
    expected: int
    matched: int
    missed: int
    spurious: int
    undecided: int
    duration_s: float
    outcome: str


@dataclass(frozen=True)
class ScoreTask(JobTask):
    """Run and score a job in a worker process."""

    def carry_out(self) -> Measures:
        """Return the numbers of the job's score.

        Raises:
            UnsupportedError: The scene has no reference, or can't begin earlier by the job's phase.
        """
        job = self.job
        adapter = load_supported_adapter(job)
        scene = shift_to_phase(job)
        reference = require_reference(_reference(scene))
        observed = observe_run(adapter, scene, job.profile, job.dt_s, overrides=job.method.overrides)
        score = compare(reference, observed)
        return Measures(
            score.total,
            score.expected,
            matched=len(score.errors),
            missed=len(score.missed),
            spurious=len(score.spurious),
            undecided=len(score.undecided),
            duration_s=scene.duration_s,
            outcome=observed.outcome.name.lower(),
        )


_reference = lru_cache(maxsize=REFERENCES_KEPT)(solve_reference)


#: Function that opens the journal of scores.
score_journal = partial(Journal[JobKey, Measures], "scores", JournalEntry[JobKey, Measures])


def score_jobs(
    jobs: Sequence[Job],
    pool: Pool,
    journal: MemoryJournal[JobKey, Measures] | None = None,
    progress: Progress = no_progress,
    *,
    refusal: Callable[[Job], Answer[Any] | None] = lambda _: None,
) -> Mapping[JobKey, Answer[Measures]]:
    """Run and score jobs, and return the answers by key.

    Args:
        jobs: The jobs.
        pool: Pool that runs the jobs; the caller closes it.
        journal: Journal with the known scores. New scores are added to the journal.
        progress: Called with (done, total, description) as jobs finish.
        refusal: Function that returns why a job can't be run; None if no reason is known. A refused job is not sent.
    """
    answers: dict[JobKey, Answer[Measures]] = {}
    requests = [
        TaskRequest(job, build_job_key(job), ScoreTask(job), refusal(job), estimate_steps(job))
        for job in sort_by_start(jobs)
    ]
    for job, answer in run_tasks(requests, pool, journal):
        answers[build_job_key(job)] = answer
        progress(len(answers), len(requests), f"{job.scene.name} on {job.engine}")
    return answers


def sort_by_start(jobs: Iterable[Job]) -> list[Job]:
    """Sort jobs so that jobs with the same scene and phase are adjacent, since a worker keeps only a few references."""
    return sorted(jobs, key=lambda job: (job.scene.name, job.phase * job.dt_s, job.dt_s))


def estimate_steps(job: Job) -> float:
    """Return the approximate number of engine steps of a job."""
    return job.scene.duration_s / job.dt_s
