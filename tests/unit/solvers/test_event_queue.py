"""The queue of predicted impacts: order, ties and voiding."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from carom.solvers.event_queue import EventQueue


def drained(queue: EventQueue) -> list[tuple[float, int, int]]:
    """Carry out and void everything in the queue, and return it in order."""
    order = []
    while (event := queue.peek()) is not None:
        order.append(event)
        queue.void(event[1])
        queue.void(event[2])
    return order


def test_an_empty_queue_has_nothing() -> None:
    """Nothing predicted, nothing comes."""
    assert EventQueue(2).peek() is None


def test_peeking_leaves_the_event_where_it_is() -> None:
    """Looking at the earliest event does not take it away: only a voided disc does."""
    queue = EventQueue(2)
    queue.predict(1.0, 0, 1)
    assert queue.peek() == (1.0, 0, 1)
    assert queue.peek() == (1.0, 0, 1)


def test_never_is_not_queued() -> None:
    """A prediction of infinity, or of no number at all, is dropped."""
    queue = EventQueue(2)
    queue.predict(math.inf, 0, 1)
    queue.predict(math.nan, 0, 1)
    assert queue.peek() is None


def test_the_earliest_comes_first_and_ties_go_to_the_lower_bodies() -> None:
    """At one instant walls come before discs and lower numbers before higher ones, whatever the order of prediction."""
    queue = EventQueue(8)
    for event in [(2.0, 0, 1), (1.0, 4, 5), (1.0, 2, 3), (1.0, 6, -1), (1.0, 7, -2)]:
        queue.predict(*event)
    assert drained(queue) == [(1.0, 2, 3), (1.0, 4, 5), (1.0, 6, -1), (1.0, 7, -2), (2.0, 0, 1)]
    queue.predict(1.0, 2, 3)
    queue.predict(1.0, 2, -1)
    assert queue.peek() == (1.0, 2, -1)


def test_voiding_a_disc_drops_what_was_predicted_of_it_and_nothing_else() -> None:
    """After an impact the old predictions of both discs are void, those of others and new ones stand."""
    queue = EventQueue(4)
    queue.predict(1.0, 0, 1)
    queue.predict(2.0, 1, 2)
    queue.predict(3.0, 0, -1)
    queue.predict(4.0, 2, 3)
    queue.void(0)
    queue.void(1)
    assert queue.peek() == (4.0, 2, 3)
    queue.predict(3.5, 0, 1)
    assert queue.peek() == (3.5, 0, 1)


def test_voiding_a_wall_does_nothing() -> None:
    """A wall has no path that could change."""
    queue = EventQueue(1)
    queue.predict(1.0, 0, -1)
    queue.void(-1)
    assert queue.peek() == (1.0, 0, -1)


events = st.tuples(st.integers(0, 5).map(float), st.integers(0, 3), st.integers(-2, 4)).filter(
    lambda e: e[1] < e[2] or e[2] < 0
)
actions = st.one_of(events, st.integers(0, 4))


@given(st.lists(actions, max_size=30))
def test_the_queue_is_a_sorted_list_of_what_still_stands(history: list[tuple[float, int, int] | int]) -> None:
    """After any predictions and voidings, the earliest event is that of a plain list kept by the same rule."""
    queue = EventQueue(5)
    standing: list[tuple[float, int, int]] = []
    for action in history:
        if isinstance(action, int):
            queue.void(action)
            standing = [event for event in standing if action not in event[1:]]
        else:
            queue.predict(*action)
            standing.append(action)
        assert queue.peek() == min(standing, default=None)
