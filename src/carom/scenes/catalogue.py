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
from carom.scenes.paper import paper

if TYPE_CHECKING:
    from collections.abc import Mapping

    from carom.scenes.known_answer import CatalogueScene

__all__ = ["catalogue", "find_scenes"]


@cache
def catalogue() -> Mapping[str, CatalogueScene]:
    """Return every scene of the catalogue by its full name, in the order in which reports list them."""
    return MappingProxyType({entry.name: entry for entry in (*paper(), *classics())})


def find_scenes(patterns: Iterable[str]) -> list[CatalogueScene]:
    """Return the scenes that match any of the patterns: full names, groups, or shell patterns such as ``paper/*``.

    Raises:
        UnknownNameError: A pattern matches no scene; the message names the nearest one.
    """
    everything = catalogue()
    found: dict[str, CatalogueScene] = {}
    for pattern in patterns:
        matches = [entry for entry in everything.values() if fnmatchcase(entry.name, pattern) or entry.group == pattern]
        if not matches:
            near = difflib.get_close_matches(pattern, everything, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}?" if near else "`carom scenes` lists them"
            raise UnknownNameError(f"no scene is named {pattern!r}; {hint}")
        found.update((entry.name, entry) for entry in matches)
    return list(found.values())
