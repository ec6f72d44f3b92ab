"""Rows of many that `make test` tries, and those that `make release-check` adds."""

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


def long_until(count: int, values: Iterable[Any]) -> list[Any]:
    """Return values to parametrise by, of which the first `count` are long and the others are for a release."""
    several = list(values)
    first = [value if isinstance(value, tuple) else (value,) for value in several[:count]]
    return [*(pytest.param(*row, marks=pytest.mark.long) for row in first), *release_after(0, several[count:])]


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


def each(names: str, values: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run a test with each of these values, as `pytest.mark.parametrize` does, but as one test: for many quick rows.

    Every row runs, and each row that fails is reported with its values. Values with marks, such as those of
    `release_after`, are one more test for each set of marks. The test is skipped if all its rows are skipped. Each row
    has a folder and a `monkeypatch` of its own.
    """
    wanted = names.replace(" ", "").split(",")
    rows = dict[tuple[str, ...], list[tuple[Any, ...]]]()
    marks = dict[tuple[str, ...], Any]()
    for value in values:
        marked = (
            value if isinstance(value, type(pytest.param())) else pytest.param(*(value if wanted[1:] else (value,)))
        )
        assert len(marked.values) == len(wanted)
        key = tuple(mark.name for mark in marked.marks)
        marks[key] = marked.marks
        rows.setdefault(key, []).append(tuple(marked.values))
    assert rows

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def run_rows(**fixtures: Any) -> None:
            skipped, failed = list[BaseException](), list[BaseException]()
            for k, row in enumerate(own := fixtures.pop(of_marks, rows.get((), []))):
                arguments = dict(zip(wanted, row, strict=True))
                try:
                    with pytest.MonkeyPatch.context() as patch:
                        if "monkeypatch" in fixtures:
                            arguments["monkeypatch"] = patch
                        if "tmp_path" in fixtures:
                            arguments["tmp_path"] = fixtures["tmp_path"] / str(k)
                            arguments["tmp_path"].mkdir()
                        test(**{**fixtures, **arguments})
                except pytest.skip.Exception as exception:
                    skipped.append(exception)
                except (Exception, pytest.fail.Exception, BaseExceptionGroup) as exception:  # noqa: BLE001 - reported after the last row
                    exception.add_note(f"with {dict(zip(wanted, row, strict=True))}")
                    failed.append(exception)
            if failed[1:]:
                raise BaseExceptionGroup(f"{len(failed)} of {len(own)} rows fail", failed)
            for error in failed or (skipped if len(skipped) == len(own) else []):
                raise error

        of_marks = f"rows_of_{'_'.join(wanted)}"
        signature = inspect.signature(test)
        left = [parameter for name, parameter in signature.parameters.items() if name not in wanted]
        assert len(left) == len(signature.parameters) - len(wanted)
        if marked := any(rows):
            left.append(inspect.Parameter(of_marks, inspect.Parameter.KEYWORD_ONLY))
        run_rows.__signature__ = signature.replace(parameters=left)  # type: ignore[attr-defined] # what pytest reads
        batches = [pytest.param(rows[key], id="-".join(key) or "quick", marks=marks[key]) for key in rows]
        return pytest.mark.parametrize(of_marks, batches)(run_rows) if marked else run_rows

    return decorate
