"""The sentences of `carom run` outside its tables."""

from __future__ import annotations

from enum import Enum


class Sentence(Enum):
    """A sentence with named placeholders."""

    NOTHING = "Nothing could be scored: no requested method ran any of these scenes."
    ONE_SCENE = "{scene}{step}: {outcomes}."
    LOST = "{lost} of {impacts}"
    VELOCITY = "velocities off by {part} of the greatest speed"
    TIME = "{time} ms {side}"
    MISSES = "With default settings, {engines} misses an impact in {missed} of {scenes} scenes{which}."
    NONE_CLOSE = "No {kind} is exact or close in any of {scenes} scenes."
    MOST_CLOSE = "Most accurate: {names}{tie}, exact or close in {scenes} and wrong in {wrong}."
    UNPROVEN = "None of these scenes has a known answer: PIC is the reference, without independent proof."
    CERTIFIED = "None of these scenes has a known answer; every impact of PIC is certified in {which}."
    DEVIATES = "PIC reproduces {which} to rounding; it does not reproduce {scenes}."
    REPRODUCES = "PIC reproduces {which} (largest deviation {deviation})."
    NO_RUN = "No {what} at {steps} could be scored."
    RUNS = "Of {runs} at {steps}: {grades}."
    NOT_SCORED = "Not scored: {others}."
    LUCKY = "{method}: {grades} depends on the phase of the step; {right}."

    def __call__(self, **filled: object) -> str:
        """Return the sentence with its placeholders filled in."""
        return self.value.format(**filled)
