"""Execution of a search for settings, and its result: the best settings and a comparison with all profiles."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from carom.engines.api import unsupported_reason
from carom.engines.registry import EngineInfo, require_profile
from carom.errors import AdapterError, InputError
from carom.execution.cache_key import JobKey
from carom.execution.describe_engines import describe_engines
from carom.execution.environment import Environment, describe_environment
from carom.execution.job import Job, Method, Progress, SettingOverrides, UnavailableError, no_progress
from carom.execution.journal import MemoryJournal
from carom.execution.methods import SettingsTask
from carom.execution.pool import Pool
from carom.execution.scene_reference import build_reference, solve_reference
from carom.execution.settings_code import find_changed_code
from carom.execution.timing import TimeTask
from carom.model.scene import Scene
from carom.model.trace import Setting, Trace
from carom.studies.tune.evaluate import Evaluator
from carom.studies.tune.objective import SceneResult, compute_merit
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.search import KnobSearch, TriedSettings
from carom.studies.tune.search_space import Space, list_values

#: Name of the study in its output folders, and file name of its journal.
PURPOSE, JOURNAL = "tune", "journal.jsonl"
#: Group of the default scenes: short scenes of all kinds with known answers.
SCENES = "classics"


@dataclass(frozen=True)
class Tuning:
    """Result of `carom tune`.

    Attributes:
        engine: Name of the adapter.
        options: Options of the search.
        scenes: Scenes of the search.
        left_out: Reasons why scenes were not used, by the scene's name.
        space: The settings and values that the search may test.
        first: Results of the first profile.
        best: Results of the best settings, or `first` if nothing was better.
        others: Results of the engine's other profiles on the same scenes, by name.
        located: Names of the profiles whose steps Carom shortens so that a step ends at each impact, which no setting
            of the engine can do.
        code: Those parts of the engine's code for the first scene that the best settings change; empty if nothing was
            better, or if the adapter writes no code.
        profile_settings: The first profile's settings at the first scene's step size, by name.
        settings: The best settings at the first scene's step size, by name.
        varying: Names of the settings whose values depend on the step size.
        time_ratio: Run time divided by the first profile's run time, as the median over scenes; NaN if no scene was
            timed.
        trials: Number of combinations of settings that were tried.
        abandoned: Number of tried combinations that were abandoned before the last scene.
        environment: Description of the machine, and versions of packages.
        command: The command that repeats the search; empty if it was called from Python.
        elapsed_s: Duration of the whole study, in seconds.
    """

    engine: str
    options: TuneOptions
    scenes: tuple[Scene, ...]
    left_out: Mapping[str, str]
    space: Space
    first: TriedSettings
    best: TriedSettings
    others: Mapping[str, TriedSettings]
    located: frozenset[str]
    code: str
    profile_settings: Mapping[str, Setting]
    settings: Mapping[str, Setting]
    varying: frozenset[str]
    time_ratio: float
    trials: int
    abandoned: int
    environment: Environment
    command: str
    elapsed_s: float


def tune(
    engine: str,
    scenes: Sequence[Scene],
    options: TuneOptions,
    *,
    notes: MemoryJournal[JobKey, SceneResult] | None = None,
    progress: Progress = no_progress,
    on_improvement: Callable[[TriedSettings], None] | None = None,
    command: str = "",
) -> Tuning:
    """Search an engine's searchable settings (knobs) for the values with the best results on some scenes.

    Args:
        engine: Name of an adapter.
        scenes: Scenes of the search.
        options: Options of the search.
        notes: Journal of results, to which new results are added.
        progress: Function that is called after each trial with the number of trials, the expected number of trials, and
            a description.
        on_improvement: Function that is called with the best settings so far, whenever they improve.
        command: The command that repeats the search, which is stored in the result.

    Raises:
        UnknownNameError: The engine or profile does not exist.
        InputError: The adapter declares no searchable settings, or can run none of the scenes.
        UnavailableError: The engine is not installed.
        MissingExtraError: Optuna is not installed.
    """
    started = time.perf_counter()
    with options.open_local_pool(1) if options.timing else options.open_pool() as pool:
        (info,) = describe_engines([engine], pool)
        if info.unavailable:
            raise UnavailableError(f"{engine}: {info.unavailable}")
        require_profile(engine, options.profile, info.profiles)
        all_steps = {scene: options.dt_s or 1.0 / scene.frame_rate_hz for scene in scenes}
        horizons, left_out = _find_horizons(all_steps, info, options.profile)
        steps = {scene: dt_s for scene, dt_s in all_steps.items() if scene.name not in left_out}
        usable = tuple(steps)
        if not usable:
            why = next(iter(left_out.values()), "there are no scenes")
            raise InputError(f"{engine} cannot run any of these scenes: {why}")
        evaluator = Evaluator(steps, horizons, pool, notes, timed=options.timing)
        space = Space({name: list_values(knob) for name, knob in info.knobs.items()})
        search = KnobSearch(Method(engine, options.profile), space, usable, evaluator, progress, on_improvement)
        best = search.run(options.trials, options.seed)
        profile, dt_s = options.profile, steps[usable[0]]
        profile_settings, _ = _read_settings(pool, engine, profile, (), dt_s)
        settings, varying = _read_settings(pool, engine, profile, best.overrides, dt_s)
        other_profiles = {
            name: _evaluate_profile(info, name, steps, evaluator) for name in info.profiles if name != profile
        }
        code = find_changed_code(engine, profile, best.overrides, usable[0], dt_s, pool) if best.overrides else ""
        with pool.to_local_pool() as local_pool:
            ratio = _measure_time_ratio(local_pool, search.method, best.overrides, steps)
    return Tuning(
        engine=engine,
        options=options,
        scenes=usable,
        left_out=left_out,
        space=space,
        first=search.first,
        best=best,
        others=other_profiles,
        located=info.located,
        code=code,
        profile_settings=profile_settings,
        settings=settings,
        varying=varying,
        time_ratio=ratio,
        trials=search.trials,
        abandoned=search.count_abandoned(),
        environment=describe_environment([info]),
        command=command,
        elapsed_s=time.perf_counter() - started,
    )


def _evaluate_profile(
    info: EngineInfo, profile: str, steps: Mapping[Scene, float], evaluator: Evaluator
) -> TriedSettings:
    """Run all scenes with another profile, and return the results.

    Scenes that the profile does not support are not run.
    """
    capabilities, located = info.own.get(profile, info.capabilities), profile in info.located
    refused = {
        scene: "" if capabilities is None else unsupported_reason(scene, capabilities, dt_s, located=located)
        for scene, dt_s in steps.items()
    }
    supported = [scene for scene, reason in refused.items() if not reason]
    found = dict(zip(supported, evaluator.evaluate(Method(info.name, profile), supported), strict=True))
    results = tuple(found.get(scene) or SceneResult(None, reason=reason) for scene, reason in refused.items())
    return TriedSettings((), compute_merit(results), results, 0)


def _find_horizons(
    steps: Mapping[Scene, float], info: EngineInfo, profile: str
) -> tuple[dict[str, float], dict[str, str]]:
    """Return the time up to which each scene's PIC trace is reliable, and the reasons why scenes can't be used."""
    horizons: dict[str, float] = {}
    left_out: dict[str, str] = {}
    capabilities, located = info.capabilities, profile in info.located
    for scene, dt_s in steps.items():
        trace = solve_reference(scene)
        reason = "" if capabilities is None else unsupported_reason(scene, capabilities, dt_s, located=located)
        if reason or not isinstance(trace, Trace):
            left_out[scene.name] = reason or str(trace)
        elif (until_s := build_reference(trace, None).horizon_s) is not None:
            horizons[scene.name] = until_s
    return horizons, left_out


def _read_settings(
    pool: Pool, engine: str, profile: str, overrides: SettingOverrides, dt_s: float
) -> tuple[dict[str, Setting], frozenset[str]]:
    """Return the settings for a step size, and the names of settings that depend on the step size."""
    answer = pool.run(SettingsTask(engine, profile, (dt_s, dt_s / 2), overrides))
    settings, finer = answer.value or (answer.problem, "")
    if isinstance(settings, str) or isinstance(finer, str):
        raise AdapterError(f"{engine} failed to return the settings of {profile!r}: {settings or finer}")
    varying = frozenset(name for name, value in settings.items() if finer.get(name) != value)
    return {name: value for name, value in settings.items() if name != "dt_s"}, varying - {"dt_s"}


def _measure_time_ratio(pool: Pool, first: Method, overrides: SettingOverrides, steps: Mapping[Scene, float]) -> float:
    """Return the run time with the best settings divided by the first profile's; NaN if no scene was timed."""
    ratios = []
    for scene, dt_s in steps.items():
        methods = (first, Method(first.engine, first.profile, overrides))
        before, after = (pool.run(TimeTask(Job(scene, method, dt_s))).value for method in methods)
        if before is not None and after is not None and before.advance_s > 0:
            ratios.append(after.advance_s / before.advance_s)
    return statistics.median(ratios) if ratios else math.nan
