"""Releases stand in the order of their numbers, and those that are asked for are taken."""

from __future__ import annotations

import pytest

from carom.errors import CaromError
from carom.studies.history.releases import in_order, selected

LISTED = ("10.0.0", "2.3.1.post1", "2.3.1", "3.0.0", "3.0.0rc1", "2.10", "0.0.0-50223ff-20240729")


def test_releases_are_ordered_by_their_numbers() -> None:
    """10 comes after 3, a candidate before its release, and a mended packaging after it."""
    ordered = ("0.0.0-50223ff-20240729", "2.3.1", "2.3.1.post1", "2.10", "3.0.0rc1", "3.0.0", "10.0.0")
    assert in_order(LISTED) == ordered


@pytest.mark.parametrize(
    ("asked", "most", "found"),
    [
        (None, 2, ("3.0.0", "10.0.0")),
        (None, 9, ("2.3.1", "2.3.1.post1", "2.10", "3.0.0", "10.0.0")),
        ([">=2.10"], 9, ("2.10", "3.0.0", "10.0.0")),
        ([">=2.4,<10"], 9, ("2.10", "3.0.0")),
        ([">2.10", "<=10"], 9, ("3.0.0", "10.0.0")),
        (["2.3.1..3"], 9, ("2.3.1", "2.3.1.post1", "2.10", "3.0.0")),
        (["2.3.1..3"], 1, ("3.0.0",)),
        (["3.0.0rc1"], 9, ("3.0.0rc1",)),
        (["3.0.0rc1", ">=10"], 1, ("3.0.0rc1", "10.0.0")),
        (["latest"], 9, ("10.0.0",)),
        (["latest,2.10"], 9, ("2.10", "10.0.0")),
        (["10.0.0, 2.3.1"], 1, ("2.3.1", "10.0.0")),
        ([">11"], 9, ()),
    ],
)
def test_conditions_and_names_select(asked: list[str] | None, most: int, found: tuple[str, ...]) -> None:
    """Conditions must all be met, the newest of what meets them are taken, and what is named is taken besides."""
    assert selected(LISTED, asked, most) == found


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("2.3.2", "no release '2.3.2' is listed; did you mean '2.3.1'"),
        ("--index-url=x", "a version must begin with a digit"),
        (">=x", "a version must begin with a digit"),
        ("1..--x", "a version must begin with a digit"),
        ("1 2", "a version must begin with a digit"),
        ("1;2", "a version must begin with a digit"),
    ],
)
def test_what_is_no_release_is_refused(word: str, told: str) -> None:
    """A version that is not listed is named with the nearest; what a client could take for an option is no version."""
    with pytest.raises(CaromError, match=told):
        selected(LISTED, [word], 3)
