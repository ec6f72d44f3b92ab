"""Comparison of a run's reported impacts with the impacts that its states show."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.model.step_windows import LocalTruth
from carom.model.trace import Trace, body_name
from carom.support.formatting import format_instant

#: Largest time between a reported contact and the change of velocities, in steps. Engines report a contact up to two
#: steps before or after the change, mostly at a step boundary. Half a step is added, so that rounding does not matter.
_AWAY_STEPS = 2.5

#: Numbers of two bodies, the lower number first.
_Bodies = tuple[int, int]


class ReportComparison(NamedTuple):
    """Differences between the impacts that a run reports and the impacts that its states show.

    Attributes:
        unshown: Number of reported impacts without a matching change of velocity in the states.
        unreported: Number of impacts that the states show, but the run does not report. Only windows (successive steps
            in which bodies collide or overlap) with a single impact are counted.
        first_unshown: Time and bodies of the first reported impact that the states do not show; empty if there is none.
        first_unreported: Time and bodies of the first impact that the states show, but the run does not report; empty
            if there is none.
    """

    unshown: int
    unreported: int
    first_unshown: str
    first_unreported: str

    @property
    def agree(self) -> bool:
        """Whether the run reports the impacts that its states show."""
        return not self.unshown and not self.unreported


def compare_reports_with_states(trace: Trace, truth: LocalTruth, until_s: float = math.inf) -> ReportComparison:
    """Compare the impacts that a trace reports up to a time with the impacts that its states show.

    A reported impact matches a window of the same bodies if the impact is at most `_AWAY_STEPS` steps away. A window
    with a single impact can explain one reported impact. The trace must report this impact, unless the bodies pass
    through each other, the run ends during the impact, or the window ends after the given time. Windows with several
    impacts, and steps in which the pair rests, can explain any number of reported impacts, or none.
    """
    windows = truth.windows[truth.meetings["window"]]
    has_one_pair = ~windows["entangled"] & (windows["due"] > 0)
    is_expected = has_one_pair & ~windows["open"] & ~truth.meetings["missed"] & (windows["end_s"] <= until_s)
    away_s = _AWAY_STEPS * trace.dt_s
    earliest, latest = windows["begin_s"] - away_s, windows["end_s"] + away_s
    rows: dict[_Bodies, list[int]] = defaultdict(list)
    for row, bodies in enumerate(_list_bodies(truth.meetings)):
        rows[bodies].append(row)
    reports: dict[_Bodies, list[float]] = {bodies: [] for bodies in rows}
    for time_s, bodies in zip(trace.impacts["time_s"].tolist(), _list_bodies(trace.impacts), strict=True):
        if time_s <= until_s:
            reports.setdefault(bodies, []).append(time_s)
    contact_spans: dict[_Bodies, list[tuple[float, float]]] = defaultdict(list)
    for row, bodies in zip(truth.rests.tolist(), _list_bodies(truth.rests), strict=True):
        contact_spans[bodies].append(row[2:])
    unshown: list[tuple[float, _Bodies]] = []
    unreported: list[tuple[float, _Bodies]] = []
    for bodies, times in reports.items():
        pair_spans = [(float(earliest[row]), float(latest[row]), row) for row in rows.get(bodies, ())]
        crowded = [span for span in pair_spans if not has_one_pair[span[2]]]
        lonely = [span for span in pair_spans if has_one_pair[span[2]]]
        # The first matching gives each report its own window, except near windows with several impacts. The second
        # matching gives a report to each window that requires one. If both matchings exist, a single matching can meet
        # both conditions (Mendelsohn and Dulmage, 1958).
        bound = [time_s for time_s in sorted(times) if not any(begin <= time_s <= end for begin, end, _ in crowded)]
        bound = [time_s for time_s in bound if not _is_within(time_s, contact_spans.get(bodies, ()), away_s)]
        left, _ = _match_times(bound, lonely)
        unshown += [(time_s, bodies) for time_s in left]
        _, open_spans = _match_times(sorted(times), [span for span in lonely if is_expected[span[2]]])
        unreported += [(float(windows["begin_s"][row]), bodies) for _, _, row in open_spans]
    return ReportComparison(len(unshown), len(unreported), _format_first(unshown), _format_first(unreported))


def _is_within(time_s: float, spans: Sequence[tuple[float, float]], away_s: float) -> bool:
    """Whether a time is in one of the spans (sorted and disjoint), or at most `away_s` away from a span."""
    after = bisect_right(spans, time_s + away_s, key=lambda span: span[0])
    return after > 0 and time_s <= spans[after - 1][1] + away_s


def _match_times(
    times: Sequence[float], spans: Sequence[tuple[float, float, int]]
) -> tuple[list[float], list[tuple[float, float, int]]]:
    """Match each time with the span that ends first, and return the unmatched times and spans."""
    left, free = [], list(spans)
    for time_s in times:
        match = min((span for span in free if span[0] <= time_s <= span[1]), key=lambda span: span[1], default=None)
        if match is None:
            left.append(time_s)
        else:
            free.remove(match)
    return left, free


def _format_first(found: Sequence[tuple[float, _Bodies]]) -> str:
    if not found:
        return ""
    time_s, bodies = min(found)
    first, second = sorted(bodies, key=lambda body: (body < 0, body))  # discs come before walls
    return f"at {format_instant(time_s)} between {body_name(first)} and {body_name(second)}"


def _list_bodies(rows: NDArray[np.void]) -> list[_Bodies]:
    return [(min(pair), max(pair)) for pair in zip(rows["first"].tolist(), rows["second"].tolist(), strict=True)]
