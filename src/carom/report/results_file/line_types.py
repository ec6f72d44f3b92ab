"""Types of the lines of results.jsonl, for writing and reading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from carom.comparator import Errors, Grade, LocalScore
from carom.comparator.measure.consistency import Consistency
from carom.comparator.scales import Scales
from carom.execution.environment import Environment
from carom.execution.job import Method, Status
from carom.execution.phases import PhaseSpread
from carom.execution.timing import Timing
from carom.model.trace import Outcome, Setting
from carom.support.limits import LARGEST, SMALLEST

#: Type of a step size in seconds, within the range that a run supports.
Step = Annotated[float, Field(ge=SMALLEST, le=LARGEST)]


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
        sampling: PIT's errors for each scene and step size. All runs with this scene and step size are compared with
            these errors.
    """

    format: int
    rows: int
    environment: Environment
    command: str
    elapsed_s: float
    verdicts: Mapping[str, str]
    scenes: Mapping[str, SceneLine]
    sampling: tuple[Mapping[str, str | int | float | None], ...]


@dataclass(frozen=True, slots=True)
class VerdictLine:
    """A verdict by name, and its reason as a sentence with numbers."""

    verdict: str
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
        matched: Number of impacts that the run found. (`missed`, `spurious` and `undecided` contain indices of impacts
            instead.)
        price_paid: Velocity error divided by PIT's velocity error; "inf" if PIT has no error.
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
