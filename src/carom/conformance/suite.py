"""Plan of the suite: adapters, their cases, and known failures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from carom.conformance.adapter_under_test import Subject
from carom.conformance.cases import Case, list_cases
from carom.conformance.known_failures import FILE_NAME, KnownFailuresFile, load_known_failures
from carom.engines.registry import ENTRY_POINT_GROUP, EngineInfo, distribution_of, list_adapter_points, resolve_engine
from carom.errors import InputError, UnknownNameError
from carom.execution.describe_engines import describe_engines
from carom.execution.methods import DEFAULT_PROFILES
from carom.execution.pool import Pool
from carom.execution.shared_options import LimitOptions

ALL = "all"


@dataclass(frozen=True)
class EnginePlan:
    """The cases of one adapter.

    Attributes:
        info: Description of the engine.
        subject: The adapter; None if its engine is unavailable for the reason that `info` contains.
        cases: Cases of the adapter; empty if the engine is unavailable.
    """

    info: EngineInfo
    subject: Subject | None
    cases: tuple[Case, ...]


@dataclass(frozen=True)
class Suite:
    """Adapters to test, and their known failures.

    Attributes:
        engines: The adapters.
        known_failures: The file of known failures.
    """

    engines: tuple[EnginePlan, ...]
    known_failures: KnownFailuresFile


def make_suite(
    engine_names: Sequence[str],
    profiles: Sequence[str],
    known_file: Path | None,
    folders: Sequence[Path],
    limits: LimitOptions,
) -> Suite:
    """Plan the suite. No engine is imported.

    Args:
        engine_names: Values of ``--carom-engine``.
        profiles: Values of ``--carom-profile``: names of profiles, or ``all``. The default is
            `carom.execution.methods.DEFAULT_PROFILES`.
        known_file: The file of known failures; None to use the first such file in `folders`.
        folders: pytest's root directory, and the working directory. The two folders can differ: if the value of an
            option is the name of a folder, pytest uses this folder as its root.
        limits: Limits of the engines' processes.

    Raises:
        CaromError: A name is unknown, an adapter can't be loaded, or the file of known failures is invalid.
    """
    planned, everything = [], dict[str, str]()
    with limits.open_pool() as pool:
        infos = select_engines(engine_names, pool)
    for info in infos:
        if info.unavailable:
            planned.append(EnginePlan(info, None, ()))
        else:
            subject = Subject(info.name, limits)
            of_engine = tuple(list_cases(subject))
            run_profiles = info.profiles if ALL in profiles else info.own_profiles(profiles or DEFAULT_PROFILES)
            # The file may also list cases of profiles that are not run, so the names of all cases are needed.
            everything |= {f"{info.name}::{case.name}": case.skip for case in of_engine}
            chosen = tuple(case for case in of_engine if not case.profile or case.profile in run_profiles)
            planned.append(EnginePlan(info, subject, chosen))
    there_are = dict.fromkeys(name for info in infos for name in info.profiles)
    for name in profiles:
        if there_are and name != ALL and not any(info.own_profiles([name]) for info in infos):
            raise InputError(f"--carom-profile: no profile {name!r}; there are: {', '.join(there_are)}, or {ALL!r}")
    if known_file is None:
        known_file = next((path for folder in folders if (path := folder / FILE_NAME).is_file()), None)
    versions = {plan.info.name: plan.info.version for plan in planned if plan.subject is not None}
    file = KnownFailuresFile(known_file, load_known_failures(known_file) if known_file else (), versions)
    file.check_names(everything, list_adapter_points())
    return Suite(tuple(planned), file)


def select_engines(engine_names: Sequence[str], pool: Pool) -> list[EngineInfo]:
    """Return the adapters that the values of ``--carom-engine`` select, without duplicates.

    Args:
        engine_names: Names of adapters, or of distributions or packages that contain adapters; paths of manifests; or
            ``all``.
        pool: Pool that queries the adapters; the caller closes it.

    Raises:
        UnknownNameError: A value selects no adapter.
        InputError: An adapter that is selected by its name is unavailable.
        AdapterError: A manifest can't be read.
    """
    engine_names = [resolve_engine(name) for name in engine_names]
    points = list_adapter_points()
    chosen: dict[str, None] = {}
    for value in engine_names:
        selected = [value] if value in points else [name for name in points if _contains(value, name)]
        if not selected:
            known = ", ".join(f"{name} ({distribution_of(name)})" for name in sorted(points))
            raise UnknownNameError(
                f"{value!r} is not the name of an adapter, or of its distribution or package; there are: {known}. "
                f"If you have added an entry point to {ENTRY_POINT_GROUP!r}, install its package again"
            )
        chosen |= dict.fromkeys(selected)
    infos = {info.name: info for info in describe_engines([*chosen], pool)}
    for name in chosen:
        if infos[name].unavailable and name in engine_names:
            raise InputError(f"{name}: {infos[name].unavailable}")
    return [infos[name] for name in chosen]


def _contains(owner: str, adapter_name: str) -> bool:
    """Whether `owner` is ``all``, or the name of the package or distribution that contains an adapter."""
    package = list_adapter_points()[adapter_name].module.partition(".")[0]
    return owner in (ALL, package) or _normalize_name(distribution_of(adapter_name)) == _normalize_name(owner)


def _normalize_name(name: str) -> str:
    """Return the name of a distribution, normalised by PEP 503."""
    return re.sub(r"[-_.]+", "-", name).lower()
