"""The plan of a cross-check: which scene runs on which engine, with which profile and step size.

The plan is computed from the scenes and from what the adapters declare. Adapters are queried in worker processes, and
no engine is imported. The option ``--explain`` shows the plan without running it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from carom.catalogue import CatalogueScene, KnownAnswer, find_scenes
from carom.engines.api import Capabilities, ContactTimes
from carom.engines.registry import EngineInfo
from carom.errors import InputError, UnknownNameError
from carom.execution.describe_engines import Methods, describe_engines, list_methods, select_engines
from carom.execution.job import Answer, Job, Status
from carom.execution.observation.engine_run import ObserveTask
from carom.execution.pool import Pool, TaskRunner
from carom.execution.run_options import Options
from carom.execution.settings_override import resolve_settings
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.support.escaping import build_name_hints, format_value

DEFAULT_PROFILES = ("default", "tuned", "located")

#: Name that selects every profile of an engine.
ALL_PROFILES = "all"


@dataclass(frozen=True)
class Plan:
    """The jobs of a cross-check, and the scenes, engines and methods that the jobs combine.

    Attributes:
        scenes: The scenes; no two have the same name.
        answers: Known answers of the catalogue scenes, by name.
        engines: Description of each requested engine; of every engine if none is requested.
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


def select_profiles(infos: Sequence[EngineInfo], names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the profiles to run: those in `names`, all for the name "all", or else `DEFAULT_PROFILES`.

    Raises:
        UnknownNameError: No requested engine has such a profile.
    """
    offered = dict.fromkeys(profile for info in infos for profile in info.profiles)
    for profile in names or ():
        is_known = profile == ALL_PROFILES or any(info.own_profiles([profile]) for info in infos)
        if not is_known and all(info.profiles for info in infos):
            hints = build_name_hints(profile, offered, f"there are: {', '.join(offered)}")
            raise UnknownNameError(f"no requested engine has a profile {profile!r}", hints=hints)
    if names is None:
        names = [name for name in DEFAULT_PROFILES if any(info.own_profiles([name]) for info in infos)]
    # If no requested adapter can be loaded, the default profiles are returned. So each adapter still has a row of
    # results, which shows why it can't be loaded.
    return tuple(offered if ALL_PROFILES in names else names) or DEFAULT_PROFILES


def resolve_scenes(scenes: Iterable[Scene | CatalogueScene | str]) -> tuple[tuple[Scene, ...], dict[str, KnownAnswer]]:
    """Look up names in the catalogue. Return the scenes, and the known answers of catalogue scenes by name.

    Raises:
        InputError: There is no scene, or two scenes have the same name.
    """
    if isinstance(scenes, Scene | CatalogueScene | str) or not isinstance(scenes, Iterable):
        raise InputError(f"scenes must be a list, even of one item, got {type(scenes).__name__}")
    scene_list = list(scenes)
    entries = [one for entry in scene_list for one in (find_scenes([entry]) if isinstance(entry, str) else [entry])]
    for k, entry in enumerate(entries):
        if not isinstance(entry, Scene | CatalogueScene):
            raise InputError(f"scenes[{k}] must be a Scene, a catalogue scene or its name, got {format_value(entry)}")
    answers = {entry.name: entry.known for entry in entries if isinstance(entry, CatalogueScene)}
    plain = tuple(entry.scene if isinstance(entry, CatalogueScene) else entry for entry in entries)
    if not plain:
        raise InputError("no scene to run")
    names = [scene.name for scene in plain]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"two scenes have the name {twice[0]!r}: names must be unique")
    return plain, answers


def build_plan(scenes: Iterable[Scene | CatalogueScene | str], options: Options, pool: Pool) -> Plan:
    """Build the plan of a cross-check.

    Args:
        scenes: Scenes, catalogue scenes or names of catalogue scenes. All names must differ.
        options: The requested options.
        pool: Pool that queries the adapters' declarations; the caller closes it.

    Raises:
        InputError: There is no scene, or two scenes have the same name.
        UnknownNameError: There is no such engine, or no requested engine has such a profile.
    """
    plain, answers = resolve_scenes(scenes)
    known = describe_engines(options.engines, pool)
    infos = select_engines(known, options.engines)
    profiles = select_profiles(infos, options.profiles)
    dts = [dt_s for scene in plain for dt_s in options.list_steps(scene)]
    tried = {info.name: resolve_settings(info, options.settings, profiles, dts[0], pool) for info in infos}
    methods = list_methods(infos, profiles, dts, pool, tried)
    jobs = [
        Job(scene, method, dt_s, refinement)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(options.list_steps(scene))
        for method in methods.at[info.name, dt_s]
        if options.dts or refinement == 0 or method.profile not in info.located
    ]
    return Plan(plain, answers, tuple(known), profiles, tuple(jobs), options, methods)


def observe_job(job: Job, runner: TaskRunner, *, samples: bool = False) -> Answer[Trace]:
    """Run a job and return its trace, or the reason why there is none."""
    return check_own_scene(job, runner.run(ObserveTask(job, samples)))


def check_own_scene(job: Job, answer: Answer[Trace]) -> Answer[Trace]:
    """Return the answer to a job with the job's own scene, or a failed answer if its trace is of another scene."""
    if answer.value is None:
        return answer
    if answer.value.scene != job.scene:
        return Answer(Status.FAILED, "invalid answer: a trace of another scene")
    return replace(answer, value=replace(answer.value, scene=job.scene))


def explain_missing_profile(profile: str, capabilities: Capabilities) -> str:
    """Return the likely reason why a method with these capabilities has no profile of this name."""
    if profile.startswith("cylinder") and capabilities.dimensions == 2:
        return "its discs are two-dimensional: there is nothing to tip over"
    if profile == "resting":
        return "no settings are known that bring discs to rest better than `tuned`"
    if profile == "no-ccd" and not capabilities.continuous_detection:
        return "it has no continuous detection to switch off"
    if capabilities.contact_times is ContactTimes.SOLVED:
        return "it computes the instant of each impact, so no step must be shortened and no path checked"
    if profile == "located":
        return "Carom does not shorten its steps: by definition it checks only at their boundaries"
    return "its adapter offers no such profile"
