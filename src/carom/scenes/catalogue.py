"""All scenes of the catalogue, by name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from fnmatch import fnmatchcase
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from carom.errors import UnknownNameError
from carom.scenes.classics import classics
from carom.scenes.gravity import gravity
from carom.scenes.known_answer import Tag
from carom.scenes.paper import paper

if TYPE_CHECKING:
    from collections.abc import Mapping

    from carom.scenes.known_answer import CatalogueScene

__all__ = ["catalogue", "find_scenes"]

_TAG_PREFIX = "tag:"


@cache
def catalogue() -> Mapping[str, CatalogueScene]:
    """Return every scene of the catalogue by its full name, in the order in which reports list them."""
    return MappingProxyType({entry.name: entry for entry in (*paper(), *classics(), *gravity())})


def find_scenes(patterns: Iterable[str]) -> list[CatalogueScene]:
    """Return the scenes that match any of the patterns, each once, in the order of the patterns.

    Args:
        patterns: Full names, groups, shell patterns such as ``paper/*``, or tags such as ``tag:walls``.

    Raises:
        UnknownNameError: A pattern matches no scene; the message names the nearest one.
    """
    everything = catalogue()
    found: dict[str, CatalogueScene] = {}
    for pattern in patterns:
        matches = [entry for entry in everything.values() if _matches(entry, pattern)]
        if not matches:
            raise UnknownNameError(f"no scene is named {pattern!r}; {_hint(pattern)}")
        found.update((entry.name, entry) for entry in matches)
    return list(found.values())


def _matches(entry: CatalogueScene, pattern: str) -> bool:
    if pattern.startswith(_TAG_PREFIX):
        return pattern.removeprefix(_TAG_PREFIX) in entry.tags
    return fnmatchcase(entry.name, pattern) or entry.group == pattern


def _hint(pattern: str) -> str:
    entries = catalogue().values()
    # A bare name, without its group, is near to its own full name whatever the lengths of the groups.
    named = {candidate: entry.name for entry in entries for candidate in (entry.name, entry.name.partition("/")[2])}
    named |= {group: group for group in {entry.group for entry in entries}}
    named |= {f"{_TAG_PREFIX}{tag}": f"{_TAG_PREFIX}{tag}" for tag in Tag}
    near = difflib.get_close_matches(pattern, named, n=1, cutoff=0.5)
    return f"did you mean {named[near[0]]!r}?" if near else "`carom scenes` lists them"
