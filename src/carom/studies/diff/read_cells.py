"""Reads the runs of a results.jsonl, to compare them with the runs of another results.jsonl.

The file is read row by row, so that a large file need not fit into memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from carom.comparator import Errors, Verdict
from carom.comparator.scales import Scales
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.execution.job import Method
from carom.report.outcome_marks import Mark, parse_mark
from carom.report.results_file.lines import RowLine, Summary
from carom.report.results_file.results_jsonl import stream_records

#: Verdicts without a number. The comparison only checks whether each run has the verdict.
_FLAGS = (
    *(Verdict.NOT_FINITE, Verdict.CUT_SHORT, Verdict.WRONG_ORDER, Verdict.DRIFTS, Verdict.TURNS),
    *(Verdict.SPINS, Verdict.WRONG_STAMP, Verdict.WRONG_NORMAL, Verdict.MOMENTUM, Verdict.ANGULAR),
    *(Verdict.SLID, Verdict.STUCK),
)
_NAMES: dict[str, str] = {field.name: field.metadata["name"] for field in fields(Errors)}
#: The errors that determine a grade, and the direction error, which is visible in pictures.
_ERRORS = ("time_s", "velocity", "spin", "direction_rad", "energy", "final_position", "final_velocity", "final_spin")


@dataclass(frozen=True)
class Measure:
    """Name and unit of a compared number, and the largest difference that rounding can cause."""

    name: str
    rounding: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class DiffCell:
    """A run from results.jsonl, with the data of its scene.

    If runs have equal settings or methods, they share one object, which saves memory.
    """

    method: Method
    scene: str
    dt_s: float
    mark: Mark
    measures: tuple[Measure, ...]
    numbers: tuple[float | bool, ...]
    verdicts: tuple[str, ...]
    settings: Mapping[str, Any]
    reference: Mapping[str, Any]
    pair: int = 0  # number (from 1) of the pair of names that selects this run; 0 without a pair

    @property
    def names(self) -> tuple[str, ...]:
        """Names with which a user can select this run: its engine, its profile, and its method with all settings."""
        return self.method.engine, f"{self.method.engine}/{self.method.profile}", self.method.name

    @property
    def as_absent(self) -> DiffCell:
        """An empty cell for this run, which is used for the other report if that report does not contain the run."""
        return replace(self, mark=Mark.ABSENT, measures=(), numbers=(), verdicts=(), settings={}, reference={})


def read_cells(path: Path) -> tuple[Summary, list[DiffCell]]:
    """Return the first line and the runs of a results.jsonl. The path may also be the folder of a report.

    Raises:
        InputError: The file can't be read, or a line is not a run of a cross-check.
    """
    file = path / "results.jsonl" if path.is_dir() else path
    summary, lines = stream_records(file)
    references = {name: {"expected": one.expected, **asdict(one.scales)} for name, one in summary.scenes.items()}
    shared = dict[Any, Any]()
    cells: list[DiffCell] = []
    try:
        cells.extend(_build_cell(summary, line, references, shared) for line in lines)
    except InputError:
        raise
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:  # all types are valid, but some values are not
        message = f"{file}, line {len(cells) + 2}: not a run of a cross-check ({error!r})"
        raise InputError(message, hints=["run the cross-check again"]) from None
    return summary, cells


def _build_cell(
    summary: Summary, line: RowLine, references: Mapping[str, Mapping[str, Any]], shared: dict[Any, Any]
) -> DiffCell:
    mark = parse_mark(line.status, line.grade, line.float_bits)
    reasons = {one.verdict: one.reason for one in line.verdicts}
    verdict_texts = tuple(f"{summary.verdicts[name]} ({reason})" for name, reason in reasons.items())
    settings = dict(line.settings or {})
    return DiffCell(
        method=shared.setdefault(line.method, line.method),
        scene=line.scene,
        dt_s=line.dt_s,
        mark=mark,
        measures=_read_measures(line, summary.scenes[line.scene].scales) if mark.ran else (),
        numbers=tuple(_list_numbers(line, reasons)) if mark.ran else (),
        verdicts=verdict_texts or tuple(filter(None, (line.reason,))),
        # Settings are compared as text, because 1, 1.0 and True are different settings, but equal in Python.
        settings=shared.setdefault(repr(settings), settings),
        reference=references[line.scene] if mark.ran else {},
    )


def _read_measures(line: RowLine, scales: Scales) -> tuple[Measure, ...]:
    """Return a description of each number of a line.

    The line must contain `float_bits`, the errors of the run, and the missed and spurious impacts.

    Raises:
        ValueError: The line lacks one of the required values.
    """
    if line.float_bits is None or line.total is None or line.missed is None or line.spurious is None:
        lacking = [name for name in ("float_bits", "total", "missed", "spurious") if getattr(line, name) is None]
        raise ValueError(f"it has a grade, but lacks {lacking}")
    return _list_measures(line.float_bits, line.dt_s, scales)


@lru_cache
def _list_measures(bits: int, dt_s: float, scales: Scales) -> tuple[Measure, ...]:
    """Return a description of each number that `_list_numbers` yields. `bits` is the width of the run's floats."""
    rounding, time_s = THRESHOLDS.rounding_of(bits), scales.time_s
    place = THRESHOLDS.place_rounding_of(bits, time_s / dt_s) * scales.reach_m / scales.length_m
    limits = {
        "time_s": (THRESHOLDS.time_rounding_of(bits, time_s, dt_s), " s"),
        "direction_rad": (math.degrees(THRESHOLDS.direction_rad), "°"),
        "energy": (min(rounding, THRESHOLDS.energy), ""),
        "final_position": (place, ""),
    }
    return (
        Measure("impacts missed", 0.0),
        Measure("impacts invented", 0.0),
        *(Measure(verdict.value, rounding) for verdict in _FLAGS),
        *(Measure(_NAMES[name], *limits.get(name, (rounding, ""))) for name in _ERRORS),
    )


def _list_numbers(line: RowLine, verdicts: Mapping[str, str]) -> Iterator[float | bool]:
    """Yield the numbers of a run that are compared, in the order of `_list_measures`."""
    missed, invented = len(line.missed or ()), len(line.spurious or ())
    # After a trajectory has diverged, impacts match only by chance, so use the comparison of single steps.
    if line.diverged_s is not None and line.local_truth:
        missed, invented = line.local_truth.missed, line.local_truth.invented
    yield float(missed)
    yield float(invented)
    for verdict in _FLAGS:
        yield verdict.name.lower() in verdicts
    for name in _ERRORS:
        error: float = getattr(line.total, name)
        yield math.degrees(error) if name == "direction_rad" else error
