"""The plan of a cross-check: which scene runs on which engine, with which profile and step size.

The plan is computed from the scenes and from what the adapters declare. Adapters are queried in worker processes, and
no engine is imported. The option ``--explain`` shows the plan without running it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from carom.catalogue import CatalogueScene, KnownAnswer, resolve_scenes
from carom.engines.registry import EngineInfo
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.job import Job
from carom.execution.methods import Methods, list_methods, select_profiles
from carom.execution.pool import Pool
from carom.model.scene import Scene
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.settings_override import resolve_settings


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
