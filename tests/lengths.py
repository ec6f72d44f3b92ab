"""What `make test` tries of many, and what `make test-long` tries besides."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import Any

import pytest

from carom.scenes import all_scenes


def long_after(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values to parametrise by, of which all but the first are long; those of several names are tuples."""
    return [
        value if k < count else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long)
        for k, value in enumerate(values)
    ]


def by_group(*groups: str) -> list[Any]:
    """Return all scenes that have a name to parametrise by, a list for each group; three of four of some are long."""
    found = list[Any]()
    for group, of_group in groupby(all_scenes().values(), lambda entry: entry.group):
        entries = list(of_group)
        short = entries[::4] if group in groups else entries
        found.append(pytest.param(short, id=group))
        if rest := [entry for entry in entries if entry not in short]:
            found.append(pytest.param(rest, id=f"{group}, the others", marks=pytest.mark.long))
    return found
