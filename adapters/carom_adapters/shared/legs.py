"""Changes the velocities of driven bodies at given instants: an engine gets a new velocity at the next step boundary.

A leg is a part of a body's motion with constant velocity. Users of an engine would also set velocities between steps.
Until the step boundary, a body keeps its old velocity, which shifts all its later positions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from operator import itemgetter
from typing import Generic, TypeVar

from carom.engines.api import Chain, Disc, Ring, Scene, StepClock, Wall
from carom_adapters.shared.settings_code import PYTHON_END

Driven = Disc | Wall | Chain | Ring
Body = TypeVar("Body")
Vector = tuple[float, float]

#: A velocity that changes at a step boundary must apply to the next step in spite of rounding errors of times.
#: `_REACHED` allows for 2^13 rounding errors of 2^-53 each, since times are added up for each piece of a shortened
#: step.
_REACHED = 1.0 + 2.0**-40


def find_first_velocity(scene_body: Driven) -> Vector:
    """Return the initial velocity of a driven disc or wall."""
    return scene_body.drive.velocity_at(0.0)


class Legs(Generic[Body]):
    """Changes of the velocities of driven bodies during a run, in order of time."""

    def __init__(self) -> None:
        self._changes: list[tuple[float, Body, Vector]] = []
        #: Number of changes that have been made. A world that restores an earlier state also restores this number.
        self.started = 0

    def add(self, body: Body, scene_body: Driven) -> None:
        """Add the changes of velocity of a driven disc or wall. `body` represents the disc or wall in the engine."""
        self._changes += [(leg.begin_s, body, leg.velocity) for leg in scene_body.drive.legs[1:]]
        self._changes.sort(key=itemgetter(0))

    def split_steps(self, steps: int, clock: StepClock) -> Iterable[tuple[int, Sequence[tuple[Body, Vector]]]]:
        """Divide steps into calls of the engine: single steps until the last change of velocity, then all other steps.

        For each call, yield the number of steps, and the bodies whose velocities change before the call, with their new
        velocities. `clock` counts the steps.
        """
        if self.started < len(self._changes):
            return self._split_steps_to_legs(steps, clock)
        clock.count(steps)
        return ((steps, ()),)

    def _split_steps_to_legs(self, steps: int, clock: StepClock) -> Iterator[tuple[int, Sequence[tuple[Body, Vector]]]]:
        steps_taken = 0
        while steps_taken < steps:
            count = 1 if self.started < len(self._changes) else steps - steps_taken
            yield count, self._start_due(clock.now_s)
            clock.count(count)
            steps_taken += count

    def _start_due(self, now_s: float) -> Sequence[tuple[Body, Vector]]:
        """Apply the changes of velocity that are due at a time.

        Return the bodies whose velocities change, with their new velocities.
        """
        first = self.started
        while self.started < len(self._changes) and self._changes[self.started][0] <= now_s * _REACHED:
            self.started += 1
        return [(body, velocity) for _, body, velocity in self._changes[first : self.started]]


def has_legs(scene: Scene) -> bool:
    """Whether a scene has a driven body whose velocity changes."""
    return any(body.legs for body in (*scene.discs, *scene.walls))


def group_legs_by_step(bodies: Sequence[Driven], dt_s: float) -> dict[int, list[tuple[int, Vector]]]:
    """Return the changes of velocity, grouped by the number of the step (from 0) before which they occur.

    A change consists of the number of the body and its new velocity.
    """
    changes: dict[int, list[tuple[int, Vector]]] = {}
    for number, body in enumerate(bodies):
        for leg in body.drive.legs[1:]:
            step = max(int(leg.begin_s / dt_s) - 1, 0)
            while not leg.begin_s <= step * dt_s * _REACHED:
                step += 1
            changes.setdefault(step, []).append((number, leg.velocity))
    return dict(sorted(changes.items()))


def format_program_end(
    scene: Scene, step: str, state: str, legs: dict[int, list[tuple[int, Vector]]], set_velocity: str
) -> str:
    """Return the last lines of a Python program, which run all steps and set the velocities of driven bodies.

    Args:
        scene: The scene.
        step: Code that takes a step.
        state: Code that is printed for each disc, with the variable `body`.
        legs: Result of `group_legs_by_step` for the bodies in the program's list `driven`.
        set_velocity: Code that sets the `velocity` of a driven body, `driven[k]`.
    """
    end = PYTHON_END.format(step=step, state=state)
    if not has_legs(scene):
        return end
    loop = (
        f"legs = {legs!r}  # by step: index of a driven body, and its new velocity\n"
        "for number in range(steps):\n"
        "    for k, velocity in legs.get(number, ()):\n"
        f"        {set_velocity}\n"
    )
    return end.replace("for _ in range(steps):\n", loop)
