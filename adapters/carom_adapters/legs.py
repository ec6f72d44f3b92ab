"""Driven bodies whose velocity changes at given instants: engines are told at the step at or after each of these.

That is what a user of an engine can do between steps. So a body goes on at its old velocity for a part of a step, and
is off by that from then on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Generic, TypeVar

from carom.engines.api import Chain, Disc, Ring, Scene, Wall
from carom_adapters.code import PYTHON_END

Driven = Disc | Wall | Chain | Ring
Body = TypeVar("Body")
Vector = tuple[float, float]

#: A leg that begins at a boundary of steps begins in the step there. The instant, the step and each sum of times, of
#: which steps that are cut make one each, are rounded by 2^-53 at most: this is room for 2^13 of them.
_REACHED = 1.0 + 2.0**-40


def first_velocity(of: Driven) -> Vector:
    """Return the velocity of a driven disc or wall at the start."""
    return of.drive.velocity_at(0.0)


class Legs(Generic[Body]):
    """What driven bodies are told while a world steps, in the order of the instants."""

    def __init__(self) -> None:
        self._coming: list[tuple[float, Body, Vector]] = []
        #: How many have been told; a world that is put back to an earlier state puts this back, too.
        self.told = 0

    def add(self, body: Body, of: Driven) -> None:
        """Take in the legs of a driven disc or wall, which moves as a body of the engine's."""
        self._coming += [(leg.begin_s, body, leg.velocity) for leg in of.drive.legs[1:]]
        self._coming.sort(key=lambda one: one[0])

    def stretches(self, steps: int) -> Iterable[int]:
        """Return how many steps are taken before a leg may begin: one each while legs are to come, then the rest."""
        return self._steps_to_legs(steps) if self.told < len(self._coming) else (steps,)

    def _steps_to_legs(self, steps: int) -> Iterator[int]:
        taken = 0
        while taken < steps:
            count = 1 if self.told < len(self._coming) else steps - taken
            yield count
            taken += count

    def begun(self, now_s: float) -> Sequence[tuple[Body, Vector]]:
        """Return the bodies whose velocity changes in the step that begins now, with the new one."""
        begin = self.told
        if begin == len(self._coming):
            return ()
        while self.told < len(self._coming) and self._coming[self.told][0] <= now_s * _REACHED:
            self.told += 1
        return [(body, velocity) for _, body, velocity in self._coming[begin : self.told]]


def has_legs(scene: Scene) -> bool:
    """Whether a scene has a driven body whose velocity changes."""
    return any(body.legs for body in (*scene.discs, *scene.walls))


def legs_by_step(bodies: Sequence[Driven], dt_s: float) -> dict[int, list[tuple[int, Vector]]]:
    """Return which of some driven bodies are given which velocity before which step, counted from 0."""
    told: dict[int, list[tuple[int, Vector]]] = {}
    for number, body in enumerate(bodies):
        for leg in body.drive.legs[1:]:
            step = max(int(leg.begin_s / dt_s) - 1, 0)
            while not leg.begin_s <= step * dt_s * _REACHED:
                step += 1
            told.setdefault(step, []).append((number, leg.velocity))
    return dict(sorted(told.items()))


def python_end(scene: Scene, step: str, state: str, legs: dict[int, list[tuple[int, Vector]]], told: str) -> str:
    """Return the last lines of a program in Python, in which driven bodies are told of their legs.

    Args:
        scene: The scene.
        step: What takes a step.
        state: What is printed of a disc, a `body`.
        legs: As `legs_by_step` has it, of the bodies in the program's list `driven`.
        told: What gives one of them, `driven[k]`, a `velocity`.
    """
    end = PYTHON_END.format(step=step, state=state)
    if not has_legs(scene):
        return end
    loop = (
        f"legs = {legs!r}  # which of them is given which velocity before which step\n"
        "for number in range(steps):\n"
        "    for k, velocity in legs.get(number, ()):\n"
        f"        {told}\n"
    )
    return end.replace("for _ in range(steps):\n", loop)
