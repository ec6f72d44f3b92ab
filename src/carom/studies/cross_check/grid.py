"""Grid of a cross-check, with a cell for each run.

The grid is built from results or from results.jsonl. All sections of the report use the grid.
"""

from __future__ import annotations

import heapq
import math
import re
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple, TypeVar
from urllib.parse import quote

from carom.comparator import Errors, Score, Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.job import Method, Status
from carom.execution.results import Results, Row
from carom.model.trace import Trace
from carom.report.outcome_marks import BROKEN, Mark, parse_mark
from carom.report.results_file.lines import RowLine, SceneLine, Summary, build_line, build_summary, list_reasons
from carom.support import formatting
from carom.support.escaping import escape_controls

T = TypeVar("T")

#: Reason for a missing run: `carom.execution` omits a profile that has the same settings as another profile.
NOT_PLANNED = "not run separately, because another profile of the engine has the same settings at this step size"
_NO_ERRORS = Errors(**{field.name: math.nan for field in fields(Errors)})
_NO_SCENE = SceneLine(0, None, 0, None)  # type: ignore[arg-type] # not scored
#: Verdicts which state that an impact was missed. Impacts of a diverged trajectory cause none of these verdicts.
_MISSES = {verdict.name.lower() for verdict in (Verdict.MISSED, Verdict.MULTIPLE_MISSED, Verdict.PASSED_THROUGH)}
#: Rank of a run without a result: one more than the rank of the worst grade.
_BROKEN_RANK = 1 + max(mark.rank for mark in Mark if mark.rank is not None)


class GridCell(NamedTuple):
    """A run of a scene by a method with a step size, or the reason why there is no run.

    Attributes:
        scene: Name of the scene.
        method: Engine and profile.
        mark: The grade, or the kind of failure.
        reasons: Every verdict with its reason, or the reason why there is no run, as sentences without a full stop.
        line: All numbers of the run, as in results.jsonl. If no run was planned, all numbers are unknown.
        scene_line: Number of impacts, horizon and scales of the scene.
        pit: PIT's errors by name for the same scene and step size; empty if PIT was not run.
        row: The run with its trace; None if no run was planned, or if the grid comes from results.jsonl.
    """

    scene: str
    method: Method
    mark: Mark
    reasons: tuple[str, ...]
    line: RowLine
    scene_line: SceneLine
    pit: Mapping[str, str | int | float | None]
    row: Row | None

    @property
    def rank(self) -> int | None:
        """Rank of the grade. Better grades have smaller ranks.

        A failed run ranks last. Other runs without a grade have no rank (None).
        """
        return _BROKEN_RANK if self.mark in BROKEN else self.mark.rank

    @property
    def scored(self) -> bool:
        """Whether the run was compared with the reference."""
        return self.line.total is not None

    @property
    def compared_run(self) -> tuple[Trace, Score] | None:
        """The run and its score, for pictures; None without a score, or if the grid comes from results.jsonl."""
        row = self.row
        return None if row is None or row.trace is None or row.score is None else (row.trace, row.score)

    @property
    def replay_key(self) -> str:
        """Key of the run's replay on a page. The key contains the scene's name as the page shows it."""
        return f"{escape_controls(self.scene)}/{self.method.name}"

    @property
    def link(self) -> str:
        """The link to the replay on the same page; empty without a replay."""
        return f"#{quote(self.replay_key)}" if self.compared_run else ""

    @property
    def expected(self) -> int:
        """Number of the reference's impacts that the run should have; 0 if the run was not compared."""
        return self.scene_line.expected if self.scored else 0

    @property
    def missed(self) -> int:
        """Number of missed impacts."""
        return len(self.line.missed or ())

    @property
    def invented(self) -> int:
        """Number of impacts that the run invents."""
        return len(self.line.spurious or ())

    @property
    def undecided(self) -> int:
        """Number of impacts so close to the end of the run that the run may not have reported them yet."""
        return len(self.line.undecided or ())

    @property
    def matched(self) -> int:
        """Number of impacts that the run found."""
        return self.line.matched or 0

    @property
    def errors(self) -> Errors:
        """The largest errors of the run; NaN for an error that was not measured."""
        return self.line.total or _NO_ERRORS

    @property
    def cost(self) -> float:
        """The run's error divided by PIT's error; NaN if this ratio is unknown."""
        return math.nan if self.line.price_paid is None else float(self.line.price_paid)

    @property
    def rounding(self) -> float:
        """Largest relative error that counts as rounding."""
        return THRESHOLDS.rounding_of(self.line.float_bits or 64)

    @property
    def time_error_s(self) -> float:
        """The largest time error, in seconds; 0 if it is only rounding, and NaN if no time error was measured."""
        error_s = self.errors.time_s
        if math.isnan(error_s):
            return error_s
        limit_s = THRESHOLDS.time_rounding_of(self.line.float_bits or 64, self.scene_line.scales.time_s, self.line.dt_s)
        return 0.0 if abs(error_s) <= limit_s else error_s

    def has_verdict(self, verdict: Verdict) -> bool:
        """Whether the run has a verdict."""
        return any(one.verdict == verdict.name.lower() for one in self.line.verdicts)

    @property
    def has_miss(self) -> bool:
        """Whether a verdict of the run states that an impact was missed.

        If the trajectory has diverged, missed impacts are only found by a comparison of single steps.
        """
        return any(one.verdict in _MISSES for one in self.line.verdicts)

    @property
    def figure(self) -> str:
        """The most important number of the run, with its unit; empty if the run is exact or has no number."""
        if self.missed:
            return f"{self.missed} of {self.expected} missed"
        if self.invented:
            return f"{self.invented} invented"
        if self.scored and not self.matched:
            if self.undecided:
                return f"{self.undecided} of {self.expected} undecided"
            return "none compared" if self.scene_line.beyond_horizon else "no impact"
        if not self.scored or self.mark in (Mark.EXACT, Mark.EXACT_32):
            return ""
        velocity, spin = self.errors.velocity, self.errors.spin  # the spin error is NaN if no disc spins
        # If a head-on impact is late, its velocities are still correct, so the time error is shown.
        if velocity <= self.rounding and not spin > self.rounding and self.time_error_s:
            side = "late" if self.errors.time_s > 0 else "early"
            return f"{formatting.format_steps(abs(self.errors.time_s), self.line.dt_s)} {side}"
        if math.isfinite(self.cost):
            return f"{formatting.format_number(self.cost)} of PIT's error"
        if spin > velocity:
            return f"{formatting.format_percent(spin)} of greatest rim speed"
        return f"{formatting.format_percent(velocity)} of greatest speed"

    @property
    def short_figure(self) -> str:
        """The most important number in short form, for a terminal."""
        if self.missed or self.invented:
            return formatting.format_missed_and_invented(self.missed, self.invented)
        ratio = self.figure.replace(" of PIT's error", "\N{MULTIPLICATION SIGN}")
        return re.sub(" (late|early|of greatest.*)$", "", ratio)


class GridRow(NamedTuple):
    """A scene and its cells at its largest step size.

    Attributes:
        name: Name of the scene.
        description: Short description of the scene.
        cells: Cells of the scene, in the order of the grid's methods.
    """

    name: str
    description: str
    cells: tuple[GridCell, ...]


@dataclass(frozen=True)
class Grid:
    """All runs of a cross-check.

    Attributes:
        methods: The methods, in the order of the results. Each method has a column of the grid.
        rows: Scenes, each at its largest step size.
        runs: Every run with every step size.
        step_phrase: Phrase that describes the step sizes of the rows.
        results: The results of the cross-check. References and engines are missing if the grid comes from
            results.jsonl.
    """

    methods: tuple[Method, ...]
    rows: tuple[GridRow, ...]
    runs: tuple[GridCell, ...]
    step_phrase: str
    results: Results

    def list_cells(self, method: Method) -> tuple[GridCell, ...]:
        """Return the cells of a method, one for each scene."""
        number = self.methods.index(method)
        return tuple(row.cells[number] for row in self.rows)

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The outcomes that the legend explains: all grades, and other outcomes that occur."""
        present = {cell.mark for row in self.rows for cell in row.cells}
        return tuple(mark for mark in Mark if mark in present or (mark.rank is not None and mark is not Mark.EXACT_32))

    @property
    def compared(self) -> list[Method]:
        """The methods to compare with PIC, best first. If only PIC ran, only PIC is returned."""
        scored = [method for method in self.methods if any(cell.scored for cell in self.list_cells(method))]
        return rank_methods(self, [method for method in scored if method.engine != "pic"] or scored)


def build_grid(results: Results) -> Grid:
    """Build the grid of a cross-check."""
    summary, lines = build_summary(results), [build_line(row) for row in results.rows]
    grid = _assemble_grid(summary, lines, results.rows, results)
    coarsest = (row.job for row in results.rows if row.job.refinement == 0)
    frames = (job.dt_s * job.scene.frame_rate_hz for job in coarsest)
    own_frames = (math.isclose(part, 1.0, rel_tol=formatting.WHOLE) for part in frames)
    return replace(grid, step_phrase="each scene's own frame rate") if all(own_frames) else grid


def read_grid(summary: Summary, lines: Sequence[RowLine]) -> Grid:
    """Build the grid of a cross-check from its results.jsonl, which contains neither traces nor references."""
    results = Results((), {}, {}, (), summary.environment, summary.command, summary.elapsed_s)
    return _assemble_grid(summary, lines, [None] * len(lines), results)


def _assemble_grid(summary: Summary, lines: Sequence[RowLine], rows: Sequence[Row | None], results: Results) -> Grid:
    methods = list(dict.fromkeys(line.method for line in lines))
    # Put the profiles of each engine next to each other. In `lines` they may be apart, because a profile that does not
    # run with the first step size comes later.
    engines = list(dict.fromkeys(method.engine for method in methods))
    methods.sort(key=lambda method: engines.index(method.engine))
    pit = {(one["scene"], one["dt_s"]): one for one in summary.sampling if "velocity" in one}
    runs = tuple(
        GridCell(
            line.scene,
            line.method,
            parse_mark(line.status, line.grade, line.float_bits),
            list_reasons(line, summary.verdicts),
            line,
            summary.scenes.get(line.scene, _NO_SCENE),
            pit.get((line.scene, line.dt_s), {}),
            row,
        )
        for line, row in zip(lines, rows, strict=True)
    )
    coarsest = {(cell.scene, cell.method): cell for cell in runs if cell.line.refinement == 0}
    scenes = {line.scene: row.job.scene.description if row else "" for line, row in zip(lines, rows, strict=True)}

    def build_row(name: str) -> GridRow:
        cells = tuple(coarsest.get((name, one)) or _build_absent_cell(name, one) for one in methods)
        return GridRow(name, scenes[name], cells)

    return Grid(tuple(methods), tuple(map(build_row, scenes)), runs, "the largest step size", results)


def _build_absent_cell(scene: str, method: Method) -> GridCell:
    line = RowLine(
        scene=scene,
        engine=method.engine,
        profile=method.profile,
        dt_s=math.nan,
        refinement=0,
        status=Status.UNAVAILABLE,
        reason=NOT_PLANNED,
    )
    return GridCell(scene, method, Mark.ABSENT, (NOT_PLANNED,), line, _NO_SCENE, {}, None)


def merge_own_profiles(contents: Mapping[Method, object]) -> list[list[Method]]:
    """Group equal profiles of Carom's own methods, for example all profiles of PIC.

    Every method of an engine is a separate group, because the profiles of an engine differ in settings.

    Args:
        contents: A value for each method. Profiles of a method are in the same group if their values are equal.
    """
    found = (((method.engine if method.is_own else method, content), method) for method, content in contents.items())
    return list(formatting.group_by(found).values())


def select_worst(items: Sequence[T], most: int, cells_of: Callable[[T], Sequence[GridCell]]) -> tuple[Sequence[T], str]:
    """Return the `most` items whose cells have the worst grades, in their original order.

    Also return a note that items are omitted; the note is empty if all items are returned.
    """
    if len(items) <= most:
        return items, ""

    def severity(place: int) -> list[int]:
        return sorted((-1 if cell.rank is None else cell.rank for cell in cells_of(items[place])), reverse=True)

    listed = [items[place] for place in sorted(heapq.nlargest(most, range(len(items)), severity))]
    shown = f"{most:,} of {len(items):,} rows are shown"
    return listed, f"{shown}, those with the worst grades; results.jsonl has all."


RANKING_NOTE = (
    "Methods are ranked by their mean grade, from 0 (exact) to 6 (wrong), with 7 for a run without a result. Methods "
    "with equal mean grades are sorted by their median error relative to PIT, smallest first."
)


def rank_methods(grid: Grid, methods: Iterable[Method]) -> list[Method]:
    """Sort methods, best first. Methods with equal sort keys keep the order of the grid."""
    return sorted(methods, key=lambda method: compute_standing(grid.list_cells(method)))


def compute_standing(cells: Iterable[GridCell]) -> tuple[float, float]:
    """Compute the sort key of a method from its cells, one for each scene. The best method has the smallest key.

    The key is the mean grade, then the median over cells of the error divided by PIT's error (0 if no cell has this
    ratio). A method without a grade is last. Keys can only be compared if all methods have cells of the same scenes.
    """
    cells = list(cells)
    places = [cell.rank for cell in cells if cell.rank is not None]
    known = [cell.cost for cell in cells if not math.isnan(cell.cost)]
    return statistics.fmean(places) if places else math.inf, statistics.median(known) if known else 0.0
