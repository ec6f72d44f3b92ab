"""The journal of a cross-check: what was observed, whole, so that one that was ended can be gone on with.

Run times are not in it: those that are compared belong to one sitting.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from carom.runs.job import Answer
from carom.runs.journal import Journal
from carom.runs.plan import Options
from carom.runs.scoring import JobKey
from carom.runs.wire import CarriedTrace

__all__ = ["Observed", "observed_journal"]


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
    answer: Answer[CarriedTrace]


def observed_journal(path: Path, options: Options, *, resume: bool = False, retry: bool = False) -> Journal[Observed]:
    """Open the journal of a cross-check; with `retry` what an engine broke off counts as not run.

    One of other options is refused, but for how many jobs run at a time.
    """
    stamp = {name: value for name, value in asdict(options).items() if name != "jobs"}
    again = (lambda entry: entry.answer.status.broken) if retry else None
    return Journal(path, Observed, lambda entry: (entry.key, entry.drawn), stamp=stamp, resume=resume, again=again)
