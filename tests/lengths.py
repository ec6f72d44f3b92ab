"""Rows of many that `make test` tries, and those that `make release-check` adds."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from itertools import groupby
from typing import Any

import pytest

from carom.catalogue import all_scenes


def release_after(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values, or tuples of values, to parametrise by; those after the first `count` are for a release."""
    return [
        value
        if k < count
        else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.release)
        for k, value in enumerate(values)
    ]


def by_group(*groups: str) -> list[Any]:
    """Return the catalogue's scenes to parametrise by, a list a group; of `groups`, three of four are for a release."""
    found = list[Any]()
    for group, of_group in groupby(all_scenes().values(), lambda entry: entry.group):
        entries = list(of_group)
        short = entries[::4] if group in groups else entries
        found.append(pytest.param(short, id=group))
        if rest := [entry for entry in entries if entry not in short]:
            found.append(pytest.param(rest, id=f"{group}, the others", marks=pytest.mark.release))
    return found


def each(names: str | tuple[str, ...], values: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run a test with each of these values, as `pytest.mark.parametrize` does, but as one test: for many quick ones.

    The error names the failing row. A test that is skipped with every value is skipped.
    """
    several = len(wanted := names if isinstance(names, tuple) else tuple(names.replace(" ", "").split(","))) > 1
    rows = list[tuple[Any, ...]]()
    for value in values:
        if isinstance(value, type(pytest.param())):
            assert not value.marks
            rows.append(tuple(value.values))
        else:
            rows.append(tuple(value) if several else (value,))
    assert rows
    assert all(len(row) == len(wanted) for row in rows)

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def tried(**fixtures: Any) -> None:
            skipped = list[BaseException]()
            for row in rows:
                told = dict(zip(wanted, row, strict=True))
                try:
                    test(**fixtures, **told)
                except pytest.skip.Exception as exception:
                    skipped.append(exception)
                except BaseException as exception:
                    exception.add_note(f"with {told}")
                    raise
            if len(skipped) == len(rows):
                raise skipped[0]

        signature = inspect.signature(test)
        left = [parameter for name, parameter in signature.parameters.items() if name not in wanted]
        assert len(left) == len(signature.parameters) - len(wanted)
        tried.__signature__ = signature.replace(parameters=left)  # type: ignore[attr-defined] # what pytest reads
        return tried

    return decorate
