"""Order and selection of an engine's releases."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from carom.errors import UnknownNameError
from carom.support.escaping import named_hints, release_numbers
from carom.support.versions import require_version, version_condition

#: Versions that are not marked as alpha, nightly or similar. `post` marks a repaired package of a final release.
_FINAL = re.compile(r"([0-9]+!)?[0-9]+(\.[0-9]+)*(\.post[0-9]+)?")

#: Word for the newest release.
LATEST = "latest"


def is_final(version: str) -> bool:
    """Return whether a version is final: not marked as alpha, nightly or similar."""
    return _FINAL.fullmatch(version) is not None


def in_order(versions: Iterable[str]) -> tuple[str, ...]:
    """Return versions from the oldest to the newest by number, with pre-releases before final releases."""
    return tuple(sorted(set(versions), key=lambda one: (release_numbers(one), is_final(one), _after(one), one)))


def _after(version: str) -> int:
    found = re.search(r"\.post([0-9]+)$", version)
    return int(found[1]) if found else -1


def selected(listed: Sequence[str], asked: Sequence[str] | None, most: int) -> tuple[str, ...]:
    """Return the requested releases, from the oldest to the newest.

    Args:
        listed: All listed releases.
        asked: Versions, "latest", and conditions that must all be met (default: all final releases). A pre-release must
            be named by its version.
        most: Largest number of releases that meet the conditions. The newest ones are used. Named versions are
            additional.

    Raises:
        UnknownNameError: A named version is not listed.
        InputError: A request is neither a version nor a condition.
    """
    words = [word.strip() for text in asked or () for word in text.split(",") if word.strip()]
    if LATEST in words:
        newest = in_order(filter(is_final, listed))[-1:]
        words = [*(word for word in words if word != LATEST), *newest]
    named = [word for word in words if version_condition(word) is None]
    for word in named:
        if require_version(word) not in listed:
            hints = named_hints(word, listed, f"there are: {_shortly(listed)}")
            raise UnknownNameError(f"there is no release {word!r}", hints=hints)
    conditions = [found for word in words if (found := version_condition(word)) is not None]
    able = [
        one
        for one in in_order(filter(is_final, listed))
        if all(condition(release_numbers(one)) for condition in conditions)
    ]
    return in_order([*named, *(able[-most:] if conditions or not named else ())])


def _shortly(listed: Sequence[str]) -> str:
    ordered = in_order(listed)
    return ", ".join(ordered if len(ordered) <= 20 else (*ordered[:3], "...", *ordered[-12:]))
