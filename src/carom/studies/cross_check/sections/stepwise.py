"""Section on the accuracy of single steps, for runs in which single steps reveal more than the whole trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from carom.comparator import LocalScore, Verdict
from carom.report.document import Block, Column, Media, Section, Table, Text
from carom.report.outcome_marks import Mark, mark_of_grade
from carom.studies.cross_check.grid import Grid, GridCell, select_worst
from carom.support import formatting

#: Largest number of listed runs.
MOST_RUNS = 1000
NOTE = (
    "Each step is compared with a step of PIC that starts from the run's own state. Therefore errors of earlier steps "
    "do not count. The table lists runs for which single steps reveal more than the whole trajectory. The best run is "
    "first."
)
DETAIL_NOTE = (
    "Successive steps in which bodies meet form a window and are compared together. 'Missed' counts pairs of bodies "
    "that passed through each other. The number in brackets counts the pairs that PIT also misses from the same state. "
    "'Invented' counts changes of velocity with no other body near. 'Late' is the delay of an impact in steps. The "
    "error is the velocity or spin error, divided by PIT's largest error from the same state. Checking once per step "
    "explains an error of up to 1. 'Late' and 'error' include only windows with a single impact. 'Energy' is the "
    "energy that the run gains or loses, minus PIT's gains and losses from the same states, divided by the scene's "
    "energy. 'Entangled' is the fraction of windows with several impacts, whose results are not unique. Runs are "
    "ranked by the impacts that they miss and PIT does not, then by invented impacts, early impacts, largest error and "
    "energy. Runs that ended early are last. A run is listed in three cases: it continues beyond the horizon or after "
    "a disc comes to rest, its trajectory diverged, or a verdict is about its steps."
)
SHORT_NOTE = (
    "The table counts missed impacts and invented impacts (+). The number in brackets counts the missed impacts that "
    "PIT also misses. The error is the run's largest error, divided by PIT's error from the same state. The best run "
    "is first. Runs that ended early are last."
)
#: Verdicts that follow only from the comparison of single steps.
_OF_STEPS = (Verdict.PASSED_THROUGH, Verdict.TURNED_ALONE, Verdict.SINKS, Verdict.WORSE_STEPS)


def build_steps_section(grid: Grid) -> Section:
    """Return a section with one row per method and scene, best first.

    A terminal shows the section only if the report has a single scene.
    """
    cells = list(_find_listed_runs(grid))
    if not cells:
        return Section("", ())
    is_single_scene, media = len(grid.rows) == 1, Media.EVERYWHERE if len(grid.rows) == 1 else Media.IN_FULL

    def build_column(
        head: str, format_score: Callable[[LocalScore], str], subheading: str = "", only: Media = Media.ON_PAPER
    ) -> Column:
        return Column(head, lambda cell: format_score(cell.line.local_truth), subheading, number=True, only=only)

    diverged = Column("diverged at", _format_divergence_time)
    columns = (
        *(() if is_single_scene else (Column("scene", lambda cell: cell.scene),)),
        Column("method", lambda cell: cell.method.title),
        Column("grade", lambda cell: cell.mark.cell._replace(link=cell.link), only=Media.ON_PAPER),
        Column("steps", lambda cell: mark_of_grade(cell.line.local_truth.grade, cell.line.local_truth.float_bits).cell),
        *([diverged] if any(map(_format_divergence_time, cells)) else []),
        build_column("due", lambda local: str(local.due)),
        build_column("impacts", _format_impacts, "- (PIT's) +", only=Media.TERMINAL | Media.DETAIL),
        build_column("missed", _format_missed, "(PIT's)"),
        build_column("invented", lambda local: str(local.invented)),
        build_column("early", lambda local: str(local.early + local.ahead), only=Media.EVERYWHERE),
        build_column("late, median", lambda local: formatting.format_number(local.late_steps[0])),
        build_column("late, worst", lambda local: formatting.format_number(local.late_steps[1], 3)),
        build_column("error, median", lambda local: formatting.format_number(local.ratio[0])),
        build_column("error", lambda local: formatting.format_number(local.ratio[1], 4), "worst", Media.EVERYWHERE),
        build_column("above 1", lambda local: f"{local.worse_than_pit} of {local.judged}"),
        build_column("energy", lambda local: formatting.format_number(local.energy), only=Media.EVERYWHERE),
        build_column("entangled", lambda local: formatting.format_percent(_compute_entangled_fraction(local))),
        build_column("until", lambda local: formatting.format_seconds(local.until_s)),
    )
    listed, note = select_worst(cells, MOST_RUNS, lambda cell: (cell,))
    folded = "" if is_single_scene else formatting.format_count(len(listed), "run")
    blocks: tuple[Block, ...] = (
        Table(columns, listed, note=note, folded=folded, css="cells", only=media),
        Text(NOTE, Media.ON_PAPER),
        Text(DETAIL_NOTE, Media.ON_PAPER, folded=True),
        Text(SHORT_NOTE, media & ~Media.ON_PAPER),
    )
    return Section("Accuracy of single steps", blocks, level=3)


def _find_listed_runs(grid: Grid) -> Iterator[GridCell]:
    """Yield the runs to list, sorted by scene, best first.

    PIC's runs are only listed for scenes in which no other method ran.
    """
    for row in grid.rows:
        reference = grid.results.references.get(row.name)
        rests = reference is not None and reference.contact_s < math.inf
        scored_cells = [cell for cell in row.cells if cell.scored]
        listed = [
            cell
            for cell in [cell for cell in scored_cells if cell.method.engine != "pic"] or scored_cells
            if cell.line.local_truth is not None
            and (
                rests
                or cell.scene_line.beyond_horizon
                or cell.mark in (Mark.DIVERGED, Mark.DIVERGED_INACCURATE)
                or any(map(cell.has_verdict, _OF_STEPS))
            )
        ]
        yield from sorted(listed, key=_compute_sort_key)


def _compute_sort_key(cell: GridCell) -> tuple[bool, int, int, int, float, float]:
    """Return a sort key that is smallest for the best run. Differences within rounding are ignored."""
    local = cell.line.local_truth
    assert local is not None  # noqa: S101 - listed runs have a score of their steps
    ratio = math.inf if math.isnan(local.ratio[1]) else float(f"{local.ratio[1]:.3e}")
    energy = local.energy if local.energy > local.energy_rounding else 0.0
    cut_short = cell.has_verdict(Verdict.CUT_SHORT)
    return (cut_short, local.missed_own, local.invented, local.early + local.ahead, ratio, energy)


def _format_missed(local: LocalScore) -> str:
    return f"{local.missed} ({local.missed_by_pit})" if local.missed else "0"


def _format_impacts(local: LocalScore) -> str:
    """Format the numbers of missed and invented impacts; empty if there are none."""
    losses = formatting.format_missed_and_invented(local.missed, local.invented)
    return losses.replace(f"-{local.missed}", f"-{_format_missed(local)}", 1) if local.missed else losses


def _compute_entangled_fraction(local: LocalScore) -> float:
    """Return the fraction of compared windows that contain several impacts; NaN if no window was compared."""
    compared = local.entangled + local.judged
    return local.entangled / compared if compared else math.nan


def _format_divergence_time(cell: GridCell) -> str:
    time_s = cell.line.diverged_s
    return "" if time_s is None else formatting.format_seconds(time_s)
