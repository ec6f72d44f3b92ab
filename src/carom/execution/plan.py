"""The plan of a cross-check: which scene runs on which engine, with which profile and at which step.

Derived from the scenes and from what the adapters declare, each in a process of its own; no engine is imported. What is
run and what ``--explain`` prints are read off the same plan.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from carom.catalogue import CatalogueScene, KnownAnswer, find_scenes
from carom.engines.api import Capabilities, ContactTimes
from carom.engines.registry import EngineInfo
from carom.errors import InputError, UnknownNameError
from carom.execution.engine_run import Observe, capabilities_of
from carom.execution.engines import Methods, described, methods_of, to_run
from carom.execution.job import Answer, Job, Status, Tried
from carom.execution.options import Options
from carom.execution.pool import Asker, Pool
from carom.execution.settings_override import tried_by
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.support.checks import shown
from carom.support.escaping import named_hints

__all__ = [
    "DEFAULT_PROFILES",
    "Plan",
    "capabilities_of",
    "missing_profile_reason",
    "of_its_scene",
    "plan_of",
    "profiles_to_plan",
    "sorted_out",
    "trace_of",
]

DEFAULT_PROFILES = ("default", "tuned", "located")

#: Stands for every profile that an engine offers.
ALL_PROFILES = "all"


@dataclass(frozen=True)
class Plan:
    """Which scene runs by which method at which step.

    Attributes:
        scenes: No two of one name.
        answers: Known answers of those of the catalogue, by name.
        engines: What is known of each engine asked for, or of every one.
        profiles: Names of the profiles to run.
        jobs: In the order scene, engine, step, profile.
        options: What was asked for.
        methods: What is known of the methods, and why some can't be run.
    """

    scenes: tuple[Scene, ...]
    answers: Mapping[str, KnownAnswer]
    engines: tuple[EngineInfo, ...]
    profiles: tuple[str, ...]
    jobs: tuple[Job, ...]
    options: Options
    methods: Methods


def profiles_to_plan(infos: Sequence[EngineInfo], asked: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the profiles to run: those asked for, all that are offered, or those of `DEFAULT_PROFILES`.

    Raises:
        UnknownNameError: No engine asked for has such a profile.
    """
    offered = dict.fromkeys(profile for info in infos for profile in info.profiles)
    for profile in asked or ():
        if profile not in (*offered, ALL_PROFILES) and all(info.profiles for info in infos):
            hints = named_hints(profile, offered, f"there are: {', '.join(offered)}")
            raise UnknownNameError(f"no requested engine has a profile {profile!r}", hints=hints)
    if asked is None:
        asked = [name for name in DEFAULT_PROFILES if name in offered]
    # Where no adapter asked for can be loaded, its rows say why.
    return tuple(offered if ALL_PROFILES in asked else asked) or DEFAULT_PROFILES


def sorted_out(scenes: Iterable[Scene | CatalogueScene | str]) -> tuple[tuple[Scene, ...], dict[str, KnownAnswer]]:
    """Return the scenes, and the known answers of those of the catalogue by name.

    Raises:
        InputError: There is no scene, or two have one name.
    """
    if isinstance(scenes, Scene | CatalogueScene | str) or not isinstance(scenes, Iterable):
        raise InputError(f"scenes must be a list, even of one item, got {type(scenes).__name__}")
    given = list(scenes)
    entries = [one for entry in given for one in (find_scenes([entry]) if isinstance(entry, str) else [entry])]
    for k, entry in enumerate(entries):
        if not isinstance(entry, Scene | CatalogueScene):
            raise InputError(f"scenes[{k}] must be a Scene, a catalogue scene or its name, got {shown(entry)}")
    answers = {entry.name: entry.known for entry in entries if isinstance(entry, CatalogueScene)}
    plain = tuple(entry.scene if isinstance(entry, CatalogueScene) else entry for entry in entries)
    if not plain:
        raise InputError("no scene to run")
    names = [scene.name for scene in plain]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"two scenes have the name {twice[0]!r}: names must be unique")
    return plain, answers


def plan_of(scenes: Iterable[Scene | CatalogueScene | str], options: Options, pool: Pool) -> Plan:
    """Return the plan of a cross-check.

    Args:
        scenes: Scenes, of one's own or of the catalogue; no two of one name.
        options: What is asked for.
        pool: Where adapters are asked what they declare; it stays open.

    Raises:
        InputError: There is no scene, or two have one name.
        UnknownNameError: There is no such engine, or no engine asked for has such a profile.
    """
    plain, answers = sorted_out(scenes)
    known = described(options.engines, pool)
    infos = to_run(known, options.engines)
    profiles = profiles_to_plan(infos, options.profiles)
    dts = [dt_s for scene in plain for dt_s in options.steps_of(scene)]
    methods = methods_of(infos, profiles, dts, pool, _tried(infos, profiles, options, dts, pool))
    jobs = [
        Job(scene, method, dt_s, refinement)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(options.steps_of(scene))
        for method in methods.at[info.name, dt_s]
        if options.dts or refinement == 0 or method.profile not in info.located
    ]
    return Plan(plain, answers, tuple(known), profiles, tuple(jobs), options, methods)


def _tried(
    infos: Sequence[EngineInfo], profiles: Sequence[str], options: Options, dts: Sequence[float], pool: Pool
) -> dict[str, Tried]:
    """Return what each engine is to try instead of its profiles' own settings."""
    if not options.settings:
        return {}
    return {info.name: tried_by(info, options.settings, profiles, dts[0], pool) for info in infos}


def trace_of(job: Job, asker: Asker, *, samples: bool = False) -> Answer[Trace]:
    """Return what happens in a job, or why it can't be run or was not."""
    return of_its_scene(job, asker.ask(Observe(job, samples)))


def of_its_scene(job: Job, answer: Answer[Trace]) -> Answer[Trace]:
    """Return the answer to a job, which must be a trace of its own scene."""
    if answer.value is not None and answer.value.scene != job.scene:
        return Answer(Status.FAILED, "answered nonsense: a trace of another scene")
    return answer


def missing_profile_reason(profile: str, capabilities: Capabilities) -> str:
    """Return why a method that declares these capabilities has no profile of this name, as far as that can be told."""
    if profile.startswith("cylinder") and capabilities.dimensions == 2:
        return "its discs are two-dimensional: there is nothing to tip over"
    if profile == "resting":
        return "no setting of its own is known that brings discs to rest better than the tuned ones"
    if profile == "no-ccd" and not capabilities.continuous_detection:
        return "it has no continuous detection that could be left out"
    if capabilities.contact_times is ContactTimes.SOLVED:
        return "it solves for the instant of an impact: there is no step to cut and nothing to sweep"
    if profile == "located":
        return "its steps are not cut: to look only at their boundaries is what it stands for"
    return "its adapter offers no such profile"
