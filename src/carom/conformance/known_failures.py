"""Known failures: a file of cases that fail, each with a reason.

A listed case that passes must be removed from the file. ::

    [[known_failure]]
    reason = "the engine shrinks a contact by its margin; example.org/issues/12"
    versions = ">=7,<8"
    platform = "linux-aarch64"
    cases = ["penalty::velocities[default-classics/graze]"]

An entry without `versions` applies to all releases of the engine. An entry without `platform` applies to all platforms.
"""

from __future__ import annotations

import platform
import re
import sys
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import tomli_w

from carom.errors import InputError
from carom.support.data_files import read_data
from carom.support.escaping import build_name_hints, escape_controls, format_value, parse_release_numbers, suggest_name
from carom.support.folders import write_file
from carom.support.versions import parse_version_conditions

FILE_NAME = "carom-known-failures.toml"

_FIELDS = ("reason", "versions", "platform", "cases")

#: Values of `sys.platform` on the POSIX systems that Carom supports.
_SYSTEMS = ("linux", "darwin", "freebsd")
_MACHINES = ("x86_64", "amd64", "i686", "aarch64", "arm64", "armv7l", "ppc64le", "riscv64", "s390x", "loongarch64")


@dataclass(frozen=True)
class KnownFailure:
    """An entry of the file.

    Attributes:
        reason: Reason why the cases fail.
        cases: Full names of the cases.
        versions: Releases of the engine to which the entry applies, such as ">=7,<8"; empty for all releases.
        platform: Platform to which the entry applies, such as "linux" or "linux-aarch64"; empty for all platforms.
    """

    reason: str
    cases: tuple[str, ...]
    versions: str = ""
    platform: str = ""

    def is_valid_for(self, version: str, platform_: str) -> bool:
        """Return whether the entry applies to this release of the engine on this platform.

        Raises:
            InputError: The entry depends on the release, but the engine's version is unknown.
        """
        if self.platform and self.platform not in (platform_, platform_.partition("-")[0]):
            return False
        if not self.versions:
            return True
        if not version[:1].isdigit():
            why = f"the engine's version is {format_value(version)}"
            raise InputError(f"versions = {self.versions!r} can't be compared with the installed version: {why}")
        numbers = parse_release_numbers(version)
        return all(condition(numbers) for condition in parse_version_conditions(self.versions))


def find_platform_name() -> str:
    """Return the name of this platform as entries write it, such as "linux-aarch64"."""
    return f"{sys.platform.rstrip('0123456789')}-{platform.machine()}".lower()


def load_known_failures(path: Path) -> tuple[KnownFailure, ...]:
    """Return the entries of a file, in the order of the file.

    Raises:
        InputError: The file can't be read or an entry is invalid. The message names the entry.
    """
    try:
        data = read_data(path, ".toml")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    entries = data.pop("known_failure", [])
    if data:
        raise InputError(f"{path}: {format_value(next(iter(data)))} is unknown: only [[known_failure]] is allowed")
    if not isinstance(entries, list):
        raise InputError(f"{path}: known_failure must be a list of tables, each under [[known_failure]]")
    found: list[KnownFailure] = []
    listed: set[tuple[str, str, str]] = set()
    for number, data_of_entry in enumerate(entries, start=1):
        location = f"{path}: known_failure {number}"
        entry = _parse_entry(data_of_entry, location)
        for name in entry.cases:
            if (place := (name, entry.versions, entry.platform)) in listed:
                raise InputError(f"{location}: {format_value(name)} is listed twice")
            listed.add(place)
        found.append(entry)
    return tuple(found)


def _parse_entry(entry: object, location: str) -> KnownFailure:
    if not isinstance(entry, dict):
        raise InputError(f"{location}: must be a table with `reason` and `cases`, got {format_value(entry)}")
    unknown = sorted(set(entry) - set(_FIELDS))
    if unknown:
        raise InputError(f"{location}: {format_value(unknown[0])} is unknown; there are: {', '.join(_FIELDS)}")
    reason, names = entry.get("reason"), entry.get("cases")
    if not (isinstance(reason, str) and reason.strip()):
        raise InputError(f"{location}: reason must be a sentence, got {format_value(reason)}")
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        problem = "cases must be a list of names such as 'penalty::energy[tuned]'"
        raise InputError(f"{location}: {problem}, got {format_value(names)}")
    versions = _parse_versions(entry["versions"], location) if "versions" in entry else ""
    place = _parse_platform(entry["platform"], location) if "platform" in entry else ""
    return KnownFailure(reason.strip(), tuple(names), versions, place)


def _parse_versions(value: object, location: str) -> str:
    try:
        if isinstance(value, str):
            parse_version_conditions(value)
            return value
    except InputError as error:
        raise InputError(f"{location}: versions: {error}") from None
    raise InputError(f"{location}: versions must be a range such as '>=7,<8', got {format_value(value)}")


def _parse_platform(value: object, location: str) -> str:
    system, dash, machine = value.partition("-") if isinstance(value, str) else ("", "", "")
    for part, names in ((system, _SYSTEMS), *([(machine, _MACHINES)] if dash else [])):
        if part not in names:
            problem = "platform must be a system, or a system and a machine, such as 'linux-aarch64'"
            hint = f"there are: {', '.join(names)}; this is {find_platform_name()}"
            hints = build_name_hints(part, names, hint)
            raise InputError(f"{location}: {problem}, got {format_value(value)}", hints=hints)
    return f"{system}{dash}{machine}"


#: Beginning of the reason in a new entry. The user must replace this text by the actual reason.
TO_BE_WRITTEN = "reason: to be written"

#: First line of an entry, with the comment lines directly above it.
_HEAD = re.compile(r"(?:^#.*\n)*^[ \t]*\[\[[ \t]*known_failure[ \t]*\]\]", re.MULTILINE)
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class KnownFailuresFile:
    """The file of known failures in a run of the suite.

    Attributes:
        path: The file; None if there is none.
        entries: Entries of the file.
        versions: Version of each tested engine, by adapter name. Entries of other engines are ignored.
        platform: The platform, as returned by `find_platform_name`.
    """

    path: Path | None
    entries: tuple[KnownFailure, ...]
    versions: Mapping[str, str]
    platform: str = field(default_factory=find_platform_name)

    @cached_property
    def reasons(self) -> dict[str, str]:
        """Known failures of the tested engines on this platform: names of cases, each with its reason.

        Raises:
            InputError: The same case is in two entries that apply, or an entry depends on an unknown version.
        """
        found: dict[str, str] = {}
        for number, entry in enumerate(self.entries, start=1):
            for name in entry.cases:
                try:
                    if not self._is_valid(entry, name):
                        continue
                except InputError as error:
                    raise InputError(f"{self.path}: known_failure {number}: {error}") from None
                if name in found:
                    scope = f"for release {self._find_version(name)} on {self.platform}"
                    problem = f"{format_value(name)} is listed twice {scope}"
                    raise InputError(f"{self.path}: known_failure {number}: {problem}")
                found[name] = entry.reason
        return found

    def check_names(self, names: Mapping[str, str], installed: Collection[str]) -> None:
        """Check that all names in the file are names of cases.

        Args:
            names: For each case of the tested engines, by its full name: the reason why the declared capabilities
                exclude the case. The reason is empty if the capabilities allow the case.
            installed: Names of all installed engines. Cases of engines that are not tested are ignored.

        Raises:
            InputError: A name is not the name of a case, or the case is skipped and so can't fail. `reasons` can also
                raise this error.
        """
        reasons, run = self.reasons, {name.partition("::")[0] for name in names}
        for name in (name for entry in self.entries for name in entry.cases):
            engine = name.partition("::")[0]
            if engine in installed and engine not in run:
                continue
            if name not in names:
                hint = suggest_name(name, names) or "`pytest --carom-engine NAME --collect-only -q` lists them"
                raise InputError(f"{self.path}: there is no case {format_value(name)}", hints=[hint])
            if names[name] and name in reasons:
                problem = f"{name!r} can't fail, because it is skipped"
                raise InputError(f"{self.path}: {problem}: {names[name]}", hints=["remove it"])

    def write(self, path: Path, failed: Mapping[str, str], passed: Collection[str]) -> list[str]:
        """Update a file of known failures, and return the cases that still need a reason from the user.

        Unchanged entries keep their text and the comments directly above them. New failures are added at the end of the
        file, with one entry for each kind of failure. If the file already lists the case for another release or
        platform, the new entry is limited to this release and platform.

        Args:
            path: The file, which may not exist yet.
            failed: Messages of failed cases that the file does not list for this release and platform, by the case's
                name.
            passed: Names of the listed cases that passed.

        Raises:
            InputError: The file can't be read or written.
        """
        try:
            text = path.read_text(encoding="utf-8") if path.is_file() else ""
        except OSError as error:
            raise InputError(f"{path}: can't be read: {error.strerror}") from None
        before, chunks = _split_entries(text, self.entries)
        updated = [self._drop_passing_cases(entry, passed) for entry in self.entries]
        stay = [
            (entry, chunk if entry == old else f"{_extract_comments(chunk)}{_render_entry(entry)}")
            for old, entry, chunk in zip(self.entries, updated, chunks, strict=True)
            if entry.cases
        ]
        joined = list(self._build_new_entries(failed))
        all_entries = [*(entry for entry, _ in stay), *joined]
        parts = [before, *(chunk for _, chunk in stay), *map(_render_entry, joined)]
        new = "\n\n".join(part.strip() for part in parts if part.strip()) + "\n"
        if _parse_entries(new) != [_build_table(entry) for entry in all_entries]:
            # The whole file is rewritten without comments if the text of single entries can't be found.
            new = "\n".join(map(_render_entry, all_entries))
        if failed or passed:
            write_file(path, new)
        return [name for entry in all_entries if entry.reason.startswith(TO_BE_WRITTEN) for name in entry.cases]

    def _find_version(self, name: str) -> str | None:
        """Return the version of the engine of a case; None if the engine is not tested."""
        return self.versions.get(name.partition("::")[0])

    def _is_valid(self, entry: KnownFailure, name: str) -> bool:
        version = self._find_version(name)
        return version is not None and entry.is_valid_for(version, self.platform)

    def _drop_passing_cases(self, entry: KnownFailure, passed: Collection[str]) -> KnownFailure:
        """Return an entry without the cases that passed. Don't change an entry for another release or platform."""
        cases = tuple(name for name in entry.cases if name not in passed or not self._is_valid(entry, name))
        return replace(entry, cases=cases)

    def _build_new_entries(self, failed: Mapping[str, str]) -> Iterator[KnownFailure]:
        """Yield an entry for each kind of failure, with all cases that fail in this way.

        Two failures are of the same kind if their messages differ only in numbers.
        """
        elsewhere = {name for entry in self.entries for name in entry.cases}
        groups: dict[tuple[str, str, bool], list[str]] = {}
        for name, message in failed.items():
            engine = name.partition("::")[0]
            groups.setdefault((engine, _NUMBER.sub("#", message), name in elsewhere), []).append(name)
        for (engine, _, scoped), names in groups.items():
            entry = KnownFailure(f"{TO_BE_WRITTEN}; {escape_controls(failed[names[0]])}", tuple(names))
            yield replace(entry, versions=self.versions[engine], platform=self.platform) if scoped else entry


def _split_entries(text: str, entries: Sequence[KnownFailure]) -> tuple[str, list[str]]:
    """Return the text before the first entry, and each entry's text."""
    heads = [found.start() for found in _HEAD.finditer(text)]
    if len(heads) != len(entries):
        return "", [_render_entry(entry) for entry in entries]
    if not heads:
        return text, []
    ends = [*heads[1:], len(text)]
    return text[: heads[0]], [text[a:b] for a, b in zip(heads, ends, strict=True)]


def _extract_comments(chunk: str) -> str:
    return "".join(line for line in chunk[: chunk.index("[[")].splitlines(keepends=True) if line.startswith("#"))


def _build_table(entry: KnownFailure) -> dict[str, object]:
    table = {"reason": entry.reason, "versions": entry.versions, "platform": entry.platform}
    return {name: value for name, value in table.items() if value} | {"cases": list(entry.cases)}


def _parse_entries(text: str) -> list[dict[str, object]]:
    """Parse a text, and return its entries as tables."""
    tables = tomllib.loads(text).get("known_failure", [])
    return [{**one, "reason": one["reason"].strip()} for one in tables]


def _render_entry(entry: KnownFailure) -> str:
    return f"[[known_failure]]\n{tomli_w.dumps(_build_table(entry))}"
