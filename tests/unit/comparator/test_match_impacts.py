"""Which observed impact is which of the reference."""

import dataclasses

from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.planted.faults import drop_impact
from tests.scene_builders import alter_impact, disc_at, staged, wall_at

from carom import compare, solve_pic, solve_pit
from carom.comparator import Grade, Verdict
from carom.comparator.align_impacts import MOST_EDITS, compute_edit_distance
from carom.comparator.match_impacts import match_impacts


@each(
    "x, speed, target, missed, undecided, grade",
    [(-95, 100, 0.45, (0,), (), Grade.WRONG), (-1, 1, 0.49, (), (0,), Grade.UNGRADED)],
)
def test_impact_in_the_last_frame_is_missed_if_no_later_frame_would_find_it(
    x: float, speed: float, target: float, missed: tuple[int, ...], undecided: tuple[int, ...], grade: Grade
) -> None:
    """An impact in the last frame is missed if the discs separate at the end; if they overlap, it is undecided."""
    discs = disc_at(x, 0, speed, 0, r=0.25), disc_at(target, 0, r=0.25)
    scene = staged("late", *discs, duration_s=1.0, frame_rate_hz=24)
    pit = solve_pit(scene)
    score = compare(solve_pic(scene), pit, sampling=pit)
    assert (score.missed, score.undecided, score.grade) == (missed, undecided, grade)
    assert (score.verdicts == (Verdict.UNDECIDED,)) is bool(undecided)


def test_impact_after_a_later_one_of_its_disc_does_not_match() -> None:
    """An impact of 1 s reported at 5 s, after the disc's next impact at 3 s, is missed and spurious."""
    discs = disc_at(0, 0, 0.6, 0.8), disc_at(1.2, 1.6), disc_at(3, 4)
    scene = staged("aslant", *discs, duration_s=10.0, frame_rate_hz=60.0)
    late = alter_impact(solve_pit(scene), 0, time_s=5.0)
    found = match_impacts(solve_pic(scene), dataclasses.replace(late, impacts=late.impacts[::-1].copy()))
    assert (found.matched, found.missed, found.spurious) == (((1, 0),), (0,), (1,))


def test_one_dropped_bounce_of_1000_is_missed() -> None:
    """If one of 1000 bounces between two walls is dropped in the middle, exactly that one is missed."""
    scene = staged(
        "to and fro", disc_at(0, 0, 500, 0, r=0.25), wall_at(-0.5, 0, 1, 0), wall_at(0.5, 0, -1, 0), duration_s=1.0
    )
    reference = solve_pic(scene)
    assert len(reference.impacts) == 1000
    assert compare(reference, drop_impact(reference, 500)).missed == (500,)


# Edit distance of event sequences: against the full table, and on what can be counted by hand -------------------------


Pairs = list[tuple[int, int]]
EVENTS = st.lists(st.sampled_from([(0, 1), (1, 2), (0, 2), (0, -1)]), max_size=14)


def compute_full_table_distance(a: Pairs, b: Pairs) -> int:
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
def test_banded_edit_distance_equals_the_full_table(a: Pairs, b: Pairs) -> None:
    """The banded edit distance equals that of the full table, for all short sequences."""
    assert compute_edit_distance(a, b) == compute_full_table_distance(a, b)


def test_edit_distance_of_long_disjoint_sequences_is_capped() -> None:
    """Two sequences of 10,000 events without a common one have the largest distance, MOST_EDITS."""
    assert compute_edit_distance([(0, 1)] * 10_000, [(2, 3)] * 10_000) == MOST_EDITS
