"""Definitions of verdicts and grades, shown by ``carom explain`` and in `docs/theory/scoring.md`."""

from __future__ import annotations

from carom.comparator.grade import Grade
from carom.comparator.verdict import Verdict

#: Condition of each verdict. A test compares this with the table of `docs/theory/scoring.md`.
VERDICT_CONDITIONS = {
    Verdict.MISSED: (
        "an impact of the reference matches none of the run: the two bodies passed through each other, or never met"
    ),
    Verdict.LATE: (
        "it is late by more than `1e-12` of the duration. This is the paper's second case, in which the "
        "path is wrong, too"
    ),
    Verdict.WRONG_DIRECTION: "a direction differs by more than 1°",
    Verdict.MULTIPLE_MISSED: "more than one impact is missed",
    Verdict.EARLY: "it is early by more than `1e-12` of the duration",
    Verdict.WRONG_VELOCITY: "a velocity error exceeds `1e-12` of the scene's speed",
    Verdict.WRONG_SPIN: "a spin error exceeds `1e-12` of the scene's rim speed",
    Verdict.SLID: (
        "sticking needs less friction than Coulomb's limit, so the bodies must stick. But the run's friction impulse "
        "is nearer to that of sliding. Both impulses are computed from the run's own velocities before the impact, "
        "normal and normal impulse"
    ),
    Verdict.STUCK: (
        "sticking needs more friction than Coulomb's limit, so the bodies must slide. But the run's friction impulse "
        "is nearer to that of sticking. Both impulses are computed as for the opposite verdict"
    ),
    Verdict.WRONG_ORDER: "two impacts or more are in the wrong order. They are not also reported as late or early",
    Verdict.SPURIOUS: "at least one impact of the run matches none of the reference",
    Verdict.ENERGY_GAINED: (
        "by more than `1e-6` of the energy at the start, in scenes without gravity. A missed impact also counts as a "
        "gain, because it loses no energy"
    ),
    Verdict.ENERGY_LOST: "by more than `1e-6` of the energy at the start, in scenes without gravity",
    Verdict.NOT_TOLD_APART: "added to other verdicts. If a run conforms, its reason mentions it instead",
    Verdict.LUCKY_PHASE: (
        "a run is *exact* or *close*, and PIT finds the same impacts. If a run conforms, its reason mentions it instead"
    ),
    Verdict.CUT_SHORT: (
        "the run ends with a standstill, the engine warns, a state is not finite, or the clock stops before the end"
    ),
    Verdict.WENT_ON: "PIC has infinitely many impacts at one instant and ends there, but the run completes",
    Verdict.CONVENTION: "several impacts at one instant share a movable disc",
    Verdict.UNDECIDED: "the run ended before an impact could have been reported",
    Verdict.UNCOMPARED: "there are errors, and `sampling` was not given",
    Verdict.MISPLACED: (
        "a final position is wrong by more than rounding: `1e-12` of the greatest coordinate, and half a unit in the "
        "last place per step"
    ),
    Verdict.WRONG_END: "a final velocity is wrong by more than `1e-12` of the scene's speed",
    Verdict.WRONG_LAST_SPIN: "a final spin is wrong by more than `1e-12` of the scene's rim speed",
    Verdict.DRIFTS: (
        "a run's positions do not follow from its own velocities. Engines may move bodies apart by the overlap "
        "gained in one step; the reason states how much exceeds this"
    ),
    Verdict.TURNS: "the velocity before an impact, or at the end, differs from the velocity after the previous impact",
    Verdict.SPINS: "the spin before an impact, or at the end, differs from the spin after the previous impact",
    Verdict.WRONG_STAMP: "the reported time of an impact is outside its step, or outside the run",
    Verdict.WRONG_NORMAL: "a velocity does not change along the normal, or a normal is not a unit vector",
    Verdict.MOMENTUM: "the velocity of the centre of mass of two discs changes",
    Verdict.ANGULAR: (
        "the spin changes by more or less than friction at the disc's rim causes. The reason gives the radius, "
        "as a fraction of the disc's, at which that friction would act"
    ),
    Verdict.NOT_FINITE: "the first number that is not finite is named",
    Verdict.PARTED: (
        "the trajectory misses, invents or reorders an impact, although no step so far does so from its own "
        "state. The reason gives the time, the same time for PIT, and the accuracy of the steps"
    ),
    Verdict.MISREPORTED: (
        "added to *the trajectory has diverged*. Either an impact is reported that the states of its pair do not "
        "show within two steps, or the states show a single impact that is not reported. If a pair rests, or hops by "
        "less than its fall in 2.5 steps, each change of velocity counts as an impact"
    ),
    Verdict.PASSED_THROUGH: (
        "from the run's own state two bodies must collide, but their velocities do not change. The verdict is "
        "omitted if the trajectory misses the same number of impacts. The reason also counts the impacts that PIT "
        "misses from the same "
        "states"
    ),
    Verdict.TURNED_ALONE: "a velocity or a spin changes by more than 1 % of itself with no other body within two steps",
    Verdict.POLYGON: (
        "added to other verdicts. The engine's integrator moves discs along straight steps instead of parabolas. "
        "The reason gives the error of a step"
    ),
    Verdict.DAMPED_POLYGON: (
        "added to other verdicts. The engine's integrator keeps a disc's speed constant during a step, although "
        "damping or a table slows it. The reason gives the error of a step"
    ),
    Verdict.SINKS: (
        "they sink by more than rounding. The reason states whether falling from rest in each step explains the depth"
    ),
    Verdict.WORSE_STEPS: (
        "steps are *inaccurate*, but the trajectory does not show it, because it has diverged or is only "
        "compared up to a horizon or to rest"
    ),
    Verdict.SAMPLED_STEPS: "steps are *close* or *sampled*, and there is no other verdict",
    Verdict.CONTACT: (
        "positions, velocities or spins of discs in contact with a wall differ from the closed form by more than "
        "rounding. The reason gives the differences, and those of PIT"
    ),
    Verdict.RESTED: "contact lasts from that time on. The reason states whether later steps were checked",
    Verdict.NO_IMPACT: "the reference has no impact, and there is no other verdict",
    Verdict.NOTHING_COMPARED: "there is a horizon, and the reference has no impact before it",
    Verdict.CONFORMS: (
        "there is no other verdict. The reason counts the impacts, up to a horizon if there is one, and states "
        "whether later steps were checked"
    ),
}

#: Condition of each grade, compared by the same test.
GRADE_CONDITIONS = {
    Grade.EXACT: (
        "every impact is found. Times, velocities, spins, energy and final state are right to the rounding of the "
        "method's floats. The run agrees with itself to the same rounding. With 64 bits that is `1e-12` of the "
        "duration, the speed and the greatest coordinate. With 32 bits it is `1e-5` (times as for *close*, energy to a "
        'millionth), and the report says "exact (float32)". Every step, compared with PIC from the run\'s own state, '
        "is right to ten times that rounding. The scene has at least one impact"
    ),
    Grade.CLOSE: (
        "every impact is found. Times are right to a hundredth of a step. Each velocity and spin is right to a "
        "hundredth of PIT's error up to that impact. Energy and final state are right to a hundredth of "
        "PIT's worst error over the phases, or follow from the run's own impacts. The run agrees with itself, "
        "except for what sampling explains. No step is worse than a hundredth of PIT's cost from the same state"
    ),
    Grade.SAMPLED: (
        "every impact is found. No velocity or spin has a larger error than PIT's at the same step up to that "
        "impact. PIT's error is the largest of several: at this phase, at each phase at which PIT finds all impacts "
        "so far, and at the phase at which PIT is as late as the run. No impact is later than PIT's latest so far, "
        "or than one step. None is early on its own account. The energy error is at most PIT's, or a millionth. The "
        "final state is at least as accurate as "
        "PIT's at this phase, or follows from the run's own impacts. If every step is *sampled* or better, PIT's "
        "final state at any phase at which it finds all impacts may be used. The run agrees with itself, except for "
        "what sampling "
        "explains. From the same state, no step is worse than PIT's at PIT's worst phase, or at the phase at which "
        "PIT is as late as the run. Sampling explains falls along polygons, a constant speed during a damped step, "
        "and sinking at rest by at most the fall of a step"
    ),
    Grade.INACCURATE: (
        "worse than *sampled*: the run is early, later than PIT, has larger errors than PIT, or contradicts "
        "itself. No impact is missed, invented or out of order"
    ),
    Grade.PARTED: (
        "the trajectory misses, invents or reorders impacts, but no step does so from its own state. All steps "
        "are *sampled* or better"
    ),
    Grade.PARTED_INACCURATE: "as *parted*, but some steps are *inaccurate*",
    Grade.WRONG: (
        "the run misses or invents an impact, or has impacts in the wrong order, and a diverged trajectory does "
        "not explain it. Or it ends differently from the reference, or has a number that is NaN or infinite. "
        "Beyond the horizon, a miss counts as sampling if PIT misses the impact from the same state"
    ),
    Grade.UNGRADED: (
        "the scene has no unique answer, an impact is undecided, there are errors and no PIT run to compare "
        "with, no impact is within the horizon, or there is neither an impact nor a fault"
    ),
}
