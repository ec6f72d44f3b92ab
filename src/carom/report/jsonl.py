"""The rows as JSON lines: every number, for other programs."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping

from carom.comparator import Errors, Score
from carom.report.grid import reasons_of
from carom.report.marks import mark_of
from carom.runs.results import Results, Row

__all__ = ["FORMAT", "jsonl", "strict"]

#: Raised when a field changes its meaning or goes; a new field does not raise it.
FORMAT = 1

_NUMBERS = (
    "time_error_s",
    "velocity_error",
    "direction_error_rad",
    "final_position_error",
    "final_velocity_error",
    "energy_error",
    "momentum_error",
    "sampling_velocity_error",
    "sampling_missed",
)


def jsonl(results: Results) -> str:
    """Return one line of strict JSON a row, each with all it takes to be understood on its own."""
    stamp = {**dataclasses.asdict(results.environment), "command": results.command}
    lines = [
        json.dumps(strict({**_fields(row), "environment": stamp}), ensure_ascii=False, allow_nan=False)
        for row in results.rows
    ]
    return "".join(f"{line}\n" for line in lines)


def _fields(row: Row) -> dict[str, object]:
    job, score, trace = row.job, row.score, row.trace
    return {
        "format": FORMAT,
        "scene": job.scene.name,
        "engine": job.engine,
        "profile": job.profile,
        "dt_s": job.dt_s,
        "refinement": job.refinement,
        "status": row.status.name.lower(),
        "reason": "; ".join(reasons_of(row)) if not mark_of(row).ran else "",
        "grade": row.grade.name.lower() if row.grade else None,
        "verdicts": [
            {"verdict": finding.verdict.name.lower(), "meaning": finding.verdict.value, "reason": finding.reason}
            for finding in (score.findings if score else ())
        ],
        "expected": score.expected if score else None,
        "matched": len(score.errors) if score else None,
        "missed": list(score.missed) if score else None,
        "spurious": list(score.spurious) if score else None,
        "undecided": list(score.undecided) if score else None,
        **{name: getattr(score, name, None) for name in _NUMBERS},
        **{name: _errors(getattr(score, name, None)) for name in ("total", "sampling", "solver")},
        **{name: getattr(score, name, None) for name in ("sampling_share", "equals_pit", "edits")},
        "horizon_s": score.horizon_s if score else None,
        "beyond_horizon": score.beyond_horizon if score else None,
        "local": _local(score) if score else None,
        "consistency": dataclasses.asdict(score.consistency) if score and score.consistency else None,
        "outcome_taken": _outcome(score) if score else None,
        "spread": dataclasses.asdict(row.spread) if row.spread else None,
        "counts": dict(trace.counts) if trace else None,
        "scales": dataclasses.asdict(score.scales) if score else None,
        "outcome": trace.outcome.name.lower() if trace else None,
        "notes": list(trace.notes) if trace else [],
        "settings": dict(trace.settings) if trace else None,
        "timing": dataclasses.asdict(row.timing) if row.timing else None,
        "untimed": row.untimed,
        "time_ratio": row.time_ratio,
    }


def _errors(errors: Errors | None) -> dict[str, float] | None:
    return dataclasses.asdict(errors) if errors else None


def _local(score: Score) -> dict[str, object]:
    """Medians and largest of the local errors: one entry an impact would be too long a line."""
    local = score.local
    kinds = ("velocity", "time_s", "restitution", "energy", "sampling_velocity", "solver_velocity")
    return {
        "scored": local.scored,
        "spurious": len(local.spurious),
        **{f"{kind}_median": local.median(kind) for kind in kinds},
        **{f"{kind}_worst": local.worst(kind) for kind in kinds},
    }


def _outcome(score: Score) -> dict[str, object] | None:
    match = score.convention
    if match is None:
        return None
    return {
        "admissible": [outcome.how for outcome in match.outcomes],
        "nearest": match.nearest,
        "distance": match.distance,
        "matches": match.matches,
    }


def strict(value: object) -> object:
    """Return the value with null for what JSON has no number for, and plain numbers for NumPy's."""
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(item) for item in value]
    plain = value.item() if hasattr(value, "item") else value
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain
