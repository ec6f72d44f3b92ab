"""Accuracy of single steps from the run's own state: which runs are listed, and in which order."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from tests.scene_builders import disc_at, require_value, run_cross_check, staged

from carom.comparator import Grade, Verdict
from carom.comparator.verdict import Finding
from carom.execution.job import Job, Method
from carom.execution.results import Results, Row
from carom.report.document import Media, Section, Table, Text
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.stepwise import build_steps_section

#: A graze that parts trajectories: whatever is said of the steps is put in by hand.
GRAZE = staged("mine/graze", disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3), duration_s=1.0)


@pytest.fixture(scope="module")
def graze_results() -> Results:
    """PIC and PIT on one scene without a horizon, a rest or a trajectory that diverged."""
    return run_cross_check([GRAZE], ["pic", "pit"], dts=[1 / 24])


def build_row(results: Results, name: str, steps: Mapping[str, Any], score: Mapping[str, Any]) -> Row:
    """Return PIT's row under the name of an engine, with other numbers of its steps and of its score."""
    row = next(row for row in results.rows if row.job.engine == "pit")
    local = replace(require_value(require_value(row.score).local_truth), **steps)
    job = Job(row.job.scene, Method(name, "tuned"), row.job.dt_s, row.job.refinement)
    return replace(row, job=job, score=replace(require_value(row.score), local_truth=local, **score))


def replace_rows(results: Results, rows: Mapping[str, Mapping[str, Any]], **score: Any) -> Results:
    """Return results of these engines alone, each beyond a horizon."""
    beyond = {"beyond_horizon": 3, **score}
    return replace(results, rows=tuple(build_row(results, name, steps, beyond) for name, steps in rows.items()))


def get_table(section: Section, medium: Media) -> tuple[list[str], list[list[str]]]:
    """Return headings and cells of a section's table in a medium."""
    (found,) = (block for block in section.select_for(medium) if isinstance(block, Table))
    columns, rows = found.select_for(medium)
    return [column.line for column in columns], [[cell.line for cell in row] for row in rows]


def list_ranking(results: Results) -> list[str]:
    """Return the engines in the order of the terminal's table."""
    _, shown = get_table(build_steps_section(build_grid(results)), Media.TERMINAL)
    return [row[0].split()[0] for row in shown]


def join_paragraphs(section: Section, medium: Media) -> str:
    """Return all paragraphs of a section in a medium."""
    return "\n".join(block.text for block in section.select_for(medium) if isinstance(block, Text))


def test_runs_are_ranked_by_misses_then_other_step_errors(graze_results: Results) -> None:
    """Steps are ranked by misses that PIT does not share, then other errors. A run that was cut short is last."""
    base: dict[str, Any] = dict.fromkeys(("missed", "missed_by_pit", "invented", "early"), 0)
    base |= {"ratio": (0.2, 1.0), "energy": 0.0}
    worse: dict[str, dict[str, Any]] = {
        "as-pit": {"missed": 9, "missed_by_pit": 9, "missed_within": 0},
        "energy": {"energy": 0.1},
        "error": {"ratio": (0.1, 1.5)},
        "nothing-compared": {"ratio": (math.nan, math.nan)},
        "early": {"early": 1, "ratio": (0.0, 0.0)},
        "invents": {"invented": 1, "ratio": (0.0, 0.0)},
        "misses": {"missed": 1, "ratio": (0.0, 0.0)},
    }
    rows = {name: {**base, **other} for name, other in reversed(worse.items())}
    ranked = replace_rows(graze_results, rows)
    assert list_ranking(ranked) == list(worse)
    *others, best = ranked.rows
    cut = replace(require_value(best.score), findings=(Finding(Verdict.CUT_SHORT, "at 0.1 s"),))
    assert list_ranking(replace(ranked, rows=(*others, replace(best, score=cut))))[-1] == "as-pit"


def test_misses_shared_with_pit_are_shown_separately(graze_results: Results) -> None:
    """Three missed impacts, of which PIT misses two from the same state, are shown as "3 (2)"."""
    results = replace_rows(graze_results, {"engine": {"missed": 3, "missed_by_pit": 2, "invented": 4}})
    section = build_steps_section(build_grid(results))
    heads, (row,) = get_table(section, Media.TERMINAL)
    assert row[heads.index("impacts - (PIT's) +")] == "-3 (2) +4"
    heads, (row,) = get_table(section, Media.MARKDOWN)
    assert row[heads.index("missed (PIT's)")] == "3 (2)"
    assert row[heads.index("invented")] == "4"


def test_diverged_run_shows_divergence_times_and_step_grade(graze_results: Results) -> None:
    """A column states the time at which the run diverged; the steps have a grade of their own."""
    results = replace_rows(graze_results, {"engine": {"early": 1}}, grade=Grade.DIVERGED_INACCURATE, diverged_s=0.25)
    section = build_steps_section(build_grid(results))
    heads, (row,) = get_table(section, Media.TERMINAL)
    assert row[heads.index("diverged at")] == "0.25 s"
    heads, (row,) = get_table(section, Media.MARKDOWN)
    assert row[heads.index("grade")].endswith("diverged inaccurate")
    assert row[heads.index("steps")].endswith("inaccurate")
    assert "diverged" not in row[heads.index("steps")]
