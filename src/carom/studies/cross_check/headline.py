"""The first line of a cross-check: what it found, in physical units."""

from __future__ import annotations

from collections.abc import Sequence

from carom.comparator import Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.report import formatting
from carom.report.grid import Grid, GridCell, GridColumn, Mark
from carom.studies.cross_check.ranking import merit, ranked
from carom.studies.cross_check.sentences import Sentence

#: What an engine as shipped is called among its profiles.
SHIPPED = "default"
#: What says that bodies passed through each other; of a trajectory that parted, missed impacts alone do not.
_MISSES = frozenset({Verdict.MISSED, Verdict.MULTIPLE_MISSED, Verdict.PASSED_THROUGH})
#: Names in one sentence.
MOST_NAMES = 3


def finding(grid: Grid) -> str:
    """Return what a cross-check found: of one scene what each method does there, of several who misses what."""
    every = [column for column in grid.columns.values() if any(cell.plays for cell in grid.cells(column))]
    columns = [column for column in every if not column.own] or [c for c in every if c.engine != "pic"] or every
    if not columns:
        return Sentence.NOTHING()
    return _of_one(grid, columns) if len(grid.rows) == 1 else _of_many(grid, columns)


def misses(cell: GridCell) -> bool:
    """Whether a run is said to miss an impact; of a trajectory that parted, a missed impact alone says nothing."""
    score = cell.row.score if cell.row else None
    return score is not None and bool(_MISSES & set(score.verdicts))


def _of_one(grid: Grid, columns: Sequence[GridColumn]) -> str:
    cells = (cell for column in ranked(grid, columns) for cell in grid.cells(column) if cell.plays)
    kinds = list(formatting.together((_does(cell), cell.column.name) for cell in cells).items())
    shown = kinds if len(kinds) <= MOST_NAMES else [kinds[0], kinds[-1]]
    parts = [f"{_names(names)}: {does}" for does, names in shown]
    more = f"; {len(kinds) - len(shown)} other outcomes in between" if len(shown) < len(kinds) else ""
    steps = {cell.row.job.dt_s for cell in grid.rows[0].cells if cell.row is not None}
    at = f" at {formatting.step(steps.pop())}" if len(steps) == 1 else ""
    return Sentence.ONE_SCENE(scene=grid.rows[0].scene.name, step=at, outcomes=f"{'; '.join(parts)}{more}")


def _does(cell: GridCell) -> str:
    """Return what a run did, the gravest alone: impacts missed or invented, velocity error, or lateness."""
    score = cell.row.score if cell.row else None
    if score is None:
        return cell.mark.word
    if Verdict.PARTED in score.verdicts:
        return cell.mark.word if cell.mark is not Mark.WRONG else "wrong and parted"
    lost = [f"{len(score.missed)} missed"] if score.missed else []
    lost += [f"{len(score.spurious)} invented"] if score.spurious else []
    if lost:
        return Sentence.LOST(lost=formatting.listed(lost), impacts=formatting.count(score.expected, "impact"))
    if not score.errors or cell.mark in (Mark.EXACT, Mark.EXACT_32):
        return cell.mark.word
    rounding = THRESHOLDS.rounding_of(score.float_bits)
    if score.total.velocity > rounding:
        return Sentence.VELOCITY(part=formatting.percent(score.total.velocity))
    late = score.total.time_s
    if cell.row is not None and abs(late) > THRESHOLDS.time_rounding_of(
        score.float_bits, score.scales.time_s, cell.row.job.dt_s
    ):
        return Sentence.TIME(time=formatting.number(abs(late) * 1e3, 3), side="late" if late > 0 else "early")
    return cell.mark.word


def _of_many(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Return what every engine as shipped misses, and who is right most often."""
    scenes = len(grid.rows)
    shipped = [column for column in columns if column.profile == SHIPPED]
    parts = []
    if shipped:
        engines = "every engine" if len(shipped) > 1 else shipped[0].label
        missed = [row.scene.name for row in grid.rows if _all_miss([c for c in row.cells if c.column in shipped])]
        which = f": {_names(missed)}" if missed else ""
        parts.append(Sentence.MISSES(missed=len(missed), scenes=scenes, engines=engines, which=which))
    merits = {column: merit([cell.mark for cell in grid.cells(column)]) for column in columns}
    best = min(merits.values())
    firsts = [column for column in ranked(grid, columns) if merits[column] == best]
    if best[0] == 0:
        parts.append(Sentence.NONE_CLOSE(kind="method" if columns[0].own else "engine", scenes=scenes))
    else:
        names, tie = [column.name for column in firsts], " tie" if len(firsts) > 1 else ""
        wrong = max(sum(cell.mark is Mark.WRONG for cell in grid.cells(column)) for column in firsts)
        parts.append(Sentence.MOST_CLOSE(names=_names(names), tie=tie, scenes=-best[0], wrong=wrong))
    return " ".join(parts)


def _all_miss(cells: Sequence[GridCell]) -> bool:
    """Whether all that ran are said to miss an impact; of none that is not so."""
    ran = [cell for cell in cells if cell.row is not None and cell.row.score is not None]
    return bool(ran) and all(map(misses, ran))


def _names(names: Sequence[str]) -> str:
    shown = names if len(names) <= MOST_NAMES else [*names[: MOST_NAMES - 1], f"{len(names) - MOST_NAMES + 1} more"]
    return formatting.listed(list(shown))
