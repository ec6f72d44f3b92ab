"""Each verdict is true where it is said, and not said where it is not; the page of scoring has every sentence."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from tests.planted.faults import DT, FIRST_S, LAST_S, ROW, find_reason, replay_impacts, replay_reference
from tests.scene_builders import alter_impact, disc_at, staged, wall_at

from carom import compare, solve_pic, solve_pit
from carom.comparator import Grade, Verdict
from carom.comparator.verdicts.stepwise_verdicts import report_polygons
from carom.model.trace import Outcome
from carom.report.outcome_marks import mark_of_grade

ROOT = Path(__file__).resolve().parents[4]
PAGE = (ROOT / "docs" / "theory" / "scoring.md").read_text()


def read_first_column(heading: str) -> list[str]:
    """Return the first cell of each row of the table below a heading of the page."""
    below = PAGE.partition(f"\n## {heading}")[2].partition("\n## ")[0]
    return [row for row in re.findall(r"^\| (.+?) \|", below, re.MULTILINE) if row not in ("verdict", "grade", "---")]


def test_scoring_page_lists_exactly_the_verdicts_and_grades() -> None:
    """The tables of scoring.md have each verdict, and each grade by its displayed word from best to worst."""
    assert sorted(read_first_column("6. The verdicts")) == sorted(verdict.value for verdict in Verdict)
    assert read_first_column("7. The grade") == [mark_of_grade(grade, 64).word for grade in Grade]


def test_run_that_continues_past_a_standstill_is_wrong() -> None:
    """Where PIC ends in STANDSTILL, a run that completes is WRONG, and the reason names inelastic collapse."""
    whole = solve_pic(ROW)
    kept = whole.impacts["time_s"] <= FIRST_S
    ended = dataclasses.replace(
        whole, impacts=whole.impacts[kept], outcome=Outcome.STANDSTILL, end_time_s=(FIRST_S + LAST_S) / 2
    )
    completes = dataclasses.replace(replay_impacts(ended, ended.impacts.copy()), outcome=Outcome.COMPLETED)
    score = compare(ended, completes)
    assert score.grade is Grade.WRONG
    assert Verdict.CONFORMS not in score.verdicts
    assert "inelastic collapse" in find_reason(score, Verdict.WENT_ON)


def test_conforms_reason_counts_impacts_up_to_the_horizon() -> None:
    """With a horizon between two impacts, the reason of CONFORMS counts only the first."""
    reference = solve_pic(ROW)
    score = compare(reference, replay_reference(reference), horizon=(FIRST_S + LAST_S) / 2)
    assert find_reason(score, Verdict.CONFORMS) == "1 of 1 impacts found up to 0.875 s"
    assert find_reason(compare(reference, replay_reference(reference)), Verdict.CONFORMS) == "2 of 2 impacts found"


def test_energy_above_the_reference_is_not_described_as_a_gain() -> None:
    """A disc that keeps .36 of its energy instead of .25 has more than the reference, but has gained none."""
    # The text of ENERGY_GAINED compares final energies.
    wall = wall_at(0, 0, -1, 0)
    reference, other = (
        solve_pic(staged("rebound", disc_at(-3, 0, 4, 0), wall, wall_restitution=restitution, duration_s=1.5))
        for restitution in (0.5, 0.6)
    )
    observed = dataclasses.replace(other, scene=reference.scene, dt_s=DT)
    score = compare(reference, observed, sampling=solve_pit(reference.scene, frame_rate_hz=1 / DT))
    assert find_reason(score, Verdict.ENERGY_GAINED).startswith("0.11 of the scene's energy")
    assert Verdict.ENERGY_GAINED.value == "discs end with more kinetic energy than the reference's"


def test_late_time_stamp_is_late_if_the_path_is_unknown() -> None:
    """If the time of a path's turn is unknown, a late reported time gives LATE, with its steps."""
    reference = solve_pic(ROW)
    late = alter_impact(replay_reference(reference), 0, time_s=FIRST_S + 0.5 * DT)
    unknown = np.array([np.nan, LAST_S])
    score = compare(reference, dataclasses.replace(late, effective_time_s=unknown))
    assert "0.5 steps" in find_reason(score, Verdict.LATE)


def test_polygon_deviation_is_half_of_g_dt_squared() -> None:
    """Straight steps of 0.25 s at 2 m/s^2 are reported to deviate from the parabola by 0.0625 m."""
    evidence: Any = SimpleNamespace(local_truth=SimpleNamespace(polygon=True), observed=SimpleNamespace(dt_s=0.25))
    evidence.reference = solve_pic(staged("falls", disc_at(0.0, 0.0), gravity_m_s2=(0.0, -2.0), duration_s=1.0))
    (finding,) = report_polygons(evidence)
    assert " 0.0625 m (half of |g| dt^2) off its parabola;" in finding.reason
