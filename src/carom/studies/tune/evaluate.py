"""Evaluation of settings on each scene, in worker processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

from carom.comparator import Score, compare
from carom.engines.registry import load_adapter
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.job import Job, JobTask, Method
from carom.execution.journal import Journal, JournalEntry, MemoryJournal
from carom.execution.observation.engine_run import observe_run, run_pit
from carom.execution.pool import Pool
from carom.execution.scene_reference import require_reference, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.timing import time_run
from carom.model.scene import Scene
from carom.studies.tune.objective import SceneResult

#: Number of PIC's and of PIT's runs that a worker process caches, which exceeds the number of scenes in a search.
_KEPT = 256

_reference, _sampling = lru_cache(maxsize=_KEPT)(solve_reference), lru_cache(maxsize=_KEPT)(run_pit)


def summarise_score(score: Score) -> SceneResult:
    """Return the numbers of a score that a search needs.

    If the run's trajectory has diverged from the reference's trajectory, impacts match only by chance. Therefore the
    error and the wrong impacts come from the comparison of single steps, which start from the run's own states.
    """
    local = score.local_truth
    if score.diverged_s is not None and local is not None:
        return SceneResult(score.grade, local.ratio[1], local.missed, local.invented, float_bits=score.float_bits)
    return SceneResult(
        score.grade, score.price_paid, len(score.missed), len(score.spurious), float_bits=score.float_bits
    )


@dataclass(frozen=True)
class EvaluationTask(JobTask):
    """Task that runs an engine in a worker process, and evaluates the run.

    Attributes:
        horizon_s: Time up to which the reference is reliable; None for the whole reference.
        timed: Whether the job's steps are also timed.
    """

    horizon_s: float | None = None
    timed: bool = False

    def carry_out(self) -> SceneResult:
        """Return the result.

        Raises:
            UnsupportedError: PIC can't solve the scene.
        """
        job, overrides = self.job, self.job.method.overrides
        # A profile may refuse a scene because of its settings. With other settings, the engine may support the scene,
        # so the scene is run.
        adapter = load_adapter(job.engine)
        reference = require_reference(_reference(job.scene))
        observed = observe_run(adapter, job.scene, job.profile, job.dt_s, overrides=overrides)
        score = compare(reference, observed, sampling=_sampling(job.scene, job.dt_s), horizon=self.horizon_s)
        result = summarise_score(score)
        if not self.timed:
            return result
        seconds = time_run(adapter, job.scene, job.profile, job.dt_s, overrides=overrides).advance_s
        return replace(result, seconds=seconds)


#: Part of the key of a job that is also timed; see `carom.execution.cache_key.JobKey`.
_TIMED = "timed"

#: Function that opens the journal of a search. A continued search requests the same jobs again, and finds the results
#: in the journal.
tune_journal = partial(Journal[JobKey, SceneResult], "judgements", JournalEntry[JobKey, SceneResult])


@dataclass(frozen=True)
class Evaluator:
    """Evaluates methods on scenes.

    Attributes:
        steps: The scenes, with a step size for each, in seconds.
        horizons: Times up to which references are reliable, by the scene's name. All other references are reliable to
            their end.
        pool: Pool of worker processes, which is not closed.
        notes: Journal of results, to which new results are added.
        timed: Whether steps are timed, with only one job at a time.
    """

    steps: Mapping[Scene, float]
    horizons: Mapping[str, float]
    pool: Pool
    notes: MemoryJournal[JobKey, SceneResult] | None = None
    timed: bool = False

    def evaluate(self, method: Method, scenes: Sequence[Scene]) -> list[SceneResult]:
        """Return the results of a method on scenes, in the order of the scenes."""
        asks = []
        for scene in scenes:
            job = Job(scene, method, self.steps[scene])
            task = EvaluationTask(job, self.horizons.get(scene.name), self.timed)
            asks.append(TaskRequest(scene, build_job_key(job, _TIMED if self.timed else ""), task))
        found = dict(run_tasks(asks, self.pool, self.notes, one_at_a_time=self.timed))
        return [found[scene].value or SceneResult(None, reason=found[scene].problem) for scene in scenes]
