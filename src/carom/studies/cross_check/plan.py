"""The plan of a cross-check: which scene runs on which engine, with which profile and step size.

The plan is computed from the scenes and from what the adapters declare. Adapters are queried in worker processes, and
no engine is imported. The option ``--explain`` shows the plan without running it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from carom.catalogue import CatalogueScene, KnownAnswer, resolve_scenes
from carom.engines.registry import EngineInfo
from carom.errors import InputError, UnknownNameError
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.job import Job, SettingOverrides
from carom.execution.methods import Methods, SettingsTask, list_methods, select_profiles
from carom.execution.pool import Pool, TaskRunner
from carom.model.scene import Scene
from carom.model.trace import Setting, format_setting
from carom.studies.cross_check.options import Options
from carom.support.escaping import build_name_hints

#: Name of the step size among the settings. The step size is set by ``--dt``, and can't be replaced with ``--set``.
STEP = "dt_s"

_BOOLS = {"true": True, "false": False}
_KINDS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}


class Plan(NamedTuple):
    """The jobs of a cross-check, and the scenes, engines and methods that the jobs combine.

    Attributes:
        scenes: The scenes; no two have the same name.
        answers: Known answers of the catalogue scenes, by name.
        engines: Descriptions of the requested engines, or of all engines if none is requested.
        profiles: Names of the profiles to run.
        jobs: The jobs, sorted by scene, engine, step size and profile.
        options: The requested options.
        methods: The methods, and the reasons why some methods can't be run.
    """

    scenes: tuple[Scene, ...]
    answers: Mapping[str, KnownAnswer]
    engines: tuple[EngineInfo, ...]
    profiles: tuple[str, ...]
    jobs: tuple[Job, ...]
    options: Options
    methods: Methods


def build_plan(scenes: Iterable[Scene | CatalogueScene | str], options: Options, pool: Pool) -> Plan:
    """Build the plan of a cross-check.

    Args:
        scenes: Scenes, catalogue scenes or names of catalogue scenes. All names must differ.
        options: The requested options.
        pool: Pool that queries the adapters' declarations; the caller closes it.

    Raises:
        InputError: There is no scene, or two scenes have the same name.
        UnknownNameError: A requested engine does not exist, or no requested engine has a requested profile.
    """
    plain, answers = resolve_scenes(scenes)
    known = describe_engines(options.engines, pool)
    infos = select_engines(known, options.engines)
    profiles = select_profiles(infos, options.profiles)
    dts = [dt_s for scene in plain for dt_s in options.list_steps(scene)]
    overrides = {info.name: resolve_settings(info, options.settings, profiles, dts[0], pool) for info in infos}
    methods = list_methods(infos, profiles, dts, pool, overrides)
    jobs = [
        Job(scene, method, dt_s, refinement)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(options.list_steps(scene))
        for method in methods.by_engine_and_step[info.name, dt_s]
        if options.dts or refinement == 0 or method.profile not in info.located
    ]
    return Plan(plain, answers, tuple(known), profiles, tuple(jobs), options, methods)


def resolve_settings(
    info: EngineInfo, overrides: Mapping[str, Setting], profiles: Sequence[str], dt_s: float, runner: TaskRunner
) -> SettingOverrides:
    """Check settings that the user has replaced, convert their values, and return them sorted by name.

    Args:
        info: Description of the engine.
        overrides: The new values by name of the setting. Texts are converted to the type of the setting.
        profiles: The profiles whose settings are replaced.
        dt_s: Step size for which the adapter returns the profiles' settings, in seconds.
        runner: Runner that requests the settings from the adapter.

    Raises:
        UnknownNameError: The engine lacks a setting.
        InputError: A value has the wrong type.
    """
    # without declarations, nothing can be checked; the results show why declarations are missing
    if not overrides or not info.profiles:
        return ()
    known = {name: knob.example for name, knob in info.knobs.items()}
    # The loop goes backwards through this list, so that values of the requested profiles, which are first in the list,
    # replace values of other profiles.
    own_profiles = info.own_profiles((*profiles, *info.profiles))
    answers = list(runner.run_each([SettingsTask(info.name, profile, (dt_s,)) for profile in own_profiles]))
    for answer in reversed(answers):
        if answer.value is None:
            raise InputError(f"{info.name} could not list its settings: {answer.problem}")
        (settings,) = answer.value
        if not isinstance(settings, str):  # a profile that fails is skipped, since the failure is reported elsewhere
            known |= settings
    return tuple(sorted((name, _check_setting(info.name, name, value, known)) for name, value in overrides.items()))


def _check_setting(engine: str, name: str, value: Setting, known: Mapping[str, Setting]) -> Setting:
    if name == STEP:
        raise InputError(f"{STEP} is the step size: set it with --dt, or with the argument dt in Python")
    if name not in known:
        names = ", ".join(sorted(known.keys() - {STEP})) or "none"
        hints = build_name_hints(name, known, f"there are: {names}")
        raise UnknownNameError(f"{engine} has no setting {name!r}", hints=hints)
    kind = type(known[name])
    found = _convert(value, kind)
    if found is None:
        raise InputError(f"setting {name!r} of {engine} must be {_KINDS[kind]}, got {format_setting(value)!r}")
    return found


def _convert(value: Setting, kind: type[Setting]) -> Setting | None:
    """Convert a value to the type of a setting; return None if that is not possible."""
    if kind is str or kind is bool:
        found = _BOOLS.get(value.lower()) if kind is bool and isinstance(value, str) else value
        return found if isinstance(found, kind) else None
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        return None
    try:
        number: int | float = kind(value)  # type: ignore[assignment] # an invalid value raises
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
