"""Section on stepwise accuracy: methods ranked by their steps, where steps show more than the trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from carom.comparator import Grade, LocalScore, Score, Verdict
from carom.execution.results import Results
from carom.report import formatting
from carom.report.document import EVERYWHERE, IN_FULL, ON_PAPER, Cell, Column, Section, Table, Text
from carom.report.grid import Grid, GridCell, mark_of_grade
from carom.report.replay import replay_link
from carom.studies.cross_check.tables import mark_cell

STEPS_NOTE = (
    "Each step, or each chain of steps in which bodies meet, is compared with PIC from the run's own state at its "
    "start, to the end of the run. Missed: two bodies passed through each other; in brackets how many of these PIT "
    "misses, too, from the same state. Invented: a body turned with nothing near. Lateness is in steps. The error is "
    "that of velocity or spin over what PIT pays at worst from the same state, at the phases of the step and at the "
    "run's own lateness: up to 1 checking once per step explains it. Energy is what is gained or lost that PIT's steps "
    "do not gain or lose, or several impacts together gain, or lose where nothing may be lost; over the scene's. "
    "Lateness and error are of impacts that stand alone; entangled is the fraction of the windows compared that have "
    "several impacts, where nobody owes one answer. The best stands first: by misses that checking once per step does "
    "not explain (within the horizon all), inventions, early impacts, the worst error, and energy; a run that ended "
    "before the scene did stands last. Listed are runs of which the trajectory alone tells too little: beyond a "
    "horizon, after rest, where it parted from the reference's, and where steps show what it does not."
)
STEPS_SHORT = (
    "impacts: - missed (PIT misses these, too, from the same state), + invented\n"
    "error: the worst over PIT's from the same state; energy: beyond PIT's\n"
    "best first; runs that ended early last"
)
#: Verdicts that only steps show.
_OF_STEPS = frozenset({Verdict.PASSED_THROUGH, Verdict.TURNED_ALONE, Verdict.SINKS, Verdict.WORSE_STEPS})
_PARTED = frozenset({Grade.PARTED, Grade.PARTED_INACCURATE})


class _Steps(NamedTuple):
    """A run with the score of its steps."""

    cell: GridCell
    scene: str
    score: Score
    local: LocalScore


def steps_section(results: Results, grid: Grid) -> Section:
    """Return one row per method and scene, the best method of a scene first; a terminal shows single scenes only."""
    found = sorted(_find_listed_runs(results, grid), key=_rank)
    scenes = list(dict.fromkeys(row.scene.name for row in grid.rows))
    found.sort(key=lambda run: scenes.index(run.scene))
    alone = len(scenes) == 1
    parted = any(run.score.parted_s is not None for run in found)
    columns = (
        *(() if alone else (Column("scene", lambda run: run.scene),)),
        Column("method", lambda run: run.cell.column.name),
        Column("grade", _grade, only=ON_PAPER),
        Column("steps", lambda run: mark_cell(mark_of_grade(run.local.grade, run.local.float_bits))),
        *((Column("parted at", lambda run: _time(run.score.parted_s), only=ON_PAPER),) if parted else ()),
        Column("due", lambda run: str(run.local.due), number=True, only=ON_PAPER),
        Column("impacts", _format_impacts, "- (PIT's) +", number=True, only=EVERYWHERE - ON_PAPER),
        Column("missed", _missed, "(PIT's)", number=True, only=ON_PAPER),
        Column("invented", _column(lambda local: str(local.invented)), number=True, only=ON_PAPER),
        Column("early", lambda run: str(run.local.early + run.local.ahead), number=True),
        Column(
            "late, median", _column(lambda local: formatting.number(local.late_steps[0])), number=True, only=ON_PAPER
        ),
        Column(
            "late, worst", _column(lambda local: formatting.number(local.late_steps[1], 3)), number=True, only=ON_PAPER
        ),
        Column("error, median", _column(lambda local: formatting.number(local.ratio[0])), number=True, only=ON_PAPER),
        Column("error", _column(lambda local: formatting.number(local.ratio[1], 4)), "worst", number=True),
        Column(
            "above 1", _column(lambda local: f"{local.worse_than_pit} of {local.judged}"), number=True, only=ON_PAPER
        ),
        Column("energy", _energy, number=True),
        Column("entangled", _column(lambda local: formatting.percent(_entangled(local))), number=True, only=ON_PAPER),
        Column("until", _column(lambda local: formatting.seconds(local.until_s)), number=True, only=ON_PAPER),
    )
    only = EVERYWHERE if alone else IN_FULL
    table = Table(columns, found, folded="" if alone else formatting.count(len(found), "run"), css="cells", only=only)
    said = (
        *(Text(line, only) for line in _describe_divergence(found, alone=alone)),
        Text(STEPS_SHORT, only - ON_PAPER),
    )
    return Section(
        "Each step from the run's own state", (Text(STEPS_NOTE, ON_PAPER), table, *said) if found else (), level=3
    )


def _find_listed_runs(results: Results, grid: Grid) -> Sequence[_Steps]:
    """Find the runs to list; PIC only where no other method ran."""
    found = []
    for row in grid.rows:
        name = row.scene.name
        ran = [cell for cell in row.cells if cell.has_replay]
        for cell in [cell for cell in ran if cell.column.engine != "pic"] or ran:
            score = cell.row.score if cell.row else None
            if score is not None and score.local_truth is not None and _needs_listing(score, results, name):
                found.append(_Steps(cell, name, score, score.local_truth))
    return found


def _needs_listing(score: Score, results: Results, scene: str) -> bool:
    """Whether the steps show something that the trajectory does not."""
    rests = results.references[scene].contact_s < math.inf
    return bool(score.beyond_horizon or rests or score.grade in _PARTED or _OF_STEPS & set(score.verdicts))


def _rank(run: _Steps) -> tuple[bool, int, int, int, float, float]:
    """Return the sort key of a run, the best first; differences within rounding do not count."""
    local = run.local
    ratio = math.inf if math.isnan(local.ratio[1]) else float(f"{local.ratio[1]:.3e}")
    energy = local.energy if local.energy > local.energy_rounding else 0.0
    return (
        Verdict.CUT_SHORT in run.score.verdicts,
        local.missed_own,
        local.invented,
        local.early + local.ahead,
        ratio,
        energy,
    )


def _column(say: Callable[[LocalScore], str]) -> Callable[[_Steps], str]:
    """Return a column's text as a function of the score of the steps."""
    return lambda run: say(run.local)


def _grade(run: _Steps) -> Cell:
    return Cell(run.cell.mark.word, css=run.cell.mark.css, symbol=run.cell.mark.symbol, link=replay_link(run.cell))


def _missed(run: _Steps) -> str:
    missed = run.local.missed
    return f"{missed} ({run.local.missed_by_pit})" if missed else "0"


def _format_impacts(run: _Steps) -> str:
    """Format the numbers of missed and invented impacts; empty if there are none."""
    lost = formatting.lost(run.local.missed, run.local.invented)
    return lost.replace(f"-{run.local.missed}", f"-{_missed(run)}", 1) if run.local.missed else lost


def _energy(run: _Steps) -> Cell:
    return Cell(formatting.number(run.local.energy), short=formatting.number(run.local.energy, 1))


def _entangled(local: LocalScore) -> float:
    """Return the fraction of the windows compared that are entangled; NaN where there is none."""
    compared = local.entangled + local.judged
    return local.entangled / compared if compared else math.nan


def _time(time_s: float | None) -> str:
    return "" if time_s is None else formatting.seconds(time_s)


def _describe_divergence(found: Sequence[_Steps], *, alone: bool) -> Sequence[str]:
    """Describe, for a single scene, when the trajectories left the reference's, and when PIT's did."""
    times = [run.score.parted_s for run in found if run.score.parted_s is not None]
    if not alone or not times:
        return ()
    first, last = formatting.seconds(min(times)), formatting.seconds(max(times))
    when = f"at {first}" if first == last else f"between {first} and {last}"
    asked = {run.score.pit_parted_s for run in found if run.score.parted_s is not None}
    pit = [formatting.seconds(time_s) for time_s in sorted(time_s for time_s in asked if time_s is not None)]
    beside = f"; PIT's at {formatting.listed(pit)}" if pit else ""
    which = formatting.count(len(times), "method")
    return (f"Parted from the reference's trajectory: {which}, {when}{beside}.",)
