"""Registry of adapters: finds adapters by entry points and manifests, without importing engines, and loads them."""

from __future__ import annotations

import importlib.util
import inspect
import os
import sys
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from carom.engines.api import Adapter, Capabilities, Engine, Knob
from carom.errors import AdapterError, UnknownNameError
from carom.model.trace import resolve_profile
from carom.support.checks import check_instance
from carom.support.escaping import build_name_hints, is_older

if TYPE_CHECKING:
    from carom.engines.protocol.adapter import ProgramAdapter

ENTRY_POINT_GROUP = "carom.adapters"
#: Environment variable that lists additional manifests, separated as in PATH. Each item is a manifest, or a folder that
#: contains a manifest.
MANIFESTS = "CAROM_ENGINES"


@dataclass(frozen=True)
class EngineInfo:
    """Description of an engine and its adapter. The engine is not imported for this description.

    Attributes:
        name: Name of the adapter, for ``--engine``.
        engine: Name of the engine.
        version: Version of the engine's distribution; empty if the engine is unavailable.
        unavailable: Why the engine can't be used on this machine; empty if it can be used.
        capabilities: Declared capabilities; None if the adapter can't be loaded.
        profiles: Descriptions of the profiles, by name.
        distribution: The distribution that contains the adapter.
        located: Names of the profiles for which Carom shortens steps.
        own: Capabilities of each profile whose capabilities differ from `capabilities`, by the profile's name.
        knobs: Settings that ``carom tune`` may change, with their ranges, by name.
        install: Command that installs the engine; empty if no command is needed.
        code: Whether the adapter can write settings as code of the engine.

    Examples:
        >>> (info,) = carom.engines(["pit"])
        >>> info.available, list(info.profiles)
        (True, ['tuned'])
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

    def own_profiles(self, names: Iterable[str]) -> list[str]:
        """Return the requested profiles that the engine has. An alias is replaced by the profile's name."""
        resolved = dict.fromkeys(resolve_profile(self.name, profile) for profile in names)
        return [profile for profile in resolved if profile in self.profiles]

    @property
    def available(self) -> bool:
        """Whether scenes can be run on this engine on this machine."""
        return not self.unavailable

    @property
    def missing(self) -> bool:
        """Whether the adapter is installed and can be loaded, but its engine is not available on this machine."""
        return not self.available and self.capabilities is not None


class AdapterPoint(NamedTuple):
    """Location of an adapter: an entry point, or the manifest of an engine that is a program.

    Attributes:
        name: Name of the adapter.
        value: The object reference of the entry point, or the path of the manifest.
        distribution: The distribution that contains the adapter; empty if there is no distribution, or if its name
            can't be read.
        manifest: Whether the location is a manifest.
        unreadable: Why the entry points of the distribution can't be read; empty if they can be read.
    """

    name: str
    value: str
    distribution: str = ""
    manifest: bool = False
    unreadable: str = ""

    @property
    def module(self) -> str:
        """The module of an entry point; empty for a manifest."""
        return "" if self.manifest else self.value.partition(":")[0]

    def load(self) -> object:
        """Load the adapter: import its module, or read its manifest."""
        if self.unreadable:
            raise AdapterError(self.unreadable)
        if self.manifest:
            return _load_program(self.value)
        point = metadata.EntryPoint(self.name, self.value, ENTRY_POINT_GROUP)
        if not point.pattern.match(self.value):
            raise AdapterError(f"an entry point must name an object, as module:object, got {self.value!r}")
        return point.load()


@cache
def _load_program(manifest: str) -> ProgramAdapter:
    """Return the adapter of a manifest. The adapter is cached, since its program stays running for the next world."""
    from carom.engines.protocol.adapter import program_adapter

    return program_adapter(manifest)


def _read_manifest_name(path: Path) -> str:
    """Return the name of the engine in a manifest.

    If the manifest can't be read, return the name of its folder or file.
    """
    from carom.engines.protocol.manifest import MANIFEST, load_manifest

    try:
        return load_manifest(path).name
    except AdapterError:
        return path.resolve().parent.name if path.name == MANIFEST else path.stem


@cache
def list_adapter_points() -> Mapping[str, AdapterPoint]:
    """Return the location of each adapter, by name. No adapter is imported, and no program is started.

    Raises:
        AdapterError: A manifest has the name of another adapter, or its path is not absolute.
    """
    points: dict[str, AdapterPoint] = {}
    for distribution in metadata.distributions():
        for point in _list_points(distribution):
            points.setdefault(point.name, point)
    for location in filter(None, os.environ.get(MANIFESTS, "").split(os.pathsep)):
        path = _find_manifest(Path(location))
        if not path.is_absolute():  # a relative path would be wrong in a worker process, which runs in another folder
            raise AdapterError(f"{MANIFESTS} must contain absolute paths, got {location!r}")
        name = _read_manifest_name(path)
        if name in points:
            raise AdapterError(f"{path} names its engine {name!r}, but {points[name].value} already has this name")
        points[name] = AdapterPoint(name, str(path), manifest=True)
    return points


def _list_points(distribution: metadata.Distribution) -> list[AdapterPoint]:
    """Return the adapters of a distribution.

    If the distribution's entry points can't be read, return one adapter. The adapter has the path of the distribution
    as its name, and the reason in `unreadable`.
    """
    try:
        # parse the file only if it can contain adapters, since parsing the files of all distributions takes long
        text = distribution.read_text("entry_points.txt") or ""
        points = distribution.entry_points.select(group=ENTRY_POINT_GROUP) if ENTRY_POINT_GROUP in text else ()
    except Exception as error:  # noqa: BLE001 - a damaged file can cause any exception
        location = str(distribution.locate_file(""))
        problem = f"can't read the entry points of an installed distribution; install it again: {type(error).__name__}"
        return [AdapterPoint(location, location, unreadable=f"{problem}: {error}")]
    name = _read_name(distribution) if points else ""  # read the name only if needed, since the name is in a file
    return [AdapterPoint(point.name, point.value, name) for point in points]


def _read_name(distribution: metadata.Distribution) -> str:
    try:
        return distribution.name or ""
    except Exception:  # noqa: BLE001 - as above
        return ""


def _find_manifest(path: Path) -> Path:
    from carom.engines.protocol.manifest import MANIFEST

    return path / MANIFEST if path.is_dir() else path


def resolve_engine(word: str) -> str:
    """Return the name of an engine, given a name or the path of a manifest. For a path, register the engine.

    Worker processes of this machine inherit the registration through the environment.

    Args:
        word: A name, a manifest, or a folder with a manifest. A path has a slash, ends in ``.toml``, or is ``.`` or
            ``..``.

    Raises:
        InputError: The word is not a string.
        AdapterError: The manifest does not exist, is invalid, or has the name of another engine.
    """
    check_instance("engine", word, str)
    if not (word.endswith(".toml") or "/" in word or os.sep in word or word in {os.curdir, os.pardir}):
        return word
    from carom.engines.protocol.manifest import load_manifest

    path = _find_manifest(Path(word)).resolve()
    name = load_manifest(path).name
    known = os.environ.get(MANIFESTS, "")
    if path not in [_find_manifest(Path(location)).resolve() for location in known.split(os.pathsep) if location]:
        os.environ[MANIFESTS] = os.pathsep.join(filter(None, (known, str(path))))
        list_adapter_points.cache_clear()
        list_adapter_points()
    return name


def format_engine_argument(name: str) -> str:
    """Return a value for ``--engine`` that works in any process: the path of a manifest if there is one, or a name."""
    point = list_adapter_points().get(name)
    return point.value if point is not None and point.manifest else name


def distribution_of(name: str) -> str:
    """Return the name of the distribution that contains an adapter; empty if there is no distribution."""
    return list_adapter_points()[name].distribution


def require_profile(engine: str, profile: str, known: Collection[str]) -> None:
    """Refuse a profile that an engine does not have.

    Raises:
        UnknownNameError: There is no such profile; the hints contain a similar name and all names.
    """
    if resolve_profile(engine, profile) not in known:
        hints = build_name_hints(profile, known, f"it has: {', '.join(known)}")
        raise UnknownNameError(f"{engine} has no profile {profile!r}", hints=hints)


def require_named(name: str) -> None:
    """Refuse a name that no adapter has.

    Raises:
        UnknownNameError: There is no such adapter; the hints contain all names.
    """
    if name not in list_adapter_points():
        there_are = ", ".join(sorted(list_adapter_points())) or "none"
        hints = build_name_hints(name, list_adapter_points(), f"there are: {there_are}")
        raise UnknownNameError(f"no engine is named {name!r}", hints=hints)


def load_adapter(name: str) -> Adapter:
    """Load an adapter. The adapter is third-party code, so call this function only in worker processes.

    Raises:
        UnknownNameError: No adapter has the name.
        AdapterError: The adapter's entry point can't be loaded, or the object is not an adapter.
    """
    require_named(name)
    point = list_adapter_points()[name]
    try:
        adapter: Any = point.load()
        # on some versions of Python, `isinstance` runs the adapter's properties
        is_adapter = isinstance(adapter, Adapter)
    except AdapterError:  # raised for an invalid manifest, with a complete message
        raise
    except Exception as error:
        message = f"the adapter {name!r} can't be loaded from {point.value}: {type(error).__name__}: {error}"
        raise AdapterError(message) from error
    if not is_adapter:
        parts = ("name", "engine", "capabilities", "profiles", "prepare")
        missing = [part for part in parts if not has_part(adapter, part)]
        # `isinstance` treats a property that raises an AttributeError as missing
        for part in set(parts) - set(missing):
            try:
                getattr(adapter, part)
            except AttributeError as error:
                raise AdapterError(f"{point.value}: its {part} failed: AttributeError: {error}") from error
        raise AdapterError(f"{point.value} is not an adapter: it lacks {', '.join(missing) or 'a callable prepare'}")
    found: Adapter = adapter
    return found


def has_part(value: object, part: str) -> bool:
    """Whether an object has an attribute. A property is not read, because reading it could raise an AttributeError."""
    try:
        inspect.getattr_static(value, part)
    except AttributeError:
        return hasattr(value, part)  # finds attributes that `__getattr__` provides
    return True


def explain_unavailable_engine(engine: Engine) -> str:
    """Return why an engine can't be used on this machine (missing or too old); empty if it can be used.

    The engine is not imported.
    """
    try:
        is_installed = not engine.module or importlib.util.find_spec(engine.module) is not None
    # ImportError: the parent package is missing; ValueError: the module has been loaded, but has no spec
    except (ImportError, ValueError):
        is_installed = False
    if is_installed:
        installed = find_installed_release(engine.distribution) if engine.oldest else ""
        if not is_older(installed, engine.oldest):
            return ""
        reason = (
            f"{engine.name} {installed} is older than {engine.oldest}, the oldest release that its adapter supports"
        )
    else:
        reason, version = f"{engine.module} is not installed", sys.version_info[:2]
        if engine.no_wheel_from and version >= engine.no_wheel_from:
            newest, this = ("{}.{}".format(*release) for release in (engine.no_wheel_from, version))
            reason += f", and {engine.name} has no wheel for CPython {newest} and later (this is {this})"
    return f"{reason}; {engine.install}" if engine.install else reason


@cache  # cached, because reading the metadata takes as long as some runs
def find_installed_release(distribution: str) -> str:
    """Return the installed release of a distribution; empty if it is not installed, or the name is empty."""
    try:
        return metadata.version(distribution)
    except (metadata.PackageNotFoundError, ValueError):
        return ""


def explain_unavailable_adapter(adapter: Adapter) -> str:
    """Return why an adapter's engine can't be used on this machine; empty if it can be used.

    An adapter may have a method ``unavailable()`` for reasons other than a missing module, such as a missing program or
    licence.
    """
    method = getattr(adapter, "unavailable", None)
    return explain_unavailable_engine(adapter.engine) or (str(method()) if callable(method) else "")


def find_version(adapter: Adapter, adapter_distribution: str) -> str:
    """Return the version of an engine, from its adapter or its distribution.

    An adapter may have a method ``version()`` if its engine is not a Python distribution. Without this method, an
    engine that has no module and no distribution gets the adapter's version.
    """
    method = getattr(adapter, "version", None)
    if callable(method):
        return str(method()) or "unknown"
    engine = adapter.engine
    return find_installed_release(engine.distribution or ("" if engine.module else adapter_distribution)) or "unknown"
