"""Matching of the impacts of a run with those of a reference. Impacts without a match are missed or spurious.

The impacts of each pair of bodies are matched separately, in order of time. There are as many matches as possible. If
several matchings have equally many matches, the matching with the smallest sum of time differences is used. Each
reference impact has a *window*: the time in which its movable bodies have no other reference impact. Outside of this
window, at least one of the bodies is on another path. An observed impact can match a reference impact only within the
reference impact's window. An engine may report an impact up to `LATEST_STAMP_STEPS` steps late, so each window is
longer by this time at both ends.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.model.trace import Trace

#: Largest lateness, in steps, of the time that an engine reports for an impact. An engine may notice an overlap one
#: step late, and may then report the end of the next step.
LATEST_STAMP_STEPS = 2

Pair = tuple[int, int]


class ComparisonRange(NamedTuple):
    """The part of a run that is compared with its reference: the whole run, or its part up to the horizon.

    Attributes:
        impacts: Number of the reference's impacts in this part.
        until_s: End of this part, in seconds; infinite if the whole run is compared.
    """

    impacts: int
    until_s: float

    @property
    def is_whole_run(self) -> bool:
        """Whether the whole run is compared."""
        return not math.isfinite(self.until_s)


class Alignment(NamedTuple):
    """Matching of the impacts of a reference with those of an observed trace.

    Attributes:
        matched: Index pairs ``(reference, observed)`` of matched impacts, sorted by the time in the reference.
        missed: Indices of the reference's impacts that have no match in the run.
        spurious: Indices of the run's impacts that have no match in the reference.
        undecided: Indices of the reference's impacts that have no match, but are so close to the end of the run that no
            later step could report them.
        is_whole_run: Whether the impacts of the whole run were matched, not only those before a horizon.
    """

    matched: tuple[tuple[int, int], ...]
    missed: tuple[int, ...]
    spurious: tuple[int, ...]
    undecided: tuple[int, ...]
    is_whole_run: bool


def match_impacts(reference: Trace, observed: Trace, compared: ComparisonRange | None = None) -> Alignment:
    """Match the impacts of two traces of one scene. If a range is given, only impacts within this range are matched."""
    slack = LATEST_STAMP_STEPS * observed.dt_s
    windows = _compute_time_windows(reference, slack)
    timed = np.isfinite(observed.impacts["time_s"]).tolist()  # an impact without a time matches nothing
    observed_by_pair = {pair: [o for o in found if timed[o]] for pair, found in group_by_pair(observed.impacts).items()}
    expected_s, found_s = reference.impacts["time_s"].tolist(), observed.impacts["time_s"].tolist()
    matched: list[tuple[int, int]] = []
    for pair, expected in group_by_pair(reference.impacts).items():
        matched += _align_pair(expected, observed_by_pair.get(pair, []), expected_s, found_s, windows)
    matched.sort()
    hit, used = {r for r, _ in matched}, {o for _, o in matched}
    unmatched = [r for r in range(len(reference.impacts)) if r not in hit]
    # An impact in the last steps is undecided if no further step follows in which the run could report it.
    last_reportable = observed.end_time_s - slack
    late = {r for r in unmatched if expected_s[r] > last_reportable and not _has_passed(reference.impacts[r], observed)}
    compared = compared or ComparisonRange(len(reference.impacts), math.inf)
    count, is_whole_run = compared.impacts, compared.is_whole_run
    spurious = (o for o in range(len(observed.impacts)) if o not in used)
    return Alignment(
        matched=tuple((r, o) for r, o in matched if r < count),
        missed=tuple(r for r in unmatched if r not in late and r < count),
        spurious=tuple(o for o in spurious if is_whole_run or found_s[o] <= compared.until_s),
        undecided=tuple(r for r in unmatched if r in late and r < count),
        is_whole_run=is_whole_run,
    )


def _has_passed(impact: np.void, observed: Trace) -> bool:
    """Whether the two bodies of an unobserved impact separate in the observed final state.

    If the bodies separate, they have passed through each other. An impact counts as missed if its bodies have passed
    through each other, because no later step would find the impact. The result is false for an impact with a wall.
    """
    first, second = int(impact["first"]), int(impact["second"])
    if second < 0 or impact["time_s"] > observed.end_time_s:
        return False
    separation = observed.final_position_m[second] - observed.final_position_m[first]
    relative_velocity = observed.final_velocity_m_s[second] - observed.final_velocity_m_s[first]
    return bool(separation @ relative_velocity >= 0.0)


def group_by_pair(impacts: NDArray[np.void]) -> dict[Pair, list[int]]:
    """Group the indices of impacts by pair of bodies, in order."""
    indices: dict[Pair, list[int]] = defaultdict(list)
    for k, (first, second) in enumerate(zip(impacts["first"].tolist(), impacts["second"].tolist(), strict=True)):
        indices[first, second].append(k)
    return indices


def _compute_time_windows(reference: Trace, slack: float) -> list[tuple[float, float]]:
    """Return the earliest and the latest time that a run may report for each impact of the reference."""
    impacts = reference.impacts
    rows = list(zip(impacts["time_s"].tolist(), impacts["first"].tolist(), impacts["second"].tolist(), strict=True))
    # An immovable body keeps its path, so its other impacts do not limit the window.
    second_changes = (impacts["velocity_second_before"] != impacts["velocity_second_after"]).any(axis=1).tolist()
    times: dict[int, list[float]] = defaultdict(lambda: [-math.inf])
    bodies: list[list[int]] = []
    for (time, first, second), changes in zip(rows, second_changes, strict=True):
        involved = [first, second] if second >= 0 and changes else [first]
        bodies.append(involved)
        for body in involved:
            times[body].append(time)
    for own_times in times.values():
        own_times.append(math.inf)
    windows = []
    for (time, _, _), involved in zip(rows, bodies, strict=True):
        earliest = max(times[body][bisect_left(times[body], time) - 1] for body in involved)
        latest = min(times[body][bisect_right(times[body], time)] for body in involved)
        windows.append((earliest - slack, latest + slack))
    return windows


def _align_pair(
    expected: list[int],
    found: list[int],
    reference_time: list[float],
    observed_time: list[float],
    windows: list[tuple[float, float]],
) -> list[tuple[int, int]]:
    """Match one pair's impacts in order by dynamic programming.

    A cost is two numbers: the number of unmatched impacts, and the sum of time errors. ``cost(r, c)`` is the smallest
    cost for the reference's impacts from r on and the observed impacts from c on. Later impacts have later windows. So
    each row of the cost table is computed only for the columns in its window.
    """
    rows, columns = len(expected), len(found)
    stamps = [observed_time[o] for o in found]
    low = [bisect_left(stamps, windows[r][0]) for r in expected]
    high = [bisect_right(stamps, windows[r][1]) for r in expected]
    if rows == columns and all(low[k] <= k < high[k] for k in range(rows)):
        return list(zip(expected, found, strict=True))  # no other alignment matches all impacts
    table: list[list[tuple[int, float]]] = [[] for _ in range(rows)]

    def cost(r: int, c: int) -> tuple[int, float]:
        skipped = 0
        while r < rows:
            if c < low[r]:
                c, skipped = low[r], skipped + low[r] - c
            if c < high[r]:
                least_cost = table[r][c - low[r]]
                return (skipped + least_cost[0], least_cost[1])
            r, skipped = r + 1, skipped + 1
        return (skipped + columns - c, 0.0)

    for r in range(rows - 1, -1, -1):
        row: list[tuple[int, float]] = [(0, 0.0)] * (high[r] - low[r])
        match, time_s = cost(r + 1, high[r]), reference_time[expected[r]]
        next_cost = (match[0] + 1, match[1])  # observed impact high[r] is after the window of impact r, so r is missed
        for c in range(high[r] - 1, low[r] - 1, -1):
            missed = cost(r + 1, c)
            best = min((missed[0] + 1, missed[1]), (next_cost[0] + 1, next_cost[1]))
            best = min(best, (match[0], match[1] + abs(stamps[c] - time_s)))
            row[c - low[r]] = next_cost = best
            match = missed
        table[r] = row
    matched, r, c = [], 0, 0
    while r < rows and c < columns:
        cost_here, missed, spurious = cost(r, c), cost(r + 1, c), cost(r, c + 1)
        if cost_here == (missed[0] + 1, missed[1]):
            r += 1
        elif cost_here == (spurious[0] + 1, spurious[1]):
            c += 1
        else:
            matched.append((expected[r], found[c]))
            r, c = r + 1, c + 1
    return matched
