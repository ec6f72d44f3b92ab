"""Lines of results.jsonl: their types, their construction from results, and verdicts as sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from carom.comparator import Errors, Grade, LocalScore, Score, Verdict
from carom.comparator.grades import EARLIER_WORDS
from carom.comparator.measure.consistency import Consistency
from carom.comparator.scales import Scales
from carom.execution.environment import Environment
from carom.execution.job import Method, Status
from carom.execution.phases import PhaseSpread
from carom.execution.results import Results, Row
from carom.execution.timing import Timing
from carom.model.trace import Outcome, Setting
from carom.report.files import FORMATS
from carom.support.limits import LARGEST, SMALLEST

#: Type of a step size in seconds, within the range that a run supports.
Step = Annotated[float, Field(ge=SMALLEST, le=LARGEST)]

#: Name of a verdict. Files of format 2 contain earlier names.
VerdictName = Annotated[str, AfterValidator(lambda name: EARLIER_WORDS.get(name, name))]


@dataclass(frozen=True)
class SceneLine:
    """Values that are the same for all runs of a scene."""

    expected: int
    horizon_s: float | None
    beyond_horizon: int
    scales: Scales


@dataclass(frozen=True)
class Summary:
    """The first line of the file: values that are the same for all runs.

    Attributes:
        rows: Number of the following lines.
        verdicts: Meaning of each verdict by name. The meanings are stored, because other versions of Carom may have
            other verdicts.
        scenes: Values of each scene by name.
        sampling: PIT's errors for each scene and step size. The errors of every other run are compared with PIT's
            errors for the same scene and step size.
    """

    format: int
    rows: int
    environment: Environment
    command: str
    elapsed_s: float
    verdicts: Mapping[VerdictName, str]
    scenes: Mapping[str, SceneLine]
    sampling: tuple[Mapping[str, str | int | float | None], ...]


@dataclass(frozen=True, slots=True)
class VerdictLine:
    """A verdict by name, and its reason as a sentence with numbers."""

    verdict: VerdictName
    reason: str


@dataclass(frozen=True, slots=True)
class OutcomeComparison:
    """Possible outcomes of simultaneous impacts, and the outcome that is nearest to the run."""

    admissible: tuple[str, ...]
    nearest: int | None
    distance: float
    matches: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RowLine:
    """A line of the file after the first one: the result for a scene, a method and a step size.

    If the job did not run, fields that describe its result are null or empty.

    Attributes:
        tried: Settings of the profile that the user changed, with the user's values.
        reason: Reason why there is no score; empty if the run has a score.
        matched: Number of impacts that the run found. (By contrast, `missed`, `spurious` and `undecided` contain
            indices of impacts.)
        price_paid: The run's error divided by PIT's error, see `carom.comparator.Score.price_paid`; "inf" if this ratio
            is infinite.
        local: Median and largest error over all impacts, for each kind of error. An impact is compared with the exact
            impact that follows from the run's own state before it.
        counts: Numbers of operations that the method reports, by name, such as steps.
    """

    scene: str
    engine: str
    profile: str
    tried: Mapping[str, Setting] = field(default_factory=dict)
    dt_s: Step
    refinement: int
    status: Status
    reason: str
    grade: Grade | None = None
    verdicts: tuple[VerdictLine, ...] = ()
    matched: int | None = None
    missed: tuple[int, ...] | None = None
    spurious: tuple[int, ...] | None = None
    undecided: tuple[int, ...] | None = None
    total: Errors | None = None
    against_pit: Errors | None = None
    own_velocity: float | None = None
    price_paid: float | Literal["inf"] | None = None
    float_bits: Literal[32, 64] | None = None
    equals_pit: bool | None = None
    edits: int | None = None
    local: Mapping[str, int | float] | None = None
    local_truth: LocalScore | None = None
    diverged_s: float | None = None
    pit_diverged_s: float | None = None
    consistency: Consistency | None = None
    outcome_taken: OutcomeComparison | None = None
    spread: PhaseSpread | None = None
    counts: Mapping[str, int] | None = None
    outcome: Outcome | None = None
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Setting] | None = None
    timing: Timing | None = None
    untimed: str = ""
    time_ratio: float | None = None

    @property
    def method(self) -> Method:
        """The method that ran."""
        return Method(self.engine, self.profile, tuple(self.tried.items()))


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
    errors = asdict(score.sampling) if score.sampling else {}
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
    names = () if trace is None else ("counts", "outcome", "notes", "settings")
    of_trace: dict[str, Any] = {name: getattr(trace, name) for name in names}
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
