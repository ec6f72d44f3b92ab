"""Finds adapters by entry point, and reads metadata alone. What they declare `carom.runs.engines` asks in a worker."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata

from carom.adapter import Adapter, Capabilities, Engine
from carom.errors import AdapterError, UnknownNameError

__all__ = [
    "ENTRY_POINT_GROUP",
    "EngineInfo",
    "adapter_points",
    "distribution_of",
    "load_adapter",
    "require_named",
    "unavailable_reason",
    "version_of",
]

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
        located: Names of the profiles whose steps are cut.
        own: What the engine can do with a profile that does not go by `capabilities`, by its name.
    """

    name: str
    engine: str
    version: str
    unavailable: str
    capabilities: Capabilities | None
    profiles: Mapping[str, str]
    distribution: str
    located: frozenset[str] = frozenset()
    own: Mapping[str, Capabilities] = field(default_factory=dict)

    @property
    def available(self) -> bool:
        """Whether scenes can be run on this engine here."""
        return not self.unavailable


@cache
def adapter_points() -> Mapping[str, metadata.EntryPoint]:
    """Return the entry point of each adapter that is installed, by its name; nothing is imported."""
    found: dict[str, metadata.EntryPoint] = {}
    for point in metadata.entry_points(group=ENTRY_POINT_GROUP):
        found.setdefault(point.name, point)
    return found


def distribution_of(name: str) -> str:
    """Return the name of the distribution that brought an adapter; empty where that is not known."""
    point = adapter_points()[name]
    return point.dist.name if point.dist else ""


def require_named(name: str) -> None:
    """Refuse a name that no adapter has.

    Raises:
        UnknownNameError: With the names that there are.
    """
    if name not in adapter_points():
        raise UnknownNameError(
            f"no engine is named {name!r}; there are: {', '.join(sorted(adapter_points())) or 'none'}"
        )


def load_adapter(name: str) -> Adapter:
    """Return the adapter of this name: code of its author's is run by it, so that this is for worker processes.

    Raises:
        UnknownNameError: No adapter has the name.
        AdapterError: Its entry point can't be loaded, or what it holds is no adapter.
    """
    require_named(name)
    point = adapter_points()[name]
    try:
        adapter: Adapter = point.load()
        is_adapter = isinstance(adapter, Adapter)  # runs the adapter's properties, on some versions of Python
    except Exception as error:
        message = f"the adapter {name!r} can't be loaded from {point.value}: {type(error).__name__}: {error}"
        raise AdapterError(message) from error
    if not is_adapter:
        missing = [
            part for part in ("name", "engine", "capabilities", "profiles", "prepare") if not hasattr(adapter, part)
        ]
        raise AdapterError(f"{point.value} is no adapter: it has no {', '.join(missing) or 'prepare to call'}")
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


def version_of(engine: Engine, adapter_distribution: str) -> str:
    """Return the version of an engine, or of the distribution of its adapter where it has none of its own."""
    try:
        return metadata.version(engine.distribution or adapter_distribution)
    except (metadata.PackageNotFoundError, ValueError):  # not installed, or no name to ask for
        return "unknown"
