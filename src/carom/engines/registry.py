"""Finds adapters by entry point, and reads metadata alone. What they declare `execution.engines` asks in a worker."""

from __future__ import annotations

import importlib.util
import inspect
import os
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.engines.api import Adapter, Capabilities, Engine, Knob
from carom.errors import AdapterError, UnknownNameError
from carom.support.escaping import is_older, named_hints

if TYPE_CHECKING:
    from carom.engines.protocol.adapter import ProgramAdapter

ENTRY_POINT_GROUP = "carom.adapters"
#: Environment variable of manifests that are known as entry points are: files, or folders with one, as in a PATH.
MANIFESTS = "CAROM_ENGINES"


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
        knobs: Settings that may be searched, and how far, by name.
        install: The command that installs the engine; empty where it needs none.
        code: Whether the adapter can write its settings as code of the engine's own.
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
    knobs: Mapping[str, Knob] = field(default_factory=dict)
    install: str = ""
    code: bool = False

    @property
    def available(self) -> bool:
        """Whether scenes can be run on this engine here."""
        return not self.unavailable

    @property
    def missing(self) -> bool:
        """Whether the engine is not installed here, though its adapter is, and declares what the engine can do."""
        return not self.available and self.capabilities is not None


@dataclass(frozen=True)
class AdapterPoint:
    """Where an adapter is found: an entry point, or the manifest of an engine that is a program.

    Attributes:
        name: Name of the adapter.
        value: The object, as the entry point names it, or the manifest's file.
        distribution: The distribution that brought it; empty where there is none, or it does not tell its name.
        manifest: Whether it is a manifest.
        broken: What is wrong with the entry point as it is written; empty where nothing is.
    """

    name: str
    value: str
    distribution: str = ""
    manifest: bool = False
    broken: str = ""

    @property
    def module(self) -> str:
        """The module of an entry point; empty for a manifest."""
        return "" if self.manifest else self.value.partition(":")[0]

    def load(self) -> object:
        """Return the adapter; this imports its module, or reads its manifest."""
        if self.broken:
            raise AdapterError(self.broken)
        if self.manifest:
            return _program(self.value)
        return metadata.EntryPoint(self.name, self.value, ENTRY_POINT_GROUP).load()


@cache
def _program(manifest: str) -> ProgramAdapter:
    """Return the adapter of a manifest, the same one each time: it keeps its program running for the next world."""
    from carom.engines.protocol.adapter import program_adapter

    return program_adapter(manifest)


def _manifest_name(path: Path) -> str:
    """Return the name that a manifest gives its engine, or, of one that can't be read, its folder's or its own."""
    from carom.engines.protocol.manifest import MANIFEST, load_manifest

    try:
        return load_manifest(path).name
    except AdapterError:
        return path.resolve().parent.name if path.name == MANIFEST else path.stem


@cache
def adapter_points() -> Mapping[str, AdapterPoint]:
    """Return where each adapter is found, by its name; nothing is imported or started.

    Raises:
        AdapterError: A manifest has the name of another adapter, or is not named by its whole path.
    """
    found: dict[str, AdapterPoint] = {}
    for distribution in metadata.distributions():
        for point in _points_of(distribution):
            found.setdefault(point.name, point)
    for word in filter(None, os.environ.get(MANIFESTS, "").split(os.pathsep)):
        path = _manifest_in(Path(word))
        if not path.is_absolute():  # a worker process has a working folder of its own
            raise AdapterError(f"{MANIFESTS} must hold absolute paths, got {word!r}")
        name = _manifest_name(path)
        if name in found:
            raise AdapterError(f"{path} names its engine {name!r}, and so does {found[name].value}")
        found[name] = AdapterPoint(name, str(path), manifest=True)
    return found


def _points_of(distribution: metadata.Distribution) -> list[AdapterPoint]:
    """Return the adapters of a distribution; one whose entry points can't be read is named by where it lies."""
    try:
        points = distribution.entry_points.select(group=ENTRY_POINT_GROUP)
    except Exception as error:  # noqa: BLE001 - whatever a file that anybody can have spoilt makes of its readers
        where = str(distribution.locate_file(""))
        broken = f"the entry points of a distribution there can't be read, install it again: {type(error).__name__}"
        return [AdapterPoint(where, where, broken=f"{broken}: {error}")]
    name = _name_of(distribution) if points else ""  # reads a file
    return [
        AdapterPoint(
            point.name,
            point.value,
            name,
            broken=""
            if point.pattern.match(point.value)
            else f"an entry point must name an object, as module:object, got {point.value!r}",
        )
        for point in points
    ]


def _name_of(distribution: metadata.Distribution) -> str:
    try:
        return distribution.name or ""
    except Exception:  # noqa: BLE001 - as above
        return ""


def _manifest_in(path: Path) -> Path:
    from carom.engines.protocol.manifest import MANIFEST

    return path / MANIFEST if path.is_dir() else path


def resolve_engine(word: str) -> str:
    """Return the name of an engine that is asked for by name or by its manifest, which is then known.

    Worker processes of this machine know it, too, since they inherit the environment.

    Args:
        word: A name, a manifest, or a folder with one; a path has a slash, ends in ``.toml``, or is ``.`` or ``..``.

    Raises:
        AdapterError: The manifest is not there, or is none, or has the name of another engine.
    """
    if not (word.endswith(".toml") or "/" in word or os.sep in word or word in {os.curdir, os.pardir}):
        return word
    from carom.engines.protocol.manifest import load_manifest

    path = _manifest_in(Path(word)).resolve()
    name = load_manifest(path).name
    known = os.environ.get(MANIFESTS, "")
    if path not in [_manifest_in(Path(one)).resolve() for one in known.split(os.pathsep) if one]:
        os.environ[MANIFESTS] = os.pathsep.join(filter(None, (known, str(path))))
        adapter_points.cache_clear()
        adapter_points()
    return name


def engine_argument(name: str) -> str:
    """Return the word by which anybody can ask for an engine: its manifest where it has one, else its name."""
    point = adapter_points().get(name)
    return point.value if point is not None and point.manifest else name


def distribution_of(name: str) -> str:
    """Return the name of the distribution that brought an adapter; empty where there is none."""
    return adapter_points()[name].distribution


def require_profile(engine: str, profile: str, known: Collection[str]) -> None:
    """Refuse a profile that is none of those that an engine has.

    Raises:
        UnknownNameError: With the near one, and which it has.
    """
    if profile not in known:
        hints = named_hints(profile, known, f"it has: {', '.join(known)}")
        raise UnknownNameError(f"{engine} has no profile {profile!r}", hints=hints)


def require_named(name: str) -> None:
    """Refuse a name that no adapter has.

    Raises:
        UnknownNameError: With the names that there are.
    """
    if name not in adapter_points():
        there_are = ", ".join(sorted(adapter_points())) or "none"
        hints = named_hints(name, adapter_points(), f"there are: {there_are}")
        raise UnknownNameError(f"no engine is named {name!r}", hints=hints)


def load_adapter(name: str) -> Adapter:
    """Return the adapter of this name: code of its author's is run by it, so that this is for worker processes.

    Raises:
        UnknownNameError: No adapter has the name.
        AdapterError: Its entry point can't be loaded, or what it holds is no adapter.
    """
    require_named(name)
    point = adapter_points()[name]
    try:
        adapter: Any = point.load()
        is_adapter = isinstance(adapter, Adapter)  # runs the adapter's properties, on some versions of Python
    except AdapterError:  # a manifest's says where and what
        raise
    except Exception as error:
        message = f"the adapter {name!r} can't be loaded from {point.value}: {type(error).__name__}: {error}"
        raise AdapterError(message) from error
    if not is_adapter:
        parts = ("name", "engine", "capabilities", "profiles", "prepare")
        missing = [part for part in parts if not has_part(adapter, part)]
        for part in set(parts) - set(missing):  # `isinstance` takes a property's AttributeError for its absence
            try:
                getattr(adapter, part)
            except AttributeError as error:
                raise AdapterError(f"{point.value}: its {part} failed: AttributeError: {error}") from error
        raise AdapterError(f"{point.value} is no adapter: it has no {', '.join(missing) or 'prepare to call'}")
    found: Adapter = adapter
    return found


def has_part(thing: object, part: str) -> bool:
    """Return whether an object has an attribute, also where reading it ends in an AttributeError of something else."""
    try:
        inspect.getattr_static(thing, part)
    except AttributeError:
        return hasattr(thing, part)  # by its `__getattr__`
    return True


def unavailable_reason(engine: Engine) -> str:
    """Return why the engine can't be used here, empty where it can; it is looked for, not imported.

    It is not installed, or older than what its adapter drives.
    """
    try:
        found = not engine.module or importlib.util.find_spec(engine.module) is not None
    except (ImportError, ValueError):  # the package that a dotted name lies in is missing, or has no spec
        found = False
    if found:
        return _too_old(engine) if engine.oldest else ""
    reason = f"{engine.module} is not installed"
    here = sys.version_info[:2]
    if engine.no_wheel_from and here >= engine.no_wheel_from:
        newest = "{}.{}".format(*engine.no_wheel_from)
        reason += f", and {engine.name} has no wheel for CPython {newest} and later (this is {here[0]}.{here[1]})"
    return f"{reason}; {engine.install}" if engine.install else reason


def _too_old(engine: Engine) -> str:
    """Return why the installed release can't be used; empty where it can, or where nothing tells which it is."""
    installed = _installed(engine.distribution)
    if not (installed and is_older(installed, engine.oldest)):
        return ""
    reason = f"{engine.name} {installed} is older than {engine.oldest}, the oldest release that its adapter drives"
    return f"{reason}; {engine.install}" if engine.install else reason


@cache  # every run of a worker asks, and reading it takes as long as some runs
def _installed(distribution: str) -> str:
    """Return which release of a distribution is installed; empty where none is, or there is no name to ask for."""
    try:
        return metadata.version(distribution)
    except (metadata.PackageNotFoundError, ValueError):
        return ""


def why_unavailable(adapter: Adapter) -> str:
    """Return why an adapter's engine can't be used here, by its module or by the adapter itself; empty where it can.

    An adapter may have a method ``unavailable()`` for what no module tells: a program that is missing, a licence.
    """
    own = getattr(adapter, "unavailable", None)
    return unavailable_reason(adapter.engine) or (str(own()) if callable(own) else "")


def version_of(adapter: Adapter, adapter_distribution: str) -> str:
    """Return the version of an engine: in its adapter's own words, or by its distribution.

    An adapter may have a method ``version()`` where the engine is not a distribution of Python's. An engine that has
    neither a module nor such a method is a part of its adapter, and has its version.
    """
    own = getattr(adapter, "version", None)
    if callable(own):
        return str(own()) or "unknown"
    engine = adapter.engine
    return _installed(engine.distribution or ("" if engine.module else adapter_distribution)) or "unknown"
