"""Queries the declarations of adapters in worker processes, since an adapter is third-party code.

Only the adapters that a command needs are queried. Adapters of one distribution share a process, since starting a
process takes longer than a query. If an adapter hangs, ends its process or declares something invalid, the adapter is
reported as unavailable, with the reason. Other adapters are not affected.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from carom.engines.api import CodedAdapter
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
from carom.execution.exception_text import describe_exception
from carom.execution.job import PIT_METHOD, AdapterTask, Status
from carom.execution.pool import LocalPool, Pool, TaskRunner
from carom.execution.validate_adapter import to_plain_text, validate_adapter
from carom.support.display import Shown
from carom.support.escaping import format_value


@dataclass(frozen=True)
class DescribeTask(AdapterTask):
    """Queries the declarations of the adapter `name`, in the worker process of the adapter `engine`."""

    name: str

    def carry_out(self) -> EngineInfo:
        """Return the description of the adapter.

        Raises:
            AdapterError: The adapter can't be loaded, or a declaration is invalid.
        """
        adapter, distribution = load_adapter(self.name), distribution_of(self.name)
        try:
            engine, capabilities, profiles, knobs = validate_adapter(adapter)
            reason = to_plain_text(explain_unavailable_adapter(adapter), "unavailable()")
            version = to_plain_text(find_version(adapter, distribution), "version()")
        except AdapterError:
            raise
        except Exception as error:
            message = f"the adapter {self.name!r} can't describe itself: {describe_exception(error)}"
            raise AdapterError(message) from error
        return EngineInfo(
            name=self.name,
            engine=engine.name,
            version="" if reason else version,
            unavailable=reason,
            capabilities=capabilities,
            profiles={name: to_plain_text(profile.description, "a description") for name, profile in profiles.items()},
            distribution=distribution,
            located=frozenset(name for name, profile in profiles.items() if profile.located),
            own={name: profile.capabilities for name, profile in profiles.items() if profile.capabilities is not None},
            knobs=knobs,
            install=to_plain_text(engine.install, "engine.install"),
            code=isinstance(adapter, CodedAdapter) and callable(adapter.code),
        )


#: Descriptions that this process has queried, by the adapter's name and entry point. Failed queries are repeated.
_KNOWN: dict[tuple[str, str], EngineInfo] = {}


class EngineList(Shown, list[EngineInfo]):
    """List of engine descriptions, printed with one line for each engine."""


def engines(names: Sequence[str] | None = None) -> EngineList:
    """Return descriptions of engines, queried in worker processes.

    Args:
        names: Names of adapters; by default all installed adapters.

    Raises:
        InputError: `names` is not a list.
        UnknownNameError: There is no such engine.

    Examples:
        >>> [info.name for info in carom.engines(["pic", "pit"])]
        ['pic', 'pit']
    """
    if isinstance(names, str) or not (names is None or isinstance(names, Iterable)):
        raise InputError(f"names must be a list, even for a single item, got {format_value(names)}")
    with LocalPool() as pool:
        return describe_engines(names, pool)


def describe_engines(names: Sequence[str] | None, pool: Pool) -> EngineList:
    """Return the descriptions of engines, with PIC and PIT first.

    The description of an unavailable engine contains the reason.

    Args:
        names: Names of adapters; None for all installed adapters.
        pool: Pool that carries out the queries; the caller closes it.

    Raises:
        UnknownNameError: There is no such engine.
    """
    for name in names or ():
        require_named(name)
    all_points = list_adapter_points()
    points = {name: point for name, point in all_points.items() if names is None or name in names}
    # PIT is always queried, because every study compares engines with PIT. A later query of PIT alone would need
    # another pool.
    also = {PIT_METHOD.engine} & all_points.keys()
    todo = [
        name
        for name in (*points, *sorted(also - points.keys()))
        if (info := _KNOWN.get((name, all_points[name].value))) is None or not info.profiles
    ]
    # An adapter that belongs to no distribution, such as one from a manifest, is queried in a process of its own.
    groups = [list(names) for _, names in groupby(sorted(todo, key=_process_key_of), _process_key_of)]
    for group in pool.map_unordered(((names[0], names) for names in groups), _describe):
        _KNOWN.update(((info.name, all_points[info.name].value), info) for info in group)
    infos = [_KNOWN[name, point.value] for name, point in points.items()]
    # Carom's methods come first, then the other engines in alphabetical order. All tables use this order.
    return EngineList(sorted(infos, key=lambda info: (bool(info.engine != "Carom"), info.name)))


def select_engines(infos: Sequence[EngineInfo], names: Sequence[str] | None) -> list[EngineInfo]:
    """Return the engines to run: the requested engines or, if no engine is requested, all installed engines."""
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
        reason = answer.reason if answer.status is Status.FAILED else f"reading its declarations: {answer.problem}"
        yield EngineInfo(name, name, "", reason, None, {}, distribution_of(name))
