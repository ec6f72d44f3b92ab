"""Conversion of a cross-check's results to lines of results.jsonl, and of verdicts to sentences."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from carom.comparator import Score, Verdict
from carom.execution.job import Status
from carom.execution.results import Results, Row
from carom.model.trace import Outcome
from carom.report.files import FORMATS
from carom.report.results_file.line_types import OutcomeComparison, RowLine, SceneLine, Summary, VerdictLine

NO_REFERENCE = "PIC does not solve this scene, so there is no reference to compare the run with"

_VERDICTS = {verdict.name.lower(): verdict.value for verdict in Verdict}


def build_summary(results: Results) -> Summary:
    """Build the first line of the file, which contains values that are the same for all runs."""
    scored = [(row.job, row.score) for row in results.rows if row.score is not None]
    by_scene = {job.scene.name: score for job, score in scored}
    by_step = {(job.scene.name, job.dt_s): score for job, score in scored}
    return Summary(
        format=FORMATS["results"],
        rows=len(results.rows),
        environment=results.environment,
        command=results.command,
        elapsed_s=results.elapsed_s,
        verdicts=_VERDICTS,
        scenes={
            name: SceneLine(score.expected, score.horizon_s, score.beyond_horizon, score.scales)
            for name, score in by_scene.items()
        },
        sampling=tuple(_build_pit_errors(name, dt_s, score) for (name, dt_s), score in by_step.items()),
    )


def _build_pit_errors(scene: str, dt_s: float, score: Score) -> dict[str, str | int | float | None]:
    errors = dataclasses.asdict(score.sampling) if score.sampling else {}
    missed = None if score.pit_missed is None else len(score.pit_missed)
    return {"scene": scene, "dt_s": dt_s, "missed": missed, **errors}


#: Fields of a score that a line contains with the same names.
_OF_SCORE = (
    *("missed", "spurious", "undecided", "total", "against_pit", "own_velocity", "float_bits", "equals_pit", "edits"),
    *("local_truth", "diverged_s", "pit_diverged_s", "consistency"),
)


def build_line(row: Row) -> RowLine:
    """Build the line of a run without the errors of single impacts, which take longest to compute."""
    job, score, trace = row.job, row.score, row.trace
    of_score: dict[str, Any] = {}
    if score is not None:
        of_score = {name: getattr(score, name) for name in _OF_SCORE} | {
            "verdicts": tuple(VerdictLine(one.verdict.name.lower(), one.reason) for one in score.findings),
            "matched": len(score.errors),
            # JSON can't express an infinite number.
            "price_paid": "inf" if math.isinf(score.price_paid) else score.price_paid,
            "outcome_taken": _build_outcome(score),
        }
    of_trace: dict[str, Any] = {}
    if trace is not None:
        of_trace = {name: getattr(trace, name) for name in ("counts", "outcome", "settings")}
        of_trace["notes"] = tuple(trace.notes)
    return RowLine(
        scene=job.scene.name,
        engine=job.engine,
        profile=job.profile,
        tried=dict(job.method.overrides),
        dt_s=job.dt_s,
        refinement=job.refinement,
        status=row.status,
        reason=row.reason or (NO_REFERENCE if row.status is Status.RAN and score is None else ""),
        grade=row.grade,
        spread=row.spread,
        timing=row.timing,
        untimed=row.untimed,
        time_ratio=row.time_ratio,
        **of_score,
        **of_trace,
    )


def list_reasons(line: RowLine, verdicts: Mapping[str, str] = _VERDICTS) -> tuple[str, ...]:
    """Return one sentence for every verdict, without a full stop, or the reason why there is no verdict.

    Args:
        line: The line of a run.
        verdicts: Meaning of each verdict by name, from the file's summary.
    """
    if line.reason:
        return (line.reason,)
    # If a warning of the engine ended the run, the list begins with this warning.
    warnings = line.notes if line.outcome is Outcome.WARNED else ()
    untimed = (f"not timed: {line.untimed}",) if line.untimed else ()
    return (*warnings, *(f"{verdicts[one.verdict]} ({one.reason})" for one in line.verdicts), *untimed)


def _build_outcome(score: Score) -> OutcomeComparison | None:
    match = score.convention
    if match is None:
        return None
    admissible = tuple(outcome.how for outcome in match.outcomes)
    return OutcomeComparison(admissible, match.nearest, match.distance, match.matches)
