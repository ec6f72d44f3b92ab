"""Comparison of the impacts that a run reports with those that its states show."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from tests.planted.altered_runs import DT, GAS
from tests.planted.faults import find_reason
from tests.scene_builders import disc_at, staged, wall_at

from carom import Scene, Trace, compare, solve_pic, solve_pit
from carom.comparator import Grade, Score, Verdict
from carom.comparator.measure.reported_impacts import compare_reports_with_states
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom.model.step_windows import MEETING_DTYPE, REST_DTYPE, SLIP_DTYPE, WINDOW_DTYPE, LocalTruth
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE, pair_name


def run_pit(scene: Scene) -> Trace:
    """Return PIT's run, as an engine's."""
    return observe_run(load_adapter("pit"), scene, "tuned", DT)


#: PIT in a gas of twelve: its trajectory leaves PIC's, and each of its steps is PIT's own.
PIT, REFERENCE = run_pit(GAS), solve_pic(GAS)
TRACE = replace(REFERENCE, dt_s=DT)


def score_reports(trace: Trace, impacts: np.ndarray) -> Score:
    """Return the score of a run with the same states that reports these impacts."""
    ordered = impacts[np.argsort(impacts["time_s"], kind="stable")]
    spins = None if trace.spins is None else np.zeros(len(impacts), SPIN_DTYPE)
    told = replace(trace, impacts=ordered, spins=spins, effective_time_s=None, state_before=None)
    return compare(solve_pic(trace.scene), told, sampling=solve_pit(trace.scene, frame_rate_hz=1 / DT))


def find_isolated_impact(impacts: np.ndarray) -> int:
    """Return an impact before the horizon whose bodies meet nothing else within four steps."""
    for k in range(len(impacts) // 3, len(impacts)):
        bodies = {int(impacts[k]["first"]), int(impacts[k]["second"])}
        near = impacts[np.abs(impacts["time_s"] - impacts[k]["time_s"]) <= 4 * DT]
        if len([row for row in near if bodies & {int(row["first"]), int(row["second"])}]) == 1:
            return k
    raise AssertionError("no impact is alone")


def test_diverged_run_with_correct_reports_is_not_wrong() -> None:
    """PIT in a crowd leaves PIC's trajectory and is DIVERGED, without the verdict MISREPORTED."""
    score = score_reports(PIT, PIT.impacts)
    assert score.grade is Grade.DIVERGED
    assert Verdict.MISREPORTED not in score.verdicts


def test_unreported_impact_makes_a_diverged_run_wrong() -> None:
    """A diverged run that does not report one of its impacts is WRONG and MISREPORTED, with no missed impact."""
    k = find_isolated_impact(PIT.impacts)
    score = score_reports(PIT, np.delete(PIT.impacts, k))
    assert score.grade is Grade.WRONG
    assert find_reason(score, Verdict.MISREPORTED).startswith("1 only in the states, the first at ")
    assert {Verdict.DIVERGED} == set(score.verdicts) & {Verdict.DIVERGED, Verdict.MISSED, Verdict.MULTIPLE_MISSED}


def test_reported_impact_that_no_state_shows_is_wrong() -> None:
    """A report of two distant bodies makes a diverged run WRONG; the reason names the time and the bodies."""
    k = find_isolated_impact(PIT.impacts)
    invented = PIT.impacts[[k]].copy()
    busy = PIT.impacts[np.abs(PIT.impacts["time_s"] - invented[0]["time_s"]) <= 4 * DT]
    met = {frozenset((int(row["first"]), int(row["second"]))) for row in busy}
    invented["first"], invented["second"] = next((a, b) for b in range(12) for a in range(b) if {a, b} not in met)
    score = score_reports(PIT, np.concatenate([PIT.impacts, invented]))
    assert score.grade is Grade.WRONG
    assert find_reason(score, Verdict.MISREPORTED) == (
        f"1 only in the reports, the first at {invented[0]['time_s']:.6g} s between {pair_name(invented[0])}"
    )


def count_disagreements(
    windows: list[tuple[int, int, bool]], reports: list[int], rests: Sequence[tuple[int, int]] = ()
) -> tuple[int, int]:
    """Return how many reports of a pair, at these steps, no window shows, and how many windows have no report.

    Args:
        windows: First and last step of each window, and whether it is a crowd's.
        reports: Steps at whose end the pair is reported.
        rests: First and last steps of rest in which pushes show.
    """
    rows, meetings = np.zeros(len(windows), WINDOW_DTYPE), np.zeros(len(windows), MEETING_DTYPE)
    for k, (begin, end, crowd) in enumerate(windows):
        rows[k]["begin_s"], rows[k]["end_s"], rows[k]["entangled"], rows[k]["due"] = begin * DT, end * DT, crowd, 1
        meetings[k]["window"], meetings[k]["second"] = k, 1
    impacts = np.zeros(len(reports), IMPACT_DTYPE)
    impacts["time_s"], impacts["second"] = np.array(reports) * DT, 1
    slips, resting = np.zeros(0, SLIP_DTYPE), [(0, 1, begin * DT, end * DT) for begin, end in rests]
    truth = LocalTruth(
        *(9.0, 540, rows, meetings, slips, 0, (0, 0), 0, 0.0, math.nan),
        polygon=False,
        rests=np.array(resting, REST_DTYPE),
        invented=0,
        first_invented_s=math.nan,
        first_inventor=-1,
    )
    trace = replace(TRACE, impacts=impacts)
    found = compare_reports_with_states(trace, truth)
    assert found.agree == (found.unshown == found.unreported == 0)
    return found.unshown, found.unreported


def test_each_window_gets_its_own_report() -> None:
    """A crowd's window does not take its neighbour's report, and windows in a row take theirs in order."""
    assert count_disagreements([(91, 93, True), (94, 96, False)], [92, 95]) == (0, 0)
    assert count_disagreements([(91, 93, True), (94, 96, False)], [95]) == (0, 0)
    assert count_disagreements([(10, 11, False), (13, 14, False)], [13, 16]) == (0, 0)
    assert count_disagreements([(10, 11, False), (10, 12, True)], [11, 13]) == (0, 0)


def test_extra_and_missing_reports_are_counted() -> None:
    """A window of one impact needs exactly one report, up to two steps away; any other counts as not shown."""
    assert count_disagreements([(10, 11, False)], [11, 12]) == (1, 0)
    assert count_disagreements([(10, 11, False)], [14]) == (1, 1)
    assert count_disagreements([(10, 11, False)], [13]) == (0, 0)
    assert count_disagreements([(10, 11, False), (13, 14, False)], [11]) == (0, 1)
    assert count_disagreements([], [14]) == (1, 0)


def test_resting_pair_can_have_any_number_of_reports() -> None:
    """A rest shows any number of reports up to two steps away, and needs none; others are not shown."""
    assert count_disagreements([], [4, 5, 6, 7, 8], [(6, 7)]) == (0, 0)
    assert count_disagreements([], [3, 10], [(6, 7)]) == (2, 0)
    assert count_disagreements([], [10, 14], [(2, 8), (16, 20), (40, 41)]) == (0, 0)
    assert count_disagreements([], [12, 30], [(2, 8), (16, 20), (40, 41)]) == (2, 0)
    assert count_disagreements([(10, 11, False)], [], [(6, 11)]) == (0, 1)


#: A disc that meets a floor and, in the same frame of PIT, a slope. The slope sends it on so slowly that it hops from
#: frame to frame, each time by less than its fall in three frames. PIC has one impact, with the slope.
NARROW = staged(
    "narrow",
    *(disc_at(0.0, 0.5, 2.1, -0.13, r=0.25), wall_at(0.0, 0.0, 0.0, 1.0), wall_at(1.0, 0.0, -0.65, 0.76)),
    gravity_m_s2=(0.0, -2.0),
    wall_friction=0.3,
    duration_s=2.0,
)


def test_pit_that_hops_on_a_slope_reports_what_it_shows() -> None:
    """PIT that hops on a slope at each frame is DIVERGED, not MISREPORTED; a false floor report is WRONG."""
    run = run_pit(NARROW)
    hops = run.impacts[run.impacts["second"] == -2]
    assert len(hops) > 50
    score = score_reports(run, run.impacts)
    assert score.grade is Grade.DIVERGED
    assert Verdict.MISREPORTED not in score.verdicts
    lie = hops[[2]].copy()
    lie["second"] = -1
    score = score_reports(run, np.concatenate([run.impacts, lie]))
    assert score.grade is Grade.WRONG
    assert find_reason(score, Verdict.MISREPORTED).startswith("1 only in the reports, the first at ")
