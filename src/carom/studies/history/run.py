"""Execution of `carom history`: runs releases, compares consecutive releases, and finds the origin of a change."""

from __future__ import annotations

import re
import tempfile
import time
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from pathlib import Path

from carom.engines.registry import require_profile
from carom.errors import AdapterError, CaromError, InputError, UnknownNameError
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.describe_engines import describe_engines
from carom.execution.environment import describe_environment
from carom.execution.job import Answer, Job, Method, Progress, UnavailableError, no_progress
from carom.execution.journal import MemoryJournal
from carom.execution.methods import list_methods
from carom.execution.phases import generate_phases
from carom.execution.pool import Pool
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.score_jobs import estimate_steps, sort_by_start
from carom.model.scene import Scene
from carom.studies.history.compare_cells import (
    CellChange,
    ChangeKind,
    HistoryTask,
    ReleaseCell,
    ReleaseRun,
    classify_change,
)
from carom.studies.history.options import HistoryOptions
from carom.studies.history.registry_clients import CLIENTS, Client, ClientError
from carom.studies.history.release_cache import ReleaseCache
from carom.studies.history.release_engines import (
    Origin,
    OriginTask,
    ServedManifestTask,
    copy_program,
    registered_engines,
    release_engine_name,
)
from carom.studies.history.result import Bisection, History, Release, RunCell
from carom.support.escaping import build_name_hints, is_older, parse_release_numbers
from carom.support.versions import parse_version_condition, require_version

#: Name of the study in its output folders, and file name of its journal.
PURPOSE, JOURNAL = "history", "journal.jsonl"


def list_releases(
    engine: str, options: HistoryOptions, cache: ReleaseCache, pool: Pool
) -> tuple[Origin, tuple[str, ...]]:
    """Return an engine's registry and package, and the releases in the registry, from the oldest to the newest.

    Raises:
        UnknownNameError: The engine does not exist.
        InputError: The engine has no registry.
        UnavailableError: The registry's client is missing, or returns no list.
    """
    describe_engines([engine], pool)  # an unknown name raises an error
    answer = pool.run(OriginTask(engine))
    if answer.value is None:
        raise AdapterError(f"{engine} could not return its registry and package: {answer.problem}")
    if not answer.value.registry:
        raise InputError(
            f"{engine} has no registry: its adapter declares neither a Python distribution nor an npm package"
        )
    return answer.value, sort_versions(_list_versions(answer.value, options, cache))


def _list_versions(origin: Origin, options: HistoryOptions, cache: ReleaseCache) -> Sequence[str]:
    """Return the versions that the registry lists.

    If the registry is unreachable, return the cached versions, but only if they include all requested versions.
    """
    try:
        return CLIENTS[origin.registry].list_versions(origin.package)
    except ClientError as error:
        cached_versions = sort_versions(cache.versions(origin.registry, origin.package))
        requested = {word.strip() for text in options.versions or () for word in text.split(",")} - {""}
        if requested and requested <= set(cached_versions):
            return cached_versions
        hint = f"; --versions can name these cached releases: {', '.join(cached_versions)}" if cached_versions else ""
        raise UnavailableError(f"the releases of {origin.package} can't be listed: {error}{hint}") from None


@dataclass
class _ReleaseRuns:
    """Runs releases of an engine on scenes, and counts finished jobs for the progress report."""

    engine: str
    scenes: Mapping[str, Scene]
    options: HistoryOptions
    notes: MemoryJournal[JobKey, ReleaseRun]
    progress: Progress
    done: int = 0
    total: int = 0

    def job(self, name: str, cell: RunCell, phase: float = 0.0) -> Job:
        """Return the job that runs a scene, with a profile and a step size, on an engine."""
        return Job(self.scenes[cell.scene], Method(name, cell.profile), cell.dt_s, phase=phase)

    def run_jobs(self, jobs: Iterable[Job], pool: Pool) -> dict[Job, Answer[ReleaseRun]]:
        """Run jobs and return their results."""
        todo = sort_by_start(jobs)
        infos = describe_engines(sorted({job.engine for job in todo}), pool)
        methods = list_methods(infos, self.options.profiles, sorted({job.dt_s for job in todo}), pool)
        asks = [
            TaskRequest(job, build_job_key(job), HistoryTask(job), methods.find_job_refusal(job), estimate_steps(job))
            for job in todo
        ]
        self.total += len(asks)
        found = {}
        for job, answer in run_tasks(asks, pool, self.notes):
            found[job] = answer
            self.report(f"{job.scene.name} on {job.engine}")
        return found

    def report(self, description: str) -> None:
        """Report progress."""
        self.done += 1
        self.progress(self.done, max(self.total, self.done), description)

    def run_cells(
        self, names: Sequence[str], cells: Sequence[RunCell], pool: Pool
    ) -> dict[str, dict[RunCell, ReleaseCell]]:
        """Return the results of each engine for each scene, profile and step size.

        If the results of two consecutive engines differ, and the phase may be the cause, both engines are run at all
        phases.
        """
        answers = self.run_jobs((self.job(name, cell) for name in names for cell in cells), pool)
        found = {name: {cell: ReleaseCell(answers[self.job(name, cell)]) for cell in cells} for name in names}
        todo = set[tuple[str, RunCell]]()
        for cell in cells:
            for pair in pairwise(name for name in names if found[name][cell].runs):
                change = classify_change(*(found[name][cell] for name in pair))
                if change.kind is ChangeKind.PHASE_ONLY:  # the phase may explain the change
                    todo.update((name, cell) for name in pair)
        phases = generate_phases(self.options.phases, self.options.seed)
        jobs = {place: [self.job(*place, phase) for phase in phases] for place in sorted(todo)}
        answers |= self.run_jobs(chain.from_iterable(jobs.values()), pool)
        for (name, cell), shifted in jobs.items():
            found[name][cell] = replace(found[name][cell], phases=tuple(answers[job] for job in shifted))
        return found


@contextmanager
def _install_releases(
    study: _ReleaseRuns, origin: Origin, versions: Sequence[str], cache: ReleaseCache, pool: Pool
) -> Iterator[tuple[Release, ...]]:
    """Install releases and register them as engines. Yield the releases, and unregister them at the end."""
    client: Client = CLIENTS[origin.registry]
    with tempfile.TemporaryDirectory(prefix="carom-history-") as place:
        releases: list[Release] = []
        manifests: list[Path] = []
        for version in versions:
            study.report(f"{origin.package} {version}")
            if is_older(version, origin.oldest):
                reason = f"older than {origin.oldest}, the oldest release that its adapter supports"
                releases.append(Release(version, reason=reason))
                continue
            name = release_engine_name(study.engine, version)
            try:
                overlay = cache.install(client, origin.registry, origin.package, version)
            except ClientError as error:
                releases.append(Release(version, reason=f"not installed: {error}"))
                continue
            folder = Path(place) / name
            folder.mkdir()
            if origin.manifest:
                path = copy_program(Path(origin.manifest), name, version, overlay, folder)
            else:
                answer = pool.run(ServedManifestTask(study.engine, name, version, str(overlay)))
                if answer.value is None:
                    raise AdapterError(f"{study.engine} could not return its manifest: {answer.problem}")
                path = folder / "engine.toml"
                path.write_text(answer.value, encoding="utf-8")
            manifests.append(path)
            releases.append(Release(version, name))
        with registered_engines(manifests):
            yield tuple(releases)


def run_history(
    engine: str,
    scenes: Sequence[Scene],
    cache: ReleaseCache,
    options: HistoryOptions,
    *,
    notes: MemoryJournal[JobKey, ReleaseRun] | None = None,
    progress: Progress = no_progress,
    command: str = "",
) -> History:
    """Run releases of an engine on scenes with the installed adapter, and return the changes between them.

    Args:
        engine: Name of an adapter.
        scenes: Scenes to run.
        cache: Cache of releases. Releases that are not in the cache are installed into the cache.
        options: Options of the history.
        notes: Journal of results, to which new results are added.
        progress: Function that is called with the number of finished jobs, the number of all jobs, and a description.
        command: The command that repeats the study, which is stored in the result.

    Raises:
        UnknownNameError: The engine, a profile or a release does not exist.
        InputError: The engine has no registry, or no release meets the conditions.
        UnavailableError: The registry's client is missing, or returns no list.
    """
    started = time.perf_counter()
    scenes_by_name = {scene.name: scene for scene in scenes}
    study = _ReleaseRuns(engine, scenes_by_name, options, notes or MemoryJournal(), progress)
    cells = [
        RunCell(scene.name, profile, dt_s)
        for scene in scenes_by_name.values()
        for dt_s in sorted(set(options.dts or (1.0 / scene.frame_rate_hz,)), reverse=True)
        for profile in options.profiles
    ]
    with options.open_pool() as pool:
        origin, versions = _select_releases(engine, options, cache, pool)
        with _install_releases(study, origin, versions, cache, pool) as registry_releases:
            own = Release(f"{origin.installed} (installed)", engine)
            installed = own if origin.installed else Release("installed", reason="it is not installed")
            columns = (*registry_releases, installed) if options.installed else registry_releases
            names = [one.name for one in columns if one.name]
            cells_of_release = study.run_cells(names, cells, pool)
    releases = tuple(replace(one, cells=cells_of_release.get(one.name, {})) for one in columns)
    return History(engine, origin, options, releases, describe_environment(), command, time.perf_counter() - started)


def _select_releases(
    engine: str, options: HistoryOptions, cache: ReleaseCache, pool: Pool
) -> tuple[Origin, tuple[str, ...]]:
    """Return an engine's registry and package, and the releases to run.

    Raises:
        UnknownNameError, InputError, UnavailableError: See `run_history`.
    """
    (info,) = describe_engines([engine], pool)
    for profile in options.profiles if info.profiles else ():
        require_profile(engine, profile, info.profiles)
    origin, listed = list_releases(engine, options, cache, pool)
    versions = select_versions(listed, options.versions, options.most)
    if not versions:
        raise InputError(f"no release of {origin.package} meets {', '.join(options.versions or ())}")
    return origin, versions


def bisect_change(
    engine: str,
    scene: Scene,
    profile: str,
    dt_s: float,
    cache: ReleaseCache,
    options: HistoryOptions,
    *,
    progress: Progress = no_progress,
) -> Bisection | None:
    """Find two consecutive releases between which the result of a run changed; None if the oldest and the newest agree.

    The search bisects the list of releases, and compares each tested release with the oldest release. If there are
    several changes, only one of them is found.

    Raises:
        CaromError: A release can't run this scene with this profile and step size. See also `run_history`.
    """
    options, cell = replace(options, profiles=(profile,), dts=(dt_s,)), RunCell(scene.name, profile, dt_s)
    study = _ReleaseRuns(engine, {scene.name: scene}, options, MemoryJournal(), progress)
    changes: dict[str, CellChange] = {}  # changes by tested release, in the order of the tests
    with options.open_pool() as pool:
        origin, versions = _select_releases(engine, options, cache, pool)
        candidates = [one for one in versions if not is_older(one, origin.oldest)]

        def is_changed(version: str) -> bool:
            """Whether a release differs from the oldest release."""
            with _install_releases(study, origin, (candidates[0], version), cache, pool) as columns:
                if reason := next((one.reason for one in columns if not one.name), ""):
                    raise UnavailableError(f"{origin.package} {version}: {reason}")
                cells_of_release = study.run_cells([one.name for one in columns], [cell], pool)
                old, new = (cells_of_release[one.name][cell] for one in columns)
            change = changes[version] = classify_change(old, new)
            if change.kind is ChangeKind.NOT_RUN:
                what = f"{origin.package} {version} can't run this scene with this profile and step size"
                raise CaromError(f"{what}: {change.numbers}")
            return change.kind.is_engine_change

        if len(candidates) < 2 or not is_changed(candidates[-1]):
            return None
        first = bisect_left(candidates, True, 1, len(candidates) - 1, key=is_changed)
    last, changed = candidates[first - 1], candidates[first]
    return Bisection(cell, last, changed, changes[changed], (candidates[0], *changes))


#: Matches versions of final releases, which have no mark such as alpha or nightly. The mark `post` is allowed, because
#: it means a repaired package of a final release.
_FINAL_VERSION = re.compile(r"([0-9]+!)?[0-9]+(\.[0-9]+)*(\.post[0-9]+)?")

#: Word with which a user requests the newest release.
LATEST = "latest"


def sort_versions(versions: Iterable[str]) -> tuple[str, ...]:
    """Sort versions by number, from the oldest to the newest.

    A pre-release precedes the final release with the same number.
    """

    def order(version: str) -> tuple[object, ...]:
        post = re.search(r"\.post([0-9]+)$", version)
        final = _FINAL_VERSION.fullmatch(version) is not None
        return parse_release_numbers(version), final, int(post[1]) if post else -1, version

    return tuple(sorted(set(versions), key=order))


def select_versions(listed: Sequence[str], terms: Sequence[str] | None, max_releases: int) -> tuple[str, ...]:
    """Return the requested releases, from the oldest to the newest.

    Args:
        listed: All listed releases.
        terms: Versions, "latest" and conditions (default: all final releases). All named releases are selected, and all
            final releases that meet every condition. A pre-release is only selected if it is named.
        max_releases: Largest number of releases that conditions select; the newest are preferred. Named releases are
            not counted.

    Raises:
        UnknownNameError: A named version is not listed.
        InputError: A term is neither a version nor a condition.
    """
    words = [word.strip() for text in terms or () for word in text.split(",") if word.strip()]
    finals = sort_versions(filter(_FINAL_VERSION.fullmatch, listed))
    if LATEST in words:
        words = [*(word for word in words if word != LATEST), *finals[-1:]]
    named_versions = [word for word in words if parse_version_condition(word) is None]
    for word in named_versions:
        if require_version(word) not in listed:
            ordered = sort_versions(listed)
            some = ordered if len(ordered) <= 20 else (*ordered[:3], "...", *ordered[-12:])
            hints = build_name_hints(word, listed, f"there are: {', '.join(some)}")
            raise UnknownNameError(f"there is no release {word!r}", hints=hints)
    conditions = [found for word in words if (found := parse_version_condition(word)) is not None]
    matching = [one for one in finals if all(condition(parse_release_numbers(one)) for condition in conditions)]
    return sort_versions([*named_versions, *(matching[-max_releases:] if conditions or not named_versions else ())])
