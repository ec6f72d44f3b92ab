"""Finds adapters by entry point. Listing them imports no engine."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata

from carom.adapter import Adapter, Capabilities, Engine
from carom.errors import AdapterError, UnknownNameError

__all__ = ["ENTRY_POINT_GROUP", "EngineInfo", "chosen_engines", "engines", "load_adapter", "unavailable_reason"]

ENTRY_POINT_GROUP = "carom.adapters"


@dataclass(frozen=True)
class EngineInfo:
    """What is known of an adapter without importing its engine.

    Attributes:
        name: Name of the adapter, the one given to ``--engine``.
        engine: Name of the engine.
        version: Version of the engine's distribution; empty where it is unavailable.
        unavailable: Why the engine can't be used here; empty where it can.
        capabilities: What it declares; None where its adapter can't be loaded.
        profiles: Its profiles with their descriptions.
        distribution: The distribution that brought the adapter.
    """

    name: str
    engine: str
    version: str
    unavailable: str
    capabilities: Capabilities | None
    profiles: Mapping[str, str]
    distribution: str

    @property
    def available(self) -> bool:
        """Whether scenes can be run on this engine here."""
        return not self.unavailable


@cache
def _entry_points() -> dict[str, metadata.EntryPoint]:
    found: dict[str, metadata.EntryPoint] = {}
    for point in metadata.entry_points(group=ENTRY_POINT_GROUP):
        found.setdefault(point.name, point)
    return found


def _require_named(name: str, names: Iterable[str]) -> None:
    if name not in names:
        raise UnknownNameError(f"no engine is named {name!r}; there are: {', '.join(names) or 'none'}")


def load_adapter(name: str) -> Adapter:
    """Return the adapter of this name.

    Raises:
        UnknownNameError: No adapter has the name.
        AdapterError: Its entry point can't be loaded, or what it holds is no adapter.
    """
    points = _entry_points()
    _require_named(name, sorted(points))
    try:
        adapter: Adapter = points[name].load()
        is_adapter = isinstance(adapter, Adapter)  # runs the adapter's properties, on some versions of Python
    except Exception as error:
        message = f"the adapter {name!r} can't be loaded from {points[name].value}: {type(error).__name__}: {error}"
        raise AdapterError(message) from error
    if not is_adapter:
        missing = [
            part for part in ("name", "engine", "capabilities", "profiles", "prepare") if not hasattr(adapter, part)
        ]
        raise AdapterError(f"{points[name].value} is no adapter: it has no {', '.join(missing)}")
    return adapter


def unavailable_reason(engine: Engine) -> str:
    """Return why the engine can't be imported here, empty where it can; it is looked for, not imported."""
    try:
        found = not engine.module or importlib.util.find_spec(engine.module) is not None
    except (ImportError, ValueError):  # the package that a dotted name lies in is missing, or has no spec
        found = False
    if found:
        return ""
    reason = f"{engine.module} is not installed"
    here = sys.version_info[:2]
    if engine.no_wheel_from and here >= engine.no_wheel_from:
        newest = "{}.{}".format(*engine.no_wheel_from)
        reason += f", and {engine.name} has no wheel for CPython {newest} and later (this is {here[0]}.{here[1]})"
    return f"{reason}; {engine.install}" if engine.install else reason


def _version(engine: Engine, adapter_distribution: str) -> str:
    try:
        return metadata.version(engine.distribution or adapter_distribution)
    except (metadata.PackageNotFoundError, ValueError):  # not installed, or no name to ask for
        return "unknown"


def _describe(name: str, distribution: str) -> EngineInfo:
    adapter = load_adapter(name)
    try:
        reason = unavailable_reason(adapter.engine)
        if not adapter.profiles:
            raise ValueError("it has no profiles")
        return EngineInfo(
            name=name,
            engine=adapter.engine.name,
            version="" if reason else _version(adapter.engine, distribution),
            unavailable=reason,
            capabilities=adapter.capabilities,
            profiles={key: profile.description for key, profile in adapter.profiles.items()},
            distribution=distribution,
        )
    except Exception as error:
        message = f"the adapter {name!r} can't describe itself: {type(error).__name__}: {error}"
        raise AdapterError(message) from error


def engines() -> list[EngineInfo]:
    """Return every adapter that is installed, Carom's own two first, with why an engine is unavailable where it is."""
    infos = []
    for name, point in _entry_points().items():
        distribution = point.dist.name if point.dist else ""
        try:
            infos.append(_describe(name, distribution))
        except AdapterError as error:
            infos.append(EngineInfo(name, name, "", str(error), None, {}, distribution))
    # Methods that need no engine of their own come first, then the alphabet; the order is that of every table.
    return sorted(infos, key=lambda info: (bool(info.engine != "Carom"), info.name))


def chosen_engines(names: Sequence[str] | None) -> list[EngineInfo]:
    """Return what is known of the engines of these names, or of all.

    Raises:
        UnknownNameError: There is no such engine.
    """
    infos = engines()
    for name in names or ():
        _require_named(name, [info.name for info in infos])
    return [info for info in infos if names is None or info.name in names]
