"""Known failures: a file of their author's, each with a reason, and strict: what no longer fails must leave it.

::

    [[known_failure]]
    reason = "the engine shrinks a contact by its margin; example.org/issues/12"
    versions = ">=7,<8"
    platform = "linux-aarch64"
    cases = ["penalty::velocities[default-classics/graze]"]

An entry without `versions` holds of each release of the engine, one without `platform` everywhere.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from carom.errors import InputError
from carom.support.checks import shown
from carom.support.data_files import read_data
from carom.support.escaping import named_hints, near, release_numbers
from carom.support.versions import version_conditions

FILE_NAME = "carom-known-failures.toml"

_FIELDS = ("reason", "versions", "platform", "cases")

#: What `sys.platform` and `platform.machine()` say, in small letters, where Carom's workers run: they need POSIX.
_SYSTEMS = ("linux", "darwin", "freebsd")
_MACHINES = ("x86_64", "amd64", "i686", "aarch64", "arm64", "armv7l", "ppc64le", "riscv64", "s390x", "loongarch64")


@dataclass(frozen=True)
class KnownFailure:
    """An entry of the file.

    Attributes:
        reason: Why its cases fail.
        cases: Their full names.
        versions: Releases of the engine for which it holds, such as ">=7,<8"; empty for all.
        platform: Platform for which it holds, such as "linux" or "linux-aarch64"; empty for all.
    """

    reason: str
    cases: tuple[str, ...]
    versions: str = ""
    platform: str = ""

    def applies(self, version: str, platform_: str) -> bool:
        """Return whether the entry holds of a release, on a platform.

        Raises:
            InputError: It depends on the release, and the engine tells of none.
        """
        if self.platform and self.platform not in (platform_, platform_.partition("-")[0]):
            return False
        if not self.versions:
            return True
        if not version[:1].isdigit():
            raise InputError(f"versions = {self.versions!r} can't be judged: the engine's version is {shown(version)}")
        numbers = release_numbers(version)
        return all(condition(numbers) for condition in version_conditions(self.versions))


def here() -> str:
    """Return this platform as an entry names it."""
    return f"{sys.platform.rstrip('0123456789')}-{platform.machine()}".lower()


def load_known_failures(path: Path) -> tuple[KnownFailure, ...]:
    """Return the entries of a file, in its order.

    Raises:
        InputError: The file can't be read or is not of the form above; the message names the entry.
    """
    try:
        data = read_data(path, ".toml")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    entries = data.pop("known_failure", [])
    if data:
        raise InputError(f"{path}: {shown(next(iter(data)))} is unknown; there is [[known_failure]]")
    if not isinstance(entries, list):
        raise InputError(f"{path}: known_failure must be a list of tables, each under [[known_failure]]")
    found: list[KnownFailure] = []
    seen: set[tuple[str, str, str]] = set()
    for number, data_of_entry in enumerate(entries, start=1):
        where = f"{path}: known_failure {number}"
        entry = _entry(data_of_entry, where)
        for name in entry.cases:
            if (place := (name, entry.versions, entry.platform)) in seen:
                raise InputError(f"{where}: {shown(name)} is listed twice")
            seen.add(place)
        found.append(entry)
    return tuple(found)


def _entry(entry: object, where: str) -> KnownFailure:
    if not isinstance(entry, dict):
        raise InputError(f"{where}: must be a table with `reason` and `cases`, got {shown(entry)}")
    unknown = sorted(set(entry) - set(_FIELDS))
    if unknown:
        raise InputError(f"{where}: {shown(unknown[0])} is unknown; there are: {', '.join(_FIELDS)}")
    reason, names = entry.get("reason"), entry.get("cases")
    if not (isinstance(reason, str) and reason.strip()):
        raise InputError(f"{where}: reason must be a sentence that says why, got {shown(reason)}")
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise InputError(f"{where}: cases must be a list of names such as 'penalty::energy[tuned]', got {shown(names)}")
    versions = _versions(entry["versions"], where) if "versions" in entry else ""
    place = _platform(entry["platform"], where) if "platform" in entry else ""
    return KnownFailure(reason.strip(), tuple(names), versions, place)


def _versions(value: object, where: str) -> str:
    try:
        if isinstance(value, str):
            version_conditions(value)
            return value
    except InputError as error:
        raise InputError(f"{where}: versions: {error}") from None
    raise InputError(f"{where}: versions must be a range such as '>=7,<8', got {shown(value)}")


def _platform(value: object, where: str) -> str:
    system, dash, machine = value.partition("-") if isinstance(value, str) else ("", "", "")
    for part, names in ((system, _SYSTEMS), *([(machine, _MACHINES)] if dash else [])):
        if part not in names:
            raise InputError(
                f"{where}: platform must be a system, or a system and a machine, such as 'linux-aarch64', "
                f"got {shown(value)}",
                hints=named_hints(part, names, f"there are: {', '.join(names)}; this is {here()}"),
            )
    return f"{system}{dash}{machine}"


def known_reasons(
    entries: Iterable[KnownFailure], versions: Mapping[str, str], platform_: str, path: Path
) -> dict[str, str]:
    """Return the reason of each known failure, by the full name of its case, of these releases on this platform.

    Args:
        entries: Entries of the file.
        versions: Version of each engine that is run, by the adapter's name; entries of others are let be.
        platform_: The platform, as `here` names it.
        path: The file.

    Raises:
        InputError: Two entries hold of one case, or one that depends on the release can't be judged.
    """
    found: dict[str, str] = {}
    for number, entry in enumerate(entries, start=1):
        for name in entry.cases:
            engine = name.partition("::")[0]
            try:
                if engine not in versions or not entry.applies(versions[engine], platform_):
                    continue
            except InputError as error:
                raise InputError(f"{path}: known_failure {number}: {error}") from None
            if name in found:
                raise InputError(
                    f"{path}: known_failure {number}: {shown(name)} is listed twice for release {versions[engine]} "
                    f"on {platform_}"
                )
            found[name] = entry.reason
    return found


def check_names(
    entries: Iterable[KnownFailure],
    known: Collection[str],
    names: Collection[str],
    skipped: Mapping[str, str],
    installed: Collection[str],
    path: Path,
) -> None:
    """Check that the names of a file are names of cases.

    Args:
        entries: Entries of the file.
        known: Names of those that hold here.
        names: Full names of all cases of the engines that are run.
        skipped: Those of them that a declared capability excludes, with the reason.
        installed: Names of all engines; a case of one that is not run is ignored.
        path: The file.

    Raises:
        InputError: A name is not that of a case, or the case is skipped and so cannot fail.
    """
    run = {name.partition("::")[0] for name in names}
    for name in (name for entry in entries for name in entry.cases):
        engine = name.partition("::")[0]
        if engine in installed and engine not in run:
            continue
        if name not in names:
            hint = near(name, names) or "`pytest --carom-engine NAME --collect-only -q` lists them"
            raise InputError(f"{path}: there is no case {shown(name)}", hints=[hint])
        if name in skipped and name in known:
            raise InputError(f"{path}: {name!r} can't fail, it is skipped: {skipped[name]}", hints=["take it out"])
