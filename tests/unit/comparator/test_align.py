"""Edit distance of event sequences: against the full table, and on what can be counted by hand."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from carom.comparator.align import MOST_EDITS, edit_distance

Pairs = list[tuple[int, int]]
EVENTS = st.lists(st.sampled_from([(0, 1), (1, 2), (0, 2), (0, -1)]), max_size=14)


def full_table(a: Pairs, b: Pairs) -> int:
    """The textbook recurrence, every cell of it."""
    d = {(i, 0): i for i in range(len(a) + 1)} | {(0, j): j for j in range(len(b) + 1)}
    for i in range(1, len(a) + 1):
        for j in range(1, len(b) + 1):
            d[i, j] = min(d[i - 1, j], d[i, j - 1]) + 1
            if a[i - 1] == b[j - 1]:
                d[i, j] = min(d[i, j], d[i - 1, j - 1])
            if i > 1 and j > 1 and a[i - 1] == b[j - 2] and a[i - 2] == b[j - 1]:
                d[i, j] = min(d[i, j], d[i - 2, j - 2] + 1)
    return d[len(a), len(b)]


@given(EVENTS, EVENTS)
def test_the_band_gives_what_the_full_table_gives(a: Pairs, b: Pairs) -> None:
    """The banded distance is that of the full table, for all sequences."""
    assert edit_distance(a, b) == full_table(a, b)


def test_one_of_each_edit() -> None:
    """One impact more, one fewer, and two neighbours swapped are one edit each."""
    a: Pairs = [(0, 1), (1, 2), (2, 3), (0, 2)]
    assert edit_distance(a, a[:2] + a[3:]) == 1
    assert edit_distance(a, [*a[:2], (5, 6), *a[2:]]) == 1
    assert edit_distance(a, [a[0], a[2], a[1], a[3]]) == 1


def test_sequences_of_ten_thousand_that_have_nothing_in_common_end_at_the_cap() -> None:
    """Two long sequences without a common event end at the cap, without a table of a hundred million cells."""
    assert edit_distance([(0, 1)] * 10_000, [(2, 3)] * 10_000) == MOST_EDITS
