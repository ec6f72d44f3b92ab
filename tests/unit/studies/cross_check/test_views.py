"""Grid and sentences of a report follow from the rows."""

import io
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from tests.cases import each
from tests.scene_builders import require_value

from carom.comparator import Grade, compare
from carom.engines.api import Capabilities
from carom.engines.registry import EngineInfo
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.model.trace import Outcome
from carom.report.document import Lines, Media
from carom.report.outcome_marks import Mark
from carom.report.render.html import render_html
from carom.report.render.markdown import render_markdown
from carom.report.render.terminal import render_terminal
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.trend import build_trend
from carom.support import formatting


def render_text(results: Results) -> str:
    """All that a terminal shows."""
    buffer = io.StringIO()
    console = Console(file=buffer, width=200)
    for item in render_terminal(cross_check_document(results), 160, full=True):
        console.print(item, soft_wrap=isinstance(item, str), markup=False, highlight=False)
    return buffer.getvalue()


def test_cells_without_run_have_reasons_listed_once(
    results: Results, not_run: Mapping[str, tuple[Status, str]]
) -> None:
    """Each cell without a run has its reason, and the list below the grid contains each reason once."""
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
        cells = grid.list_cells(next(method for method in grid.methods if method.engine == engine))
        assert {cell.reasons for cell in cells} == {(reason,)}
        assert {cell.mark for cell in cells} == {Mark[status.name]}
        assert sum(reason in line and "every scene" in line for line in lines) == 1


def test_cell_without_row_is_marked_absent(results: Results, nasty: str) -> None:
    """If a profile was not planned for a scene, its cell is marked as absent, with the reason."""
    rows = tuple(row for row in results.rows if not (row.job.engine == "toy" and row.job.scene.name == nasty))
    cell = build_grid(replace(results, rows=rows)).rows[2].cells[2]
    assert (cell.mark, cell.figure) == (Mark.ABSENT, "")
    assert "another profile" in cell.reasons[0]


def test_runs_without_reference_are_marked_unscored(results: Results) -> None:
    """Runs of scenes that PIC can't solve are marked as not scored, and the text reports this."""
    rows = tuple(replace(row, score=None) for row in results.rows)
    bare = replace(results, rows=rows, references={}, known={})
    grid = build_grid(bare)
    assert {cell.mark for cell in grid.list_cells(grid.methods[2])} == {Mark.UNSCORED}
    assert "could be scored" in render_text(bare)


def test_runs_without_reliable_impacts_are_ungraded(results: Results) -> None:
    """If no impact is within the horizon, each cell is ungraded with the reason, never exact or sampled."""
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
    (table,) = re.findall(r"(?s)paper/late.*?paper/missed[^\n]*", render_text(bare))[:1]
    assert "✓" not in table
    assert "≈" not in table


def test_run_that_ends_early_is_not_counted_as_missing_impacts(results: Results) -> None:
    """A run that ended early is wrong, and no text calls it one that misses or invents an impact."""
    row = next(row for row in results.rows if row.job.engine == "toy" and row.job.scene.name == "paper/late")
    cut = replace(require_value(row.trace), outcome=Outcome.WARNED, notes=("careful",))
    score = compare(results.references["paper/late"], cut)
    assert (score.grade, score.missed, score.spurious) == (Grade.WRONG, (), ())
    early = replace(results, rows=tuple(replace(r, score=score) if r is row else r for r in results.rows))
    told = next(s for s in cross_check_document(early).sections if s.heading == "Error against step size")
    assert "missed or invented impact" not in str(told.blocks)


def test_run_without_decided_impacts_shows_their_number(results: Results) -> None:
    """A run whose only impact is undecided, since it is in the last step, shows "1 of 1 undecided"."""
    row = next(row for row in results.rows if row.job.engine == "pit" and row.job.scene.name == "paper/missed")
    score = replace(require_value(row.score), missed=(), undecided=(0,), findings=())
    (cells,) = build_grid(replace(results, rows=(replace(row, score=score),))).rows
    assert cells.cells[0].figure == "1 of 1 undecided"


def test_summary_counts_engine_runs_by_grade(results: Results) -> None:
    """The terminal shows each cell's mark, a legend, and the number of runs by grade, reason and known answer."""
    line = render_text(results)
    assert re.search(r"paper/missed .* ✓ exact .* ✗ -1 .* ✗ -1 .*unavailable.*unsupported.*crashed", line)
    assert "wrong: misses or invents an impact, has impacts out of order" in line
    rows = [row for row in results.rows if row.job.engine == "toy" and row.job.refinement == 0]
    assert f"Grades of {len(rows)} engine runs at each scene's own frame rate: " in line
    for grade in (Grade.SAMPLED, Grade.WRONG):
        n = sum(row.grade is grade for row in rows)
        assert n
        assert re.search(rf"frame rate: [^.]*\b{n} {grade.name.lower()}\b", line)
    assert "PIC reproduces all 3 known answers (largest deviation 2.5e-15)." in line
    assert "3 unsupported, 3 unavailable, 3 crashed, 3 timed out, 3 failed" in line
    assert "gone is not installed; pip install 'gone'" in line


def test_report_names_engines_that_are_not_installed(results: Results) -> None:
    """Engines that are not installed are named briefly in the terminal, and with the reason in the report."""
    reason = f"absent is not installed; make it in {Path.cwd() / 'its' / 'folder'}"
    missing = EngineInfo("absent", "Absent", "", reason, Capabilities(), {"tuned": ""}, "")
    shown = replace(results, engines=(*results.engines, missing))
    short = "\n".join(line for line in render_terminal(cross_check_document(shown), 80) if isinstance(line, str))
    assert "Not installed: absent; 'carom engines' shows how to install them." in short
    full = "absent is not run: absent is not installed; make it in its/folder"
    assert full in render_text(shown)
    assert full in render_markdown(cross_check_document(shown))
    assert "absent" not in render_text(results)


def test_trend_uses_scenes_with_errors_at_every_step(results: Results, nasty: str) -> None:
    """The trend shows medians over scenes in which PIT has errors at each step: PIT's falls, and PIC's is 0."""
    trend = build_trend(build_grid(results))
    assert (trend.parts, trend.scenes) == ((1.0, 0.25), ("paper/late",))
    assert {name for names in trend.left_out.values() for name in names} == {"paper/missed", nasty}
    series = {entry.method.engine: entry.points for entry in trend.series}
    assert [point.median for point in series["pic"]] == [0.0, 0.0]
    coarse, fine = (point.median for point in series["pit"])
    assert coarse > fine > 0.0
    assert series["gone"][0].errors == ()
    assert series["pit"][0].wrong == 1


def test_report_without_any_run_gives_the_reason(results: Results) -> None:
    """Without any run, the report states that nothing could be scored and contains no drawings."""
    rows = tuple(row for row in results.rows if row.status is not Status.RAN)
    bare = cross_check_document(replace(results, rows=rows))
    assert {"Error against step size", "What goes wrong"}.isdisjoint(section.heading for section in bare.sections)
    assert "No engine run at each scene's own frame rate could be scored." in " ".join(bare.lead)
    assert "<svg" not in render_html(bare)


@each(
    "value, shown",
    [
        (0.0, "0"),
        (0.0754, "0.075"),
        (0.00999, "0.01"),
        (1234.0, "1234"),
        (-0.5, "-0.5"),
        (2.5e-15, "2.5e-15"),
        (9.99e-6, "1e-5"),
        (float("nan"), "n/a"),
        (float("inf"), "∞"),
    ],
)
def test_format_number_uses_two_digits(value: float, shown: str) -> None:
    """`format_number` shows two significant digits without padding, and 0 only for 0."""
    assert formatting.format_number(value) == shown


@each("dt_s, shown", [(1 / 24, "1/24 s"), (1 / 960, "1/960 s"), (0.03, "0.03 s"), (2.0, "2 s")])
def test_format_step_uses_fractions(dt_s: float, shown: str) -> None:
    """`format_step` shows steps such as 1/24 s as fractions, and others as decimals."""
    assert formatting.format_step(dt_s) == shown
