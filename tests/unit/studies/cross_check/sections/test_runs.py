"""Tables of every run: each metric, the spread over phases, run times and settings."""

import json
from dataclasses import fields, replace
from pathlib import Path

from carom.comparator import Errors
from carom.execution.phases import PhaseSpread
from carom.execution.results import Results, Row
from carom.report.document import Cell, Media, Section, Table
from carom.report.render.markdown import render_markdown
from carom.report.results_file.line_codec import OF_SPINS
from carom.report.results_file.results_jsonl import format_records
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.runs import (
    build_cells_section,
    build_run_time_section,
    build_settings_section,
    build_spread_section,
)
from carom.support import formatting


def get_table_rows(section: Section) -> list[list[Cell]]:
    """The rows of a section's one table, as a page shows them."""
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    return table.select_for(Media.PAGE)[1]


def test_every_error_metric_is_in_table_records_and_docs(results: Results) -> None:
    """Each field of `Errors` is a column of the table and documented; JSON lines omit only those of spins."""
    (table,) = build_cells_section(build_grid(results)).blocks
    assert isinstance(table, Table)
    columns, _ = table.select_for(Media.PAGE)
    head, *rows = (json.loads(line) for line in format_records(results).splitlines())
    assert head["rows"] == len(rows)
    for metric in fields(Errors):
        assert metric.metadata["name"] in {column.head for column in columns}
        assert all((metric.name in row["total"]) == (metric.name not in OF_SPINS) for row in rows if row["total"])
        assert f"`{metric.name}`" in Path("docs/theory/scoring.md").read_text(encoding="utf-8")


def test_spread_over_phases_has_a_section(results: Results) -> None:
    """With 12 phases, the spread section shows median, worst error and share of misses; with one it is missing."""
    spread = PhaseSpread(12, 3, 3, 0.0123, 0.0456, 0.01, 0.02, 0.25)
    rows = tuple(replace(row, spread=spread) if row.job.engine == "toy" else row for row in results.rows)
    wide = replace(results, rows=rows, phases=12)
    section = build_spread_section(build_grid(wide))
    shown = [[cell.text for cell in row] for row in get_table_rows(section)]
    assert {row[1] for row in shown} == {"toy tuned"}
    assert all({"0.012", "0.046", "25 %"} <= set(row) for row in shown)
    assert section.heading in render_markdown(cross_check_document(wide))
    assert section.heading not in render_markdown(cross_check_document(results))


def test_settings_and_run_time_ratios_come_from_the_traces(results: Results) -> None:
    """Settings come from the coarsest trace, with a remark if they vary with the step; ratios are medians."""
    grid = build_grid(results)
    settings = {row[0]: row for row in get_table_rows(build_settings_section(grid))}
    by_engine = {cell.text.split()[0]: row[-1].text for cell, row in settings.items()}
    assert set(by_engine) == {"PIC", "PIT", "toy"}
    assert by_engine["PIT"] == "dt_s = 0.0416667 (varies with the step)"
    medians = {row[0].text: row[1].text for row in get_table_rows(build_run_time_section(grid))}
    once = formatting.format_ratio(1.0)
    assert medians == {"PIC event-driven": once, "PIT": once, "toy tuned": formatting.format_ratio(0.5)}


def test_run_time_table_counts_reproducible_scenes(results: Results) -> None:
    """A method whose timed runs end in equal states in two of three scenes shows "2 of 3"; without counts, "-"."""
    ends = iter((1, 1, 2))

    def counted(row: Row) -> Row:
        here = row.job.engine == "toy" and row.job.refinement == 0 and row.timing
        return replace(row, timing=replace(here, ends=next(ends))) if here else row

    grid = build_grid(replace(results, rows=tuple(map(counted, results.rows))))
    told = {row[0].text: row[4].text for row in get_table_rows(build_run_time_section(grid))}
    assert (told["toy tuned"], told["PIT"]) == ("2 of 3", "-")
