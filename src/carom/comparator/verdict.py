"""Verdicts on a run, and a finding: one verdict with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """A verdict on a run; the value is the sentence shown. The first four are the source paper's cases."""

    MISSED = "an impact is missed"
    LATE = "found late"
    WRONG_DIRECTION = "wrong direction after the bounce"
    MULTIPLE_MISSED = "several impacts are missed"
    EARLY = "found before it happens"
    WRONG_VELOCITY = "velocities after an impact are off"
    WRONG_SPIN = "spins after an impact are off"
    SLID = "discs slide where friction holds them"
    STUCK = "discs hold where friction lets them slide"
    WRONG_ORDER = "impacts come in the wrong order"
    SPURIOUS = "impacts are found that the reference does not have"
    ENERGY_GAINED = "discs end with more kinetic energy than the reference's"
    ENERGY_LOST = "discs end with less kinetic energy than the reference's"
    NOT_TOLD_APART = "velocities between several impacts of a disc in one step are not told apart"
    LUCKY_PHASE = "checking once per step is as good at this phase of the step, and not at others"
    CUT_SHORT = "the run ended before the scene did"
    WENT_ON = "the run goes on where the reference ends"
    CONVENTION = "the scene has no unique answer"
    UNDECIDED = "too close to the end of the run to be decided"
    UNCOMPARED = "there is no PIT at this step to compare it with"
    MISPLACED = "discs end in the wrong place"
    WRONG_END = "discs end with the wrong velocity"
    WRONG_LAST_SPIN = "discs end with the wrong spin"
    DRIFTS = "discs move otherwise than their velocities say"
    TURNS = "velocities change where no impact is reported"
    SPINS = "spins change where no impact is reported"
    WRONG_STAMP = "impacts are stamped outside the step that reports them"
    WRONG_NORMAL = "the normals reported are not those of the impacts"
    MOMENTUM = "momentum is gained or lost at an impact"
    ANGULAR = "angular momentum about the contact is gained or lost"
    NOT_FINITE = "a number is NaN or infinite"
    PARTED = "the trajectory has left the reference's"
    MISREPORTED = "the impacts reported are not those that the states show"
    PASSED_THROUGH = "bodies pass through each other"
    TURNED_ALONE = "bodies turn with nothing near"
    POLYGON = "falling discs move along polygons"
    DAMPED_POLYGON = "slowed discs move a step at one speed"
    SINKS = "discs sink into what they rest on"
    WORSE_STEPS = "steps are worse than PIT's from the same state"
    SAMPLED_STEPS = "steps are off, by no more than checking once per step costs from the same state"
    CONTACT = "discs slide, roll or rest otherwise than Coulomb's law says"
    RESTED = "a disc comes to rest, to slide or to roll, or is crushed, and impacts are compared up to there"
    NO_IMPACT = "the scene has no impact to be graded by"
    NOTHING_COMPARED = "no impact lies within the horizon, so there is nothing to compare"
    CONFORMS = "agrees with the reference to rounding"


@dataclass(frozen=True)
class Finding:
    """One verdict, and a sentence with the numbers it was derived from."""

    verdict: Verdict
    reason: str
