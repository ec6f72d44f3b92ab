"""Exact motion of a scene, computed by brute force with hundreds of decimal digits.

Every float of a scene is converted to an exactly equal decimal number. After each impact, the next impacts of its discs
with all other bodies are computed from formulas. With hundreds of digits, cancellation does not matter. The motion is
computed twice, the second time with twice as many digits. An error is raised if the two results differ. The module uses
neither Carom's solvers nor Carom's physics.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.errors import InputError
from carom.model.scene import Need, Scene
from carom.model.trace import Vector, wall_body, wall_index

#: Number of decimal digits of the first computation. In the smallest graze of a stress test, 1e-15 of the contact
#: distance, 30 digits are lost by cancellation. A chain of impacts loses about one digit per impact.
DIGITS = 120

#: Largest allowed relative difference between the results of the two computations. This limit is far below the rounding
#: error of a float, and far above the error that the lost digits cause.
AGREEMENT = Decimal("1e-30")

NEVER = Decimal("Infinity")


class UndecidedError(InputError):
    """The exact motion can't be computed, because of unsupported forces, too many impacts, or too few digits."""


class TrueImpact(NamedTuple):
    """An impact of the exact motion: its time in seconds, the disc with the lower number, and the other body."""

    time_s: float
    first: int
    second: int


@dataclass(frozen=True)
class TrueMotion:
    """Exact motion of a scene until its end.

    Attributes:
        impacts: All impacts, in order.
        final_velocity_m_s: Velocity of each disc at the end, in metres per second.
        greatest_change_m_s: For each disc, the greatest velocity change that one impact causes, in metres per second; 0
            for a disc that is never hit.
        convention: Whether two impacts of a movable disc come at the same instant, so that the order of these impacts
            is a convention.
    """

    impacts: tuple[TrueImpact, ...]
    final_velocity_m_s: tuple[Vector, ...]
    greatest_change_m_s: tuple[float, ...]
    convention: bool


def compute_true_motion(scene: Scene, *, most_impacts: int = 1000) -> TrueMotion:
    """Compute the exact motion of a scene.

    Raises:
        UndecidedError: The scene has gravity, damping or friction, there are more than `most_impacts` impacts, or more
            digits are needed to compute them.
    """
    beyond = sorted(scene.needs & {Need.GRAVITY, Need.DAMPING, Need.FRICTION, Need.TANGENTIAL_RESTITUTION})
    if beyond:
        raise UndecidedError(f"the exact motion with {' and '.join(beyond)} can't be computed")
    rough, fine = (_Motion(scene, digits) for digits in (DIGITS, 2 * DIGITS))
    rough.run(most_impacts)
    fine.run(most_impacts)
    if [event[1:] for event in rough.events] != [event[1:] for event in fine.events]:
        raise UndecidedError(f"{DIGITS} digits are not enough to decide the order of impacts in {scene.name!r}")
    for (a, *_), (b, *_) in zip(rough.events, fine.events, strict=True):
        if abs(a - b) > AGREEMENT * fine.end:
            raise UndecidedError(f"{DIGITS} digits are not enough to compute the time of an impact in {scene.name!r}")
    return fine.round_motion()


def _convert_exactly(numbers: Sequence[float] | Sequence[Vector]) -> NDArray[np.object_]:
    """Convert floats to exactly equal decimal numbers, in an array of the same shape."""
    exact: NDArray[np.object_] = np.vectorize(Decimal, otypes=[object])(np.array(numbers, dtype=np.float64))
    return exact


class _Motion:
    """Computes the motion by brute force with a given number of decimal digits."""

    def __init__(self, scene: Scene, digits: int) -> None:
        self.context = Context(prec=digits)
        self.tie = Decimal(10) ** (-digits // 2)
        self.scene = scene
        self.place = _convert_exactly([disc.position_m for disc in scene.discs])
        self.velocity = _convert_exactly([disc.velocity_m_s for disc in scene.discs])
        self.radius = _convert_exactly([disc.radius_m for disc in scene.discs])
        with localcontext(self.context):
            self.weight = [Decimal(0) if disc.immovable else 1 / Decimal(disc.mass_kg) for disc in scene.discs]
            normals = [_convert_exactly(wall.normal) for wall in scene.half_planes()]
            # Normals are stored as rounded floats, so their length is not exactly 1.
            units = [normal / (normal @ normal).sqrt() for normal in normals]
        points = [_convert_exactly(wall.point_m) for wall in scene.half_planes()]
        self.walls = list(zip(points, units, strict=True))
        self.end = Decimal(scene.duration_s)
        self.now = Decimal(0)
        self.events: list[tuple[Decimal, int, int]] = []
        self.convention = False
        self.change = [Decimal(0)] * len(scene.discs)
        self._upcoming: dict[tuple[int, int], Decimal] = {}

    def run(self, max_impacts: int) -> None:
        with localcontext(self.context):
            self._predict(range(len(self.place)))
            last: tuple[int, int] | None = None
            since: dict[int, Decimal] = {}
            while (event := self._find_next_impact(last)) is not None:
                if len(self.events) == max_impacts:
                    raise UndecidedError(f"{self.scene.name!r} has more than {max_impacts} impacts")
                time, pair = event
                self.place = self.place + self.velocity * max(time - self.now, Decimal(0))
                self.now = time
                touched = [body for body in pair if body >= 0 and self.weight[body] > 0]
                if any(body in since and time - since[body] <= self.tie * self.end for body in touched):
                    self.convention = True
                since.update(dict.fromkeys(touched, time))
                before = self.velocity.copy()
                self._collide(*pair)
                for body in touched:
                    change = self.velocity[body] - before[body]
                    self.change[body] = max(self.change[body], (change @ change).sqrt())
                self.events.append((time, *pair))
                last = pair
                self._predict(touched)

    def round_motion(self) -> TrueMotion:
        impacts = tuple(TrueImpact(float(time), first, second) for time, first, second in self.events)
        velocity = tuple((float(x), float(y)) for x, y in self.velocity)
        return TrueMotion(impacts, velocity, tuple(map(float, self.change)), self.convention)

    def _predict(self, changed: Collection[int]) -> None:
        """Predict the next impact of each pair of bodies that contains a changed disc."""
        pairs = [(i, j) for i, j in combinations(range(len(self.place)), 2) if i in changed or j in changed]
        pairs += [(i, wall_body(k)) for i in changed for k in range(len(self.walls))]
        for first, second in pairs:
            compute_wait = self._compute_wall_wait if second < 0 else self._compute_pair_wait
            self._upcoming[first, second] = self.now + compute_wait(first, second)

    def _find_next_impact(self, last: tuple[int, int] | None) -> tuple[Decimal, tuple[int, int]] | None:
        """Return the earliest impact.

        If several impacts come at the same instant, return the impact whose bodies have the lowest numbers.
        """
        # Two discs can't meet again before one of them has another impact.
        times = {pair: time for pair, time in self._upcoming.items() if pair != last}
        if (earliest := min(times.values(), default=NEVER)) > self.end:
            return None
        together = [pair for pair, time in times.items() if time - earliest <= self.tie * self.end]
        return earliest, min(together, key=lambda pair: (pair[0], pair[1] if pair[1] >= 0 else math.inf))

    def _compute_pair_wait(self, i: int, j: int) -> Decimal:
        if self.weight[i] == self.weight[j] == 0:
            return NEVER
        gap, relative = self.place[j] - self.place[i], self.velocity[j] - self.velocity[i]
        approach: Decimal = gap @ relative
        if approach >= 0:
            return NEVER
        contact = self.radius[i] + self.radius[j]
        square_difference: Decimal = gap @ gap - contact * contact
        if square_difference <= 0:
            return Decimal(0)
        discriminant = approach * approach - relative @ relative * square_difference
        if discriminant <= 0:
            return NEVER
        wait: Decimal = square_difference / (discriminant.sqrt() - approach)
        return wait

    def _compute_wall_wait(self, i: int, wall: int) -> Decimal:
        point, normal = self.walls[wall_index(wall)]
        approach: Decimal = self.velocity[i] @ normal
        if self.weight[i] == 0 or approach >= 0:
            return NEVER
        clearance: Decimal = (self.place[i] - point) @ normal - self.radius[i]
        return max(clearance, Decimal(0)) / -approach

    def _collide(self, i: int, j: int) -> None:
        if j < 0:
            _, normal = self.walls[wall_index(j)]
            self.velocity[i] -= (1 + Decimal(self.scene.wall_restitution)) * (self.velocity[i] @ normal) * normal
            return
        gap = self.place[j] - self.place[i]
        push = (1 + Decimal(self.scene.restitution)) * ((self.velocity[i] - self.velocity[j]) @ gap)
        push /= gap @ gap * (self.weight[i] + self.weight[j])
        self.velocity[i] -= push * self.weight[i] * gap
        self.velocity[j] += push * self.weight[j] * gap
