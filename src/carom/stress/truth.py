"""The true motion of a scene as it is stored: brute force in decimal numbers of hundreds of digits.

Every float of a scene is a decimal number exactly, so nothing is lost on the way in. All pairs are solved for by the
textbook quadratic after each impact; that the textbook form cancels does not matter where hundreds of digits are kept.
The motion is worked out twice, the second time with twice as many digits: what the two agree on is the answer, and
where they do not agree on the order of impacts there is none. Nothing here comes from Carom's solvers or its physics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from itertools import combinations
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.scene import Need
from carom.trace import wall_body, wall_index

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.scene import Scene
    from carom.trace import Vector

__all__ = ["TrueImpact", "TrueMotion", "UndecidedError", "true_motion"]

#: Decimal digits of the first pass. The least relative distance that a sweep asks for, a graze of 1e-15, costs 30 of
#: them in the discriminant; a chain of impacts loses at most about a digit an impact.
DIGITS = 120

#: Two passes agree where their values differ by less than this, relative: far below a float's rounding, far above the
#: digits lost.
AGREEMENT = Decimal("1e-30")


class UndecidedError(InputError):
    """The true motion can't be told: more impacts than allowed, or an order that no number of digits decides."""


@dataclass(frozen=True)
class TrueImpact:
    """One impact of the true motion, rounded to floats at the very end.

    Attributes:
        time_s: Seconds from the start.
        first: The disc, the lower number of two.
        second: The other disc, or the wall, ``wall_body(k)``.
    """

    time_s: float
    first: int
    second: int


@dataclass(frozen=True)
class TrueMotion:
    """What really happens in a scene, until its end.

    Attributes:
        impacts: All impacts, in order.
        final_position_m: Centre of each disc at the end, metres.
        final_velocity_m_s: Velocity of each disc at the end, metres a second.
        greatest_change_m_s: The greatest change of velocity that one impact makes to each disc, metres a second; 0
            for a disc that is never hit.
        convention: Whether two impacts share one instant and one movable disc, so that their order is a convention.
    """

    impacts: tuple[TrueImpact, ...]
    final_position_m: tuple[Vector, ...]
    final_velocity_m_s: tuple[Vector, ...]
    greatest_change_m_s: tuple[float, ...]
    convention: bool


def true_motion(scene: Scene, *, most_impacts: int = 1000) -> TrueMotion:
    """Return the true motion of a scene.

    Raises:
        UndecidedError: The scene has gravity or more impacts than `most_impacts`, or its order can't be decided.
    """
    if Need.GRAVITY in scene.needs:
        raise UndecidedError("the true motion under gravity is not worked out here")
    rough, fine = (_Motion(scene, digits) for digits in (DIGITS, 2 * DIGITS))
    rough.run(most_impacts)
    fine.run(most_impacts)
    if [event[1:] for event in rough.events] != [event[1:] for event in fine.events]:
        raise UndecidedError(f"the order of impacts of {scene.name!r} is not decided by {DIGITS} digits")
    for (a, *_), (b, *_) in zip(rough.events, fine.events, strict=True):
        if abs(a - b) > AGREEMENT * fine.end:
            raise UndecidedError(f"an instant of {scene.name!r} is not decided by {DIGITS} digits")
    return fine.rounded()


def _wall(px: Decimal, py: Decimal, nx: Decimal, ny: Decimal) -> tuple[Decimal, Decimal, Decimal, Decimal]:
    """Return a wall with its normal of length 1: a stored one is so to a float's rounding only."""
    length = (nx * nx + ny * ny).sqrt()
    return px, py, nx / length, ny / length


class _Motion:
    """Brute force with one number of digits."""

    def __init__(self, scene: Scene, digits: int) -> None:
        self.context = Context(prec=digits)
        self.tie = Decimal(10) ** (-digits // 2)
        self.scene = scene
        self.x = [Decimal(disc.position_m[0]) for disc in scene.discs]
        self.y = [Decimal(disc.position_m[1]) for disc in scene.discs]
        self.vx = [Decimal(disc.velocity_m_s[0]) for disc in scene.discs]
        self.vy = [Decimal(disc.velocity_m_s[1]) for disc in scene.discs]
        self.radius = [Decimal(disc.radius_m) for disc in scene.discs]
        with localcontext(self.context):
            self.weight = [Decimal(0) if disc.immovable else 1 / Decimal(disc.mass_kg) for disc in scene.discs]
            self.walls = [_wall(*map(Decimal, (*wall.point_m, *wall.normal))) for wall in scene.walls]
        self.end = Decimal(scene.duration_s)
        self.now = Decimal(0)
        self.events: list[tuple[Decimal, int, int]] = []
        self.convention = False
        self.change = [Decimal(0)] * len(self.x)
        self._upcoming: dict[tuple[int, int], Decimal] = {}

    def run(self, most: int) -> None:
        with localcontext(self.context):
            self._predict(self._pairs())
            last: tuple[int, int] | None = None
            since: dict[int, Decimal] = {}
            while (event := self._next(last)) is not None:
                if len(self.events) == most:
                    raise UndecidedError(f"{self.scene.name!r} has more than {most} impacts")
                time, pair = event
                self._move_to(time)
                touched = [body for body in pair if body >= 0 and self.weight[body] > 0]
                if any(body in since and time - since[body] <= self.tie * self.end for body in touched):
                    self.convention = True
                since.update(dict.fromkeys(touched, time))
                before = {body: (self.vx[body], self.vy[body]) for body in touched}
                self._collide(*pair)
                for body, (vx, vy) in before.items():
                    change = ((self.vx[body] - vx) ** 2 + (self.vy[body] - vy) ** 2).sqrt()
                    self.change[body] = max(self.change[body], change)
                self.events.append((time, *pair))
                last = pair
                self._predict(self._pairs(set(touched)))
            self._move_to(self.end)

    def rounded(self) -> TrueMotion:
        return TrueMotion(
            impacts=tuple(TrueImpact(float(time), first, second) for time, first, second in self.events),
            final_position_m=tuple((float(x), float(y)) for x, y in zip(self.x, self.y, strict=True)),
            final_velocity_m_s=tuple((float(x), float(y)) for x, y in zip(self.vx, self.vy, strict=True)),
            greatest_change_m_s=tuple(map(float, self.change)),
            convention=self.convention,
        )

    def _pairs(self, changed: set[int] | None = None) -> Iterator[tuple[int, int]]:
        n = len(self.x)
        discs = range(n)
        if changed is None:
            yield from combinations(discs, 2)
            yield from ((i, wall_body(k)) for i in discs for k in range(len(self.walls)))
            return
        for i in sorted(changed):
            yield from ((min(i, j), max(i, j)) for j in discs if j != i)
            yield from ((i, wall_body(k)) for k in range(len(self.walls)))

    def _predict(self, pairs: Iterator[tuple[int, int]]) -> None:
        for first, second in pairs:
            wait = self._wall_wait(first, wall_index(second)) if second < 0 else self._pair_wait(first, second)
            if wait is None:
                self._upcoming.pop((first, second), None)
            else:
                self._upcoming[first, second] = self.now + wait

    def _next(self, last: tuple[int, int] | None) -> tuple[Decimal, tuple[int, int]] | None:
        """Return the earliest impact; of impacts at one instant, that of the lower body numbers."""
        # The two that have just parted can't meet again before something else has happened to one of them.
        times = {pair: time for pair, time in self._upcoming.items() if pair != last}
        if not times or (earliest := min(times.values())) > self.end:
            return None
        together = [pair for pair, time in times.items() if time - earliest <= self.tie * self.end]
        return earliest, min(together, key=lambda pair: (pair[0], pair[1] if pair[1] >= 0 else math.inf))

    def _pair_wait(self, i: int, j: int) -> Decimal | None:
        if self.weight[i] == self.weight[j] == 0:
            return None
        dx, dy = self.x[j] - self.x[i], self.y[j] - self.y[i]
        ux, uy = self.vx[j] - self.vx[i], self.vy[j] - self.vy[i]
        approach = dx * ux + dy * uy
        if approach >= 0:
            return None
        contact = self.radius[i] + self.radius[j]
        apart = dx * dx + dy * dy - contact * contact
        if apart <= 0:
            return Decimal(0)
        speed2 = ux * ux + uy * uy
        discriminant = approach * approach - speed2 * apart
        if discriminant <= 0:
            return None
        return apart / (discriminant.sqrt() - approach)

    def _wall_wait(self, i: int, wall: int) -> Decimal | None:
        px, py, nx, ny = self.walls[wall]
        approach = self.vx[i] * nx + self.vy[i] * ny
        if self.weight[i] == 0 or approach >= 0:
            return None
        apart = (self.x[i] - px) * nx + (self.y[i] - py) * ny - self.radius[i]
        return max(apart, Decimal(0)) / -approach

    def _move_to(self, time: Decimal) -> None:
        wait = max(time - self.now, Decimal(0))
        self.x = [x + v * wait for x, v in zip(self.x, self.vx, strict=True)]
        self.y = [y + v * wait for y, v in zip(self.y, self.vy, strict=True)]
        self.now = time

    def _collide(self, i: int, j: int) -> None:
        if j < 0:
            _, _, nx, ny = self.walls[wall_index(j)]
            back = (1 + Decimal(self.scene.wall_restitution)) * (self.vx[i] * nx + self.vy[i] * ny)
            self.vx[i] -= back * nx
            self.vy[i] -= back * ny
            return
        dx, dy = self.x[j] - self.x[i], self.y[j] - self.y[i]
        closing = (self.vx[i] - self.vx[j]) * dx + (self.vy[i] - self.vy[j]) * dy
        push = (1 + Decimal(self.scene.restitution)) * closing
        push /= (dx * dx + dy * dy) * (self.weight[i] + self.weight[j])
        self.vx[i] -= push * self.weight[i] * dx
        self.vy[i] -= push * self.weight[i] * dy
        self.vx[j] += push * self.weight[j] * dx
        self.vy[j] += push * self.weight[j] * dy
