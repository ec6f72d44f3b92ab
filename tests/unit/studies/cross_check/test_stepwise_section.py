"""Each step from the run's own state: which runs are listed, how they are ranked, and what is said of them."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from tests.scene_builders import cross_checked, disc_at, staged, sure

from carom.comparator import Grade, Verdict
from carom.comparator.verdict import Finding
from carom.execution.job import Job, Method
from carom.execution.results import Results, Row
from carom.report.document import Media, Section, Table, Text
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.stepwise_section import build_steps_section

#: A graze that parts trajectories: whatever is said of the steps is put in by hand.
GRAZE = staged("mine/graze", disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3), duration_s=1.0)


@pytest.fixture(scope="module")
def plain() -> Results:
    """PIC and PIT on one scene without a horizon, a rest or a trajectory that parted."""
    return cross_checked([GRAZE], ["pic", "pit"], dts=[1 / 24])


def ran(results: Results, name: str, steps: Mapping[str, Any], score: Mapping[str, Any]) -> Row:
    """Return PIT's row under the name of an engine, with other numbers of its steps and of its score."""
    row = next(row for row in results.rows if row.job.engine == "pit")
    local = replace(sure(sure(row.score).local_truth), **steps)
    job = Job(row.job.scene, Method(name, "tuned"), row.job.dt_s, row.job.refinement)
    return replace(row, job=job, score=replace(sure(row.score), local_truth=local, **score))


def with_rows(results: Results, rows: Mapping[str, Mapping[str, Any]], **score: Any) -> Results:
    """Return results of these engines alone, each beyond a horizon."""
    beyond = {"beyond_horizon": 3, **score}
    return replace(results, rows=tuple(ran(results, name, steps, beyond) for name, steps in rows.items()))


def table(section: Section, medium: Media) -> tuple[list[str], list[list[str]]]:
    """Return headings and cells of a section's table in a medium."""
    (found,) = (block for block in section.select_for(medium) if isinstance(block, Table))
    columns, rows = found.select_for(medium)
    return [column.line for column in columns], [[cell.line for cell in row] for row in rows]


def ranked(results: Results) -> list[str]:
    """Return the engines in the order of the terminal's table."""
    _, shown = table(build_steps_section(build_grid(results)), Media.TERMINAL)
    return [row[0].split()[0] for row in shown]


def texts(section: Section, medium: Media) -> str:
    """Return all paragraphs of a section in a medium."""
    return "\n".join(block.text for block in section.select_for(medium) if isinstance(block, Text))


def test_runs_whose_trajectory_tells_all_are_not_listed(plain: Results) -> None:
    """Without a horizon, a rest, a parted trajectory, or a verdict of the steps alone, there is no table."""
    assert not build_steps_section(build_grid(plain)).blocks


def test_misses_then_inventions_then_early_then_error_then_energy_rank(plain: Results) -> None:
    """Each number decides only between what those before it leave equal; a miss that PIT shares counts for nothing."""
    base: dict[str, Any] = {
        "missed": 0,
        "missed_by_pit": 0,
        "invented": 0,
        "early": 0,
        "ratio": (0.2, 1.0),
        "energy": 0.0,
    }
    worse: dict[str, dict[str, Any]] = {
        "as-pit": {"missed": 9, "missed_by_pit": 9, "missed_within": 0},
        "energy": {"energy": 0.1},
        "error": {"ratio": (0.1, 1.5)},
        "nothing-judged": {"ratio": (math.nan, math.nan)},
        "early": {"early": 1, "ratio": (0.0, 0.0)},
        "invents": {"invented": 1, "ratio": (0.0, 0.0)},
        "misses": {"missed": 1, "ratio": (0.0, 0.0)},
    }
    rows = {name: {**base, **other} for name, other in reversed(worse.items())}
    assert ranked(with_rows(plain, rows)) == list(worse)


def test_rounding_ranks_nothing(plain: Results) -> None:
    """Errors of 1 to ten digits and energies of rounding are ties: the order of the methods stays."""
    rows = {"first": {"ratio": (0.2, 1.0 + 1e-11), "energy": 2e-15}, "second": {"ratio": (0.2, 1.0), "energy": 0.0}}
    assert ranked(with_rows(plain, rows)) == ["first", "second"]


def test_a_run_that_ended_early_stands_last(plain: Results) -> None:
    """What was not simulated can't be missed: a short run is no better than one that misses something later."""
    results = with_rows(plain, {"short": {"missed": 0}, "whole": {"missed": 5}})
    short, whole = results.rows
    cut = replace(sure(short.score), findings=(Finding(Verdict.CUT_SHORT, "at 0.1 s"),))
    results = replace(results, rows=(replace(short, score=cut), whole))
    assert ranked(results) == ["whole", "short"]


def test_both_counts_of_misses_stand_together(plain: Results) -> None:
    """A miss that PIT has from the same state is said to be that, on paper and on a terminal."""
    results = with_rows(plain, {"engine": {"missed": 3, "missed_by_pit": 2, "invented": 4}})
    section = build_steps_section(build_grid(results))
    heads, (row,) = table(section, Media.TERMINAL)
    assert row[heads.index("impacts - (PIT's) +")] == "-3 (2) +4"
    heads, (row,) = table(section, Media.MARKDOWN)
    assert row[heads.index("missed (PIT's)")] == "3 (2)"
    assert row[heads.index("invented")] == "4"


def test_a_parted_run_says_when_it_parted_and_when_pit_did(plain: Results) -> None:
    """One sentence has the times of the run and of PIT; the steps have their own grade in the column of the steps."""
    results = with_rows(plain, {"engine": {"early": 1}}, grade=Grade.PARTED_INACCURATE, parted_s=0.25, pit_parted_s=0.5)
    section = build_steps_section(build_grid(results))
    assert "0.25 s; PIT diverged at 0.5 s" in texts(section, Media.TERMINAL)
    heads, (row,) = table(section, Media.MARKDOWN)
    assert row[heads.index("grade")].endswith("parted inaccurate")
    assert row[heads.index("steps")].endswith("inaccurate")
    assert "parted" not in row[heads.index("steps")]


def test_a_suite_gains_no_line_on_a_terminal(plain: Results) -> None:
    """With more scenes than one the table is on paper, and in full with -v."""
    results = with_rows(plain, {"engine": {}})
    (row,) = results.rows
    other = replace(row, job=replace(row.job, scene=GRAZE.model_copy(update={"name": "other"})))
    references = {**results.references, "other": results.references[GRAZE.name]}
    results = replace(results, rows=(row, other), references=references)
    section = build_steps_section(build_grid(results))
    assert not section.select_for(Media.TERMINAL)
    heads, shown = table(section, Media.MARKDOWN)
    assert [row[heads.index("scene")] for row in shown] == [GRAZE.name, "other"]
