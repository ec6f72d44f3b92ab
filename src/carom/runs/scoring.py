"""Sweeps: many jobs, of each of which the numbers of its score are kept and not its trace.

A score is found in the worker that ran the job, and written to a journal as soon as it is there.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

from carom.comparator import Errors, compare
from carom.comparator.shift import begun_earlier
from carom.errors import InputError
from carom.registry import adapter_points
from carom.runs.engines import engine_of
from carom.runs.job import Answer, Job, JobTask, Method, Progress, UnsupportedError
from carom.runs.journal import Journal
from carom.runs.observe import able_adapter, observe_run
from carom.runs.pool import Asker, Pool
from carom.runs.reference import reference_trace
from carom.scene import Scene
from carom.trace import Trace

__all__ = [
    "JobKey",
    "Measures",
    "ScoreJob",
    "Scored",
    "batches",
    "job_key",
    "scene_hash",
    "score_journal",
    "sweep",
    "versions_of",
]

#: A message holds as many jobs as take so many steps together, a second or so: then what a message costs is nothing,
#: and what is lost with one is little. So many jobs at most, that workers have equal shares to the end.
BATCH_STEPS = 50_000
BATCH_JOBS = 64

#: References kept by a worker: the jobs of a batch are in order of scene and phase, so that few are enough.
REFERENCES_KEPT = 8


@dataclass(frozen=True)
class JobKey:
    """What tells a job from all others, in any sweep on any machine.

    Attributes:
        scene_sha256: Hash of all that the scene is made of, its name included.
        method: Engine and profile.
        dt_s: Step, seconds.
        phase: Part of a step by which the scene begins earlier.
        versions: Name and version of all that the numbers depend on, in order of name.
    """

    scene_sha256: str
    method: Method
    dt_s: float
    phase: float
    versions: tuple[tuple[str, str], ...]


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
        outcome: How the run ended, the name of a `carom.trace.Outcome`.
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
class Scored:
    """What came of a job of a sweep.

    Attributes:
        key: Which job it is.
        scene: Name of the scene, for readers.
        answer: The numbers of its score, or why there are none.
    """

    key: JobKey
    scene: str
    answer: Answer[Measures]


@dataclass(frozen=True)
class ScoreJob(JobTask):
    """Run a job and score it, in a worker process."""

    def carry_out(self) -> Measures:
        """Return the numbers of the job's score.

        Raises:
            UnsupportedError: There is no reference, or no such start.
        """
        job = self.job
        adapter = able_adapter(job)
        try:
            scene = begun_earlier(job.scene, job.phase * job.dt_s)
        except InputError as error:
            raise UnsupportedError(str(error)) from None
        reference = _reference(scene)
        if not isinstance(reference, Trace):
            raise UnsupportedError(reference)
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


_reference = lru_cache(maxsize=REFERENCES_KEPT)(reference_trace)


@lru_cache(maxsize=64)
def scene_hash(scene: Scene) -> str:
    """Return the SHA-256 of a scene: of every field but the description, each float to the bit."""
    # Pydantic writes each float as the shortest text that reads back as the same one.
    return hashlib.sha256(scene.model_dump_json(exclude={"description"}).encode()).hexdigest()


@cache
def versions_of(engine: str) -> tuple[tuple[str, str], ...]:
    """Return name and version of all that an engine's numbers depend on; an engine that is missing has an empty one."""
    found = [
        ("carom", metadata.version("carom")),
        ("numpy", metadata.version("numpy")),
        (platform.python_implementation(), platform.python_version()),
    ]
    if engine not in adapter_points():
        return ()
    info = engine_of(engine)
    return tuple(sorted(found if info.engine == "Carom" else [*found, (info.engine, info.version)]))


def job_key(job: Job) -> JobKey:
    """Return the key of a job on this machine."""
    return JobKey(scene_hash(job.scene), job.method, job.dt_s, job.phase, versions_of(job.engine))


def score_journal(path: Path, *, resume: bool = False, retry: bool = False) -> Journal[Scored]:
    """Open the journal of a sweep; with `retry` what an engine broke off counts as not run."""
    again = (lambda result: result.answer.status.broken) if retry else None
    return Journal(path, Scored, lambda result: result.key, resume=resume, again=again)


def sweep(
    jobs: Sequence[Job],
    pool: Pool,
    journal: Journal[Scored] | None = None,
    progress: Progress | None = None,
    *,
    refusal: Callable[[Job], Answer[Any] | None] = lambda _: None,
) -> Mapping[JobKey, Scored]:
    """Run the jobs that the journal does not hold, write each to it, and return what came of all.

    Args:
        jobs: What is to be run; a job that is there twice is run once.
        pool: Where; it stays open.
        journal: What is finished already, and where results go; None to keep them in memory alone.
        progress: Called with (done, all, what) as jobs finish, first with what was finished before.
        refusal: Why a job can't be run, as far as that is known; such a job is not sent.
    """
    wanted = {job_key(job): job for job in jobs}
    found = {key: result for key, result in journal.entries.items() if key in wanted} if journal else {}
    if progress is not None:
        progress(len(found), len(wanted), "")
    refused = {key: (job, why) for key, job in wanted.items() if key not in found and (why := refusal(job)) is not None}
    told = [Scored(key, job.scene.name, why) for key, (job, why) in refused.items()]
    if told and journal is not None:
        journal.add(told)
    found.update((result.key, result) for result in told)
    missing = batches([job for key, job in wanted.items() if key not in found])
    for results in pool.each(((batch[0].engine, batch) for batch in missing), _score_batch):
        if journal is not None:
            journal.add(results)
        found.update((result.key, result) for result in results)
        if progress is not None:
            progress(len(found), len(wanted), f"{results[-1].scene} on {results[-1].key.method.engine}")
    return found


def batches(jobs: Sequence[Job]) -> list[list[Job]]:
    """Return the jobs in messages, each of one engine."""
    # A worker keeps the references of the last few starts, so those of one start stand together.
    ordered = sorted(jobs, key=lambda job: (job.engine, job.scene.name, job.phase * job.dt_s, job.dt_s))
    found: list[list[Job]] = []
    steps, engine = 0.0, ""
    for job in ordered:
        cost = job.scene.duration_s / job.dt_s
        if not found or job.engine != engine or steps + cost > BATCH_STEPS or len(found[-1]) >= BATCH_JOBS:
            found.append([])
            steps, engine = 0.0, job.engine
        found[-1].append(job)
        steps += cost
    return found


def _score_batch(batch: Sequence[Job], asker: Asker) -> Iterator[Scored]:
    """Run the jobs of one message."""
    for job, answer in zip(batch, asker.ask_each([ScoreJob(job) for job in batch]), strict=True):
        yield Scored(job_key(job), job.scene.name, answer)
