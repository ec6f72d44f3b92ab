"""The rows as JSON lines: every number, for other programs. The first line says what all rows were made on and by."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from carom.comparator import Errors, Score, Verdict
from carom.errors import InputError
from carom.report.grid import reasons_of
from carom.report.marks import mark_of
from carom.runs.results import Results, Row

__all__ = ["FORMAT", "read_records", "records", "strict"]

#: Raised when a field changes its meaning or goes; a new field does not raise it.
FORMAT = 2


def records(results: Results) -> str:
    """Return one line of strict JSON for the whole run, and one a row; a number that is not finite is null."""
    scored = [(row.job.scene.name, row.job.dt_s, row.score) for row in results.rows if row.score is not None]
    head = {
        "format": FORMAT,
        "rows": len(results.rows),
        "environment": dataclasses.asdict(results.environment),
        "command": results.command,
        "elapsed_s": results.elapsed_s,
        "verdicts": {verdict.name.lower(): verdict.value for verdict in Verdict},
        "scenes": {name: _of_scene(score) for name, _, score in scored},
        "sampling": list({(name, dt_s): _of_pit(name, dt_s, score) for name, dt_s, score in scored}.values()),
    }
    write = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode
    return "".join(f"{write(strict(line))}\n" for line in (head, *map(_fields, results.rows)))


def _of_scene(score: Score) -> dict[str, object]:
    """What is the same for all rows of a scene."""
    names = ("expected", "horizon_s", "beyond_horizon")
    return {**{name: getattr(score, name) for name in names}, "scales": dataclasses.asdict(score.scales)}


def _of_pit(scene: str, dt_s: float, score: Score) -> dict[str, object]:
    """What PIT's errors are at a step of a scene, which every row there is held against."""
    return {"scene": scene, "dt_s": dt_s, "missed": score.pit_missed, **(_errors(score.sampling) or {})}


def read_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return what `records` wrote: the head, and the rows.

    Raises:
        InputError: The file is of another format, or not whole.
    """
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    head, rows = (lines[0], lines[1:]) if lines else ({}, [])
    found = head.get("format")
    if found != FORMAT or head.get("rows") != len(rows):
        what = f"has {len(rows)} of {head.get('rows')} rows" if found == FORMAT else f"is of format {found}"
        raise InputError(
            f"{path} {what}; this Carom reads whole files of format {FORMAT}: run the cross-check again, or read it "
            "with the version that wrote it"
        )
    return head, rows


def _fields(row: Row) -> dict[str, object]:
    job, score, trace = row.job, row.score, row.trace
    return {
        "scene": job.scene.name,
        "engine": job.engine,
        "profile": job.profile,
        "dt_s": job.dt_s,
        "refinement": job.refinement,
        "status": row.status.name.lower(),
        "reason": "; ".join(reasons_of(row)) if not mark_of(row).ran else "",
        "grade": row.grade.name.lower() if row.grade else None,
        "verdicts": [
            {"verdict": finding.verdict.name.lower(), "reason": finding.reason}
            for finding in (score.findings if score else ())
        ],
        "matched": len(score.errors) if score else None,
        "missed": list(score.missed) if score else None,
        "spurious": list(score.spurious) if score else None,
        "undecided": list(score.undecided) if score else None,
        **{name: _errors(getattr(score, name, None)) for name in ("total", "against_pit")},
        "own_velocity": score.own_velocity if score else None,
        "price_paid": _paid(score.price_paid) if score else None,
        **{name: getattr(score, name, None) for name in ("float_bits", "equals_pit", "edits")},
        "local": _local(score) if score else None,
        "consistency": dataclasses.asdict(score.consistency) if score and score.consistency else None,
        "outcome_taken": _outcome(score) if score else None,
        "spread": dataclasses.asdict(row.spread) if row.spread else None,
        "counts": dict(trace.counts) if trace else None,
        "outcome": trace.outcome.name.lower() if trace else None,
        "notes": list(trace.notes) if trace else [],
        "settings": dict(trace.settings) if trace else None,
        "timing": dataclasses.asdict(row.timing) if row.timing else None,
        "untimed": row.untimed,
        "time_ratio": row.time_ratio,
    }


def _paid(price: float) -> float | str:
    """A price that is infinite is one still, which JSON has no number for; a mass is written in the same way."""
    return "inf" if math.isinf(price) else price


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
