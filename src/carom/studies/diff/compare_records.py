"""Changes between the results.jsonl files of two cross-checks. Differences within rounding do not count."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from carom.comparator import Grade
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.execution.environment import Environment
from carom.report.outcome_marks import BROKEN, GRADED, Mark
from carom.studies.diff.options import DiffOptions
from carom.studies.diff.read_cells import DiffCell, Measure, read_cells
from carom.support import formatting


class Kind(Enum):
    """Kinds of changes of a run, beginning with the worst."""

    WORSE = "worse"
    MIXED = "mixed"
    VANISHED = "vanished"
    CHANGED = "neither better nor worse"
    APPEARED = "appeared"
    BETTER = "better"


@dataclass(frozen=True, kw_only=True)
class BeforeAfter(Measure):
    """A number of a run in the old and the new report.

    Attributes:
        old: The number in the old report, with its sign; NaN if it was not measured.
        new: The number in the new report; NaN if it was not measured.
    """

    old: float | bool
    new: float | bool

    @property
    def is_count(self) -> bool:
        """Whether this number counts impacts, so that every difference is a change."""
        return self.rounding == 0.0

    @property
    def is_changed(self) -> bool:
        """Whether the number differs, or is measured in only one of the runs."""
        if math.isnan(self.old) or math.isnan(self.new):
            return math.isnan(self.old) is not math.isnan(self.new)
        return not abs(self.new - self.old) <= self.rounding

    @property
    def growth(self) -> float:
        """Increase of the number's absolute value; 0 within rounding, or if only one of the runs has the number."""
        grown = abs(self.new) - abs(self.old)
        return grown if abs(grown) > self.rounding else 0.0

    def __str__(self) -> str:
        if isinstance(self.old, bool):
            return f"{self.name}: {'gone' if self.old else 'new'}"
        # Use as few digits as possible to show the difference. 17 digits distinguish any two floats.
        texts = ([_format_number(value, digits) for value in (self.old, self.new)] for digits in range(3, 18))
        old, new = next((pair for pair in texts if pair[0] != pair[1]), ["", ""])
        return f"{self.name} {old} → {new}{self.unit}"


def _format_number(value: float, digits: int) -> str:
    return "not measured" if math.isnan(value) else formatting.format_number(value, digits)


@dataclass(frozen=True)
class Change:
    """A run whose result changed.

    Attributes:
        kind: Kind of the change.
        scene: Name of the scene.
        method: Engine and profile; the old and the new ones if they differ.
        dt_s: Step size, in seconds.
        old: Grade or failure in the old report.
        new: Grade or failure in the new report.
        measures: The numbers that changed.
        verdicts: New verdicts and, if the old run failed, also the old run's reasons that no longer apply.
        changed: Changed settings, versions and reference values: pairs of a name, and a text with the old and the new
            value.
    """

    kind: Kind
    scene: str
    method: str
    dt_s: float
    old: Mark
    new: Mark
    measures: tuple[BeforeAfter, ...]
    verdicts: tuple[str, ...]
    changed: tuple[tuple[str, str], ...]

    @property
    def causes(self) -> tuple[str, ...]:
        """The `verdicts`, and the changed settings, versions and reference values, as phrases."""
        split_names = ((name.partition(": "), values) for name, values in self.changed)
        kinds = formatting.group_by((kind, f"{subject} {values}") for (kind, _, subject), values in split_names)
        return (*self.verdicts, *(f"{kind}: {', '.join(phrases)}" for kind, phrases in kinds.items()))

    @property
    def graded(self) -> bool:
        """Whether the change can count as better or worse. False if a run is ungraded and no run failed."""
        return _are_graded(self.old, self.new)

    @property
    def severity(self) -> tuple[float, ...]:
        """Sort key that is largest for the worst change.

        The key consists of: whether the runs are graded, the kind, the new grade, the old grade, the increase in missed
        and invented impacts, and the largest increase of an error.
        """
        impacts = sum(measure.growth for measure in self.measures if measure.is_count)
        # Only errors without a unit are compared, because seconds and degrees are not comparable.
        growth = max((one.growth for one in self.measures if not (one.is_count or one.unit)), default=0.0)
        kind = -list(Kind).index(self.kind)
        return (float(self.graded), kind, _rank_of(self.new), -_rank_of(self.old), impacts, growth)

    @property
    def most_important(self) -> BeforeAfter | None:
        """The most important changed number; None if no number changed.

        If the run became better, numbers that became better are the most important. Otherwise, numbers that became
        worse are the most important. Then the order of importance is: missed and invented impacts, errors without a
        unit, errors with a unit, verdicts. Among equally important numbers, the first is returned. Errors of impacts
        are first, because they cause the other errors.
        """
        direction = -1.0 if self.kind is Kind.BETTER else 1.0

        def order(one: BeforeAfter) -> tuple[bool, bool, bool, bool]:
            return (direction * one.growth > 0.0, one.is_count, not isinstance(one.old, bool), not one.unit)

        return max(self.measures, key=order, default=None)

    def is_regression_to(self, fail_on: Grade) -> bool:
        """Whether a graded run became worse, and its new grade is at least as bad as `fail_on`.

        A mixed change counts as worse, and a failed run is worse than all grades.
        """
        is_worse = self.kind in (Kind.WORSE, Kind.MIXED) and self.graded
        return is_worse and _rank_of(self.new) >= list(Grade).index(fail_on)


@dataclass(frozen=True)
class Diff:
    """Changes between two cross-checks.

    Attributes:
        changes: The changes, worst first.
        unchanged: Number of unchanged runs.
        environment_changes: Differences in versions and machine, each as a phrase.
    """

    changes: tuple[Change, ...]
    unchanged: int
    environment_changes: tuple[str, ...]


def compare_records(old: Path, new: Path, match: Sequence[tuple[str, str]] | None = None) -> Diff:
    """Compare the results.jsonl files of two cross-checks.

    Args:
        old: Folder of the old report, or its `results.jsonl`.
        new: Folder of the new report, or its `results.jsonl`.
        match: See `carom.studies.diff.options.DiffOptions`.

    Raises:
        InputError: A file can't be read or is not a results.jsonl, the reports have no run in common, or `match` is not
            a list of pairs.
    """
    match = DiffOptions(match).match
    (before, old_cells), (after, new_cells) = read_cells(old), read_cells(new)
    if match:
        old_names, new_names = zip(*match, strict=True)
        old_cells = list(_select_cells(old_cells, old_names, old))
        new_cells = list(_select_cells(new_cells, new_names, new))
    methods = {cell.method for cell in old_cells}, {cell.method for cell in new_cells}

    def key(cell: DiffCell) -> tuple[object, ...]:
        if len(methods[0]) == len(methods[1]) == 1:
            return (cell.scene, cell.dt_s)
        # The key ignores settings that the user has replaced. Therefore a run with replaced settings is compared with a
        # run of the unchanged profile.
        return (cell.scene, cell.dt_s, cell.method.profile, cell.pair or cell.method.engine)

    olds, news = {key(cell): cell for cell in old_cells}, {key(cell): cell for cell in new_cells}
    names = dict.fromkeys((*olds, *news))
    pairs = [(olds.get(name) or news[name].as_absent, news.get(name) or olds[name].as_absent) for name in names]
    run_pairs = [pair for pair in pairs if any(map(_has_run, pair))]
    if not any(all(map(_has_run, pair)) for pair in run_pairs):
        raise InputError(
            f"{old} and {new} have no run in common: scenes, engines, profiles or step sizes differ, or an engine was "
            "not available; --engine OLD=NEW compares one engine with another"
        )
    versions = _find_differences(_list_versions(before.environment), _list_versions(after.environment))
    changes = [change for a, b in run_pairs if (change := _compare_cell(a, b, versions))]
    changes.sort(key=lambda change: change.severity, reverse=True)
    environment_changes = tuple(f"{name} {values}" for name, values in versions.items())
    return Diff(tuple(changes), len(run_pairs) - len(changes), environment_changes)


def _has_run(cell: DiffCell) -> bool:
    """Whether an engine was started for this cell, even if the run failed."""
    return cell.mark.ran or cell.mark in BROKEN


def _select_cells(cells: Sequence[DiffCell], names: Sequence[str], path: Path) -> Iterator[DiffCell]:
    """Yield the runs of a report whose engine or method has one of the names.

    Each run stores the position of its name in `names`, counted from 1.

    Args:
        cells: All runs of the report.
        names: Names of engines or methods.
        path: Path of the report, for messages.
    """
    for number, name in enumerate(names, start=1):
        found = [replace(cell, pair=number) for cell in cells if name in cell.names]
        if not found:
            known = formatting.join_words(sorted({cell.method.name for cell in cells})) or "no rows"
            raise InputError(f"--engine: {path} has no engine or method {name!r}", hints=[f"it has {known}"])
        yield from found


def _list_versions(environment: Environment) -> dict[str, str]:
    """Return the versions and the properties of the machine by name."""
    machine = {name: getattr(environment, name) for name in ("python", "system", "processor")}
    return {"Carom": environment.carom, **environment.versions, **machine}


def _find_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, str]:
    """Return a text with the old and the new value for each name whose values differ."""
    pairs = {name: (old.get(name, "none"), new.get(name, "none")) for name in (*old, *new)}
    return {name: f"{a} → {b}" for name, (a, b) in pairs.items() if not _are_equal(a, b)}


def _are_equal(a: object, b: object) -> bool:
    """Whether two values are equal.

    Floats that differ only by rounding count as equal, because the reports may be from different machines.
    """
    if not (isinstance(a, float) and isinstance(b, float)):
        return a == b
    return math.isclose(a, b, rel_tol=THRESHOLDS.rounding) or (math.isnan(a) and math.isnan(b))


def _compare_cell(old: DiffCell, new: DiffCell, versions: Mapping[str, str]) -> Change | None:
    """Compare two runs, and return the change; None if nothing changed."""
    measures = tuple(_list_changed_numbers(old, new))
    kind: Kind | None = Kind.APPEARED if _has_run(new) else Kind.VANISHED
    if _has_run(old) and _has_run(new):
        kind = _classify(old.mark, new.mark, measures)
    if kind is None:
        return None
    method = " → ".join(dict.fromkeys((old.method.label, new.method.label)))
    verdicts, changed = tuple(_list_changed_verdicts(old, new)), tuple(_list_causes(old, new, versions))
    return Change(kind, new.scene, method, new.dt_s, old.mark, new.mark, measures, verdicts, changed)


def _list_changed_numbers(old: DiffCell, new: DiffCell) -> Iterator[BeforeAfter]:
    """Yield the changed numbers: counts of impacts, verdicts and errors. A run without a result has no numbers.

    If one run has 32-bit floats and the other 64-bit floats, the smaller rounding error is used.
    """
    for a, b, before, after in zip(old.measures, new.measures, old.numbers, new.numbers, strict=False):
        if before != after:
            measure = BeforeAfter(a.name, min(a.rounding, b.rounding), a.unit, old=before, new=after)
            if measure.is_changed:
                yield measure


def _classify(old_mark: Mark, new_mark: Mark, measures: Sequence[BeforeAfter]) -> Kind | None:
    grew = _rank_of(new_mark) - _rank_of(old_mark) if _are_graded(old_mark, new_mark) else 0
    # Numbers of impacts are compared first, because a run has no errors for impacts that it does not find.
    impacts = sum(measure.growth for measure in measures if measure.is_count)
    growths = [impacts] if impacts else [measure.growth for measure in measures]
    rose, fell = any(growth > 0 for growth in growths), any(growth < 0 for growth in growths)
    if grew < 0:
        return Kind.BETTER
    if grew > 0:
        return Kind.MIXED if fell and not rose else Kind.WORSE
    if rose and fell:
        return Kind.MIXED
    if rose or fell:
        return Kind.WORSE if rose else Kind.BETTER
    return Kind.CHANGED if measures or old_mark is not new_mark else None


def _are_graded(old_mark: Mark, new_mark: Mark) -> bool:
    return Mark.UNGRADED not in (old_mark, new_mark) or bool(BROKEN & {old_mark, new_mark})


def _rank_of(mark: Mark) -> int:
    """Return a number that is larger for a worse grade, and largest for a failed run."""
    if mark in BROKEN:
        return len(Grade)
    return list(Grade).index(GRADED[mark]) if mark in GRADED else -1


def _list_changed_verdicts(old: DiffCell, new: DiffCell) -> Iterator[str]:
    yield from (verdict for verdict in new.verdicts if verdict not in old.verdicts)
    if not old.mark.ran and new.mark is not Mark.ABSENT:
        yield from (f"before: {verdict}" for verdict in old.verdicts if verdict not in new.verdicts)


def _list_causes(old: DiffCell, new: DiffCell, versions: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    if Mark.ABSENT in (old.mark, new.mark):
        return
    if new.mark.ran and old.mark.ran:
        for name, values in _find_differences(old.reference, new.reference).items():
            yield f"changed scene or reference: {name}", values
    if old.method.engine == new.method.engine:
        if old.settings and new.settings:
            for name, values in _find_differences(old.settings, new.settings).items():
                yield f"settings: {name}", values
        # The header contains versions by engine name. An engine's name in lower case is usually the adapter's name.
        for name in versions:
            if name.casefold() in (new.method.engine.casefold(), "carom"):
                yield f"version: {name}", versions[name]
