"""Report of a cross-check. The document is built from results in two steps: grid, then sections in page order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from carom.comparator import Grade
from carom.errors import CaromError
from carom.execution.exception_text import describe_exception
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.execution.run_options import default_dts
from carom.report.document import Document
from carom.report.files import packed
from carom.report.provenance import making
from carom.report.replay import replay_data
from carom.report.results_file.line_types import RowLine, Summary
from carom.studies.cross_check import grade_tables, reference_sections, run_sections, scene_sections
from carom.studies.cross_check.cells import Grid, build_grid, read_grid
from carom.studies.cross_check.fault_pictures import picture_sections
from carom.studies.cross_check.headline import build_headline
from carom.studies.cross_check.play_page import PLAY_PAGE, build_play_page
from carom.studies.cross_check.sampling_cost_section import sampling_cost_section
from carom.studies.cross_check.skipping_section import skipping_section
from carom.studies.cross_check.stepwise_section import steps_section
from carom.studies.cross_check.trend_section import trend_section
from carom.support.folders import write_files

ABOUT = (
    "PIC computes the instant of each impact and is the reference. PIT checks for overlap once per step, so it "
    "finds impacts late or misses them. Each engine is compared with PIC and PIT."
)
FROM_RECORDS = (
    "This report was rebuilt from results.jsonl, which contains no states. Replays and pictures need a new run."
)

#: Name of the study in its output folders.
PURPOSE = "cross-check"


def cross_check_document(results: Results) -> Document:
    """Build the report of a cross-check."""
    return _document("Carom cross-check", ABOUT, build_grid(results))


def rebuild_document(summary: Summary, lines: Sequence[RowLine]) -> Document:
    """Build the report of a cross-check from its records, without running engines."""
    return _document("Carom cross-check, from its records", f"{ABOUT} {FROM_RECORDS}", read_grid(summary, lines))


def _document(title: str, about: str, grid: Grid) -> Document:
    results = grid.results
    sections = (
        grade_tables.methods_section(grid),
        grade_tables.impacts_section(grid),
        sampling_cost_section(grid),
        scene_sections.scenes_section(grid),
        scene_sections.unscored_section(grid),
        steps_section(grid),
        reference_sections.reference_section(grid),
        run_sections.spread_section(grid),
        trend_section(grid),
        *picture_sections(grid),
        reference_sections.known_section(grid),
        run_sections.run_time_section(grid),
        skipping_section(grid),
        *making(results.environment, results.command or _python_call(grid), results.elapsed_s),
        run_sections.settings_section(grid),
        run_sections.cells_section(grid),
        run_sections.impact_tables_section(grid),
    )
    return Document(title, build_headline(grid), sections, about=about, watch=grade_tables.first_replay(grid))


@dataclass(frozen=True)
class Report:
    """A report before it is written.

    Attributes:
        results: The reported results. A row that can't be written or replayed is replaced by a failure.
        document: The content of its page.
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


def report_of(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> Report:
    """Build the report of a cross-check in memory, before the first file is written.

    Args:
        results: The results to report.
        fail_on: The best grade that fails a case of `junit.xml`; None if no grade fails.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
    """
    try:
        return _report(results, fail_on)
    except CaromError:
        raise
    except Exception:  # noqa: BLE001 - find the rows that can't be reported, and replace them
        return _report(_replace_unreportable(results), fail_on)


def _report(results: Results, fail_on: Grade | None) -> Report:
    from carom.report.junit import junit
    from carom.report.render.html import html
    from carom.report.render.markdown import markdown
    from carom.report.results_file.read_write import records

    document = cross_check_document(results)
    files = {
        "index.html": html(document),
        "report.md": markdown(document),
        "results.jsonl": records(results),
        "junit.xml": junit(results, fail_on),
    }
    if page := build_play_page(reference.scene for reference in results.references.values()):
        files[PLAY_PAGE] = page
    return Report(results, document, files)


def _replace_unreportable(results: Results) -> Results:
    """Replace each row that can't be written or replayed by a failure with the reason."""
    from carom.report.results_file.read_write import record

    def check(row: Row) -> Row:
        try:
            record(row)
            if row.trace is not None and row.score is not None:
                packed(replay_data(results.references[row.job.scene.name], [(row.trace, row.score, {})]))
        except Exception as error:  # noqa: BLE001 - one bad row must not prevent a report
            return Row(row.job, Status.FAILED, f"the engine's result can't be reported: {describe_exception(error)}")
        return row

    return replace(results, rows=tuple(map(check, results.rows)))


def _python_call(grid: Grid) -> str:
    """Return the Python call that reproduces the results of a cross-check not started from the command line."""
    engines = list(dict.fromkeys(method.engine for method in grid.columns))
    profiles = list(dict.fromkeys(method.profile for method in grid.columns))
    tried = next((dict(method.tried) for method in grid.columns if method.tried), {})
    settings = f", settings={tried!r}" if tried else ""
    jobs = [row.job for row in grid.results.rows]
    own = all(job.dt_s in default_dts(job.scene) for job in jobs)
    dts = "" if own else f", dts={sorted({job.dt_s for job in jobs}, reverse=True)!r}"
    return f"carom.cross_check(scenes, {engines!r}, profiles={profiles!r}{settings}{dts})"
