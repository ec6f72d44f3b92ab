"""Judging settings scene by scene, in worker processes, with a journal of what is done."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from carom.comparator import Score, compare
from carom.registry import load_adapter
from carom.runs.job import PIT_METHOD, Answer, Job, JobTask, Method, UnsupportedError
from carom.runs.journal import Journal
from carom.runs.observe import observe_run
from carom.runs.pool import Asker, Pool
from carom.runs.reference import reference_trace
from carom.runs.scoring import JobKey, job_key
from carom.runs.timing import time_run
from carom.scene import Scene
from carom.trace import Trace
from carom.tune.merit import Judged

__all__ = ["JudgeTask", "JudgedJob", "Jury", "judged_by", "tune_journal"]

#: References, and runs of PIT, that a worker keeps: more scenes than a search is made over.
_KEPT = 256

_reference = lru_cache(maxsize=_KEPT)(reference_trace)


@lru_cache(maxsize=_KEPT)
def _sampling(scene: Scene, dt_s: float) -> Trace:
    return observe_run(load_adapter(PIT_METHOD.engine), scene, PIT_METHOD.profile, dt_s)


def judged_by(score: Score) -> Judged:
    """Return what a search reads of a score.

    Of a trajectory that parted from the reference's, which impacts it has is chance, and so is what it pays for them:
    there the error over PIT's, and what is missed and invented, is that of the steps from the run's own states.
    """
    local = score.local_truth
    if score.parted_s is not None and local is not None:
        return Judged(score.grade, local.ratio[1], local.missed, local.invented, float_bits=score.float_bits)
    return Judged(score.grade, score.price_paid, len(score.missed), len(score.spurious), float_bits=score.float_bits)


@dataclass(frozen=True)
class JudgeTask(JobTask):
    """Run a job and judge it, in a worker process.

    Attributes:
        horizon_s: Time up to which the reference may be believed; None for all of it.
        timed: Whether its steps are timed too.
    """

    horizon_s: float | None = None
    timed: bool = False

    def carry_out(self) -> Judged:
        """Return what came of it.

        Raises:
            UnsupportedError: There is no reference.
        """
        job, tried = self.job, self.job.method.tried
        # Also where the first profile says that it can't: it is held against settings that say nothing of themselves.
        adapter = load_adapter(job.engine)
        reference = _reference(job.scene)
        if not isinstance(reference, Trace):
            raise UnsupportedError(reference)
        observed = observe_run(adapter, job.scene, job.profile, job.dt_s, tried=tried)
        score = compare(reference, observed, sampling=_sampling(job.scene, job.dt_s), horizon=self.horizon_s)
        judged = judged_by(score)
        if not self.timed:
            return judged
        return replace(judged, seconds=time_run(adapter, job.scene, job.profile, job.dt_s, tried=tried).advance_s)


@dataclass(frozen=True)
class JudgedJob:
    """What came of a job of a search.

    Attributes:
        key: Which job it is.
        scene: Name of the scene, for readers.
        timed: Whether its steps were timed.
        answer: What came of it, or why nothing did.
    """

    key: JobKey
    scene: str
    timed: bool
    answer: Answer[Judged]


def tune_journal(path: Path, *, resume: bool = False, retry: bool = False) -> Journal[JudgedJob]:
    """Open the journal of a search; with `retry` what an engine broke off counts as not run.

    A search asks the same of the same answers, so that one that goes on finds again what it had found.
    """
    again = (lambda entry: entry.answer.status.broken) if retry else None
    return Journal(path, JudgedJob, lambda entry: (entry.key, entry.timed), resume=resume, again=again)


class Jury:
    """Judges a method on scenes.

    Args:
        steps: The scenes with the step of each, seconds.
        horizons: Time up to which a scene's reference may be believed, by the scene's name; what is not listed is
            believed whole.
        pool: Where jobs are run; it stays open.
        journal: What is judged already, and where more of it goes.
        timed: Whether steps are timed: then one job is run at a time.
    """

    def __init__(
        self,
        steps: Mapping[Scene, float],
        horizons: Mapping[str, float],
        pool: Pool,
        journal: Journal[JudgedJob] | None = None,
        *,
        timed: bool = False,
    ) -> None:
        self._steps, self._horizons, self._pool, self._journal, self._timed = steps, horizons, pool, journal, timed
        self._known: dict[tuple[JobKey, bool], Judged] = {}

    def judge(self, method: Method, scenes: Sequence[Scene]) -> list[Judged]:
        """Return what came of each scene, in their order."""
        jobs = [Job(scene, method, self._steps[scene]) for scene in scenes]
        keys = [(job_key(job), self._timed) for job in jobs]
        missing = [job for job, key in zip(jobs, keys, strict=True) if not self._knows(key)]
        for found in self._answers(missing):
            if self._journal is not None:
                self._journal.add([found])
            self._known[found.key, found.timed] = _judged(found.answer)
        return [self._known[key] for key in keys]

    def _knows(self, key: tuple[JobKey, bool]) -> bool:
        entry = self._journal.entries.get(key) if self._journal is not None else None
        if entry is not None:
            self._known.setdefault(key, _judged(entry.answer))
        return key in self._known

    def _answers(self, jobs: Sequence[Job]) -> Iterator[JudgedJob]:
        def work(job: Job, asker: Asker) -> Iterator[JudgedJob]:
            task = JudgeTask(job, self._horizons.get(job.scene.name), self._timed)
            yield JudgedJob(job_key(job), job.scene.name, self._timed, asker.ask(task))

        if self._timed:
            for job in jobs:
                yield from work(job, self._pool)
            return
        for several in self._pool.each(((job.engine, job) for job in jobs), work):
            yield from several


def _judged(answer: Answer[Judged]) -> Judged:
    return Judged(None, reason=answer.said) if answer.value is None else answer.value
