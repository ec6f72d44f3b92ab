"""Queries what adapters declare, and their settings, in worker processes, since an adapter is third-party code.

Only the adapters that a command needs are queried. Adapters of one distribution share a process, since starting a
process takes longer than a query. If an adapter hangs, ends its process or declares something invalid, it is reported
as unavailable, with the reason. Other adapters are not affected.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from types import MappingProxyType
from typing import Any

from carom.engines.api import CodedAdapter, unsupported_reason
from carom.engines.registry import (
    EngineInfo,
    distribution_of,
    explain_unavailable_adapter,
    find_version,
    list_adapter_points,
    load_adapter,
    require_named,
)
from carom.errors import AdapterError, InputError
from carom.execution.adapter_profile import prepare_settings
from carom.execution.exception_text import describe_exception
from carom.execution.job import PIT_METHOD, AdapterTask, Answer, Job, Method, SettingOverrides, Status
from carom.execution.pool import LocalPool, Pool, TaskRunner
from carom.execution.validate_adapter import to_plain_text, validate_adapter
from carom.model.trace import Setting
from carom.support.display import Shown
from carom.support.escaping import format_value


@dataclass(frozen=True)
class DescribeTask(AdapterTask):
    """Queries what the adapter `name` declares, in the worker process of the adapter `engine`, which it may share."""

    name: str

    def carry_out(self) -> EngineInfo:
        """Return the description of the adapter.

        Raises:
            AdapterError: The adapter can't be loaded, or a declaration is invalid.
        """
        adapter, distribution = load_adapter(self.name), distribution_of(self.name)
        try:
            declared = validate_adapter(adapter)
            reason = to_plain_text(explain_unavailable_adapter(adapter), "unavailable()")
            version = to_plain_text(find_version(adapter, distribution), "version()")
        except AdapterError:
            raise
        except Exception as error:
            message = f"the adapter {self.name!r} can't describe itself: {describe_exception(error)}"
            raise AdapterError(message) from error
        return EngineInfo(
            name=self.name,
            engine=declared.engine.name,
            version="" if reason else version,
            unavailable=reason,
            capabilities=declared.capabilities,
            profiles={name: to_plain_text(one.description, "a description") for name, one in declared.profiles.items()},
            distribution=distribution,
            located=frozenset(name for name, one in declared.profiles.items() if one.located),
            own={name: one.capabilities for name, one in declared.profiles.items() if one.capabilities is not None},
            knobs=declared.knobs,
            install=to_plain_text(declared.engine.install, "engine.install"),
            code=isinstance(adapter, CodedAdapter) and callable(adapter.code),
        )


#: Descriptions that this process has queried, by the adapter's name and entry point. Failed queries are not stored.
_KNOWN: dict[tuple[str, str], EngineInfo] = {}


class EngineList(Shown, list[EngineInfo]):
    """List of engine descriptions that prints as one line each."""


def engines(names: Sequence[str] | None = None) -> EngineList:
    """Query engines in worker processes, end these processes, and return the descriptions of the engines.

    Args:
        names: Names of adapters; by default all that are installed.

    Raises:
        InputError: `names` is not a list.
        UnknownNameError: There is no such engine.

    Examples:
        >>> [info.name for info in carom.engines(["pic", "pit"])]
        ['pic', 'pit']
    """
    if isinstance(names, str) or not (names is None or isinstance(names, Iterable)):
        raise InputError(f"names must be a list, even of one item, got {format_value(names)}")
    with LocalPool() as pool:
        return describe_engines(names, pool)


def describe_engines(names: Sequence[str] | None, pool: Pool) -> EngineList:
    """Return the descriptions of engines, with PIC and PIT first.

    The description of an unavailable engine contains the reason.

    Args:
        names: Names of adapters; None for all that are installed.
        pool: Pool that carries out the queries; the caller closes it.

    Raises:
        UnknownNameError: There is no such engine.
    """
    for name in names or ():
        require_named(name)
    there_are = list_adapter_points()
    points = {name: point for name, point in there_are.items() if names is None or name in names}
    # PIT is always queried, because every study compares engines with PIT. A later query of PIT alone would need
    # another pool.
    also = {PIT_METHOD.engine} & there_are.keys()
    todo = [
        name
        for name in (*points, *sorted(also - points.keys()))
        if (one := _KNOWN.get((name, there_are[name].value))) is None or not one.profiles
    ]
    # An adapter that belongs to no distribution, such as one from a manifest, is queried in a process of its own.
    groups = [list(names) for _, names in groupby(sorted(todo, key=_process_key_of), _process_key_of)]
    for found in pool.map_unordered(((names[0], names) for names in groups), _describe):
        _KNOWN.update(((info.name, there_are[info.name].value), info) for info in found)
    infos = [_KNOWN[name, point.value] for name, point in points.items()]
    # Carom's methods come first, then the other engines in alphabetical order. All tables use this order.
    return EngineList(sorted(infos, key=lambda info: (bool(info.engine != "Carom"), info.name)))


def select_engines(infos: Sequence[EngineInfo], names: Sequence[str] | None) -> list[EngineInfo]:
    """Return the engines to run: the requested engines or, if no engine is requested, all installed ones."""
    return [info for info in infos if names is not None or not info.missing]


def find_engine(name: str) -> EngineInfo:
    """Return the description of an engine. The engine is queried only if this process has not queried it yet."""
    return _KNOWN.get((name, list_adapter_points()[name].value)) or engines([name])[0]


def _process_key_of(name: str) -> tuple[str, str]:
    """Return a key that is equal for adapters that share a process."""
    distribution = distribution_of(name)
    return distribution, "" if distribution else name


def _describe(names: Sequence[str], runner: TaskRunner) -> Iterator[EngineInfo]:
    answers = list(runner.run_each([DescribeTask(names[0], name) for name in names]))
    for name, first_answer in zip(names, answers, strict=True):
        # An earlier query in the same process can make a query fail. So a failed query is repeated in a process of its
        # own.
        failed = first_answer.status in (Status.FAILED, Status.CRASHED) and name != names[0]
        answer = runner.run(DescribeTask(name, name)) if failed else first_answer
        if answer.value is not None and answer.value.name == name:
            yield answer.value
            continue
        reason = answer.reason
        if answer.status is not Status.FAILED:
            reason = f"query of its declarations: {answer.status.value}: {answer.reason}"
        yield EngineInfo(name, name, "", reason, None, {}, distribution_of(name))


#: For each step size, the settings of a profile, or the reason why they can't be queried.
_Settings = tuple[Mapping[str, Setting] | str, ...]


@dataclass(frozen=True)
class SettingsTask(AdapterTask):
    """Queries the settings of a profile for several step sizes. Settings in `tried` replace the profile's settings."""

    profile: str
    dts: tuple[float, ...]
    tried: SettingOverrides = ()

    def carry_out(self) -> _Settings:
        """Return the settings in the order of the step sizes."""
        adapter = load_adapter(self.engine)
        found: list[Mapping[str, Setting] | str] = []
        for dt_s in self.dts:
            try:
                found.append(prepare_settings(adapter, self.profile, dt_s, self.tried))
            except AdapterError as error:
                found.append(str(error))
        return tuple(found)


@dataclass(frozen=True)
class Methods:
    """The methods to run with each step size, and the reasons why some methods can't be run.

    Attributes:
        at: Methods to run, by engine and step size. If profiles have the same settings, only the last of them is
            included.
        refused: By method and step size, why an available engine can run no scene with this method and step size.
        infos: Descriptions of the engines, by name.
    """

    at: Mapping[tuple[str, float], tuple[Method, ...]]
    refused: Mapping[tuple[Method, float], Answer[Any]]
    infos: Mapping[str, EngineInfo]

    def find_refusal(self, method: Method, dt_s: float) -> Answer[Any] | None:
        """Return why a method can run no scene with a step size; None if no reason is known."""
        info = self.infos.get(method.engine)
        if info is not None and info.unavailable:
            return Answer(Status.UNAVAILABLE, info.unavailable)
        return self.refused.get((method, dt_s))

    def find_job_refusal(self, job: Job) -> Answer[Any] | None:
        """Return why a job can't be run, without querying its adapter; None if no reason is known."""
        info = self.infos.get(job.engine)
        if (known := self.find_refusal(job.method, job.dt_s)) is not None or info is None or info.capabilities is None:
            return known
        # A profile may declare capabilities of its own. They hold only for the profile's own settings.
        capabilities = info.capabilities if job.method.tried else info.own.get(job.profile, info.capabilities)
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
        overrides: Settings that replace those of the profiles, by the engine's name.
    """
    steps = tuple(dict.fromkeys(dts))
    tasks = {
        info.name: [
            SettingsTask(info.name, profile, steps, overrides.get(info.name, ()))
            for profile in info.own_profiles(profiles)
        ]
        for info in infos
    }
    queried = pool.map_unordered(
        ((name, engine_tasks) for name, engine_tasks in tasks.items() if engine_tasks), _query_all
    )
    found = {(task.engine, task.profile): answer for several in queried for task, answer in several}
    methods: dict[tuple[str, float], tuple[Method, ...]] = {}
    refused: dict[tuple[Method, float], Answer[Any]] = {}
    for info in infos:
        own_overrides = overrides.get(info.name, ())
        # If an adapter's declarations can't be queried, one method represents it, whose row of results shows why.
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
    """Return the settings of a profile for step size number `step`, or why a method with this profile can't be run."""
    if answer is not None and answer.value is not None and isinstance(settings := answer.value[step], Mapping):
        # The settings are needed even if the engine is not installed: profiles with equal settings are one method.
        return settings
    if info.unavailable or answer is None:
        return Answer(Status.UNAVAILABLE, info.unavailable)
    if answer.value is None:
        return Answer(answer.status, f"query of its settings: {answer.reason}")
    return Answer(Status.FAILED, str(answer.value[step]))


def _query_all(tasks: Sequence[SettingsTask], runner: TaskRunner) -> Iterator[tuple[SettingsTask, Answer[_Settings]]]:
    yield from zip(tasks, runner.run_each(tasks), strict=True)
