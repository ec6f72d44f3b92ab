"""Finds scenes of the catalogue by names and patterns."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from functools import cache
from itertools import chain
from types import MappingProxyType, ModuleType

from carom.catalogue.bug_reports.bug_report import load_bug_reports
from carom.catalogue.entry import CatalogueScene, KnownAnswer, list_scenes
from carom.catalogue.groups import (
    classics_collinear,
    classics_many_discs,
    classics_two_discs,
    classics_walled,
    contact,
    contact_damping,
    driven,
    engines,
    gravity,
    paper,
    spin,
    tables,
)
from carom.errors import InputError, UnknownNameError
from carom.model.scene import Scene
from carom.support.escaping import format_value

#: Modules whose scenes run by default, and modules whose scenes run only if the user names them. Reports list the
#: scenes in this order.
_SUITE = (paper, classics_two_discs, classics_walled, classics_collinear, classics_many_discs, gravity)
_ON_REQUEST = (spin, tables, driven, contact_damping, contact, engines)


def _list_scenes_of(modules: Iterable[ModuleType]) -> Iterator[CatalogueScene]:
    return chain.from_iterable(map(list_scenes, modules))


@cache
def catalogue() -> Mapping[str, CatalogueScene]:
    """Return the scenes that run by default (the suite), by full name, in the order of reports."""
    return MappingProxyType({entry.name: entry for entry in _list_scenes_of(_SUITE)})


@cache
def all_scenes() -> Mapping[str, CatalogueScene]:
    """Return all scenes by name: scenes that run by default, and groups that run only if the user names them."""
    entries = [*catalogue().values(), *load_bug_reports(), *_list_scenes_of(_ON_REQUEST)]
    return MappingProxyType({entry.name: entry for entry in entries})


def find_scenes(patterns: Iterable[str]) -> list[CatalogueScene]:
    """Return each scene that matches one of the patterns, in the order of the patterns.

    Args:
        patterns: Full names, groups, or shell patterns such as ``paper/*``.

    Raises:
        UnknownNameError: A pattern matches no scene; the message contains the nearest name.
    """
    matching: dict[str, CatalogueScene] = {}
    for pattern in patterns:
        # Scenes that do not run by default are searched only if no other scene matches, because loading them takes
        # milliseconds.
        matches = _list_matches(catalogue(), pattern) or _list_matches(all_scenes(), pattern)
        if not matches:
            raise UnknownNameError(f"no scene is named {pattern!r}", hints=[_format_hint(pattern)])
        matching.update((entry.name, entry) for entry in matches)
    return list(matching.values())


def resolve_scenes(scenes: Iterable[Scene | CatalogueScene | str]) -> tuple[tuple[Scene, ...], dict[str, KnownAnswer]]:
    """Look up names in the catalogue.

    Return all scenes, and the known answers of those scenes that are from the catalogue. The known answers have the
    scenes' names as keys.

    Raises:
        InputError: The list of scenes is empty, or two scenes have the same name.
    """
    if isinstance(scenes, Scene | CatalogueScene | str) or not isinstance(scenes, Iterable):
        raise InputError(f"scenes must be a list, even for a single item, got {type(scenes).__name__}")
    found = [find_scenes([scene]) if isinstance(scene, str) else [scene] for scene in scenes]
    entries = list(chain.from_iterable(found))
    for k, entry in enumerate(entries):
        if not isinstance(entry, Scene | CatalogueScene):
            raise InputError(f"scenes[{k}] must be a Scene, a catalogue scene or its name, got {format_value(entry)}")
    answers = {entry.name: entry.known for entry in entries if isinstance(entry, CatalogueScene)}
    plain = tuple(entry.scene if isinstance(entry, CatalogueScene) else entry for entry in entries)
    if not plain:
        raise InputError("no scene to run")
    names = [scene.name for scene in plain]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"two scenes have the name {twice[0]!r}: names must be unique")
    return plain, answers


def scene_named(name: str) -> Scene:
    """Return the scene with a full name.

    Raises:
        UnknownNameError: No scene has this name. The message contains the nearest name, or the scenes that a pattern
            matches.
    """
    if (entry := catalogue().get(name) or all_scenes().get(name)) is not None:
        return entry.scene
    several = ", ".join(match.name for match in find_scenes([name]))
    raise UnknownNameError(f"{name!r} is not the name of a single scene", hints=[f"it matches: {several}"])


def _list_matches(scenes: Mapping[str, CatalogueScene], pattern: str) -> list[CatalogueScene]:
    return [entry for entry in scenes.values() if _is_match(entry, pattern)]


def _is_match(entry: CatalogueScene, pattern: str) -> bool:
    if entry.name not in catalogue() and not pattern.startswith(entry.group):
        return False  # patterns such as `*` select only scenes that run by default
    return fnmatchcase(entry.name, pattern) or entry.group == pattern


def _format_hint(pattern: str) -> str:
    entries = all_scenes().values()
    # Names are also compared without their groups, because the user may have given no group or a wrong one.
    suggestions = {
        candidate: entry.name for entry in entries for candidate in (entry.name, entry.name.partition("/")[2])
    }
    suggestions |= {group: group for group in {entry.group for entry in entries}}
    near = difflib.get_close_matches(pattern, suggestions, n=1, cutoff=0.6)
    return f"did you mean {suggestions[near[0]]!r}?" if near else "`carom scenes` lists them"
