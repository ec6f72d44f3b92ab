"""Discs and walls as arrays: what every solver of straight paths starts from, and the way in for a million discs.

A scene of a million discs is a million validated objects; as arrays the same state takes milliseconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.limits import ORDINARY, require_within
from carom.overlap import Overlap, overlaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["DiscArrays"]


@dataclass(frozen=True, eq=False)
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
            InputError: A shape does not fit, a value is not finite or not of an ordinary size (`carom.limits`), a
                radius or mass not positive, an immovable disc moves, or a restitution is outside 0 to 1.
        """
        n = len(self.position_m)
        if n == 0:
            raise InputError("position_m must hold at least one disc")
        for name, shape in (("position_m", (n, 2)), ("velocity_m_s", (n, 2)), ("radius_m", (n,)), ("mass_kg", (n,))):
            array = getattr(self, name)
            if array.shape != shape:
                raise InputError(f"{name} must have the shape {shape}, got {array.shape}")
        if not (np.all(self.radius_m > 0) and np.all(self.mass_kg > 0)):
            raise InputError("radius_m and mass_kg must be above 0 everywhere")
        self.require_ordinary()
        if np.any(self.velocity_m_s[np.isinf(self.mass_kg)]):
            raise InputError("velocity_m_s must be (0, 0) for an immovable disc (mass_kg = inf)")
        if not (0 <= self.restitution <= 1 and 0 <= self.wall_restitution <= 1):
            raise InputError("restitution and wall_restitution must lie in 0 to 1")

    def require_ordinary(self) -> None:
        """Refuse sizes beyond those that are computed with as they are; speeds, and coordinates, may be smaller.

        Raises:
            InputError: The message names the attribute, the value, and the limits.
        """
        for name, array, least in (
            ("position_m", self.position_m, 0.0),
            ("velocity_m_s", self.velocity_m_s, 0.0),
            ("radius_m", self.radius_m, 1.0 / ORDINARY),
            ("mass_kg", self.mass_kg[~np.isinf(self.mass_kg)], 1.0 / ORDINARY),
            ("walls", np.array([wall[:2] for wall in self.walls]), 0.0),
        ):
            require_within(name, array, least, ORDINARY)

    @classmethod
    def of_valid(cls, **fields: Any) -> DiscArrays:
        """Return the start of a scene, whose fields have been checked one by one, as read-only arrays."""
        start = object.__new__(cls)
        start.__dict__.update(fields)
        for name in ("position_m", "velocity_m_s", "radius_m", "mass_kg"):
            fields[name].flags.writeable = False
        return start

    def __len__(self) -> int:
        return len(self.position_m)

    @property
    def movable(self) -> NDArray[np.bool_]:
        """Whether an impact moves each disc, shape ``(n,)``."""
        return np.isfinite(self.mass_kg)

    @cached_property
    def is_ordinary(self) -> bool:
        """Whether every number but 0 and infinity is of an ordinary size, see `carom.limits`."""
        points = np.array([wall[:2] for wall in self.walls])
        sizes = [np.abs(array) for array in (self.position_m, self.velocity_m_s, self.radius_m, self.mass_kg, points)]
        return all(
            np.all(((size >= 1.0 / ORDINARY) & (size <= ORDINARY)) | (size == 0.0) | (size == math.inf))
            for size in sizes
        )

    def overlaps(self, disc_name: str, wall_name: str) -> tuple[list[Overlap], bool]:
        """Return the first overlaps of bodies, named as in `carom.overlap.overlaps`, and whether there are more."""
        walls = np.array(self.walls).reshape(-1, 4)
        return overlaps(self.position_m, self.radius_m, self.movable, walls, disc_name, wall_name)

    def require_apart(self) -> None:
        """Refuse a start in which two discs, or a disc and a wall, overlap by more than rounding can explain.

        Raises:
            InputError: Bodies overlap; the message names the first ten pairs of each kind.
        """
        found, more = self.overlaps("disc {}", "wall {}")
        if found:
            lines = [f"position_m[{overlap.disc}] {overlap.message}" for overlap in found]
            raise InputError("\n".join([*lines, "and more of them"] if more else lines))
