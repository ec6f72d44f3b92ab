"""Methods of a study: the requested engines with their requested profiles.

Profiles with equal settings count as one method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

from carom.engines.api import unsupported_reason
from carom.engines.registry import EngineInfo, load_adapter
from carom.errors import AdapterError, UnknownNameError
from carom.execution.adapter_profile import prepare_settings
from carom.execution.job import AdapterTask, Answer, Job, Method, SettingOverrides, Status
from carom.execution.pool import Pool, TaskRunner
from carom.model.trace import Setting
from carom.support.escaping import build_name_hints

DEFAULT_PROFILES = ("default", "tuned", "located")

#: Name that selects every profile of an engine.
ALL_PROFILES = "all"


def select_profiles(infos: Sequence[EngineInfo], names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the profiles to run. The name "all" selects all profiles; the default is `DEFAULT_PROFILES`.

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
    # results, which shows why the adapter can't be loaded.
    return tuple(offered if ALL_PROFILES in names else names) or DEFAULT_PROFILES


#: For each step size, the settings of a profile, or the reason why the settings can't be queried.
_Settings = tuple[Mapping[str, Setting] | str, ...]


@dataclass(frozen=True)
class SettingsTask(AdapterTask):
    """Queries the settings of a profile for several step sizes, with replacements from `overrides`."""

    profile: str
    dts: tuple[float, ...]
    overrides: SettingOverrides = ()

    def carry_out(self) -> _Settings:
        """Return the settings in the order of the step sizes."""
        adapter = load_adapter(self.engine)
        found: list[Mapping[str, Setting] | str] = []
        for dt_s in self.dts:
            try:
                found.append(prepare_settings(adapter, self.profile, dt_s, self.overrides))
            except AdapterError as error:
                found.append(str(error))
        return tuple(found)


class Methods(NamedTuple):
    """The methods to run with each step size, and the reasons why some methods can't be run.

    Attributes:
        by_engine_and_step: Methods to run, by engine and step size. Only the last of several profiles with the same
            settings is included.
        refusals: Reasons why methods of available engines can't run any scene, by method and step size.
        infos: Descriptions of the engines, by name.
    """

    by_engine_and_step: Mapping[tuple[str, float], tuple[Method, ...]]
    refusals: Mapping[tuple[Method, float], Answer[Any]]
    infos: Mapping[str, EngineInfo]

    def find_refusal(self, method: Method, dt_s: float) -> Answer[Any] | None:
        """Return why a method can't run any scene with a step size; None if no reason is known."""
        info = self.infos.get(method.engine)
        if info is not None and info.unavailable:
            return Answer(Status.UNAVAILABLE, info.unavailable)
        return self.refusals.get((method, dt_s))

    def find_job_refusal(self, job: Job) -> Answer[Any] | None:
        """Return why a job can't be run, without querying its adapter; None if no reason is known."""
        info = self.infos.get(job.engine)
        if (known := self.find_refusal(job.method, job.dt_s)) is not None or info is None or info.capabilities is None:
            return known
        # The capabilities that a profile declares are valid only if no setting of the profile is replaced.
        capabilities = info.capabilities if job.method.overrides else info.own.get(job.profile, info.capabilities)
        reason = unsupported_reason(job.scene, capabilities, job.dt_s, located=job.profile in info.located)
        return Answer(Status.UNSUPPORTED, reason) if reason else None


def list_methods(
    infos: Sequence[EngineInfo],
    profiles: Sequence[str],
    dts: Sequence[float],
    pool: Pool,
    overrides: Mapping[str, SettingOverrides] = MappingProxyType({}),
) -> Methods:
    """Return the methods to run with each step size.

    Args:
        infos: Descriptions of the engines.
        profiles: Names of the profiles to run.
        dts: Step sizes, in seconds.
        pool: Pool that carries out the queries of adapters; the caller closes it.
        overrides: Settings that are used instead of the profiles' settings, by the engine's name.
    """
    steps = tuple(dict.fromkeys(dts))
    tasks: dict[str, list[SettingsTask]] = {}
    for info in infos:
        for profile in info.own_profiles(profiles):
            task = SettingsTask(info.name, profile, steps, overrides.get(info.name, ()))
            tasks.setdefault(info.name, []).append(task)
    queried = pool.map_unordered(tasks.items(), _query_all)
    found = {(task.engine, task.profile): answer for several in queried for task, answer in several}
    methods: dict[tuple[str, float], tuple[Method, ...]] = {}
    refused: dict[tuple[Method, float], Answer[Any]] = {}
    for info in infos:
        own_overrides = overrides.get(info.name, ())
        # An adapter whose declarations can't be queried gets one method, so that a row of results shows the reason.
        own_profiles = info.own_profiles(profiles) if info.profiles else profiles[-1:]
        for k, dt_s in enumerate(steps):
            last_of: dict[object, str] = {}
            for profile in own_profiles:
                settings = _extract_settings(info, found.get((info.name, profile)), k)
                if isinstance(settings, Answer):
                    refused[Method(info.name, profile, own_overrides), dt_s] = settings
                    last_of[profile] = profile
                else:
                    last_of[profile in info.located, *sorted(settings.items())] = profile
            names = sorted(last_of.values(), key=own_profiles.index)
            methods[info.name, dt_s] = tuple(Method(info.name, profile, own_overrides) for profile in names)
    return Methods(methods, refused, {info.name: info for info in infos})


def _extract_settings(
    info: EngineInfo, answer: Answer[_Settings] | None, step: int
) -> Mapping[str, Setting] | Answer[Any]:
    """Return the settings of a profile for step size number `step`, or the reason why this profile can't be run."""
    if answer is not None and answer.value is not None and isinstance(settings := answer.value[step], Mapping):
        # The settings are needed even if the engine is not installed, because profiles with equal settings are one
        # method.
        return settings
    if info.unavailable or answer is None:
        return Answer(Status.UNAVAILABLE, info.unavailable)
    if answer.value is None:
        return Answer(answer.status, f"query of its settings: {answer.reason}")
    return Answer(Status.FAILED, str(answer.value[step]))


def _query_all(tasks: Sequence[SettingsTask], runner: TaskRunner) -> Iterator[tuple[SettingsTask, Answer[_Settings]]]:
    yield from zip(tasks, runner.run_each(tasks), strict=True)
