"""What `make test` tries of many, and what `make test-long` tries besides."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def long_after(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values to parametrise by, of which all but the first are long; those of several names are tuples."""
    return [
        value if k < count else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.long)
        for k, value in enumerate(values)
    ]
