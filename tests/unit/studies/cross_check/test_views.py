"""What the report says must follow from the rows."""

import io
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from tests.cases import each
from tests.scene_builders import cross_checked, disc_at, staged, sure

from carom.comparator import Grade, Score, Verdict, compare
from carom.engines.api import Capabilities
from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Job, Method, Status
from carom.execution.results import Results, Row
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace
from carom.report import formatting
from carom.report.document import Lines, Media
from carom.report.junit import render_junit
from carom.report.outcome_marks import Mark
from carom.report.paths import build_exact_paths, build_observed_paths
from carom.report.render.html import render_html
from carom.report.render.markdown import render_markdown
from carom.report.render.terminal import render_terminal
from carom.report.replay import build_impact_rows
from carom.report.results_file.lines_from_rows import build_line, list_reasons
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.fault_pictures import find_divergences
from carom.studies.cross_check.grid import GridCell, build_grid
from carom.studies.cross_check.trend_section import build_trend


def said(results: Results) -> str:
    """All that a terminal shows."""
    buffer = io.StringIO()
    console = Console(file=buffer, width=200)
    for item in render_terminal(cross_check_document(results), 160, full=True):
        console.print(item, soft_wrap=isinstance(item, str), markup=False, highlight=False)
    return buffer.getvalue()


def test_grid_holds_every_scene_and_engine(
    results: Results, nasty: str, not_run: Mapping[str, tuple[Status, str]]
) -> None:
    """Each scene has a cell for each engine and profile, with its row at the scene's coarsest step."""
    grid = build_grid(results)
    assert [row.name for row in grid.rows] == ["paper/late", "paper/missed", nasty]
    assert [column.engine for column in grid.columns.values()] == ["pic", "pit", "toy", *not_run]
    for row in grid.rows:
        for column, cell in zip(grid.columns.values(), row.cells, strict=True):
            assert (sure(cell.line).engine, sure(cell.line).refinement) == (column.engine, 0)
            assert cell.reasons
            assert all(cell.reasons)


def test_every_cell_that_was_not_run_has_its_reason(
    results: Results, not_run: Mapping[str, tuple[Status, str]]
) -> None:
    """Each cell has its reason, and the list below the grid has it once for all cells that share it."""
    grid = build_grid(results)
    section = next(s for s in cross_check_document(results).sections if s.heading == "Runs without a score")
    (block,) = section.select_for(Media.PAGE)
    (short,) = section.select_for(Media.TERMINAL)
    assert isinstance(block, Lines)
    assert isinstance(short, Lines)
    lines = block.items
    assert len(lines) == len(not_run)
    assert short.items == lines
    for engine, (status, reason) in not_run.items():
        cells = grid.list_cells(next(column for column in grid.columns.values() if column.engine == engine))
        assert {cell.reasons for cell in cells} == {(reason,)}
        assert {cell.mark for cell in cells} == {Mark[status.name]}
        assert sum(reason in line and "every scene" in line for line in lines) == 1


def test_a_row_that_ran_keeps_its_verdicts_where_it_could_not_be_timed(results: Results) -> None:
    """Why a row has no run time is said after its verdicts, in the grid and in JUnit, and takes none of them away."""
    untimed = "timed out: no answer in 60 s"
    rows = tuple(replace(row, timing=None, untimed=untimed if row.score else "") for row in results.rows)
    for before, after in zip(results.rows, rows, strict=True):
        said = (f"not timed: {untimed}",) if before.score else ()
        assert list_reasons(build_line(after)) == (*list_reasons(build_line(before)), *said)
    wrong = next(row for row in rows if row.grade is Grade.WRONG)
    assert str(wrong.score and wrong.score.findings[0].verdict.value) in render_junit(replace(results, rows=rows))


def test_a_cell_without_a_row_says_so(results: Results, nasty: str) -> None:
    """Where a profile was not planned at a scene's coarsest step the grid has a cell all the same."""
    rows = tuple(row for row in results.rows if not (row.job.engine == "toy" and row.job.scene.name == nasty))
    cell = build_grid(replace(results, rows=rows)).rows[2].cells[2]
    assert (cell.mark, cell.figure) == (Mark.ABSENT, "")
    assert "another profile" in cell.reasons[0]


def test_a_run_without_a_reference_is_not_scored(results: Results) -> None:
    """What PIC can't solve is shown as not scored, with the reason, and counted in no grade."""
    rows = tuple(replace(row, score=None) for row in results.rows)
    bare = replace(results, rows=rows, references={}, known={})
    grid = build_grid(bare)
    assert {cell.mark for cell in grid.list_cells(list(grid.columns.values())[2])} == {Mark.UNSCORED}
    assert "could be scored" in said(bare)


def test_what_has_a_horizon_before_its_first_impact_has_no_tick(results: Results) -> None:
    """Where no impact may be believed, no cell is shown as exact or sampled, and each says why it is not graded."""
    pit = {(row.job.scene.name, row.job.dt_s): row.trace for row in results.rows if row.job.engine == "pit"}

    def at_nothing(row: Row) -> Row:
        if row.trace is None:
            return row
        name = row.job.scene.name
        sampling = pit[name, row.job.dt_s]
        return replace(row, score=compare(results.references[name], row.trace, sampling=sampling, horizon=0))

    bare = replace(results, rows=tuple(at_nothing(row) for row in results.rows))
    shown = [cell for row in build_grid(bare).rows for cell in row.cells if cell.mark.ran]
    assert {(cell.mark, cell.mark.symbol, cell.figure) for cell in shown} == {(Mark.UNGRADED, "○", "none compared")}
    assert all("no impact is within the horizon" in "; ".join(cell.reasons) for cell in shown)
    (table,) = re.findall(r"(?s)paper/late.*?paper/missed[^\n]*", said(bare))[:1]
    assert "✓" not in table
    assert "≈" not in table


def cell_of(scene: Scene, observed: Trace, dt_s: float) -> tuple[GridCell, Score]:
    """What a grid of one cell shows of a trace, and its score."""
    reference = solve_pic(scene)
    found = compare(reference, observed, sampling=solve_pit(scene, frame_rate_hz=1.0 / dt_s))
    row = Row(Job(scene, Method("toy", "tuned"), dt_s), Status.RAN, trace=observed, score=found)
    here = Environment("", "", "", "", "", 1, {})
    grid = build_grid(Results((row,), {scene.name: reference}, {}, (), here, "", 0.0))
    return grid.rows[0].cells[0], found


def test_late_is_late_wherever_it_is_told() -> None:
    """In 32 bits a run of 30 s rounds to 3e-4 s, and a hundredth of a step is less: 2.5e-4 s is late in every place."""
    scene = staged("slow", disc_at(-5, 0, 1, 0, r=0.5), disc_at(0, 0, r=0.5), duration_s=30.0)
    right = solve_pic(scene)
    impacts = right.impacts.copy()
    impacts["time_s"] += 2.5e-4
    cell, score = cell_of(scene, replace(right, impacts=impacts, dt_s=1 / 60, float_bits=32), 1 / 60)
    assert Verdict.LATE in score.verdicts
    assert cell.figure == "0.015 steps late"
    (told,) = build_impact_rows(right, sure(sure(cell.row).trace), score)
    assert (told["flag"], told["became"]) == ("late", "0.015 steps late")


def test_an_impact_too_close_to_the_end_is_not_called_none() -> None:
    """Where the one impact comes in the last step, a run that has not found it yet leaves one undecided."""
    scene = staged("last", disc_at(-5, 0, 1, 0, r=0.5), disc_at(0, 0, r=0.5), duration_s=4.01)
    right = solve_pic(scene)
    assert len(right.impacts) == 1
    start = scene.arrays
    before = replace(
        right,
        impacts=right.impacts[:0],
        dt_s=1 / 60,
        final_velocity_m_s=start.velocity_m_s,
        final_position_m=start.position_m + 4.01 * start.velocity_m_s,
    )
    cell, _ = cell_of(scene, before, 1 / 60)
    assert (cell.mark, cell.figure) == (Mark.UNGRADED, "1 of 1 undecided")


def test_a_scene_is_wrong_for_more_than_an_impact(results: Results) -> None:
    """A run that ends early is wrong though it misses nothing: no sentence calls it one that misses an impact."""
    row = next(row for row in results.rows if row.job.engine == "toy" and row.job.scene.name == "paper/late")
    score = compare(
        results.references["paper/late"], replace(sure(row.trace), outcome=Outcome.WARNED, notes=("careful",))
    )
    assert (score.grade, score.missed, score.spurious) == (Grade.WRONG, (), ())
    early = replace(results, rows=tuple(replace(r, score=score) if r is row else r for r in results.rows))
    told = next(s for s in cross_check_document(early).sections if s.heading == "Error against step")
    assert "missed or invented impact" not in str(told.blocks)


def test_verdict_line_counts_the_rows(results: Results) -> None:
    """The numbers of the verdict are those of the foreign engines' rows at the coarsest step."""
    line = said(results)
    rows = [row for row in results.rows if row.job.engine == "toy" and row.job.refinement == 0]
    assert f"Of {len(rows)} engine runs at each scene's own frame rate" in line
    for grade in (Grade.SAMPLED, Grade.WRONG):
        n = sum(row.grade is grade for row in rows)
        assert n
        assert f"{n} {grade.name.lower()}" in line
    assert "PIC reproduces all 3 known answers (largest deviation 2.5e-15)." in line
    assert "3 unsupported; 3 unavailable; 3 crashed; 3 timed out; 3 failed" in line
    assert "gone is not installed; pip install 'gone'" in line


def test_engines_that_are_not_installed_are_named(results: Results) -> None:
    """Engines that are not installed are one sentence on a terminal, and a line with the reason in the report."""
    reason = f"absent is not installed; make it in {Path.cwd() / 'its' / 'folder'}"
    missing = EngineInfo("absent", "Absent", "", reason, Capabilities(), {"tuned": ""}, "")
    shown = replace(results, engines=(*results.engines, missing))
    short = "\n".join(line for line in render_terminal(cross_check_document(shown), 80) if isinstance(line, str))
    assert "Not installed: absent; 'carom engines' shows how to install them." in short
    assert "absent is not run: absent is not installed; make it in its/folder" in said(shown)
    assert "absent is not run: absent is not installed; make it in its/folder" in render_markdown(
        cross_check_document(shown)
    )
    assert "absent" not in said(results)


def test_verdict_line_without_engines_speaks_of_pit(results: Results) -> None:
    """Where only Carom's own methods were run, the counts are PIT's."""
    own = tuple(row for row in results.rows if row.job.engine in {"pic", "pit"})
    assert "Of 3 PIT runs at" in said(replace(results, rows=own, engines=results.engines[:2]))


def test_verdict_line_with_other_steps_does_not_speak_of_frame_rates(results: Results) -> None:
    """Where the coarsest step is not the scene's frame, the sentence says so."""
    rows = tuple(
        replace(row, job=replace(row.job, dt_s=row.job.dt_s / 3.0, refinement=row.job.refinement))
        for row in results.rows
    )
    assert "at the coarsest step" in said(replace(results, rows=rows))


def test_trend_compares_the_same_scenes_at_every_step(results: Results, nasty: str) -> None:
    """Medians are over scenes in which PIT has a velocity error at each step; PIT's falls with the step, PIC's is 0."""
    grid = build_grid(results)
    trend = build_trend(grid)
    assert trend.parts == (1.0, 0.25)
    assert trend.scenes == ("paper/late",)
    left_out = {name for names in trend.left_out.values() for name in names}
    assert left_out == {"paper/missed", nasty}
    series = {entry.column.engine: entry.points for entry in trend.series}
    assert [point.median for point in series["pic"]] == [0.0, 0.0]
    coarse, fine = (point.median for point in series["pit"])
    assert sure(coarse) > sure(fine) > 0.0
    assert series["gone"][0].median is None
    assert series["pit"][0].wrong == 1


def test_the_trend_has_pic_once() -> None:
    """PIC has nothing to set, so all its profiles are one line; an engine's profiles are each one."""
    results = cross_checked(
        ["paper/late"], ["pic", "pit", "pymunk"], profiles=["default", "tuned"], dts=[1 / 24, 1 / 96]
    )
    assert [series.name for series in build_trend(build_grid(results)).series] == [
        *("PIC", "PIT", "pymunk default", "pymunk tuned")
    ]


def test_reference_path_turns_at_the_impact_and_ends_at_the_final_state(results: Results) -> None:
    """The exact path has a corner at each impact's instant, where the two discs touch."""
    trace = results.references["paper/late"]
    paths = build_exact_paths(trace)
    (impact,) = trace.impacts
    a, b = (paths.position_at(disc, impact["time_s"]) for disc in (0, 1))
    assert np.hypot(*(b - a)) == pytest.approx(0.6, abs=1e-12)
    assert len(paths.impact_positions) == 2
    for disc, (_, points) in enumerate(paths.lines):
        np.testing.assert_allclose(points[-1], trace.final_position_m[disc])
        assert len(points) == 3


def test_observed_path_has_a_point_for_each_step(results: Results) -> None:
    """A sampled path runs through the states looked at, and ends where the scene does, if the last step reaches on."""
    row = next(row for row in results.rows if row.job.engine == "pit" and row.trace is not None)
    assert row.trace is not None
    paths = build_observed_paths(row.trace)
    times, points = paths.lines[0]
    assert times[-1] == row.trace.end_time_s
    assert len(times) == 25
    np.testing.assert_allclose(points[-1], row.trace.final_position_m[0])
    without = build_observed_paths(replace(row.trace, samples=None))
    np.testing.assert_allclose(without.lines[0][1][-1], points[-1])


def test_verdict_table_shows_every_cell(results: Results, nasty: str) -> None:
    """The terminal's table has a line for each scene, a column for each engine, and the legend of what it shows."""
    text = said(results)
    assert nasty in text
    assert re.search(r"paper/missed .* ✓ exact .* ✗ -1 .* ✗ -1 .*unavailable.*unsupported.*crashed", text)
    assert "wrong: misses or invents an impact, has impacts out of order" in text


def test_nothing_run_is_still_a_report(results: Results) -> None:
    """Where no engine could be run at all the report says why, and draws nothing."""
    rows = tuple(row for row in results.rows if row.status is not Status.RAN)
    bare = cross_check_document(replace(results, rows=rows))
    assert {"Error against step", "What goes wrong"}.isdisjoint(section.heading for section in bare.sections)
    assert "No engine run at each scene's own frame rate could be scored." in " ".join(bare.lead)
    assert "<svg" not in render_html(bare)


def test_scenes_too_full_to_draw_are_left_out(results: Results) -> None:
    """A picture of very many discs shows nothing and weighs megabytes: such a scene is not among the pictures."""
    grid = build_grid(results)
    paper, _ = find_divergences(grid)
    assert len(paper) == 2
    assert find_divergences(grid, most_discs=1) == ((), ())


@each(
    "value, shown",
    [
        (0.0, "0"),
        (0.0754, "0.075"),
        (0.0999, "0.1"),
        (0.00999, "0.01"),
        (0.95, "0.95"),
        (0.001, "0.001"),
        (1.0, "1"),
        (12.34, "12"),
        (100.0, "100"),
        (1234.0, "1234"),
        (-0.5, "-0.5"),
        (2.5e-15, "2.5e-15"),
        (1e-16, "1e-16"),
        (9.99e-6, "1e-5"),
        (1e30, "1e30"),
        (float("nan"), "n/a"),
        (float("inf"), "∞"),
    ],
)
def test_numbers_are_short_and_right(value: float, shown: str) -> None:
    """A number is shown to two digits, without padding, and never as 0 when it is not."""
    assert formatting.format_number(value) == shown


@each("dt_s, shown", [(1 / 24, "1/24 s"), (1 / 960, "1/960 s"), (0.03, "0.03 s"), (2.0, "2 s")])
def test_steps_are_fractions_where_they_are(dt_s: float, shown: str) -> None:
    """A step is shown as the fraction of a second that it is meant to be."""
    assert formatting.format_step(dt_s) == shown
