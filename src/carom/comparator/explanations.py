"""Conditions of each verdict and each grade, as in `docs/theory/scoring.md` and printed by ``carom explain``."""

from __future__ import annotations

from carom.comparator.grades import Grade
from carom.comparator.verdict import Verdict

#: Condition of each verdict. A test compares this with the table of `docs/theory/scoring.md`.
SAID_WHEN = {
    Verdict.MISSED: (
        "the run has no impact that matches one of the reference: the two bodies passed through each other, or never "
        "met"
    ),
    Verdict.LATE: (
        "a time error above 0, by more than `1e-12` of the duration. It is the paper's second case, in which the path "
        "is wrong, too"
    ),
    Verdict.WRONG_DIRECTION: "a direction error above 1°",
    Verdict.MULTIPLE_MISSED: "more than one impact is missed",
    Verdict.EARLY: "a time error below 0, by more than `1e-12` of the duration",
    Verdict.WRONG_VELOCITY: "a velocity error above `1e-12` of the scene's speed",
    Verdict.WRONG_SPIN: "a spin error above `1e-12` of the scene's speed of rims",
    Verdict.SLID: (
        "friction's impulse is nearer to that of sliding than to that of sticking, which is smaller; both follow from "
        "the run's own velocities before, normal and impulse"
    ),
    Verdict.STUCK: (
        "friction's impulse is nearer to that of sticking than to that of sliding, which is smaller; both are computed "
        "as for the opposite verdict"
    ),
    Verdict.WRONG_ORDER: "at least one inversion. The inverted impacts are not reported as late or early, too",
    Verdict.SPURIOUS: "at least one impact of the run matches none of the reference",
    Verdict.ENERGY_GAINED: (
        "by more than `1e-6` of the energy at the start, in scenes without gravity. Energy that restitution would have "
        "taken is not a gain of the run alone"
    ),
    Verdict.ENERGY_LOST: "by more than `1e-6` of the energy at the start, in scenes without gravity",
    Verdict.NOT_TOLD_APART: "with other verdicts. The reason of a run that conforms contains it",
    Verdict.LUCKY_PHASE: "*close*, and PIT's impacts. The reason of a run that conforms contains it",
    Verdict.CUT_SHORT: "standstill, a warning of the engine, a state that is not finite, or a clock short of the end",
    Verdict.WENT_ON: "PIC's impacts come without end at one instant, and the run completes",
    Verdict.CONVENTION: "impacts that share a movable disc at one instant",
    Verdict.UNDECIDED: "at least one impact is undecided",
    Verdict.UNCOMPARED: "errors, and no `sampling` given",
    Verdict.MISPLACED: "final positions off by more than rounding (`1e-12` of the reach, and half a unit a step)",
    Verdict.WRONG_END: "final velocities off by more than `1e-12` of the speed",
    Verdict.WRONG_LAST_SPIN: "final spins off by more than `1e-12` of the speed of rims",
    Verdict.DRIFTS: (
        "a run's positions do not follow from its own velocities. The reason gives the part that a step does not "
        "explain"
    ),
    Verdict.TURNS: "a velocity before an impact, or at the end, differs from that after the impact before",
    Verdict.SPINS: "a spin before an impact, or at the end, differs from that after the impact before",
    Verdict.WRONG_STAMP: "or outside the run",
    Verdict.WRONG_NORMAL: "velocities do not change along the normals, or normals are not unit vectors",
    Verdict.MOMENTUM: "the velocity of the centre of mass of two discs changes",
    Verdict.ANGULAR: (
        "the spin changes by more or less than friction at the full radius turns it. The reason gives the fraction of "
        "the radius"
    ),
    Verdict.NOT_FINITE: "see section 0",
    Verdict.PARTED: (
        "the trajectory misses, invents or reorders an impact, and until then no step does from its own state. The "
        "reason says when, when PIT's trajectory leaves, and how good the steps are"
    ),
    Verdict.MISREPORTED: (
        "with *the trajectory has left*: an impact is reported and the states of its pair show none within two steps; "
        "or an impact alone in its step is shown and not reported. A pair at rest shows one where a velocity changes, "
        "and so does a pair that hops by less than its fall in 2.5 steps"
    ),
    Verdict.PASSED_THROUGH: (
        "a step, or a chain of steps, in which two bodies that must meet from the run's own state continue unturned. "
        "It is left out if the trajectory misses as many. The reason also counts those that PIT misses from the same "
        "states"
    ),
    Verdict.TURNED_ALONE: "a velocity or a spin changes by more than 1 % of itself with no other body within two steps",
    Verdict.POLYGON: (
        "with other verdicts: steps are straight where paths are parabolas, which is the engine's integrator. The "
        "reason gives the error of a step"
    ),
    Verdict.DAMPED_POLYGON: (
        "with other verdicts: in a step a disc keeps one speed although damping or a table slows it down, which is the "
        "engine's integrator. The reason gives the error of a step"
    ),
    Verdict.SINKS: "deeper than rounding. The reason says whether a fall from rest in each step explains it",
    Verdict.WORSE_STEPS: (
        "the steps are *inaccurate*, and the trajectory does not show it: it has parted, or is compared up to a "
        "horizon or a rest only"
    ),
    Verdict.SAMPLED_STEPS: "the steps are *close* or *sampled*, and there is no other verdict",
    Verdict.CONTACT: (
        "after discs begin to slide, roll or rest on a wall their places, velocities or spins leave those of the "
        "closed form by more than rounding. The reason gives the differences, and those of PIT"
    ),
    Verdict.RESTED: "contact lasts from there on. The reason says whether later steps were checked",
    Verdict.NO_IMPACT: "the reference has none, and there is no other verdict",
    Verdict.NOTHING_COMPARED: "there is a horizon, and no impact of the reference before it",
    Verdict.CONFORMS: (
        "there is no other verdict. The reason counts the impacts, up to the horizon if there is one, and says whether "
        "later steps were checked"
    ),
}

#: Condition of each grade, with the same test.
GRADED_WHEN = {
    Grade.EXACT: (
        "every impact found. Times, velocities, spins, energy and final state are right to the rounding of the floats "
        "that the method declares, and the run agrees with itself to the same rounding. With 64 bits that is `1e-12` "
        "of the duration, the speed and the reach. With 32 bits it is `1e-5`, times as for *close*, the energy to a "
        'millionth, and the report says "exact (float32)". Every step from its own state is right to ten times that, '
        "to the end of the run. The scene has an impact"
    ),
    Grade.CLOSE: (
        "every impact found. Times are right to a hundredth of a step, each velocity and spin to a hundredth of the "
        "cost of sampling up to its impact. Energy and final state are right to a hundredth of PIT's worst error over "
        "the phases, or end as the run's own impacts imply. The run agrees with itself, except for what sampling "
        "explains. No step is worse than a hundredth of PIT's cost from the same state"
    ),
    Grade.SAMPLED: (
        "every impact found. No velocity or spin is worse than PIT's at the same step up to that impact: at this "
        "phase, at another at which PIT finds all impacts up to there, or at the run's own lateness. No impact is "
        "later than PIT's up to it, or than one step, and none is early on its own account. The energy is no further "
        "off than PIT's, or than a millionth. The end is no further off than PIT's at this phase, or is what the run's "
        "own impacts imply. If every step is *sampled* or better, any phase counts at which PIT finds all. The run "
        "agrees with itself, except for what sampling explains. No step is worse than PIT's at its worst phase, or at "
        "the run's own lateness, from the same state. Sampling explains falls along polygons, damped steps at one "
        "speed, and sinking at rest by at most the fall of a step"
    ),
    Grade.INACCURATE: (
        "worse than that: early, later, or with more error than PIT at any phase or from the same state; or in "
        "contradiction with itself. No impact is missed, invented or out of order"
    ),
    Grade.PARTED: (
        "the trajectory misses, invents or reorders impacts, and no step does from its own state: the steps are "
        "*sampled* or better"
    ),
    Grade.PARTED_INACCURATE: "as *parted*, and the steps are *inaccurate*",
    Grade.WRONG: (
        "misses or invents an impact, or has impacts in the wrong order, and not only by a trajectory that parted; "
        "ends in another way than the reference; or has a number that is NaN or infinite. Beyond the horizon a miss "
        "that PIT has from the same state is part of sampling"
    ),
    Grade.UNGRADED: (
        "the scene has no unique answer; an impact is undecided; there are errors and no PIT to compare with; no "
        "impact is within the horizon; or there is no impact and no fault"
    ),
}
