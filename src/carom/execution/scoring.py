"""Sweeps: many jobs, of each of which the numbers of its score are kept and not its trace.

A score is found in the worker that ran the job, and written to a journal as soon as it is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from carom.comparator import Errors, compare
from carom.execution.cache_key import JobKey, job_key
from carom.execution.engine_run import load_supported_adapter, observe_run
from carom.execution.job import Answer, Job, JobTask, Progress, no_progress
from carom.execution.journal import Journal, JournalEntry, MemoryJournal
from carom.execution.pool import Pool
from carom.execution.reference import require_reference, scene_at_phase, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks

#: References kept by a worker: the jobs of a batch are in order of scene and phase, so that few are enough.
REFERENCES_KEPT = 8


@dataclass(frozen=True)
class Measures:
    """The numbers of a score, see `carom.comparator.Score`.

    Attributes:
        total: The largest errors against the reference, kind by kind.
        expected: Impacts of the reference.
        matched: Impacts found.
        missed: Impacts missed.
        spurious: Impacts invented.
        undecided: Impacts too close to the end of the run to have been reported.
        duration_s: By which times are divided where they are to have no unit.
        outcome: How the run ended, the name of a `carom.model.trace.Outcome`.
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
    """Run a job and score it, in a worker process."""

    def carry_out(self) -> Measures:
        """Return the numbers of the job's score.

        Raises:
            UnsupportedError: There is no reference, or no such start.
        """
        job = self.job
        adapter = load_supported_adapter(job)
        scene = scene_at_phase(job)
        reference = require_reference(_reference(scene))
        observed = observe_run(adapter, scene, job.profile, job.dt_s, tried=job.method.tried)
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


#: Opens the journal of a sweep.
score_journal = partial(Journal[JobKey, Measures], "scores", JournalEntry[JobKey, Measures])


def sweep(
    jobs: Sequence[Job],
    pool: Pool,
    notes: MemoryJournal[JobKey, Measures] | None = None,
    progress: Progress = no_progress,
    *,
    refusal: Callable[[Job], Answer[Any] | None] = lambda _: None,
) -> Mapping[JobKey, Answer[Measures]]:
    """Score jobs, and return what came of each.

    Args:
        jobs: What is to be run.
        pool: Where; it stays open.
        notes: What is known already, and where more of it goes.
        progress: Called with (done, all, what) as jobs finish.
        refusal: Why a job can't be run, as far as that is known; such a job is not sent.
    """
    found: dict[JobKey, Answer[Measures]] = {}
    asks = [TaskRequest(job, job_key(job), ScoreTask(job), refusal(job), steps_of(job)) for job in sort_by_start(jobs)]
    for job, answer in run_tasks(asks, pool, MemoryJournal() if notes is None else notes):
        found[job_key(job)] = answer
        progress(len(found), len(asks), f"{job.scene.name} on {job.engine}")
    return found


def sort_by_start(jobs: Iterable[Job]) -> list[Job]:
    """Return jobs with those of one start together, since a worker keeps the references of the last few."""
    return sorted(jobs, key=lambda job: (job.scene.name, job.phase * job.dt_s, job.dt_s))


def steps_of(job: Job) -> float:
    """Return about how many engine steps a job takes."""
    return job.scene.duration_s / job.dt_s
