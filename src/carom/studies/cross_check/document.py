"""Report of a cross-check: its sections in order, and the sentences of its headline."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from carom.comparator import Grade, Horizon
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import CaromError
from carom.execution.exception_text import describe_exception
from carom.execution.job import Status
from carom.execution.options import default_dts
from carom.execution.results import Results, Row
from carom.report import formatting
from carom.report.document import Document, Headline
from carom.report.files import packed
from carom.report.grid import Grid, Mark, build_grid
from carom.report.provenance import making
from carom.report.replay import replay_data
from carom.studies.cross_check import tables
from carom.studies.cross_check.divergences import picture_sections
from carom.studies.cross_check.headline import build_headline
from carom.studies.cross_check.overview import first_replay, overview
from carom.studies.cross_check.play_page import PLAY_PAGE, build_play_page
from carom.studies.cross_check.reference import known_section, reference_section
from carom.studies.cross_check.sampling_cost import measure_engine_costs, sampling_cost_section
from carom.studies.cross_check.sentences import Sentence
from carom.studies.cross_check.skipping import skipping_section
from carom.studies.cross_check.stepwise import steps_section
from carom.studies.cross_check.trend import trend_sections
from carom.support.folders import write_files

ABOUT = (
    "Discs touch at an instant between two frames. A method that looks for overlap once a step, as PIT does (periodic "
    "interference test), finds an impact up to a step late and turns discs from the wrong place, those that meet off "
    "centre in the wrong direction, or never sees them touch. PIC (predicted instant of collision) solves for the "
    "instant: it is the reference here."
)

#: What a folder of a cross-check is for.
PURPOSE = "cross-check"


def cross_check_document(results: Results) -> Document:
    """Build the report of a cross-check."""
    grid = build_grid(results)
    found = measure_engine_costs(grid)
    return Document(
        "Carom cross-check",
        Headline(
            build_headline(grid),
            (_describe_reference(results), _describe_counts(grid), *_describe_phase_dependence(grid)),
        ),
        (
            *overview(results, grid, found),
            *tables.grid_sections(results, grid),
            sampling_cost_section(found),
            *(() if len(grid.rows) == 1 else (steps_section(results, grid),)),  # of one scene it is in the overview
            reference_section(results),
            tables.spread_section(results, grid),
            *trend_sections(results, grid),
            *picture_sections(results, grid),
            known_section(results),
            tables.run_time_section(grid),
            skipping_section(results),
            *making(results.environment, results.command or _python_call(results, grid), results.elapsed_s),
            tables.settings_section(results, grid),
            *tables.cell_sections(results, grid),
        ),
        about=ABOUT,
        watch=first_replay(grid),
    )


@dataclass(frozen=True)
class Report:
    """A report before it is written.

    Attributes:
        results: The reported results. A row that can't be written or replayed is replaced by a failure.
        document: The content of its page.
        files: Its files by their names in the folder: `index.html`, `report.md`, `results.jsonl` and `junit.xml`, and
            `play.html` with the scenes whose discs can be thrown, to which replays of them lead.
    """

    results: Results
    document: Document
    files: Mapping[str, str]

    def write(self, folder: Path) -> Path:
        """Write all files, replacing older ones, and return the page: each is renamed into place when it is whole.

        Raises:
            InputError: The folder can't be written into, or holds files that are no report of Carom's.
        """
        return write_files(Path(folder), PURPOSE, self.files)


def report_of(results: Results, fail_on: Grade | None = Grade.INACCURATE) -> Report:
    """Build the report of a cross-check in memory, before the first file is written.

    Args:
        results: The results to report.
        fail_on: The best grade that fails a case of `junit.xml`; None for none.

    Raises:
        MissingExtraError: jinja2 or matplotlib, the extra `report`, is not installed.
    """
    try:
        return _report(results, fail_on)
    except CaromError:
        raise
    except Exception:  # noqa: BLE001 - a row whose numbers can't be told costs no other: which one is asked row by row
        return _report(_replace_unreportable(results), fail_on)


def _report(results: Results, fail_on: Grade | None) -> Report:
    from carom.report.records import junit, records
    from carom.report.render.html import html
    from carom.report.render.markdown import markdown

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
    """Replace rows that can't be written or replayed by failures, with the reason."""
    from carom.report.records import record

    def check(row: Row) -> Row:
        try:
            record(row)
            if row.trace is not None and row.score is not None:
                packed(replay_data(results.references[row.job.scene.name], [(row.trace, row.score, {})]))
        except Exception as error:  # noqa: BLE001 - whatever the numbers of a run do to us
            return Row(row.job, Status.FAILED, f"what it returned can't be reported: {describe_exception(error)}")
        return row

    return replace(results, rows=tuple(map(check, results.rows)))


def _describe_reference(results: Results) -> str:
    """Describe the evidence for PIC's accuracy."""
    if not results.known:
        proven = [n for n, how in results.certified.items() if isinstance(how, Horizon) and how.covers_the_scene]
        if not proven:
            return Sentence.UNPROVEN()
        which = f"{len(proven)} of {formatting.count(len(results.references), 'scene')}"
        return Sentence.CERTIFIED(which=which)
    deviations = {name: deviation for name, (_, deviation) in results.known.items()}
    off = [name for name, deviation in deviations.items() if not deviation <= THRESHOLDS.rounding]
    if off:
        right = f"{len(deviations) - len(off)} of {formatting.count(len(deviations), 'known answer')}"
        return Sentence.DEVIATES(which=right, scenes=formatting.listed(off))
    which = f"all {len(deviations)} known answers" if len(deviations) > 1 else "the one known answer"
    return Sentence.REPRODUCES(which=which, deviation=formatting.number(max(deviations.values())))


def _describe_counts(grid: Grid) -> str:
    """Describe the number of runs by grade."""
    every = list(grid.columns.values())
    columns, what = [column for column in every if not column.own], "engine run"
    if not columns:  # Carom's own methods only: then it is PIT that is compared with PIC
        columns = [column for column in every if column.engine != "pic"] or every
        labels = {column.label for column in columns}
        what = f"{labels.pop()} run" if len(labels) == 1 else "run"
    tally = Counter(cell.mark for column in columns for cell in grid.cells(column))
    ran = sum(n for mark, n in tally.items() if mark.ran)
    scored = [f"{tally[mark]} {mark.word}" for mark in Mark if mark.ran and tally[mark]]
    others = [f"{tally[mark]} {mark.word}" for mark in Mark if not mark.ran and mark is not Mark.ABSENT and tally[mark]]
    sentence = Sentence.NO_RUN(what=what, steps=grid.step_phrase)
    if ran:
        sentence = Sentence.RUNS(runs=formatting.count(ran, what), steps=grid.step_phrase, grades="; ".join(scored))
    return f"{sentence} {Sentence.NOT_SCORED(others='; '.join(others))}" if others else sentence


def _describe_phase_dependence(grid: Grid) -> Iterator[str]:
    """Say which grades of PIT stand at this phase of the step only: where in a step an impact falls is nobody's merit.

    An engine that is as right there may be so at all phases.
    """
    for column in grid.columns.values():
        if column.engine != "pit":
            continue
        lucky = [cell.row.score.lucky_phase for cell in grid.cells(column) if cell.row and cell.row.score]
        shares = sorted({share[0] for share in lucky if share})
        if shares:
            phases = next(share[1] for share in lucky if share)
            owes = "its grade" if len(lucky) == 1 else f"the grade in {sum(map(bool, lucky))} of {len(lucky)} scenes"
            some = str(shares[0]) if len(shares) == 1 else f"{shares[0]} to {shares[-1]}"
            right = f"sampling alone is equally accurate at {some} of {phases} phases"
            yield Sentence.LUCKY(method=column.name, grades=owes, right=right)


def _python_call(results: Results, grid: Grid) -> str:
    """Return the Python call that reproduces the results of a cross-check not started from the command line."""
    engines = list(dict.fromkeys(method.engine for method in grid.columns))
    profiles = list(dict.fromkeys(method.profile for method in grid.columns))
    tried = next((dict(method.tried) for method in grid.columns if method.tried), {})
    settings = f", settings={tried!r}" if tried else ""
    steps = formatting.together((row.job.scene.name, row.job.dt_s) for row in results.rows)
    own = all(set(steps[row.scene.name]) <= set(default_dts(row.scene)) for row in grid.rows)
    dts = "" if own else f", dts={sorted(set().union(*steps.values()), reverse=True)!r}"
    return f"carom.cross_check(scenes, {engines!r}, profiles={profiles!r}{settings}{dts})"
