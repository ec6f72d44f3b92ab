"""Update of the file of known failures after a run: new failures are added, and passing cases are removed."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import tomli_w

from carom.conformance.known_failures import KnownFailure
from carom.errors import InputError
from carom.support.escaping import visible
from carom.support.folders import write_file

#: Beginning of a new entry's reason. The user replaces this text.
TO_BE_WRITTEN = "reason: to be written"

#: First line of an entry, with the comment lines directly above it.
_HEAD = re.compile(r"(?:^#.*\n)*^[ \t]*\[\[[ \t]*known_failure[ \t]*\]\]", re.MULTILINE)
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class WrittenFailures:
    """Changes to the file of known failures.

    Attributes:
        added: Added cases.
        dropped: Removed cases.
        without_reason: Cases in the file whose reason is not yet written.
    """

    added: tuple[str, ...]
    dropped: tuple[str, ...]
    without_reason: tuple[str, ...]


def write_known_failures(
    path: Path,
    entries: Sequence[KnownFailure],
    failed: Mapping[str, str],
    passed: Collection[str],
    versions: Mapping[str, str],
    platform: str,
) -> WrittenFailures:
    """Update the file of known failures, and return the changes.

    Unchanged entries keep their text and the comments directly above them. Reasons are kept. New failures are added at
    the end, with one entry for each kind of failure. A case that the file lists only for other releases or platforms is
    added for this release and platform.

    Args:
        path: The file, which may not exist yet.
        entries: Entries of the file.
        failed: Message of each failed case that is not listed for this release and platform.
        passed: Listed cases that passed.
        versions: Version of each tested engine, by adapter name.
        platform: This platform.

    Raises:
        InputError: The file can't be read or written.
    """
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
    except OSError as error:
        raise InputError(f"{path}: can't be read: {error.strerror}") from None
    before, chunks = _parted(text, entries)
    kept = [_without(entry, passed, versions, platform) for entry in entries]
    stay = [
        (entry, chunk if entry == old else f"{_comments(chunk)}{_rendered(entry)}")
        for old, entry, chunk in zip(entries, kept, chunks, strict=True)
        if entry.cases
    ]
    joined = list(_joining(failed, entries, versions, platform))
    wanted = [*(entry for entry, _ in stay), *joined]
    parts = [before, *(chunk for _, chunk in stay), *map(_rendered, joined)]
    new = "\n\n".join(part.strip() for part in parts if part.strip()) + "\n"
    if _read(new) != [_table(entry) for entry in wanted]:
        new = "\n".join(map(_rendered, wanted))  # an unusual form of TOML is rewritten and loses its comments
    if failed or passed:
        write_file(path, new)
    bare = (name for entry in wanted if entry.reason.startswith(TO_BE_WRITTEN) for name in entry.cases)
    return WrittenFailures(tuple(failed), tuple(sorted(passed)), tuple(bare))


def _parted(text: str, entries: Sequence[KnownFailure]) -> tuple[str, list[str]]:
    """Return the text before the first entry, and each entry's text."""
    heads = [found.start() for found in _HEAD.finditer(text)]
    if len(heads) != len(entries):
        return "", [_rendered(entry) for entry in entries]
    if not heads:
        return text, []
    ends = [*heads[1:], len(text)]
    return text[: heads[0]], [text[a:b] for a, b in zip(heads, ends, strict=True)]


def _comments(chunk: str) -> str:
    return "".join(line for line in chunk[: chunk.index("[[")].splitlines(keepends=True) if line.startswith("#"))


def _without(entry: KnownFailure, passed: Collection[str], versions: Mapping[str, str], platform: str) -> KnownFailure:
    """Return an entry without its passing cases, if the entry is valid for this release and platform."""
    stay = [
        name
        for name in entry.cases
        if name not in passed or not entry.applies(versions[name.partition("::")[0]], platform)
    ]
    return entry if len(stay) == len(entry.cases) else replace(entry, cases=tuple(stay))


def _joining(
    failed: Mapping[str, str], entries: Sequence[KnownFailure], versions: Mapping[str, str], platform: str
) -> Iterator[KnownFailure]:
    """Yield an entry for each kind of failure with its cases.

    Failures are of one kind if their messages differ only in numbers.
    """
    elsewhere = {name for entry in entries for name in entry.cases}
    groups: dict[tuple[str, str, bool], list[str]] = {}
    for name, what in failed.items():
        engine = name.partition("::")[0]
        groups.setdefault((engine, _NUMBER.sub("#", what), name in elsewhere), []).append(name)
    for (engine, _, scoped), names in groups.items():
        entry = KnownFailure(f"{TO_BE_WRITTEN}; {visible(failed[names[0]])}", tuple(names))
        yield replace(entry, versions=versions[engine], platform=platform) if scoped else entry


def _table(entry: KnownFailure) -> dict[str, object]:
    table = {"reason": entry.reason, "versions": entry.versions, "platform": entry.platform}
    return {name: value for name, value in table.items() if value} | {"cases": list(entry.cases)}


def _read(text: str) -> list[dict[str, object]]:
    """Parse the entries of a text as tables like those of `_table`."""
    tables = tomllib.loads(text).get("known_failure", [])
    return [{**one, "reason": one["reason"].strip()} for one in tables]


def _rendered(entry: KnownFailure) -> str:
    return f"[[known_failure]]\n{tomli_w.dumps(_table(entry))}"
