"""The journal of a cross-check: what was observed, whole, so that one that was ended can be gone on with.

Run times are not in it: those that are compared belong to one sitting.
"""

from __future__ import annotations

import base64
import io
import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import PlainSerializer, PlainValidator

from carom.runs.job import Answer
from carom.runs.journal import Journal
from carom.runs.plan import Options
from carom.runs.scoring import JobKey
from carom.scene import Scene
from carom.trace import Outcome, Samples, Trace

__all__ = ["Observed", "observed_journal"]


def _packed(trace: Trace) -> dict[str, str]:
    """Return a trace as text: its arrays as a file of NumPy's, all else as JSON."""
    plain = {field.name: getattr(trace, field.name) for field in fields(trace)}
    arrays = {name: plain.pop(name) for name, value in list(plain.items()) if isinstance(value, np.ndarray)}
    if trace.samples is not None:
        arrays |= {f"samples.{name}": value for name, value in vars(plain.pop("samples")).items()}
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    plain |= {"scene": trace.scene.model_dump(mode="json"), "outcome": trace.outcome.name}
    plain |= {"settings": dict(trace.settings), "counts": dict(trace.counts)}
    return {"plain": json.dumps(plain), "arrays": base64.b64encode(file.getvalue()).decode()}


def _unpacked(text: dict[str, str]) -> Trace:
    with np.load(io.BytesIO(base64.b64decode(text["arrays"])), allow_pickle=False) as file:
        arrays = dict(file)
    plain: dict[str, Any] = json.loads(text["plain"])
    plain |= {"scene": Scene.model_validate(plain["scene"]), "outcome": Outcome[plain["outcome"]]}
    plain |= {name: tuple(plain[name]) for name in ("ambiguous", "notes")}
    samples = {name.partition(".")[2]: arrays.pop(name) for name in list(arrays) if name.startswith("samples.")}
    return Trace(**{**plain, **arrays, **({"samples": Samples(**samples)} if samples else {})})


if TYPE_CHECKING:
    Kept = Trace
else:  # pydantic can't know what the arrays of a trace are
    Kept = Annotated[Any, PlainSerializer(_packed), PlainValidator(_unpacked)]


@dataclass(frozen=True)
class Observed:
    """What came of a job.

    Attributes:
        key: Which job it is.
        drawn: Whether states were kept for drawing.
        answer: The trace, or why there is none.
    """

    key: JobKey
    drawn: bool
    answer: Answer[Kept]


def observed_journal(path: Path, options: Options, *, resume: bool = False, retry: bool = False) -> Journal[Observed]:
    """Open the journal of a cross-check; with `retry` what an engine broke off counts as not run.

    One of other options is refused, but for how many jobs run at a time.
    """
    stamp = {name: value for name, value in asdict(options).items() if name != "jobs"}
    again = (lambda entry: entry.answer.status.broken) if retry else None
    return Journal(path, Observed, lambda entry: (entry.key, entry.drawn), stamp=stamp, resume=resume, again=again)
