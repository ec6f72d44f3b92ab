"""Verdicts on a run, and findings, which consist of a verdict and its reason."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """A verdict on a run.

    Each value is the text that reports show. The first four verdicts are the cases of the paper that inspired Carom.
    """

    MISSED = "an impact is missed"
    LATE = "an impact is found late"
    WRONG_DIRECTION = "a direction after an impact is wrong"
    MULTIPLE_MISSED = "several impacts are missed"
    EARLY = "an impact is found before it happens"
    WRONG_VELOCITY = "velocities after an impact are wrong"
    WRONG_SPIN = "spins after an impact are wrong"
    SLID = "discs slide although friction can hold them"
    STUCK = "discs stick although friction can't hold them"
    WRONG_ORDER = "impacts come in the wrong order"
    SPURIOUS = "impacts are found that the reference does not have"
    ENERGY_GAINED = "discs end with more kinetic energy than the reference's"
    ENERGY_LOST = "discs end with less kinetic energy than the reference's"
    NOT_TOLD_APART = "velocities between several impacts of a disc in one step are unknown"
    LUCKY_PHASE = "PIT is equally accurate at this phase of the step, but not at others"
    CUT_SHORT = "the run ended before the scene did"
    WENT_ON = "the run continues after the reference ends"
    CONVENTION = "the scene has no unique answer"
    UNDECIDED = "an impact is too close to the end of the run to be decided"
    UNCOMPARED = "no PIT run with this step size was given for comparison"
    MISPLACED = "discs end in the wrong place"
    WRONG_END = "discs end with the wrong velocity"
    WRONG_LAST_SPIN = "discs end with the wrong spin"
    DRIFTS = "positions of discs do not follow from their velocities"
    TURNS = "velocities change where no impact is reported"
    SPINS = "spins change where no impact is reported"
    WRONG_STAMP = "the reported time of an impact is outside its step"
    WRONG_NORMAL = "the reported normals differ from those of the impacts"
    MOMENTUM = "momentum is gained or lost at an impact"
    ANGULAR = "angular momentum about the contact is gained or lost"
    NOT_FINITE = "a number is NaN or infinite"
    DIVERGED = "the trajectory has diverged from the reference's"
    MISREPORTED = "the reported impacts differ from those that the states show"
    PASSED_THROUGH = "bodies pass through each other"
    TURNED_ALONE = "bodies change their motion with no other body near"
    POLYGON = "falling discs move along polygons"
    DAMPED_POLYGON = "discs that slow down keep one speed during each step"
    SINKS = "discs sink into what they rest on"
    WORSE_STEPS = "steps are worse than PIT's from the same state"
    SAMPLED_STEPS = "steps have errors, but no larger than PIT's from the same state"
    CONTACT = "sliding, rolling or resting differs from Coulomb's law"
    RESTED = "impacts are compared only until a disc rests, slides, rolls or is crushed"
    NO_IMPACT = "the scene has no impact to grade"
    NOTHING_COMPARED = "no impact is within the horizon, so nothing is compared"
    CONFORMS = "agrees with the reference to rounding"


@dataclass(frozen=True)
class Finding:
    """A verdict with its reason, which is a sentence with numbers."""

    verdict: Verdict
    reason: str
