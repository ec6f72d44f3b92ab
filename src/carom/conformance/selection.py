"""Which adapters ``--carom-engine`` means: one by its name, or all of a distribution or a package."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import metadata

from carom.errors import InputError, UnknownNameError
from carom.registry import ENTRY_POINT_GROUP, EngineInfo, engines

__all__ = ["ALL", "selected_engines"]

ALL = "all"


def selected_engines(wanted: Sequence[str]) -> list[EngineInfo]:
    """Return the adapters that the words mean, each once.

    Args:
        wanted: Names of adapters, of distributions, of the packages that entry points lead to, or ``all``.

    Raises:
        UnknownNameError: A word means none of these.
        InputError: An adapter asked for by its own name is unavailable.
    """
    infos = engines()
    packages = _packages()
    chosen: dict[str, EngineInfo] = {}
    for word in wanted:
        named = [info for info in infos if info.name == word]
        if named and named[0].unavailable:
            raise InputError(f"{word}: {named[0].unavailable}")
        found = named or [
            info
            for info in infos
            if word == ALL
            or _normal(info.distribution) == _normal(word)
            or packages.get(info.name, "").partition(".")[0] == word
        ]
        if not found:
            known = ", ".join(f"{info.name} ({info.distribution})" for info in infos)
            raise UnknownNameError(
                f"no adapter, and no distribution or package with one, is named {word!r}; there are: {known}. "
                f"A new entry point in {ENTRY_POINT_GROUP!r} needs its package to be installed again"
            )
        chosen.update((info.name, info) for info in found)
    return list(chosen.values())


def _packages() -> dict[str, str]:
    packages: dict[str, str] = {}
    for point in metadata.entry_points(group=ENTRY_POINT_GROUP):
        packages.setdefault(point.name, point.value.partition(":")[0])
    return packages


def _normal(name: str) -> str:
    """Return a distribution's name as it is compared: PEP 503."""
    return re.sub(r"[-_.]+", "-", name).lower()
