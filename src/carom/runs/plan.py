"""The plan of a cross-check: which scene runs on which engine, with which profile and at which step.

Derived from the scenes and from what the adapters declare; no engine is started. What is run and what ``--explain``
prints are read off the same plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from carom.adapter import Adapter, Capabilities, ContactTimes, unsupported_reason
from carom.errors import AdapterError, InputError, UnknownNameError
from carom.limits import require_seconds
from carom.registry import EngineInfo, chosen_engines, load_adapter, unavailable_reason
from carom.runs.job import Answer, Job, Method, Status
from carom.runs.observe import Observe, profile_settings
from carom.runs.pool import DEFAULT_TIME_LIMIT_S, Asker
from carom.runs.reference import CERTIFY_SECONDS
from carom.scene import Scene
from carom.scenes import CatalogueScene, KnownAnswer
from carom.trace import Trace

__all__ = [
    "DEFAULT_PROFILES",
    "Options",
    "Plan",
    "capabilities_of",
    "default_dts",
    "distinct_methods",
    "missing_profile_reason",
    "plan_of",
    "profiles_to_plan",
    "refusal",
    "require_positive",
    "sorted_out",
    "trace_of",
]

DEFAULT_PROFILES = ("default", "tuned", "located")

#: Stands for every profile that an engine offers.
ALL_PROFILES = "all"

#: Each step of a scene's series is this part of the one before: far enough apart to show an order of convergence.
REFINEMENT = 4
REFINEMENTS = 3


def default_dts(scene: Scene) -> tuple[float, ...]:
    """Return the steps at which a scene is run unless others are asked for: its own frame, a quarter, a sixteenth."""
    return tuple(1.0 / (scene.frame_rate_hz * REFINEMENT**k) for k in range(REFINEMENTS))


@dataclass(frozen=True)
class Options:
    """What is asked of a cross-check beside its scenes: one thing for Python, the command line and the journal.

    Attributes:
        engines: Names of adapters; every one that is installed by default.
        dts: Steps, seconds; by default those of `default_dts` for each scene.
        profiles: Names of profiles, or "all"; by default those of `DEFAULT_PROFILES` that there are. Where two profiles
            of an engine have the same settings, only the later one is run. One whose steps are cut is run at a scene's
            coarsest step only, unless steps are asked for, since what it finds does not depend on them.
        phases: At how many sub-step phases to run each job beside the scene's own, for the spread of its errors.
        seed: Where the quasi-random sequence of phases begins.
        certified: Whether to score against certified runs. By default PIC is the reference, and for scenes of three
            discs or more a certified run says up to which impact it may be believed, where python-flint is installed.
        certify_s: Seconds for the certified run of each scene.
        timing: Whether to time each job at its scene's coarsest step too, in a pass in which nothing else runs.
        samples: Whether to keep states for drawing; nobody draws them where no report is written.
        jobs: How many jobs are run at a time; as many as there are cores by default.
        time_limit_s: An engine that gives no answer for so long is ended, and its row says so.
        memory_limit_mb: Megabytes that an engine's process may take; by default as a `carom.runs.pool.LocalPool` has
            it.

    Raises:
        InputError: A number is out of range, or a list is none.
    """

    engines: Sequence[str] | None = None
    dts: Sequence[float] | None = None
    profiles: Sequence[str] | None = None
    phases: int = 0
    seed: int = 0
    certified: bool | None = None
    certify_s: float = CERTIFY_SECONDS
    timing: bool = True
    samples: bool = True
    jobs: int | None = None
    time_limit_s: float = DEFAULT_TIME_LIMIT_S
    memory_limit_mb: float | None = None

    def __post_init__(self) -> None:
        for name in ("engines", "dts", "profiles"):
            value = getattr(self, name)
            if isinstance(value, str):
                raise InputError(f"{name} must be a list, also where there is one of them, got {value!r}")
            object.__setattr__(self, name, None if value is None else tuple(value))
        if isinstance(self.phases, bool) or not isinstance(self.phases, int) or self.phases < 0:
            raise InputError(f"phases must be a whole number, 0 or more, got {self.phases!r}")
        require_seconds("time_limit_s", self.time_limit_s)
        require_seconds("certify_s", self.certify_s)
        require_positive(**{f"dts[{k}]": dt for k, dt in enumerate(self.dts or ())})

    def steps_of(self, scene: Scene) -> tuple[float, ...]:
        """Return the steps at which a scene is run, from the coarsest on."""
        return tuple(sorted(set(self.dts or default_dts(scene)), reverse=True))


def require_positive(**values: float) -> None:
    """Refuse what is no positive number of seconds, by its name."""
    for name, value in values.items():
        if not (isinstance(value, int | float) and 0 < value < math.inf):
            raise InputError(f"{name} must be a positive number of seconds, got {value!r}")


@dataclass(frozen=True)
class Plan:
    """Which scene runs by which method at which step.

    Attributes:
        scenes: No two of one name.
        answers: Known answers of those of the catalogue, by name.
        engines: What is known of each engine asked for.
        profiles: Names of the profiles to run.
        jobs: In the order scene, engine, step, profile.
        options: What was asked for.
    """

    scenes: tuple[Scene, ...]
    answers: Mapping[str, KnownAnswer]
    engines: tuple[EngineInfo, ...]
    profiles: tuple[str, ...]
    jobs: tuple[Job, ...]
    options: Options


def profiles_to_plan(infos: Sequence[EngineInfo], asked: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the profiles to run: those asked for, all that are offered, or those of `DEFAULT_PROFILES`.

    Raises:
        UnknownNameError: No engine asked for has such a profile.
    """
    offered = dict.fromkeys(profile for info in infos for profile in info.profiles)
    for profile in asked or ():
        if profile not in (*offered, ALL_PROFILES) and all(info.profiles for info in infos):
            raise UnknownNameError(f"no engine asked for has a profile {profile!r}; there are: {', '.join(offered)}")
    if asked is None:
        asked = [name for name in DEFAULT_PROFILES if name in offered]
    # Where no adapter asked for can be loaded, its rows say why.
    return tuple(offered if ALL_PROFILES in asked else asked) or DEFAULT_PROFILES


def sorted_out(scenes: Iterable[Scene | CatalogueScene]) -> tuple[tuple[Scene, ...], dict[str, KnownAnswer]]:
    """Return the scenes, and the known answers of those of the catalogue by name.

    Raises:
        InputError: There is no scene, or two have one name.
    """
    if isinstance(scenes, Scene | CatalogueScene):
        raise InputError("scenes must be a list, also where there is one of them")
    entries = list(scenes)
    answers = {entry.name: entry.known for entry in entries if isinstance(entry, CatalogueScene)}
    plain = tuple(entry.scene if isinstance(entry, CatalogueScene) else entry for entry in entries)
    if not plain:
        raise InputError("there is no scene to run")
    names = [scene.name for scene in plain]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"two scenes have the name {twice[0]!r}: a report could not tell them apart")
    return plain, answers


def plan_of(scenes: Iterable[Scene | CatalogueScene], options: Options) -> Plan:
    """Return the plan of a cross-check.

    Raises:
        InputError: There is no scene, or two have one name.
        UnknownNameError: There is no such engine, or no engine asked for has such a profile.
    """
    plain, answers = sorted_out(scenes)
    infos = chosen_engines(options.engines)
    profiles = profiles_to_plan(infos, options.profiles)
    loaded = [(info.name, load_adapter(info.name)) for info in infos if info.profiles]
    located = {Method(name, profile) for name, of in loaded for profile in of.profiles if of.profiles[profile].located}
    jobs = [
        Job(scene, method, dt_s, refinement)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(options.steps_of(scene))
        for method in distinct_methods(info, profiles, dt_s)
        if options.dts or refinement == 0 or method not in located
    ]
    return Plan(plain, answers, tuple(infos), profiles, tuple(jobs), options)


def distinct_methods(info: EngineInfo, profiles: Sequence[str], dt_s: float) -> list[Method]:
    """Return the methods to run of an engine: of profiles with the same settings at a step only the last."""
    if not info.profiles:  # the adapter can't be loaded: one row says why
        return [Method(info.name, profiles[-1])]
    adapter = load_adapter(info.name)
    by_settings: dict[object, str] = {}
    for profile in profiles:
        if profile in adapter.profiles:
            located = adapter.profiles[profile].located
            try:
                settings: object = (located, *sorted(profile_settings(adapter, profile, dt_s).items()))
            except AdapterError:  # its row will say why
                settings = profile
            by_settings[settings] = profile
    return [Method(info.name, profile) for profile in sorted(by_settings.values(), key=list(profiles).index)]


def refusal(job: Job) -> Answer[Any] | None:
    """Return why a job can't be run, decided without starting the engine; None where it can."""
    try:
        adapter = load_adapter(job.engine)
    except AdapterError as error:
        return Answer(Status.UNAVAILABLE, str(error))
    missing = unavailable_reason(adapter.engine)
    if missing:
        return Answer(Status.UNAVAILABLE, missing)
    try:
        profile_settings(adapter, job.profile, job.dt_s)
    except AdapterError as error:
        return Answer(Status.FAILED, str(error))
    unsupported = unsupported_reason(job.scene, capabilities_of(adapter, job.profile), job.dt_s)
    return Answer(Status.UNSUPPORTED, unsupported) if unsupported else None


def trace_of(job: Job, asker: Asker, *, samples: bool = False) -> Answer[Trace]:
    """Return what happens in a job, or why it can't be run or was not."""
    return refusal(job) or asker.ask(Observe(job, samples))


def capabilities_of(adapter: Adapter, profile: str) -> Capabilities:
    """Return what an engine can do with a profile: the profile's own word, or else the adapter's."""
    known = adapter.profiles.get(profile)
    return known.capabilities if known is not None and known.capabilities is not None else adapter.capabilities


def missing_profile_reason(profile: str, capabilities: Capabilities) -> str:
    """Return why a method that declares these capabilities has no profile of this name, as far as that can be told."""
    if profile.startswith("cylinder") and capabilities.dimensions == 2:
        return "its discs are two-dimensional: there is nothing to tip over"
    if profile == "no-ccd" and not capabilities.continuous_detection:
        return "it has no continuous detection that could be left out"
    if capabilities.contact_times is ContactTimes.SOLVED:
        return "it solves for the instant of an impact: there is no step to cut and nothing to sweep"
    if profile == "located":
        return "its steps are not cut: to look only at their boundaries is what it stands for"
    return "its adapter offers no such profile"
