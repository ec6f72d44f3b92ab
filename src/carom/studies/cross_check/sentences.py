"""The sentences of `carom run` outside its tables."""

from __future__ import annotations

from enum import Enum


class Sentence(Enum):
    """A sentence with named placeholders."""

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
        """Return the sentence with its placeholders filled in."""
        return self.value.format(**filled)
