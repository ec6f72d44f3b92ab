"""Discs and walls as arrays: what the event-driven kernel starts from, and the way in for a million discs.

A scene of a million discs is a million validated objects; as arrays the same state takes milliseconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.scene import Scene

__all__ = ["DiscArrays"]


@dataclass(frozen=True)
class DiscArrays:
    """The start of an event-driven run, which refuses one in which discs overlap.

    Attributes:
        position_m: Centres at time 0, shape ``(n, 2)``, metres.
        velocity_m_s: Velocities, shape ``(n, 2)``, metres a second.
        radius_m: Radii, shape ``(n,)``, metres, above 0.
        mass_kg: Masses, shape ``(n,)``, kilograms, above 0; infinity is an immovable disc.
        walls: ``(x, y, nx, ny)`` of each wall: a point, and the unit normal into the free side.
        restitution: Of every pair of discs, 0 to 1.
        wall_restitution: Of every disc and wall, 0 to 1.
    """

    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    mass_kg: NDArray[np.float64]
    walls: tuple[tuple[float, float, float, float], ...] = ()
    restitution: float = 1.0
    wall_restitution: float = 1.0

    def __post_init__(self) -> None:
        """Check shapes and values.

        Raises:
            InputError: A shape does not fit, a value is not finite, a radius or mass not positive, an immovable disc
                moves, or a restitution is outside 0 to 1.
        """
        n = len(self.position_m)
        if n == 0:
            raise InputError("position_m must hold at least one disc")
        for name, shape in (("position_m", (n, 2)), ("velocity_m_s", (n, 2)), ("radius_m", (n,)), ("mass_kg", (n,))):
            array = getattr(self, name)
            if array.shape != shape:
                raise InputError(f"{name} must have the shape {shape}, got {array.shape}")
            if name != "mass_kg" and not np.all(np.isfinite(array)):
                raise InputError(f"{name} must be finite everywhere")
        if not (np.all(self.radius_m > 0) and np.all(self.mass_kg > 0)):
            raise InputError("radius_m and mass_kg must be above 0 everywhere")
        if np.any(self.velocity_m_s[np.isinf(self.mass_kg)]):
            raise InputError("velocity_m_s must be (0, 0) for an immovable disc (mass_kg = inf)")
        if not (0 <= self.restitution <= 1 and 0 <= self.wall_restitution <= 1):
            raise InputError("restitution and wall_restitution must lie in 0 to 1")

    @classmethod
    def from_scene(cls, scene: Scene) -> DiscArrays:
        """Return the start of a scene; its gravity is not part of it."""
        discs = scene.discs
        return cls(
            np.array([disc.position_m for disc in discs]),
            np.array([disc.velocity_m_s for disc in discs]),
            np.array([disc.radius_m for disc in discs]),
            np.array([disc.mass_kg for disc in discs]),
            tuple((*wall.point_m, *wall.normal) for wall in scene.walls),
            scene.restitution,
            scene.wall_restitution,
        )

    def __len__(self) -> int:
        return len(self.position_m)

    @property
    def largest_reach(self) -> float:
        """Largest contact distance of two discs, metres."""
        largest = np.partition(self.radius_m, -2)[-2:] if len(self) > 1 else self.radius_m * 2
        return math.fsum(largest)
