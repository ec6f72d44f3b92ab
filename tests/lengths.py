"""What `make test` tries of many, and what `make test-long` tries besides."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from carom.scenes import all_scenes


def long_after(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values to parametrise by, of which all but the first are long; those of several names are tuples."""
    return [
        value if k < count else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long)
        for k, value in enumerate(values)
    ]


def sampled(*groups: str) -> list[Any]:
    """Return all scenes that have a name to parametrise by, of which in some groups three of four are long."""
    entries = enumerate(all_scenes().values())
    return [
        pytest.param(entry, id=entry.name, marks=[pytest.mark.long] * (entry.group in groups and k % 4 > 0))
        for k, entry in entries
    ]
