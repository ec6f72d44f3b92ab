"""Rows that grow while what was given out of them stays."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from carom.model.trace import SPIN_DTYPE
from carom.solvers.rows import Rows


@given(st.lists(st.integers(0, 9), max_size=30))
def test_rows_are_those_added_and_what_was_given_out_stays(sizes: list[int]) -> None:
    """However many come at a time: all rows in their order, read-only, and earlier answers as they were."""
    rows, numbers, given_out = Rows(SPIN_DTYPE), np.arange(4.0 * sum(sizes)).view(SPIN_DTYPE), []
    at = 0
    for size in sizes:
        rows.add(numbers[at : at + size].copy())
        at += size
        assert len(rows) == at
        given_out.append(rows.array())
        assert not given_out[-1].flags.writeable
    for found in given_out:
        assert found.tobytes() == numbers[: len(found)].tobytes()


def test_looking_often_copies_each_row_once_or_twice() -> None:
    """A log of a thousand rows, looked at after each, has moved its memory ten times, not a thousand."""
    rows, given_out = Rows(SPIN_DTYPE), []
    for _ in range(1000):
        rows.add(np.zeros(1, SPIN_DTYPE))
        given_out.append(rows.array())  # kept, so that no place is used twice
    assert len({found.ctypes.data for found in given_out}) <= 11


def test_the_first_rows_are_not_copied() -> None:
    """A run that is looked at once gives out the very memory that it was written into."""
    rows, first = Rows(SPIN_DTYPE), np.zeros(5, SPIN_DTYPE)
    rows.add(first)
    assert rows.array().ctypes.data == first.ctypes.data
