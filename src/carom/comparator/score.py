"""What a comparison finds: errors, verdicts with their reasons, and a grade."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from carom.comparator.consistency import Consistency
from carom.comparator.convention import ConventionMatch
from carom.comparator.local import LocalErrors
from carom.comparator.scales import Scales

__all__ = ["Errors", "Finding", "Grade", "ImpactError", "Scales", "Score", "Verdict"]


class Verdict(Enum):
    """What is wrong, if anything; the value is the sentence shown. The first four are the source paper's cases."""

    MISSED = "an impact is missed"
    LATE = "found late: wrong time and path"
    WRONG_DIRECTION = "wrong direction after the bounce"
    MULTIPLE_MISSED = "several impacts are missed"
    EARLY = "found before it happens"
    WRONG_VELOCITY = "velocities after an impact are off"
    WRONG_ORDER = "impacts come in the wrong order"
    SPURIOUS = "impacts are invented that do not happen"
    ENERGY_GAINED = "energy is gained"
    ENERGY_LOST = "energy is lost"
    CUT_SHORT = "the run ended before the scene did"
    CONVENTION = "the scene has no unique answer"
    UNDECIDED = "too close to the end of the run to be decided"
    UNCOMPARED = "there is no PIT at this step to hold it against"
    MISPLACED = "discs end in the wrong place"
    WRONG_END = "discs end with the wrong velocity"
    DRIFTS = "discs move otherwise than their velocities say"
    TURNS = "velocities change where no impact is reported"
    WRONG_STAMP = "impacts are stamped outside the step that reports them"
    WRONG_NORMAL = "the normals reported are not those of the impacts"
    MOMENTUM = "momentum is gained or lost at an impact"
    NOT_FINITE = "a number is NaN or infinite"
    NOTHING_COMPARED = "no impact lies within the horizon, so there is nothing to compare"
    CONFORMS = "agrees with the reference to rounding"


class Grade(Enum):
    """A grade that a reader can use; the value is the sentence shown."""

    EXACT = "exact: to rounding"
    SAMPLED = "sampled: no worse than PIT at the same step"
    INACCURATE = "inaccurate: finds every impact, with more error than sampling explains"
    WRONG = "wrong: misses or invents an impact, takes impacts in the wrong order, ends early, or is not finite"
    UNGRADED = "not graded: no unique answer, or nothing to decide by"


@dataclass(frozen=True)
class ImpactError:
    """Errors of one matched impact, observed less reference.

    Attributes:
        reference: Index in the reference's impacts.
        observed: Index in the observed impacts.
        reported_time_s: Error of the time that the method gives, seconds.
        effective_time_s: Error of the instant at which the path turned, seconds; NaN where that is not known.
        along_normal: Velocity error along the reference's normal, the worse of the two bodies, over the scene's speed.
        across_normal: The same across it.
        velocity: Length of the velocity error, the worse of the two bodies, over the scene's speed.
        direction_rad: Angle between observed and reference velocity after, the worse of the two bodies; a body that
            rests in either has none.
        normal_rad: Angle between observed and reference normal.
        restitution: Effective coefficient of restitution along the observed normal; NaN where nothing approached.
        restitution_error: The same less the reference's, which is along the reference's normal.
    """

    reference: int
    observed: int
    reported_time_s: float
    effective_time_s: float
    along_normal: float
    across_normal: float
    velocity: float
    direction_rad: float
    normal_rad: float
    restitution: float
    restitution_error: float

    @property
    def time_s(self) -> float:
        """Error of the effective time where it is known, else of the reported time."""
        return self.reported_time_s if self.effective_time_s != self.effective_time_s else self.effective_time_s


@dataclass(frozen=True)
class Errors:
    """The largest error of each kind, of one trace against another. NaN where there is none.

    Attributes:
        time_s: Effective time (reported where that is not known), seconds, with its sign.
        reported_time_s: Reported time, seconds, with its sign.
        velocity: Velocity after, over the scene's speed.
        along_normal: Its part along the normal.
        across_normal: Its part across it.
        restitution: Effective coefficient of restitution, with its sign.
        direction_rad: Direction after.
        energy: Final kinetic energy, over that at the start, with its sign.
    """

    time_s: float
    reported_time_s: float
    velocity: float
    along_normal: float
    across_normal: float
    restitution: float
    direction_rad: float
    energy: float


@dataclass(frozen=True)
class Finding:
    """One verdict and the numbers it was derived from, as a sentence."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Score:
    """How an observed trace compares with the reference.

    Attributes:
        expected: Number of impacts in the reference, up to the horizon.
        errors: One entry a matched impact.
        missed: Indices of missed reference impacts.
        spurious: Indices of observed impacts that the reference does not have.
        undecided: Indices of reference impacts too close to the end of the run to have been reported.
        time_error_s: Largest time error by magnitude, with its sign; effective where known. NaN without a match.
        velocity_error: Largest velocity error of a matched impact, over the scene's speed. NaN without a match.
        direction_error_rad: Largest direction error. NaN without a match.
        final_position_error: Largest distance of a disc from its final place, over the scene's length.
        final_velocity_error: Largest error of a final velocity, over the scene's speed.
        energy_error: Final kinetic energy less the reference's, over the energy at the start; 0 where that is 0.
        momentum_error: Length of the error of the final momentum of the movable discs, over their mass and speed.
        sampling_velocity_error: `velocity_error` of PIT at the same step; NaN where that was not given.
        sampling_missed: How many impacts PIT at the same step misses; None where that was not given.
        findings: Verdicts, each with its reason; at least one.
        grade: The grade.
        scales: What errors were divided by.
        total: The largest errors against the reference, kind by kind.
        sampling: The same of PIT at the same step against the reference: what sampling alone costs. None where PIT was
            not given.
        solver: The same of the observed trace against that PIT: what is the method's own. None where PIT was not given.
        equals_pit: Whether it finds the very impacts that PIT finds, with all errors against PIT within rounding.
        edits: Edit distance of the two sequences of impacts.
        beyond_horizon: How many of the reference's impacts lie beyond the horizon, and were not compared.
        horizon_s: The horizon, seconds; None where the whole run is compared.
        local: Each impact against the analytic answer from the trace's own state before it.
        convention: Which of the admissible outcomes the trace took, where the scene has no unique answer.
        consistency: How far the trace is from what its own impacts and states lead to; None where one of its numbers is
            NaN or infinite.
    """

    expected: int
    errors: tuple[ImpactError, ...]
    missed: tuple[int, ...]
    spurious: tuple[int, ...]
    undecided: tuple[int, ...]
    time_error_s: float
    velocity_error: float
    direction_error_rad: float
    final_position_error: float
    final_velocity_error: float
    energy_error: float
    momentum_error: float
    sampling_velocity_error: float
    sampling_missed: int | None
    findings: tuple[Finding, ...]
    grade: Grade
    scales: Scales
    total: Errors
    sampling: Errors | None
    solver: Errors | None
    equals_pit: bool
    edits: int
    beyond_horizon: int
    horizon_s: float | None
    local: LocalErrors
    convention: ConventionMatch | None
    consistency: Consistency | None

    @property
    def sampling_share(self) -> float:
        """What part of the velocity error is the price of sampling, 0 to 1; NaN without PIT or without an error.

        The error is the sum of two vectors, PIT less reference and observed less PIT; this is the length of the first
        over that of both, so that two errors that happen to cancel do not hide each other.
        """
        if self.sampling is None or self.solver is None:
            return math.nan
        both = self.sampling.velocity + self.solver.velocity
        return self.sampling.velocity / both if both > 0.0 else math.nan

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts without their reasons."""
        return tuple(finding.verdict for finding in self.findings)
