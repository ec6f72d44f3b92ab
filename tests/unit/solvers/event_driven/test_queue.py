"""The event queue, compared with a plain list of times."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.lengths import each

probe = pytest.importorskip("tests.probe")

# Few different times, so that many are the same.
TIMES = st.sampled_from([0.0, 1.0, 2.0, 3.0, math.inf])
DISCS = 70  # three levels, none of them full

changes = st.lists(st.tuples(st.integers(0, DISCS - 1), TIMES), min_size=1, max_size=60)


@given(changes)
def test_the_queue_knows_the_earliest_of_all_and_of_the_others(given_times: list[tuple[int, float]]) -> None:
    """After any changes it names a disc of the least time, the least of all but one or two, and every disc as early."""
    queue = probe.EventQueue(DISCS)
    times = [math.inf] * DISCS
    for disc, time in given_times:
        queue.set_time(disc, time)
        times[disc] = time
        least = min(times)
        assert times[queue.earliest()] == least
        for other in (disc, (disc + 1) % DISCS, (disc + 31) % DISCS):
            left = [times[k] for k in range(DISCS) if k not in (disc, other)]
            assert queue.earliest_except(disc, other) == min(left)
        for limit in {least, time}:
            found, after = [], queue.next_not_after(0, limit)
            while after < DISCS:
                found.append(after)
                after = queue.next_not_after(after + 1, limit)
            assert found == [k for k in range(DISCS) if times[k] <= limit]


@each("discs", [1, 2, 7, 8, 9, 64, 65, 512, 513])
def test_a_queue_of_any_length_names_each_disc_in_its_turn(discs: int) -> None:
    """Discs whose times are set in any order and taken off one by one come in the order of their times."""
    queue = probe.EventQueue(discs)
    order = sorted(range(discs), key=lambda disc: (disc * 37) % 541)
    for disc in range(discs):
        queue.set_time(disc, float((disc * 37) % 541))
    for disc in order:
        assert queue.earliest() == disc
        queue.set_time(disc, math.inf)
