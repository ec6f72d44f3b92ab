"""What a run reports in addition to what its states show: the same impacts, or others."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.model.step_windows import LocalTruth
from carom.model.trace import Trace, body_name
from carom.support.formatting import instant

#: How many steps a report may lie from its window: engines tell of a contact up to two before or after it acts, most at
#: a step's boundary, and half a step more keeps rounding from deciding on those.
_AWAY_STEPS = 2.5

#: Two bodies, the lower number first.
_Bodies = tuple[int, int]


@dataclass(frozen=True)
class ReportComparison:
    """Where reports and states of a run part.

    Attributes:
        unshown: Impacts that are reported and that no state shows.
        unreported: Impacts that states show, each alone in its window, and that are not reported.
        first_unshown: Time and bodies of the first, empty where there is none.
        first_unreported: The same.
    """

    unshown: int
    unreported: int
    first_unshown: str
    first_unreported: str

    @property
    def agree(self) -> bool:
        """Whether the run reports what its states show."""
        return not self.unshown and not self.unreported


def compare_reports_with_states(trace: Trace, truth: LocalTruth, until_s: float = math.inf) -> ReportComparison:
    """Return where the reports of a trace and its states part, up to a time.

    A report is shown by a window that holds its pair in its step, or in the two around it. A window of one impact shows
    one report, and must have one unless the impact is missed or the window open; others show as many as come, and so
    do steps in which the pair rests and a push shows. Of these none must be reported.
    """
    windows = truth.windows[truth.meetings["window"]]
    alone = ~windows["entangled"] & (windows["due"] > 0)
    asked = alone & ~windows["open"] & ~truth.meetings["missed"] & (windows["end_s"] <= until_s)
    away_s = _AWAY_STEPS * trace.dt_s
    earliest, latest = windows["begin_s"] - away_s, windows["end_s"] + away_s
    rows: dict[_Bodies, list[int]] = defaultdict(list)
    for row, bodies in enumerate(_bodies(truth.meetings)):
        rows[bodies].append(row)
    reports: dict[_Bodies, list[float]] = {bodies: [] for bodies in rows}
    for time_s, bodies in zip(trace.impacts["time_s"].tolist(), _bodies(trace.impacts), strict=True):
        if time_s <= until_s:
            reports.setdefault(bodies, []).append(time_s)
    held: dict[_Bodies, list[tuple[float, float]]] = defaultdict(list)
    if truth.rests is not None:
        for row, bodies in zip(truth.rests.tolist(), _bodies(truth.rests), strict=True):
            held[bodies].append(row[2:])
    unshown: list[tuple[float, _Bodies]] = []
    unreported: list[tuple[float, _Bodies]] = []
    for bodies, times in reports.items():
        own = [(float(earliest[row]), float(latest[row]), row) for row in rows.get(bodies, ())]
        crowded = [span for span in own if not alone[span[2]]]
        lonely = [span for span in own if alone[span[2]]]
        # What no crowded window can show must find one of its own; what must be reported may be by any report. Where
        # each can be matched by itself, both can at once (Mendelsohn and Dulmage, 1958).
        bound = [time_s for time_s in sorted(times) if not any(begin <= time_s <= end for begin, end, _ in crowded)]
        bound = [time_s for time_s in bound if not _is_within(time_s, held.get(bodies, ()), away_s)]
        left, _ = _match(bound, lonely)
        unshown += [(time_s, bodies) for time_s in left]
        _, open_spans = _match(sorted(times), [span for span in lonely if asked[span[2]]])
        unreported += [(float(windows["begin_s"][row]), bodies) for _, _, row in open_spans]
    return ReportComparison(len(unshown), len(unreported), _format_first(unshown), _format_first(unreported))


def _is_within(time_s: float, spans: Sequence[tuple[float, float]], away_s: float) -> bool:
    """Whether a time lies in one of some spans, in order and apart, or no further away from one than is said."""
    after = bisect_right(spans, time_s + away_s, key=lambda span: span[0])
    return after > 0 and time_s <= spans[after - 1][1] + away_s


def _match(
    times: Sequence[float], spans: Sequence[tuple[float, float, int]]
) -> tuple[list[float], list[tuple[float, float, int]]]:
    """Return the times and the spans that are left where each span takes one time: the one that ends first, first."""
    left, free = [], list(spans)
    for time_s in times:
        taken = min((span for span in free if span[0] <= time_s <= span[1]), key=lambda span: span[1], default=None)
        if taken is None:
            left.append(time_s)
        else:
            free.remove(taken)
    return left, free


def _format_first(found: Sequence[tuple[float, _Bodies]]) -> str:
    if not found:
        return ""
    time_s, bodies = min(found)
    first, second = sorted(bodies, key=lambda body: (body < 0, body))  # a wall comes last
    return f"at {instant(time_s)} between {body_name(first)} and {body_name(second)}"


def find_shown_by_states(reference: Trace, missed: Sequence[int], truth: LocalTruth, dt_s: float) -> frozenset[int]:
    """Return which impacts that a run does not report its states show, among others of the same steps.

    Of several impacts of a disc in one step, an engine may report the outcome alone.
    """
    windows = truth.windows[truth.meetings["window"]]
    kept = np.flatnonzero(windows["entangled"] & ~truth.meetings["missed"] & ~np.isnan(truth.meetings["due_s"]))
    shown: dict[_Bodies, list[int]] = {}
    for row, bodies in zip(kept.tolist(), _bodies(truth.meetings[kept]), strict=True):
        shown.setdefault(bodies, []).append(row)
    impacts = reference.impacts[list(missed)]
    return frozenset(
        number
        for number, time_s, bodies in zip(missed, impacts["time_s"].tolist(), _bodies(impacts), strict=True)
        if any(
            windows["begin_s"][row] - dt_s <= time_s <= windows["end_s"][row] + dt_s for row in shown.get(bodies, ())
        )
    )


def _bodies(rows: NDArray[np.void]) -> list[_Bodies]:
    pairs = zip(rows["first"].tolist(), rows["second"].tolist(), strict=True)
    return [(min(pair), max(pair)) for pair in pairs]
