"""Results of a cross-check: one row for each scene, engine, profile and step size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from carom.catalogue import KnownAnswer
from carom.comparator import Grade, Horizon, Score
from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Job, Status
from carom.execution.phases import PhaseSpread
from carom.execution.time_saved import SceneSkips
from carom.execution.timing import Timing
from carom.model.trace import Trace
from carom.support.display import Tabular


@dataclass(frozen=True)
class Row:
    """Result of a job.

    Attributes:
        job: The job.
        status: Whether the job was run.
        reason: Reason why the job was not run; empty if it was run.
        trace: The trace; None if the job was not run.
        score: The comparison with the reference; None if the job was not run.
        timing: Run times; None if the job was not timed.
        time_ratio: Run time of all steps divided by PIT's run time for the same scene and step size. The run times of
            the engine and of PIT are measured directly one after the other. None if one of the runs was not timed.
        spread: Distribution of the scores over many phases; None if only one phase was run.
        untimed: Reason why a job that ran could not be timed as requested; empty for other jobs.
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
        """The grade; None if the job was not run."""
        return self.score.grade if self.score else None


def is_violation(row: Row, fail_on: Grade) -> bool:
    """Whether the row's grade is `fail_on` or worse; false if the row has no grade."""
    return row.grade is not None and row.grade.is_at_least_as_bad_as(fail_on)


@dataclass(frozen=True, repr=False)
class Results(Tabular):
    """All rows of a cross-check, with the references.

    Attributes:
        rows: The rows, sorted by scene, engine, profile and step size.
        references: The PIC trace of each scene, by the scene's name.
        known: The known answer of each catalogue scene, and the reference's deviation from this answer, by the scene's
            name.
        engines: Descriptions of the requested engines, by default of all engines. Engines that are not installed are
            not run.
        environment: Machine and versions.
        command: The command that repeats this cross-check; empty if the cross-check was called from Python.
        elapsed_s: Wall-clock seconds of the whole cross-check.
        certified: Comparison of PIC with a certified run (a run with proven error bounds) for each scene, by the
            scene's name. If no run was certified, the value is the reason. Scenes of one or two discs are included only
            if certification is requested.
        horizons: Time up to which runs are compared with the reference, in seconds, by the scene's name. After this
            time the reference is not reliable, or lasting contact has begun. Scenes that are not listed are compared up
            to their end.
        phases: Number of phases at which each job was run, in addition to the run without a shift.
        skipped: How much run time PIC and PIT save by skipping bodies that can't touch, by the scene's name. PIT runs
            at the largest step size. Empty if no run was timed, or no report is drawn.

    Examples:
        >>> results = carom.cross_check(["paper"], ["pit"], dts=[1 / 24], timing=False)
        >>> [row.score.grade.name for row in results.rows]
        ['WRONG', 'SAMPLED', 'SAMPLED', 'WRONG']
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
