"""Headline of a cross-check: its result in physical units."""

from __future__ import annotations

from collections.abc import Sequence

from carom.comparator import Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.report import formatting
from carom.report.grid import Grid, GridCell, GridColumn, Mark
from carom.studies.cross_check.ranking import count_outcomes, rank_methods
from carom.studies.cross_check.sentences import Sentence

#: Name of the profile of an engine as shipped.
SHIPPED = "default"
#: Verdicts that show that bodies passed through each other. A diverged trajectory has no such verdict for its impacts.
_MISSES = frozenset({Verdict.MISSED, Verdict.MULTIPLE_MISSED, Verdict.PASSED_THROUGH})
#: Largest number of names in one sentence.
MOST_NAMES = 3


def build_headline(grid: Grid) -> str:
    """Summarise a cross-check: for one scene what each method does, for several which methods miss impacts."""
    every = [column for column in grid.columns.values() if any(cell.has_replay for cell in grid.cells(column))]
    columns = [column for column in every if not column.own] or [c for c in every if c.engine != "pic"] or every
    if not columns:
        return Sentence.NOTHING()
    return _describe_scene(grid, columns) if len(grid.rows) == 1 else _describe_scenes(grid, columns)


def has_miss(cell: GridCell) -> bool:
    """Whether a verdict on a run is a missed impact; after a divergence only steps can show one."""
    score = cell.row.score if cell.row else None
    return score is not None and bool(_MISSES & set(score.verdicts))


def _describe_scene(grid: Grid, columns: Sequence[GridColumn]) -> str:
    cells = (cell for column in rank_methods(grid, columns) for cell in grid.cells(column) if cell.has_replay)
    kinds = list(formatting.together((_describe_run(cell), cell.column.name) for cell in cells).items())
    shown = kinds if len(kinds) <= MOST_NAMES else [kinds[0], kinds[-1]]
    parts = [f"{_join_names(names)}: {does}" for does, names in shown]
    more = f"; {len(kinds) - len(shown)} other outcomes in between" if len(shown) < len(kinds) else ""
    steps = {cell.row.job.dt_s for cell in grid.rows[0].cells if cell.row is not None}
    at = f" at {formatting.step(steps.pop())}" if len(steps) == 1 else ""
    return Sentence.ONE_SCENE(scene=grid.rows[0].scene.name, step=at, outcomes=f"{'; '.join(parts)}{more}")


def _describe_run(cell: GridCell) -> str:
    """Describe the gravest fault of a run: impacts missed or invented, velocity error, or lateness."""
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


def _describe_scenes(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Summarise several scenes: what every engine as shipped misses, and which methods are right most often."""
    scenes = len(grid.rows)
    shipped = [column for column in columns if column.profile == SHIPPED]
    parts = []
    if shipped:
        engines = "every engine" if len(shipped) > 1 else shipped[0].label
        missed = [row.scene.name for row in grid.rows if _all_have_miss([c for c in row.cells if c.column in shipped])]
        which = f": {_join_names(missed)}" if missed else ""
        parts.append(Sentence.MISSES(missed=len(missed), scenes=scenes, engines=engines, which=which))
    outcomes = {column: count_outcomes([cell.mark for cell in grid.cells(column)]) for column in columns}
    best = min(outcomes.values())
    firsts = [column for column in rank_methods(grid, columns) if outcomes[column] == best]
    if best[0] == 0:
        parts.append(Sentence.NONE_CLOSE(kind="method" if columns[0].own else "engine", scenes=scenes))
    else:
        names, tie = [column.name for column in firsts], " tie" if len(firsts) > 1 else ""
        wrong = max(sum(cell.mark is Mark.WRONG for cell in grid.cells(column)) for column in firsts)
        parts.append(Sentence.MOST_CLOSE(names=_join_names(names), tie=tie, scenes=-best[0], wrong=wrong))
    return " ".join(parts)


def _all_have_miss(cells: Sequence[GridCell]) -> bool:
    """Whether there are runs and all of them miss an impact."""
    ran = [cell for cell in cells if cell.row is not None and cell.row.score is not None]
    return bool(ran) and all(map(has_miss, ran))


def _join_names(names: Sequence[str]) -> str:
    shown = names if len(names) <= MOST_NAMES else [*names[: MOST_NAMES - 1], f"{len(names) - MOST_NAMES + 1} more"]
    return formatting.listed(list(shown))
