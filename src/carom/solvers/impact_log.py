"""The impacts of a run as they happen: recorded, and watched for the two ways in which they can lose their meaning."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.trace import ImpactRecord, Vector

__all__ = ["ImpactLog"]

#: Equal discs in a line make at most n(n-1)/2 impacts altogether, and all of them at one instant if they touch. Masses
#: 1:100 against a wall make 31, 1:10,000 make 314. A hundred times the square of the number of bodies lets all of these
#: through, and ends a run in which time stands still after milliseconds.
STANDSTILL_IMPACTS_PER_SQUARED_BODIES = 100


class _Instant(NamedTuple):
    """When and in which direction a disc was struck."""

    time_s: float
    resolution_s: float
    normal: Vector

    def may_equal(self, other: _Instant) -> bool:
        """Whether the two are one instant as far as the arithmetic can tell."""
        return abs(self.time_s - other.time_s) <= self.resolution_s + other.resolution_s

    def interferes_with(self, other: _Instant) -> bool:
        """Whether the one impulse changes what the other impact sees: not where they are exactly orthogonal."""
        return self.normal[0] * other.normal[0] + self.normal[1] * other.normal[1] != 0.0

    def is_parallel_to(self, other: _Instant) -> bool:
        """Whether both normals lie on one line."""
        return self.normal[0] * other.normal[1] == self.normal[1] * other.normal[0]

    @property
    def reach_s(self) -> float:
        """The latest that it can have been."""
        return self.time_s + self.resolution_s


def _two_that_matter(instants: list[_Instant]) -> list[_Instant]:
    """Leave out the instants that change no later answer: a thousand impacts at one instant cost no more than two.

    No direction is orthogonal to two that are not parallel. So of all that reach as far as some later impact, the one
    that reaches furthest interferes with it, or else the one that reaches furthest of those not parallel to that one
    does, if any does.
    """
    furthest = max(instants, key=lambda instant: instant.reach_s)
    across = [instant for instant in instants if not instant.is_parallel_to(furthest)]
    return [furthest, max(across, key=lambda instant: instant.reach_s)] if across else [furthest]


class ImpactLog:
    """Impacts in order, those without a unique answer, and whether time has come to a standstill."""

    def __init__(self, scene: Scene) -> None:
        self.records: list[ImpactRecord] = []
        self.ambiguous: list[int] = []
        self._movable = [not disc.immovable for disc in scene.discs]
        self._instant = -1.0
        self._impacts_now = 0
        self._latest: dict[int, list[_Instant]] = {}
        self._standstill = STANDSTILL_IMPACTS_PER_SQUARED_BODIES * (len(scene.discs) + len(scene.walls)) ** 2

    def add(self, record: ImpactRecord, resolution_s: float = 0.0) -> None:
        """Append one impact, whose instant is known to `resolution_s` either way.

        It is ambiguous when one of its movable discs has had another impact at what may be the very same instant,
        unless the two normals are exactly orthogonal: then neither impulse changes what the other sees, and the order
        does not matter. Two instants may be the same where their difference is no more than rounding makes of it.
        """
        if record.time_s != self._instant:
            self._instant = record.time_s
            self._impacts_now = 0
        self._impacts_now += 1
        instant = _Instant(record.time_s, resolution_s, record.normal)
        shared = False
        for body in (record.first, record.second):
            if body >= 0 and self._movable[body]:
                latest = self._latest.get(body, [])
                shared = shared or any(instant.may_equal(other) and instant.interferes_with(other) for other in latest)
                self._latest[body] = _two_that_matter([*latest, instant])
        if shared:
            self.ambiguous.append(len(self.records))
        self.records.append(record)

    @property
    def at_standstill(self) -> bool:
        """Whether impacts follow one another without the clock advancing by even one unit in the last place."""
        return self._impacts_now > self._standstill
