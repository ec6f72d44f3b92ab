"""Headline of a cross-check: sentences with its main results, and the evidence for PIC's accuracy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from carom.comparator import Horizon, Verdict
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.job import Method
from carom.execution.results import Results
from carom.report.outcome_marks import RIGHT, Mark
from carom.studies.cross_check.grid import Grid, GridCell
from carom.support import formatting

#: Name of the profile with an engine's default settings.
SHIPPED = "default"
#: Largest number of names in one sentence.
MOST_NAMES = 4


def build_headline(grid: Grid) -> tuple[str, ...]:
    """Build the headline: the main result, and sentences on the reference, the grades and the effect of phases."""
    compared = grid.compared
    methods = [method for method in compared if not method.is_own] or compared
    if not methods:
        sentence = "Nothing was scored, because no requested method ran any of these scenes."
    else:
        sentence = _describe_scene(grid, methods) if len(grid.rows) == 1 else _describe_scenes(grid, methods)
    details = (_describe_reference(grid.results), _describe_counts(grid, methods), *_describe_phase_dependence(grid))
    return (sentence, *filter(None, details))


def _describe_scene(grid: Grid, methods: Sequence[Method]) -> str:
    """Describe the result of each method on a single scene."""
    cells = [cell for method in methods for cell in grid.list_cells(method) if cell.scored]
    kinds = list(formatting.group_by((_describe_run(cell), cell.method.title) for cell in cells).items())
    listed = kinds if len(kinds) < MOST_NAMES else [kinds[0], kinds[-1]]
    parts = [f"{_join_names(names)}: {does}" for does, names in listed]
    omission = f"; {len(kinds) - len(listed)} outcomes in between are omitted" if len(listed) < len(kinds) else ""
    steps = {cell.line.dt_s for cell in grid.rows[0].cells if cell.mark is not Mark.ABSENT}
    step_text = f" at {formatting.format_step(steps.pop())}" if len(steps) == 1 else ""
    return f"{grid.rows[0].name}{step_text}: {'; '.join(parts)}{omission}."


def _describe_run(cell: GridCell) -> str:
    """Describe the worst fault of a run: missed or invented impacts, velocity error, or time error."""
    if cell.has_verdict(Verdict.DIVERGED):
        return cell.mark.word if cell.mark is not Mark.WRONG else "wrong, with a diverged trajectory"
    losses = [f"{count} {word}" for count, word in ((cell.missed, "missed"), (cell.invented, "invented")) if count]
    if losses:
        return f"{formatting.join_words(losses)} of {formatting.format_count(cell.expected, 'impact')}"
    if cell.matched and cell.mark not in (Mark.EXACT, Mark.EXACT_32):
        if cell.errors.velocity > cell.rounding:
            return f"velocities are wrong by {formatting.format_percent(cell.errors.velocity)} of the greatest speed"
        if late_s := cell.time_error_s:
            return f"{formatting.format_number(abs(late_s) * 1e3, 3)} ms {'late' if late_s > 0 else 'early'}"
    return cell.mark.word


def _describe_scenes(grid: Grid, methods: Sequence[Method]) -> str:
    """Summarise several scenes.

    The summary states how often default settings miss impacts, and how often tuned settings are as accurate as PIT.
    """
    by_profile = formatting.group_by((method.profile_shown, method) for method in methods)
    first = SHIPPED if SHIPPED in by_profile else next(iter(by_profile))
    other_profiles = [profile for profile in by_profile if profile != first]
    second = "tuned" if "tuned" in other_profiles else next(iter(other_profiles), first)
    shipped, tuned = by_profile[first], by_profile[second]
    misses, sampled = _describe_misses(grid, shipped), _describe_sampled(grid, tuned)
    if methods[0].is_own:  # without an engine, PIT would be compared with itself
        return f"{formatting.capitalise(misses)}."
    if first == second:
        return f"{_format_profile(first)}: {misses}; {sampled}."
    return f"{_format_profile(first)}: {misses}. {_format_profile(second)}: {sampled}."


def _format_profile(profile: str) -> str:
    return "Default settings" if profile == SHIPPED else formatting.capitalise(profile)


def _describe_misses(grid: Grid, methods: Sequence[Method]) -> str:
    """Describe in how many scenes all methods miss an impact.

    If there is no such scene, describe in how many scenes each method misses an impact.
    """
    scenes = len(grid.rows)
    counts = [sum(cell.has_miss for cell in grid.list_cells(method)) for method in methods]
    scored_cells = [[cell for cell in row.cells if cell.method in methods and cell.scored] for row in grid.rows]
    by_all = sum(bool(cells) and all(cell.has_miss for cell in cells) for cells in scored_cells)
    if len(methods) == 1:
        miss_text = f"an impact in {by_all} of {scenes} scenes" if by_all else f"no impact in {scenes} scenes"
        return f"{methods[0].heading} misses {miss_text}"
    kind = "method" if methods[0].is_own else "engine"
    if by_all:
        return f"every {kind} misses an impact in {by_all} of {scenes} scenes"
    if not any(counts):
        return f"no {kind} misses an impact in {scenes} scenes"
    return f"each {kind} misses an impact in {_format_count_range(counts)} of {scenes} scenes"


def _describe_sampled(grid: Grid, methods: Sequence[Method]) -> str:
    """Describe in how many scenes each method finds all impacts and has errors that are at most PIT's."""
    good = RIGHT | {Mark.SAMPLED}
    counts = [sum(cell.mark in good for cell in grid.list_cells(method)) for method in methods]
    names, does = _join_names([method.heading for method in methods]), "is" if len(methods) == 1 else "are"
    scenes = "scene" if max(counts) == 1 else "scenes"
    return f"{names} {does} at least as accurate as PIT in {_format_count_range(counts)} {scenes}"


def _format_count_range(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def _join_names(names: Sequence[str]) -> str:
    listed = names if len(names) <= MOST_NAMES else [*names[: MOST_NAMES - 1], f"{len(names) - MOST_NAMES + 1} more"]
    return formatting.join_words(list(listed))


def _describe_reference(results: Results) -> str:
    """Describe the evidence for PIC's accuracy."""
    if not results.known:
        if not results.references:
            return ""
        proven = [n for n, how in results.certified.items() if isinstance(how, Horizon) and how.covers_the_scene]
        alone = len(results.references) == 1
        unknown = "This scene has no known answer" if alone else "None of these scenes has a known answer"
        if not proven:
            return f"{unknown}: PIC is the reference, without independent proof."
        which = f"{len(proven)} of {formatting.format_count(len(results.references), 'scene')}"
        return f"{unknown}; every impact of PIC is certified in {which}."
    deviations = {name: deviation for name, (_, deviation) in results.known.items()}
    deviating = [name for name, deviation in deviations.items() if not deviation <= THRESHOLDS.rounding]
    if deviating:
        right = f"{len(deviations) - len(deviating)} of {formatting.format_count(len(deviations), 'known answer')}"
        return f"PIC reproduces {right} to rounding, but not {formatting.join_words(deviating)}."
    which = f"all {len(deviations)} known answers" if len(deviations) > 1 else "the one known answer"
    return f"PIC reproduces {which} (largest deviation {formatting.format_number(max(deviations.values()))})."


def _describe_counts(grid: Grid, methods: Sequence[Method]) -> str:
    """Describe the numbers of runs by grade."""
    counted_methods, noun = [method for method in grid.methods if not method.is_own], "engine run"
    if not counted_methods:  # if only Carom's own methods ran, count PIT
        counted_methods = list(methods) or list(grid.methods)
        labels = {method.heading for method in counted_methods}
        noun = f"{labels.pop()} run" if len(labels) == 1 else "run"
    tally = Counter(cell.mark for method in counted_methods for cell in grid.list_cells(method))
    run_count = sum(n for mark, n in tally.items() if mark.ran)
    present = [mark for mark in Mark if tally[mark]]
    scored = [f"{tally[mark]} {mark.word}" for mark in present if mark.ran]
    unscored = [f"{tally[mark]} {mark.word}" for mark in present if not mark.ran and mark is not Mark.ABSENT]
    sentence = f"No {noun} at {grid.step_phrase} could be scored."
    if run_count:
        runs = f"{formatting.format_count(run_count, noun)} at {grid.step_phrase}"
        sentence = f"Grades of {runs}: {formatting.join_words(scored)}."
    return f"{sentence} Other runs have no score: {', '.join(unscored)}." if unscored else sentence


def _describe_phase_dependence(grid: Grid) -> Iterator[str]:
    """Describe how often PIT's grade depends on the phase of the step."""
    for method in grid.methods:
        scores = [cell.row.score for cell in grid.list_cells(method) if cell.row and cell.row.score]
        found = [score.lucky_phase for score in scores if score.lucky_phase]
        if method.engine != "pit" or not found:
            continue
        owes = "its grade" if len(scores) == 1 else f"the grade in {len(found)} of {len(scores)} scenes"
        shares = sorted({share for share, _ in found})
        share_text = str(shares[0]) if len(shares) == 1 else f"{shares[0]} to {shares[-1]}"
        right = f"PIT reaches this accuracy at only {share_text} of {found[0][1]} phases"
        yield f"{method.title}: {owes} depends on the phase of the step; {right}."
