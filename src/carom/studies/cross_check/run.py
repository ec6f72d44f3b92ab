"""Execution of a cross-check: references, runs, scores, repetition at other phases, and run times."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice
from types import MappingProxyType
from typing import Any

from carom.catalogue import CatalogueScene, deviation
from carom.comparator import Score, Scorer, compare
from carom.comparator.shifted_scenes import solve_shifted_references
from carom.engines.registry import require_named, resolve_engine
from carom.errors import AdapterError
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.codec import CarriedTrace
from carom.execution.describe_engines import describe_engines
from carom.execution.environment import describe_environment
from carom.execution.exception_text import describe_exception
from carom.execution.job import PIT_METHOD, Answer, Job, Method, Progress, Status, no_progress
from carom.execution.journal import Journal, JournalEntry, MemoryJournal
from carom.execution.methods import select_profiles
from carom.execution.observation.engine_run import ObserveTask, check_own_scene, observe_job
from carom.execution.phases import compute_spread, generate_phases
from carom.execution.pool import Pool
from carom.execution.results import Results, Row
from carom.execution.scene_reference import Reference, build_reference, needs_certification, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.score_jobs import estimate_steps
from carom.execution.shared_options import LimitOptions
from carom.execution.time_saved import measure_skips
from carom.execution.timing import TimeTask, Timing
from carom.model.scene import Scene, to_scene
from carom.model.trace import Setting, Trace
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import Plan, build_plan, resolve_settings
from carom.support.limits import DEFAULT_TIME_LIMIT_S, MOST_DISCS_DRAWN
from carom.support.options import build_step_kind, check_value

#: Part of the key of a job that stores states for pictures; see `carom.execution.cache_key.JobKey`.
DRAWN = "drawn"

#: Function that opens the journal of a cross-check. Callers must pass `Options.stamp` as the journal's stamp. The
#: journal contains no run times, because only times of one session can be compared.
observed_journal = partial(Journal[JobKey, Trace], "traces", JournalEntry[JobKey, CarriedTrace])


#: Key of a job in a cross-check. Scene names are unique.
Key = tuple[str, Method, float]


def run(
    scene: Scene | str,
    engine: str,
    *,
    dt: float | None = None,
    profile: str = "tuned",
    settings: Mapping[str, Setting] = MappingProxyType({}),
    time_limit_s: float = DEFAULT_TIME_LIMIT_S,
    scheduler: str | None = None,
) -> Trace:
    """Run a scene on an engine in a separate process, and return the trace.

    Args:
        scene: The scene, or its name in the catalogue.
        engine: Name of an adapter, as listed by `carom.engines()`, or the ``engine.toml`` of a program.
        dt: Step size, in seconds (default: the scene's frame).
        profile: Name of one of the engine's profiles.
        settings: Settings by name, which replace settings of the profile.
        time_limit_s: Seconds after which the engine is terminated.
        scheduler: Address of a Dask scheduler whose cluster runs the engine (default: this machine).

    Raises:
        UnknownNameError: The scene, engine, profile or setting does not exist.
        InputError: `dt` or `time_limit_s` is not a positive number, or a setting has an invalid value.
        AdapterError: The engine is unavailable, does not support the scene, crashed, or timed out.

    Examples:
        >>> trace = carom.run("paper/missed", "pit", dt=1 / 24)
        >>> len(trace.impacts)  # the impact is missed
        0
    """
    scene = to_scene(scene)
    dt = 1.0 / scene.frame_rate_hz if dt is None else dt
    limits = LimitOptions(jobs=1, time_limit_s=time_limit_s, scheduler=scheduler)
    check_value(build_step_kind(), "dt", dt)
    require_named(engine := resolve_engine(engine))
    with limits.open_pool() as pool:
        infos = describe_engines([engine], pool) if settings else []
        overrides = resolve_settings(infos[0], settings, [profile], dt, pool) if infos else ()
        job = Job(scene, Method(engine, profile, overrides), dt)
        answer = observe_job(job, pool, samples=True)
        if answer.status is Status.FAILED:
            select_profiles(describe_engines([engine], pool), [profile])
    if answer.value is None:
        raise AdapterError(f"{job}: {answer.problem}")
    return answer.value


def cross_check(
    scenes: Iterable[Scene | CatalogueScene | str],
    engine_names: Sequence[str] | None = None,
    *,
    progress: Progress | None = None,
    command: str = "",
    pool: Pool | None = None,
    **options: Any,
) -> Results:
    """Run every scene on every engine with every profile and step size, and score each run against PIC.

    Args:
        scenes: Scene objects, or scenes of the catalogue by name, group or pattern. Names must differ.
        engine_names: Names of adapters, or manifests (default: all installed ones).
        progress: Function that is called with the number of finished jobs, the number of all jobs, and a description.
        command: The command that the report shows.
        pool: Pool of worker processes, which stays open (default: a new pool, which is closed).
        options: ``dts``, ``profiles``, ``settings``, ``phases``, ``scheduler`` and the other fields of
            `carom.studies.cross_check.options.Options`.

    Raises:
        InputError: There are no scenes, two scenes have the same name, or a number is out of range.
        UnknownNameError: An engine does not exist, no requested engine has a requested profile, or an engine lacks a
            setting.

    Examples:
        >>> results = carom.cross_check(["paper/missed"], ["pit"], dts=[1 / 24], timing=False)
        >>> [(row.job.scene.name, row.score.missed) for row in results.rows]
        [('paper/missed', (0,))]
    """
    parsed = Options.build_from_arguments("cross_check", options, engines=engine_names)
    parsed = replace(parsed, engines=parsed.engines and [resolve_engine(word) for word in parsed.engines])
    with parsed.open_pool() if pool is None else nullcontext(pool) as opened:
        plan = build_plan(scenes, parsed, opened)
        return execute(plan, opened, progress=progress or no_progress, command=command)


def execute(
    plan: Plan,
    pool: Pool,
    *,
    notes: MemoryJournal[JobKey, Trace] | None = None,
    progress: Progress = no_progress,
    command: str = "",
) -> Results:
    """Execute the plan of a cross-check.

    Args:
        plan: The jobs to run.
        pool: Pool of worker processes, which is not closed.
        notes: Journal of finished runs, to which new runs are added.
        progress: Function that is called with the number of finished jobs, the number of all jobs, and a description.
        command: The command that the report shows.
    """
    started, options = time.perf_counter(), plan.options
    references = _solve_references(plan, progress)
    usable = {name: found for name, found in references.items() if isinstance(found, Reference)}
    jobs = [job for job in plan.jobs if job.scene.name in usable]
    shifted = _shift_references(jobs, usable, generate_phases(options.phases, options.seed))
    timed = [job for job in jobs if options.timing and job.refinement == 0]
    observed = {_build_key(job) for one in jobs for job in (one, _build_pit_job(one))}
    total = len(observed) + sum(map(len, shifted.values())) + len(timed)
    observer = _Observer(plan, pool, notes, progress, total)
    rows = _score_jobs(jobs, usable, observer)
    rows |= _run_phases(rows, shifted, usable, observer)
    rows |= _time_jobs([rows[_build_key(job)] for job in timed], observer)
    for job in plan.jobs:
        if isinstance(reason := references[job.scene.name], str):
            rows[_build_key(job)] = Row(job, Status.UNSUPPORTED, reason)
    skipped = {}
    if options.samples:  # only a report shows the skipped work
        steps = {job.scene.name: job.dt_s for job in timed}  # several timed jobs can have the same scene
        skipped = {name: measure_skips(usable[name].trace, dt_s) for name, dt_s in steps.items()}
    return Results(
        rows=tuple(rows[_build_key(job)] for job in plan.jobs),
        references={name: reference.trace for name, reference in usable.items()},
        known={
            name: (answer, deviation(usable[name].pic or usable[name].trace, answer, usable[name].trace.scene))
            for name, answer in plan.answers.items()
            if name in usable
        },
        engines=plan.engines,
        environment=describe_environment(plan.engines),
        command=command,
        elapsed_s=time.perf_counter() - started,
        certified={name: one.certified for name, one in usable.items() if one.certified is not None},
        horizons={name: one.horizon_s for name, one in usable.items() if one.horizon_s is not None},
        phases=options.phases,
        skipped=skipped,
    )


@dataclass
class _Observer:
    """Runs the jobs of a cross-check through the scheduler, and reports progress."""

    plan: Plan
    pool: Pool
    notes: MemoryJournal[JobKey, Trace] | None
    progress: Progress
    total: int
    done: int = 0

    def count(self, description: str, done: int = 1) -> None:
        self.done += done
        self.progress(self.done, self.total, description)

    def observe_traces(self, jobs: Iterable[Job], *, shifted: bool = False) -> Iterator[tuple[Job, Answer[Trace]]]:
        """Yield the result of each job as it arrives.

        States are stored for pictures, but only at the scene's largest step size, and only if a picture can show all
        discs of the scene.
        """
        asks, samples = [], self.plan.options.samples and not shifted
        for job in jobs:
            drawn = samples and job.refinement == 0 and len(job.scene.discs) <= MOST_DISCS_DRAWN
            key, refusal = build_job_key(job, DRAWN if drawn else ""), self.plan.methods.find_job_refusal(job)
            asks.append(TaskRequest(job, key, ObserveTask(job, drawn), refusal, estimate_steps(job)))
        for job, answer in run_tasks(asks, self.pool, self.notes):
            self.count(f"{job.scene.name} on {job.engine}")
            yield job, check_own_scene(job, answer)


def _build_key(job: Job) -> Key:
    return (job.scene.name, job.method, job.dt_s)


def _solve_references(plan: Plan, progress: Progress) -> dict[str, Reference | str]:
    """Return the reference of each scene, or the reason why the scene has no reference."""
    options = plan.options
    references: dict[str, Reference | str] = {}
    for scene in plan.scenes:
        trace = solve_reference(scene)
        if isinstance(trace, str):
            references[scene.name] = trace
            continue
        if needs_certification(scene, options.certified):
            progress(0, len(plan.jobs), f"certifying {scene.name}")
        references[scene.name] = build_reference(trace, options.certified, options.certify_s)
    return references


def _build_pit_job(job: Job) -> Job:
    """Return the job that runs PIT on the same scene with the same step size."""
    return replace(job, method=PIT_METHOD)


def _score_jobs(jobs: Sequence[Job], usable: Mapping[str, Reference], observer: _Observer) -> dict[Key, Row]:
    """Run and score all jobs. A run is compared with the reference, and with PIT's run of the same scene and step size.

    PIT always runs first on each scene with each step size, even if it was not requested.
    """
    sampling = {_build_key(one): one for one in map(_build_pit_job, jobs)}
    pit = {_build_key(job): answer for job, answer in observer.observe_traces(sampling.values())}

    @cache
    def build_scorer(scene: str, dt_s: float) -> Scorer:
        return Scorer(usable[scene].trace, pit[scene, PIT_METHOD, dt_s].value, usable[scene].horizon_s)

    def score_answer(job: Job, answer: Answer[Trace]) -> Row:
        row = Row(job, answer.status, answer.reason, answer.value)
        if answer.value is None:
            return row
        try:
            return replace(row, score=build_scorer(job.scene.name, job.dt_s).score(answer.value))
        except Exception as error:  # noqa: BLE001 - one bad run must not affect other rows
            return _build_failed_row(job, error)

    rows: dict[Key, Row] = {}
    left = iter(pit)
    rows_by_engine: dict[tuple[str, str, float], list[Row]] = {}
    for job, answer in observer.observe_traces(job for job in jobs if job.method != PIT_METHOD):
        similar = rows_by_engine.setdefault((job.scene.name, job.engine, job.dt_s), [])
        equal_row = next((row for row in similar if _is_same_run(row.trace, answer.value)), None)
        if equal_row is None:
            row = score_answer(job, answer)
            similar.append(row)
        else:
            row = replace(equal_row, job=job, trace=answer.value)
        rows[_build_key(job)] = row
        if answer.status is Status.RAN:  # score PIT while engines run
            rows |= {key: score_answer(sampling[key], pit[key]) for key in islice(left, 1)}
    return rows | {key: score_answer(sampling[key], pit[key]) for key in left}


def _is_same_run(one: Trace | None, other: Trace | None) -> bool:
    """Whether two runs are equal except for their profile, settings and work counts, so that their scores are equal."""
    if one is None or other is None:
        return False
    settings = {name: getattr(other, name) for name in ("profile", "overrides", "settings", "counts")}
    return replace(one, **settings) == other


def _build_failed_row(job: Job, error: Exception) -> Row:
    """Return the row of a job whose run could not be scored."""
    return Row(job, Status.FAILED, f"the engine's result can't be scored: {describe_exception(error)}")


def _shift_references(
    jobs: Sequence[Job], usable: Mapping[str, Reference], phases: Sequence[float]
) -> dict[Key, list[Trace]]:
    """For each job, return the references of its scene at all phases, except phases that change the scene's impacts."""
    if not phases:
        return {}
    steps = {(job.scene.name, job.dt_s) for job in jobs}
    references = {step: list(solve_shifted_references(usable[step[0]].trace, step[1], phases)) for step in steps}
    return {_build_key(job): references[job.scene.name, job.dt_s] for job in jobs}


def _run_phases(
    rows: Mapping[Key, Row], shifted: Mapping[Key, list[Trace]], usable: Mapping[str, Reference], observer: _Observer
) -> dict[Key, Row]:
    """Run every successful job again at each phase.

    Return the rows of these jobs, to which the spread of errors is added.
    """
    scores: dict[Key, list[Score]] = {key: [] for key in shifted if rows[key].status is Status.RAN}
    origins = [(key, reference) for key in scores for reference in shifted[key]]
    if omitted := sum(map(len, shifted.values())) - len(origins):
        observer.count("phases", omitted)
    jobs = [replace(rows[key].job, scene=reference.scene) for key, reference in origins]
    origin_of = {id(job): origin for job, origin in zip(jobs, origins, strict=True)}
    failed: dict[Key, Row] = {}
    for job, answer in observer.observe_traces(jobs, shifted=True):
        key, reference = origin_of[id(job)]
        if answer.value is not None:
            try:
                scores[key].append(compare(reference, answer.value, horizon=usable[key[0]].horizon_s))
            except Exception as error:  # noqa: BLE001 - one bad run must not affect other rows, as above
                failed[key] = _build_failed_row(rows[key].job, error)
    return {
        key: failed.get(key) or replace(rows[key], spread=compute_spread(found, rows[key].job.scene, key[2]))
        for key, found in scores.items()
    }


def _time_jobs(rows: Sequence[Row], observer: _Observer) -> dict[Key, Row]:
    """Time the jobs that ran, one after another with nothing else running.

    If PIT was timed, each run time is also divided by PIT's run time for the same scene and step size.
    """
    completed_rows = {_build_key(row.job): row for row in rows if row.status is Status.RAN}
    if len(completed_rows) < len(rows):
        observer.count("timing", len(rows) - len(completed_rows))
    asks = [TaskRequest(row.job, build_job_key(row.job), TimeTask(row.job)) for row in completed_rows.values()]
    answers: dict[Key, Answer[Timing]] = {}
    with observer.pool.to_local_pool() as pool:
        for job, answer in run_tasks(asks, pool, one_at_a_time=True):
            observer.count(f"{job.scene.name} on {job.engine}")
            answers[_build_key(job)] = answer
    found: dict[Key, Row] = {}
    for key, answer in answers.items():
        timing, pit = answer.value, answers.get(_build_key(_build_pit_job(completed_rows[key].job)))
        ratio = timing.advance_s / pit.value.advance_s if timing and pit and pit.value else None
        found[key] = replace(completed_rows[key], timing=timing, untimed=answer.problem, time_ratio=ratio)
    return found
