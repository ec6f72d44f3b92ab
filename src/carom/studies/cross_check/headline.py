"""Headline of a cross-check: its result in numbers, and the evidence for the reference."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from carom.comparator import Horizon, Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.results import Results
from carom.report import formatting
from carom.report.document import Headline
from carom.report.outcome_marks import RIGHT, Mark
from carom.studies.cross_check.grid import Grid, GridCell, GridColumn

#: Name of the profile with an engine's default settings.
SHIPPED = "default"
#: Largest number of names in one sentence.
MOST_NAMES = 4


def build_headline(grid: Grid) -> Headline:
    """Return the result in one sentence, and further sentences on the reference, counts, and chance."""
    every = grid.compared
    columns = [column for column in every if not column.own] or every
    if not columns:
        sentence = "Nothing was scored, because no requested method ran any of these scenes."
    else:
        sentence = _describe_scene(grid, columns) if len(grid.rows) == 1 else _describe_scenes(grid, columns)
    more = (_describe_reference(grid.results), _describe_counts(grid, columns), *_describe_phase_dependence(grid))
    return Headline(sentence, tuple(filter(None, more)))


def _describe_scene(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Describe the result of each method on a single scene."""
    cells = [cell for column in columns for cell in grid.list_cells(column) if cell.scored]
    kinds = list(formatting.group_by((_describe_run(cell), cell.column.name) for cell in cells).items())
    shown = kinds if len(kinds) < MOST_NAMES else [kinds[0], kinds[-1]]
    parts = [f"{_join_names(names)}: {does}" for does, names in shown]
    more = f"; {len(kinds) - len(shown)} outcomes in between are omitted" if len(shown) < len(kinds) else ""
    steps = {cell.line.dt_s for cell in grid.rows[0].cells if cell.mark is not Mark.ABSENT}
    at = f" at {formatting.format_step(steps.pop())}" if len(steps) == 1 else ""
    return f"{grid.rows[0].name}{at}: {'; '.join(parts)}{more}."


def _describe_run(cell: GridCell) -> str:
    """Describe the worst fault of a run: missed or invented impacts, velocity error, or lateness."""
    if cell.has_verdict(Verdict.PARTED):
        return cell.mark.word if cell.mark is not Mark.WRONG else "wrong, with a diverged trajectory"
    lost = [f"{cell.missed} missed"] * bool(cell.missed) + [f"{cell.invented} invented"] * bool(cell.invented)
    if lost:
        return f"{formatting.join_words(lost)} of {formatting.format_count(cell.expected, 'impact')}"
    if cell.matched and cell.mark not in (Mark.EXACT, Mark.EXACT_32):
        if cell.errors.velocity > cell.rounding:
            return f"velocities are wrong by {formatting.format_percent(cell.errors.velocity)} of the greatest speed"
        if late_s := cell.time_error_s:
            return f"{formatting.format_number(abs(late_s) * 1e3, 3)} ms {'late' if late_s > 0 else 'early'}"
    return cell.mark.word


def _describe_scenes(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Summarise several scenes: misses with default settings, and scenes with errors within PIT's when tuned."""
    by_profile = formatting.group_by((column.profile, column) for column in columns)
    first = SHIPPED if SHIPPED in by_profile else next(iter(by_profile))
    others = [profile for profile in by_profile if profile != first]
    second = "tuned" if "tuned" in others else next(iter(others), first)
    shipped, tuned = by_profile[first], by_profile[second]
    misses, sampled = _describe_misses(grid, shipped), _describe_sampled(grid, tuned)
    if columns[0].own:  # without an engine, PIT would be compared with itself
        return f"{formatting.capitalise(misses)}."
    if first == second:
        return f"{_format_profile(first)}: {misses}; {sampled}."
    return f"{_format_profile(first)}: {misses}. {_format_profile(second)}: {sampled}."


def _format_profile(profile: str) -> str:
    return "Default settings" if profile == SHIPPED else formatting.capitalise(profile)


def _describe_misses(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Describe in how many scenes all methods miss an impact; if in none, in how many scenes each method does."""
    scenes = len(grid.rows)
    counts = [sum(cell.has_miss for cell in grid.list_cells(column)) for column in columns]
    ran = [[cell for cell in row.cells if cell.column in columns and cell.scored] for row in grid.rows]
    by_all = sum(bool(cells) and all(cell.has_miss for cell in cells) for cells in ran)
    if len(columns) == 1:
        where = f"an impact in {by_all} of {scenes} scenes" if by_all else f"no impact in {scenes} scenes"
        return f"{columns[0].label} misses {where}"
    kind = "method" if columns[0].own else "engine"
    if by_all:
        return f"every {kind} misses an impact in {by_all} of {scenes} scenes"
    if not any(counts):
        return f"no {kind} misses an impact in {scenes} scenes"
    return f"each {kind} misses an impact in {_format_count_range(counts)} of {scenes} scenes"


def _describe_sampled(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Describe the number of scenes in which methods find all impacts with errors within sampling error."""
    good = RIGHT | {Mark.SAMPLED}
    counts = [sum(cell.mark in good for cell in grid.list_cells(column)) for column in columns]
    names, does = _join_names([column.label for column in columns]), "is" if len(columns) == 1 else "are"
    scenes = "scene" if max(counts) == 1 else "scenes"
    return f"{names} {does} within sampling error in {_format_count_range(counts)} {scenes}"


def _format_count_range(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def _join_names(names: Sequence[str]) -> str:
    shown = names if len(names) <= MOST_NAMES else [*names[: MOST_NAMES - 1], f"{len(names) - MOST_NAMES + 1} more"]
    return formatting.join_words(list(shown))


def _describe_reference(results: Results) -> str:
    """Describe the evidence for PIC's accuracy."""
    if not results.known:
        if not results.references:
            return ""
        proven = [n for n, how in results.certified.items() if isinstance(how, Horizon) and how.covers_the_scene]
        unknown = "None of these scenes has a known answer"
        if not proven:
            return f"{unknown}: PIC is the reference, without independent proof."
        which = f"{len(proven)} of {formatting.format_count(len(results.references), 'scene')}"
        return f"{unknown}; every impact of PIC is certified in {which}."
    deviations = {name: deviation for name, (_, deviation) in results.known.items()}
    off = [name for name, deviation in deviations.items() if not deviation <= THRESHOLDS.rounding]
    if off:
        right = f"{len(deviations) - len(off)} of {formatting.format_count(len(deviations), 'known answer')}"
        return f"PIC reproduces {right} to rounding, but not {formatting.join_words(off)}."
    which = f"all {len(deviations)} known answers" if len(deviations) > 1 else "the one known answer"
    return f"PIC reproduces {which} (largest deviation {formatting.format_number(max(deviations.values()))})."


def _describe_counts(grid: Grid, columns: Sequence[GridColumn]) -> str:
    """Describe the numbers of runs by grade."""
    asked, what = [column for column in grid.columns.values() if not column.own], "engine run"
    if not asked:  # if only Carom's own methods ran, PIT is compared with PIC
        asked = list(columns) or list(grid.columns.values())
        labels = {column.label for column in asked}
        what = f"{labels.pop()} run" if len(labels) == 1 else "run"
    tally = Counter(cell.mark for column in asked for cell in grid.list_cells(column))
    ran = sum(n for mark, n in tally.items() if mark.ran)
    scored = [
        f"{tally[mark]} {'is' if tally[mark] == 1 else 'are'} {mark.word}" for mark in Mark if mark.ran and tally[mark]
    ]
    others = [f"{tally[mark]} {mark.word}" for mark in Mark if not mark.ran and mark is not Mark.ABSENT and tally[mark]]
    said = f"No {what} at {grid.step_phrase} could be scored."
    if ran:
        number, rest = scored[0].split(" ", 1)
        first = f"{number} of {formatting.format_count(ran, what)} at {grid.step_phrase} {rest}"
        said = f"{formatting.join_words((first, *scored[1:]))}."
    return f"{said} Runs without a score: {', '.join(others)}." if others else said


def _describe_phase_dependence(grid: Grid) -> Iterator[str]:
    """Describe grades that depend on the phase of the step at which an impact falls."""
    for column in grid.columns.values():
        scores = [cell.row.score for cell in grid.list_cells(column) if cell.row and cell.row.score]
        found = [score.lucky_phase for score in scores if score.lucky_phase]
        if column.engine != "pit" or not found:
            continue
        owes = "its grade" if len(scores) == 1 else f"the grade in {len(found)} of {len(scores)} scenes"
        shares = sorted({share for share, _ in found})
        some = str(shares[0]) if len(shares) == 1 else f"{shares[0]} to {shares[-1]}"
        right = f"PIT is equally accurate at {some} of {found[0][1]} phases"
        yield f"{column.name}: {owes} depends on the phase of the step; {right}."
