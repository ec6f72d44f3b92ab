"""What a cross-check yields: one row for each scene, engine, profile and step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from carom.catalogue import KnownAnswer
from carom.comparator import Grade, Horizon, Score
from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Job, Status
from carom.execution.phases import PhaseSpread
from carom.execution.skipped import SceneSkips
from carom.execution.timing import Timing
from carom.model.trace import Trace
from carom.support.display import Tabular


@dataclass(frozen=True)
class Row:
    """What came of a job.

    Attributes:
        job: What was asked for.
        status: Whether it was run.
        reason: Why it was not run, empty where it was.
        trace: What happened; None where it was not run.
        score: How that compares with the reference; None where it was not run.
        timing: Its two clocks; None where it was not timed.
        time_ratio: Seconds for all steps over PIT's for the same scene and step, in the same round; None where either
            was not timed.
        spread: Its scores over many sub-step phases; None where only one was run.
        untimed: Why it was not timed although it ran and timing was asked for; empty otherwise.
    """

    job: Job
    status: Status
    reason: str = ""
    trace: Trace | None = None
    score: Score | None = None
    timing: Timing | None = None
    time_ratio: float | None = None
    spread: PhaseSpread | None = None
    untimed: str = ""

    @property
    def grade(self) -> Grade | None:
        """The grade, None where the job was not run."""
        return self.score.grade if self.score else None


def violates(row: Row, fail_on: Grade) -> bool:
    """Whether the row's grade is `fail_on` or worse; a row that was not run, or not graded, violates nothing."""
    return row.grade is not None and row.grade.is_at_least_as_bad_as(fail_on)


@dataclass(frozen=True, repr=False)
class Results(Tabular):
    """All rows of a cross-check, and what they were compared with.

    Attributes:
        rows: In the order scene, engine, profile, step.
        references: The PIC trace of each scene, by the scene's name.
        known: Known answer of each catalogue scene and the reference's deviation from it, by the scene's name.
        engines: What was known of each engine asked for, or of every one: those not installed are not run then.
        environment: Machine and versions.
        command: The command that makes this again; empty where the cross-check was called from Python.
        elapsed_s: Wall-clock seconds of the whole cross-check.
        certified: How far the reference of a scene is certified, or in words why it is not, by the scene's name; scenes
            of one or two discs are left out unless that was asked for.
        horizons: Up to when runs of a scene are compared with its reference, seconds, by the scene's name: where it is
            no longer reliable, by an estimate where nobody has certified it, or where contact that lasts begins. What
            is not listed is compared whole.
        phases: At how many sub-step phases each job was run in addition to the scene's own.
        skipped: What PIC and PIT at the coarsest step save by skipping, by the scene's name; empty where no run was
            timed, or nobody draws it.
    """

    rows: tuple[Row, ...]
    references: Mapping[str, Trace]
    known: Mapping[str, tuple[KnownAnswer, float]]
    engines: tuple[EngineInfo, ...]
    environment: Environment
    command: str
    elapsed_s: float
    certified: Mapping[str, Horizon | str] = field(default_factory=dict)
    horizons: Mapping[str, float] = field(default_factory=dict)
    phases: int = 0
    skipped: Mapping[str, SceneSkips] = field(default_factory=dict)
