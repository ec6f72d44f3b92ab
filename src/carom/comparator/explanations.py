"""Conditions of each verdict and each grade, as in `docs/theory/scoring.md` and printed by ``carom explain``."""

from __future__ import annotations

from carom.comparator.grades import Grade
from carom.comparator.verdict import Verdict

#: Condition of each verdict. A test compares this with the table of `docs/theory/scoring.md`.
SAID_WHEN = {
    Verdict.MISSED: (
        "one impact of the reference has none of the run to go with it: the two bodies passed through each other, or "
        "never came to meet"
    ),
    Verdict.LATE: (
        "a time error above 0, by more than `1e-12` of the duration; the paper's second case, where the path is wrong "
        "with it"
    ),
    Verdict.WRONG_DIRECTION: "a direction error above 1°",
    Verdict.MULTIPLE_MISSED: "more than one is missed, each as above",
    Verdict.EARLY: "a time error below 0, by more than `1e-12` of the duration",
    Verdict.WRONG_VELOCITY: "a velocity error above `1e-12` of the scene's speed",
    Verdict.WRONG_SPIN: "a spin error above `1e-12` of the scene's speed of rims",
    Verdict.SLID: (
        "friction's impulse, with the run's own velocities before, normal and push, is nearer to that of sliding than "
        "to that of sticking, which is less"
    ),
    Verdict.STUCK: (
        "friction's impulse, likewise, is nearer to that of sticking than to that of sliding, which is less"
    ),
    Verdict.WRONG_ORDER: (
        "at least one inversion; the times of the inverted impacts are not called late or early as well"
    ),
    Verdict.SPURIOUS: ("at least one spurious: an impact of the run that has none of the reference to go with it"),
    Verdict.ENERGY_GAINED: (
        "by more than `1e-6` of the energy at the start, in scenes without gravity; where restitution takes energy, "
        "that is no gain of the run alone"
    ),
    Verdict.ENERGY_LOST: "by more than `1e-6` of the energy at the start, in scenes without gravity",
    Verdict.NOT_TOLD_APART: "with other verdicts; a run that conforms says it in its reason",
    Verdict.LUCKY_PHASE: "*close*, and PIT's impacts; a run that conforms says it in its reason",
    Verdict.CUT_SHORT: ("standstill, an engine's own warning, a state that is not finite, a clock short of the end"),
    Verdict.WENT_ON: "PIC's impacts come without end at one instant, and the run completes",
    Verdict.CONVENTION: "impacts that share a movable disc at one instant",
    Verdict.UNDECIDED: "at least one undecided",
    Verdict.UNCOMPARED: "errors, and no `sampling` given",
    Verdict.MISPLACED: ("final positions off by more than rounding (`1e-12` of the reach, and half a unit a step)"),
    Verdict.WRONG_END: "final velocities off by more than `1e-12` of the speed",
    Verdict.WRONG_LAST_SPIN: "final spins off by more than `1e-12` of the speed of rims",
    Verdict.DRIFTS: (
        "a run's own positions part from its own velocities; the reason says what of it a step does not explain"
    ),
    Verdict.TURNS: ("a velocity before an impact, or at the end, is not that after the impact before"),
    Verdict.SPINS: ("a spin before an impact, or at the end, is not that after the impact before"),
    Verdict.WRONG_STAMP: "or outside the run",
    Verdict.WRONG_NORMAL: "they are not what velocities change along, or no unit vectors",
    Verdict.MOMENTUM: "the centre of mass of two discs is faster or slower after it",
    Verdict.ANGULAR: (
        "the spin changes by more or less than friction at the full radius turns it; the reason says at how much of "
        "the radius"
    ),
    Verdict.NOT_FINITE: "see section 0",
    Verdict.PARTED: (
        "an impact missed, found in addition or out of order by the trajectory, and until then none by any step from "
        "its own state; the reason says when, when PIT's trajectory leaves, and how good the steps are"
    ),
    Verdict.MISREPORTED: (
        "with *the trajectory has left*: a report that no state of its pair shows within two steps (a pair that rests, "
        "or hops by less than what it falls in 2.5 steps, shows one where a velocity changes), or an impact alone in "
        "its step that is shown and not reported"
    ),
    Verdict.PASSED_THROUGH: (
        "a step, or a chain of steps, in which two bodies that must meet from the run's own state go on unturned; not "
        "said again where the trajectory misses as many. The reason counts those that PIT misses, too, from the same "
        "states"
    ),
    Verdict.TURNED_ALONE: (
        "a velocity or a spin changes by more than 1 % of itself with no other body within two steps"
    ),
    Verdict.POLYGON: (
        "with other verdicts: steps are straight where paths are parabolas, which is the engine's integrator; the "
        "reason says by how much a step is off"
    ),
    Verdict.DAMPED_POLYGON: (
        "with other verdicts: in a step a disc goes as far as one speed takes it, where damping or a table slows it "
        "down meanwhile, which is the engine's integrator; the reason says by how much a step is off"
    ),
    Verdict.SINKS: ("deeper than rounding; the reason says whether falling for each step anew explains it"),
    Verdict.WORSE_STEPS: (
        "the steps are *inaccurate*, and the trajectory is not the place to say so: it has parted, or is compared up "
        "to a horizon or a rest only"
    ),
    Verdict.SAMPLED_STEPS: "the steps are *close* or *sampled*, and nothing else is said",
    Verdict.CONTACT: (
        "after discs begin to slide, roll or rest on a wall their places, velocities or spins leave those of the "
        "closed form by more than rounding; the reason says by how much, and by how much PIT's do"
    ),
    Verdict.RESTED: ("contact lasts from there on; the reason says whether the steps beyond were looked at"),
    Verdict.NO_IMPACT: "the reference has none, and nothing else is said",
    Verdict.NOTHING_COMPARED: "there is a horizon, and no impact of the reference before it",
    Verdict.CONFORMS: (
        "nothing else is said; the reason counts the impacts, up to the horizon where there is one, and says whether "
        "the steps beyond were looked at"
    ),
}

#: Condition of each grade, with the same test.
GRADED_WHEN = {
    Grade.EXACT: (
        "every impact found; times, velocities, spins, energy and final state right to the rounding of the floats "
        "that the method declares, and the run in agreement with itself to as much. 64 bits: `1e-12` of the duration, "
        "the speed, the reach. 32 bits: `1e-5`, no time off by more than is close, the energy by no more than a "
        'millionth; the report says "exact (float32)"; every step from its own state right to ten times that, to the '
        "end of the run; and the scene has an impact"
    ),
    Grade.CLOSE: (
        "every impact found; times right to a hundredth of a step, each velocity and each spin to a hundredth of its "
        "price of sampling up to its impact; energy and final state to a hundredth of what PIT's are off by at worst "
        "over the phases, or as its own impacts make it end; in agreement with itself, except for what sampling "
        "explains; no step worse than a hundredth of what PIT pays from the same state"
    ),
    Grade.SAMPLED: (
        "every impact found; none worse in velocity or in spin than PIT at the same step has been at it or before it, "
        "at this phase, at another at which it finds all up to there, or at the run's own lateness; none later than "
        "PIT has been up to it, or one step, and none early on its own account; energy no further off than PIT's, or "
        "a millionth; ends no further off than PIT (at this phase, or, where every step is *sampled* or better, at any "
        "at which PIT finds all), or where its own impacts make it end; in agreement with itself, "
        "except for what sampling explains; no step worse than PIT at its worst phase, or at the run's own lateness, "
        "from the same state; falling along polygons, damped steps at one speed, and sinking at rest by no more than "
        "the fall of a step, are sampling's"
    ),
    Grade.INACCURATE: (
        "worse than that: early, later, or with more error than PIT at any phase, or from the same state; or in "
        "contradiction with itself; but nothing missed, invented or out of order"
    ),
    Grade.PARTED: (
        "the trajectory misses, invents or swaps impacts, and no step does from its own state: the steps are "
        "*sampled* or better"
    ),
    Grade.PARTED_INACCURATE: "as *parted*, and the steps are *inaccurate*",
    Grade.WRONG: (
        "misses or invents an impact, takes impacts in the wrong order, and not by a trajectory alone that parted; "
        "ends where the reference does not; or holds a number that is NaN or infinite. Beyond the horizon a miss that "
        "PIT has from the same state is sampling's"
    ),
    Grade.UNGRADED: (
        "the scene has no unique answer; or an impact is undecided; or there are errors and no PIT to compare with; "
        "or no impact lies within the horizon; or there is no impact, and nothing wrong"
    ),
}
