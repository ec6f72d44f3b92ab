"""The tournament tree of earliest times, held against a plain list of them."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from tests.unit.solvers.columns import columns_of

from carom.bench.gas import hard_disc_gas
from carom.solvers.tournament import earliest, least_other, next_at, set_time

# Few different times, so that many are the same.
TIMES = st.sampled_from([0.0, 1.0, 2.0, 3.0, math.inf])
DISCS = 70  # three levels, none of them full

changes = st.lists(st.tuples(st.integers(0, DISCS - 1), TIMES), min_size=1, max_size=60)


@given(changes)
def test_the_tree_knows_the_earliest_of_all_and_of_the_others(given_times: list[tuple[int, float]]) -> None:
    """After any changes it names a disc of the least time, the least of all but one or two, and every disc as early."""
    s = columns_of(hard_disc_gas(DISCS, 0.3))
    times = [math.inf] * DISCS
    for disc, time in given_times:
        set_time(s, disc, time)
        times[disc] = time
        least = min(times)
        assert times[earliest(s)] == least
        for other in (disc, (disc + 1) % DISCS, (disc + 31) % DISCS):
            left = [times[k] for k in range(DISCS) if k not in (disc, other)]
            assert least_other(s, disc, other) == min(left)
        for limit in {least, time}:
            found, after = [], next_at(s, 0, limit)
            while after < DISCS:
                found.append(after)
                after = next_at(s, after + 1, limit)
            assert found == [k for k in range(DISCS) if times[k] <= limit]
