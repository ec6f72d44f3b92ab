"""Report of a cross-check. The results are arranged in a grid, from which the sections of the document are built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from carom.comparator import Grade
from carom.errors import CaromError
from carom.execution.exception_text import describe_exception
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.report.document import Document
from carom.report.files import pack_data
from carom.report.provenance import build_provenance
from carom.report.results_file.lines import RowLine, Summary
from carom.studies.cross_check.grid import Grid, build_grid, read_grid
from carom.studies.cross_check.headline import build_headline
from carom.studies.cross_check.sections import fault_pictures, grade_tables, reference, runs, scenes
from carom.studies.cross_check.sections.sampling_cost import build_sampling_cost_section
from carom.studies.cross_check.sections.skipping import build_skipping_section
from carom.studies.cross_check.sections.stepwise import build_steps_section
from carom.studies.cross_check.sections.trend import build_trend_section
from carom.support.folders import write_files

ABOUT = (
    "PIC computes the instant of each impact and is the reference. PIT checks for overlap once per step, so it "
    "finds impacts late or misses them. Each engine is compared with PIC and PIT."
)
FROM_RECORDS = "This report was rebuilt from results.jsonl, without states. Replays and pictures need a new run."

#: Name of the study in its output folders.
PURPOSE = "cross-check"


def cross_check_document(results: Results) -> Document:
    """Build the report of a cross-check."""
    return _build_document("Carom cross-check", ABOUT, build_grid(results))


def rebuild_document(summary: Summary, lines: Sequence[RowLine]) -> Document:
    """Build the report of a cross-check from its results.jsonl, without running engines."""
    return _build_document("Carom cross-check, from its records", f"{ABOUT} {FROM_RECORDS}", read_grid(summary, lines))


def _build_document(title: str, about: str, grid: Grid) -> Document:
    results = grid.results
    sections = (
        grade_tables.build_methods_section(grid),
        grade_tables.build_impacts_section(grid),
        build_sampling_cost_section(grid),
        scenes.build_scenes_section(grid),
        scenes.build_unscored_section(grid),
        build_steps_section(grid),
        reference.build_reference_section(grid),
        runs.build_spread_section(grid),
        build_trend_section(grid),
        *fault_pictures.build_picture_sections(grid),
        reference.build_known_answers_section(grid),
        runs.build_run_time_section(grid),
        build_skipping_section(grid),
        *build_provenance(results.environment, results.command, results.elapsed_s),
        runs.build_settings_section(grid),
        runs.build_cells_section(grid),
        runs.build_impact_tables_section(grid),
    )
    return Document(title, build_headline(grid), sections, about, grade_tables.find_first_replay(grid))


class Report(NamedTuple):
    """A report before it is written.

    Attributes:
        results: The results on which the report is based. A failure replaces each result that can't be written or
            replayed.
        document: The content of `index.html` and `report.md`.
        files: Content of the files by name: `index.html`, `report.md`, `results.jsonl`, `junit.xml`, and `play.html`
            with the scenes that the play page can show.
    """

    results: Results
    document: Document
    files: Mapping[str, str]

    def write(self, folder: Path) -> Path:
        """Write all files, replacing older ones, and return the path of the page.

        Raises:
            InputError: The folder is not writable, or contains files that are not from a report by Carom.
        """
        return write_files(Path(folder), PURPOSE, self.files)


def build_report(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> Report:
    """Build the report of a cross-check in memory, so that an error leaves no incomplete files.

    Args:
        results: The results to report.
        fail_on: Runs with this grade or a worse one are failed tests in `junit.xml`. If None, no grade is a failure.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    try:
        return _render_report(results, fail_on)
    except CaromError:
        raise
    except Exception:  # noqa: BLE001 - find and replace the results that can't be reported
        return _render_report(_replace_unreportable(results), fail_on)


def _render_report(results: Results, fail_on: Grade | None) -> Report:
    from carom.report.junit import render_junit
    from carom.report.render.html import render_html
    from carom.report.render.markdown import render_markdown
    from carom.report.results_file.results_jsonl import format_records

    document = cross_check_document(results)
    files = {
        "index.html": render_html(document),
        "report.md": render_markdown(document),
        "results.jsonl": format_records(results),
        "junit.xml": render_junit(results, fail_on),
    }
    if page := scenes.build_play_page(trace.scene for trace in results.references.values()):
        files[scenes.PLAY_PAGE] = page
    return Report(results, document, files)


def _replace_unreportable(results: Results) -> Results:
    """Return the results. If a result can't be written or replayed, it becomes a failure that states the reason."""
    from carom.report.replay_data import build_replay_data
    from carom.report.results_file.results_jsonl import format_record

    def check(row: Row) -> Row:
        try:
            format_record(row)
            if row.trace is not None and row.score is not None:
                pack_data(build_replay_data(results.references[row.job.scene.name], [(row.trace, row.score, {})]))
        except Exception as error:  # noqa: BLE001 - one bad result must not prevent a report
            return Row(row.job, Status.FAILED, f"the engine's result can't be reported: {describe_exception(error)}")
        return row

    return replace(results, rows=tuple(map(check, results.rows)))
