"""What a run reports, beside what its states show."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from tests.planted.doctored import DT, GAS, Run, judged, sampled

from carom.comparator import Grade, Score, Verdict
from carom.comparator.local_truth.reports import reports_and_states
from carom.solvers.pic import solve_pic
from carom.trace import IMPACT_DTYPE, pair_name
from carom.windows import MEETING_DTYPE, SLIP_DTYPE, WINDOW_DTYPE, LocalTruth

#: PIT in a gas of twelve: its trajectory leaves PIC's, and each of its steps is PIT's own.
PIT = sampled(GAS)
TRACE = replace(solve_pic(GAS), dt_s=DT)


def reporting(run: Run, impacts: np.ndarray) -> Score:
    return judged(replace(run, impacts=impacts[np.argsort(impacts["time_s"], kind="stable")]))


def reason(score: Score, verdict: Verdict) -> str:
    (found,) = (finding.reason for finding in score.findings if finding.verdict is verdict)
    return found


def alone(run: Run) -> int:
    """Return an impact before the horizon whose bodies meet nothing else within four steps."""
    rows = run.impacts
    for k in range(len(rows) // 3, len(rows)):
        bodies = {int(rows[k]["first"]), int(rows[k]["second"])}
        near = rows[np.abs(rows["time_s"] - rows[k]["time_s"]) <= 4 * DT]
        if len([row for row in near if bodies & {int(row["first"]), int(row["second"])}]) == 1:
            return k
    raise AssertionError("no impact is alone")


def test_a_run_that_parted_and_reports_what_it_shows_is_parted() -> None:
    """PIT in a crowd has left the reference's trajectory, and nothing is said of its reports."""
    score = judged(PIT)
    assert score.grade is Grade.PARTED
    assert Verdict.MISREPORTED not in score.verdicts


def test_an_impact_that_is_not_reported_is_said_as_that() -> None:
    """One report taken from a run that parted makes it wrong, and nothing is called missed for it."""
    k = alone(PIT)
    score = reporting(PIT, np.delete(PIT.impacts, k))
    assert score.grade is Grade.WRONG
    assert reason(score, Verdict.MISREPORTED).startswith("1 shown and not reported, the first at ")
    assert {Verdict.PARTED} == set(score.verdicts) & {Verdict.PARTED, Verdict.MISSED, Verdict.MULTIPLE_MISSED}


def test_an_impact_that_no_state_shows_is_said_as_that() -> None:
    """One report of two bodies that are far apart makes a run that parted wrong, and names time and bodies."""
    k = alone(PIT)
    invented = PIT.impacts[[k]].copy()
    busy = PIT.impacts[np.abs(PIT.impacts["time_s"] - invented[0]["time_s"]) <= 4 * DT]
    met = {frozenset((int(row["first"]), int(row["second"]))) for row in busy}
    invented["first"], invented["second"] = next((a, b) for b in range(12) for a in range(b) if {a, b} not in met)
    score = reporting(replace(PIT, told=True), np.concatenate([PIT.impacts, invented]))
    assert score.grade is Grade.WRONG
    assert reason(score, Verdict.MISREPORTED) == (
        f"1 reported that no state shows, the first at {invented[0]['time_s']:.6g} s between {pair_name(invented[0])}"
    )


def parting(windows: list[tuple[int, int, bool]], reports: list[int]) -> tuple[int, int]:
    """Return how many reports of a pair, at these steps, no window shows, and how many windows none is of.

    Args:
        windows: Of each its first and last step, and whether it is a crowd's.
        reports: Steps at whose end the pair is reported.
    """
    rows, meetings = np.zeros(len(windows), WINDOW_DTYPE), np.zeros(len(windows), MEETING_DTYPE)
    for k, (begin, end, crowd) in enumerate(windows):
        rows[k]["begin_s"], rows[k]["end_s"], rows[k]["entangled"], rows[k]["due"] = begin * DT, end * DT, crowd, 1
        meetings[k]["window"], meetings[k]["second"] = k, 1
    impacts = np.zeros(len(reports), IMPACT_DTYPE)
    impacts["time_s"], impacts["second"] = np.array(reports) * DT, 1
    slips = np.zeros(0, SLIP_DTYPE)
    truth = LocalTruth(9.0, 540, rows, meetings, slips, 0, (0, 0), 0, 0.0, math.nan, polygon=False)
    trace = replace(TRACE, impacts=impacts)
    found = reports_and_states(trace, truth)
    assert found.agree == (found.unshown == found.unreported == 0)
    return found.unshown, found.unreported


def test_each_report_is_of_the_window_that_leaves_the_others_theirs() -> None:
    """A crowd's window never takes the report of the one beside it, and windows in a row take theirs in order."""
    assert parting([(91, 93, True), (94, 96, False)], [92, 95]) == (0, 0)
    assert parting([(91, 93, True), (94, 96, False)], [95]) == (0, 0)
    assert parting([(10, 11, False), (13, 14, False)], [13, 16]) == (0, 0)
    assert parting([(10, 11, False), (10, 12, True)], [11, 13]) == (0, 0)


def test_a_report_too_many_or_too_few_is_counted() -> None:
    """A window of one impact shows one report and needs one, of which two steps away is the farthest."""
    assert parting([(10, 11, False)], [11, 12]) == (1, 0)
    assert parting([(10, 11, False)], [14]) == (1, 1)
    assert parting([(10, 11, False)], [13]) == (0, 0)
    assert parting([(10, 11, False), (13, 14, False)], [11]) == (0, 1)
    assert parting([], [14]) == (1, 0)
