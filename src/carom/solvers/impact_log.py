"""The impacts of a run as they happen: recorded, and watched for the two ways in which they can lose their meaning."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.trace import ImpactRecord, Vector

__all__ = ["ImpactLog"]

#: Equal discs in a line make at most n(n-1)/2 impacts altogether, and all of them at one instant if they touch. Masses
#: 1:100 against a wall make 31, 1:10,000 make 314. A hundred times the square of the number of bodies lets all of these
#: through, and ends a run in which time stands still after milliseconds.
STANDSTILL_IMPACTS_PER_SQUARED_BODIES = 100


class ImpactLog:
    """Impacts in order, those without a unique answer, and whether time has come to a standstill."""

    def __init__(self, scene: Scene) -> None:
        self.records: list[ImpactRecord] = []
        self.ambiguous: list[int] = []
        self._movable = [not disc.immovable for disc in scene.discs]
        self._instant = -1.0
        self._normals_now: dict[int, list[Vector]] = {}
        self._impacts_now = 0
        self._standstill = STANDSTILL_IMPACTS_PER_SQUARED_BODIES * (len(scene.discs) + len(scene.walls)) ** 2

    def add(self, record: ImpactRecord) -> None:
        """Append one impact.

        It is ambiguous when one of its movable discs has had another impact at the very same instant, unless the two
        normals are exactly orthogonal: then neither impulse changes what the other sees, and the order does not matter.
        """
        if record.time_s != self._instant:
            self._instant = record.time_s
            self._normals_now.clear()
            self._impacts_now = 0
        self._impacts_now += 1
        nx, ny = record.normal
        shared = False
        for body in (record.first, record.second):
            if body >= 0 and self._movable[body]:
                normals = self._normals_now.setdefault(body, [])
                shared = shared or any(nx * mx + ny * my != 0.0 for mx, my in normals)
                normals.append(record.normal)
        if shared:
            self.ambiguous.append(len(self.records))
        self.records.append(record)

    @property
    def at_standstill(self) -> bool:
        """Whether impacts follow one another without the clock advancing by even one unit in the last place."""
        return self._impacts_now > self._standstill
