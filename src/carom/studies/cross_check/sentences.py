"""The sentences of `carom run` outside its tables, and when each is said, as in the table of docs/scoring.md."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class Sentence(Enum):
    """A sentence; what stands in braces is filled in."""

    NOTHING = "Nothing could be scored: no method that was asked ran any of these scenes."
    ONE_SCENE = "{scene}{step}: {outcomes}."
    LOST = "{lost} of {impacts}"
    VELOCITY = "velocities off by {part} of the greatest speed"
    TIME = "{time} ms {side}"
    MISSES = "In {missed} of {scenes} scenes {engines} misses an impact{which}."
    NONE_CLOSE = "No {kind} is exact or close in any of {scenes} scenes."
    MOST_CLOSE = "Most exact or close: {names}{tie}, in {scenes}; wrong in {wrong}."
    UNPROVEN = "None of these scenes has a known answer, so PIC is the reference here without a proof of its own."
    CERTIFIED = "None of these scenes has a known answer; of {which} every impact of PIC is certified."
    DEVIATES = "PIC reproduces {which} to rounding; it does not reproduce {scenes}."
    REPRODUCES = "PIC reproduces {which} (largest deviation {deviation})."
    NO_RUN = "No {what} at {steps} could be scored."
    RUNS = "Of {runs} at {steps}: {grades}."
    NOT_SCORED = "Not scored: {others}."
    LUCKY = "{method} owes {grades} to the phase of the step: {right}."

    def __call__(self, **filled: object) -> str:
        """Return the sentence with what is filled in."""
        return self.value.format(**filled)


#: When each is said.
SAID: Mapping[Sentence, str] = {
    Sentence.NOTHING: "no run has a score",
    Sentence.ONE_SCENE: (
        "of one scene: an outcome for each engine, or for PIT if no engine ran, the best first; methods of "
        "the same outcome share it, and of more than three outcomes the first and the last stand, with how "
        "many lie between"
    ),
    Sentence.LOST: (
        "outcome of a run that misses or invents impacts, unless its trajectory has parted: then it is its grade"
    ),
    Sentence.VELOCITY: (
        "outcome of a run that finds every impact, is not *exact*, and has a velocity error above rounding"
    ),
    Sentence.TIME: (
        "outcome of such a run whose velocities are right to rounding, and whose times are not; of any other "
        "run the outcome is its grade"
    ),
    Sentence.MISSES: (
        "of several scenes, if a profile `default` ran: in how many every run with it misses an impact "
        "(verdicts *an impact is missed*, *several impacts are missed* or *bodies pass through each other*)"
    ),
    Sentence.NONE_CLOSE: "of several scenes: no method is *exact* or *close* in any",
    Sentence.MOST_CLOSE: (
        "otherwise: who is *exact* or *close* in most; among equals those wrong in fewest, then those worse "
        "than *sampled* in fewest; all who are equal in it are named"
    ),
    Sentence.UNPROVEN: "no scene has a known answer, and PIC is certified to the end of none",
    Sentence.CERTIFIED: "no scene has a known answer, and PIC is certified to the end of some",
    Sentence.DEVIATES: "PIC is off one of the known answers by more than rounding",
    Sentence.REPRODUCES: "PIC is off none of them by more than rounding",
    Sentence.NO_RUN: "no engine's run has a score, nor PIT's if no engine was asked",
    Sentence.RUNS: "otherwise: how many runs have which grade, at the coarsest step of each scene",
    Sentence.NOT_SCORED: "some of them were not run, or ended without an answer",
    Sentence.LUCKY: (
        "checking once per step is as right as PIT was at this phase at some of the sixteen phases, and not at all"
    ),
}
