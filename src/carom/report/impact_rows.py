"""Table of a run's impacts next to those of its reference: the outcome of each impact, and the cause of its error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from carom.comparator import ImpactError, Score
from carom.comparator.measure.local_errors import LocalErrors
from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import Trace, pair_name
from carom.support import formatting

#: Text for an unknown cause.
UNKNOWN = "unknown: the run's state before the impact is not known"

#: An impact counts as missed if its bodies pass through each other at most this number of steps before or after its
#: time.
NEAR_STEPS = 2.0

Json = dict[str, Any]


def build_impact_rows(reference: Trace, trace: Trace, score: Score) -> Iterator[Json]:
    """Yield the outcome of each impact of the reference and of each invented impact, in order of time."""
    found = {error.reference: error for error in score.errors}
    rows: list[Json] = []
    for k, impact in enumerate(reference.impacts):
        row = {**_describe_bodies(impact), "true": float(impact["time_s"]), "at": k}
        if error := found.get(k):
            rows.append(row | _describe_matched(row["true"], error, trace, score))
        else:
            rows.append(row | _describe_unmatched(k, impact, trace, score))
    for k in score.spurious:
        reported = {"reported": _replace_non_finite(float(trace.impacts[k]["time_s"]))}
        outcome = {"flag": "invented", "became": "invented", "cause": _explain_invented(k, score.local)}
        rows.append(_describe_bodies(trace.impacts[k]) | reported | outcome)
    yield from sorted(rows, key=lambda row: row.get("true", row.get("reported")) or 0.0)


def _describe_bodies(impact: np.void) -> Json:
    return {"bodies": [int(impact["first"]), int(impact["second"])], "pair": pair_name(impact)}


def _describe_matched(true_s: float, error: ImpactError, trace: Trace, score: Score) -> Json:
    """Describe an impact of the reference at time `true_s` that the run found."""
    return {
        "reported": _replace_non_finite(true_s + error.reported_time_s),
        "turned": _replace_non_finite(true_s + error.effective_time_s),
        "velocity": _replace_non_finite(error.velocity),
        "spin": _replace_non_finite(error.spin),
        **_describe_delay(error.time_s, trace.dt_s, score),
        "cause": _explain_error(error, score),
    }


def _explain_invented(k: int, local: LocalErrors) -> str:
    """State whether the bodies of an invented impact collide, starting from the run's own state before this impact."""
    if k in local.spurious:
        return "starting from the run's own state before the impact, the bodies do not collide"
    if math.isnan(local.velocity[k]):
        return UNKNOWN
    return "starting from the run's own state before the impact, the bodies do collide"


def _replace_non_finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _describe_unmatched(k: int, impact: np.void, trace: Trace, score: Score) -> Json:
    """Describe an impact of the reference that has no match, with the cause if it is missed."""
    if k >= score.expected:
        return {"flag": "beyond", "became": "not compared", "cause": ""}
    if k in score.undecided:
        return {"flag": "undecided", "became": "not found before the end of the run", "cause": ""}
    if k not in score.missed:
        return {"flag": "undecided", "became": "visible in the states, but not reported", "cause": ""}
    return {"flag": "missed", "became": "missed", "cause": _explain_missed(k, impact, trace, score)}


def _explain_missed(k: int, impact: np.void, trace: Trace, score: Score) -> str:
    """Describe why an impact is missed.

    If the run's own states were not checked, only report whether PIT also misses the impact.
    """
    if trace.local_truth is None:
        pit = {True: "PIT also misses this impact", False: "PIT finds this impact"}
        return "" if score.pit_missed is None else pit[k in score.pit_missed]
    meetings = trace.local_truth.meetings
    # If an engine finds impacts early, bodies can pass through each other before the exact instant; if an engine finds
    # impacts late, after the exact instant.
    near = np.abs(meetings["begin_s"] - impact["time_s"]) <= NEAR_STEPS * trace.dt_s
    passed = meetings[
        (meetings["first"] == impact["first"]) & (meetings["second"] == impact["second"]) & meetings["missed"] & near
    ]
    if not len(passed):
        return "earlier errors led the run elsewhere: its own states do not lead to this impact"
    alone = "the method itself: PIT finds the impact from the same state"
    return "checking once per step" if passed["pit_missed"].any() else alone


def _describe_delay(time_s: float, dt_s: float, score: Score) -> Json:
    """Describe the time error of a matched impact by one word, and by a text with the error's size."""
    if abs(time_s) <= THRESHOLDS.time_rounding_of(score.float_bits, score.scales.time_s, dt_s):
        return {"flag": "found", "became": "found"}
    flag = "late" if time_s > 0 else "early"
    size = formatting.format_steps(abs(time_s), dt_s) if dt_s else formatting.format_seconds(abs(time_s))
    return {"flag": flag, "became": f"{size} {flag}"}


def _explain_error(error: ImpactError, score: Score) -> str:
    """Return the cause of a velocity or spin error: earlier errors, checking once per step, or the method itself."""
    rounding = THRESHOLDS.rounding_of(score.float_bits)
    kind = "spin" if error.spin > rounding and not error.velocity > rounding else "velocity"
    if not getattr(error, kind) > rounding:
        return ""
    local_error, solver_error, sampling_error = (
        getattr(score.local, name)[error.observed] for name in (kind, f"solver_{kind}", f"sampling_{kind}")
    )
    if math.isnan(local_error):
        return UNKNOWN
    if local_error <= rounding:
        return "earlier errors: starting from the run's own state, the impact is correct"
    if solver_error <= rounding:
        return "checking once per step"
    if math.isnan(solver_error) or sampling_error <= rounding:
        return "the method itself"
    sampling, solver = formatting.format_number(sampling_error), formatting.format_number(solver_error)
    return f"checking once per step ({sampling}) and the method itself ({solver})"
