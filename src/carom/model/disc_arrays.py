"""Discs and walls as arrays: the input of solvers.

A scene of a million discs would consist of a million validated objects. Arrays with the same numbers are built in
milliseconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.errors import InputError
from carom.model.chain_geometry import Outline
from carom.model.prescribed_motion import Drive
from carom.support.escaping import format_value
from carom.support.formatting import format_number
from carom.support.limits import LARGEST, ORDINARY, require_within

#: A half-plane wall: a point on its surface, and the unit normal that points to the discs' side, as x, y, nx, ny.
HalfPlane = tuple[float, float, float, float]

#: Greatest allowed difference between a normal's length and 1. The limit is four times the effect of rounding.
_UNIT_WITHIN = 2.0**-50

#: Path of a body that does not move.
STANDS = Drive.along([(0.0, (0.0, 0.0))])


class Material(NamedTuple):
    """Coefficients of restitution and Coulomb friction of a wall."""

    restitution: float
    friction: float


@dataclass(frozen=True, eq=False)
class DiscArrays:
    """The initial state of a run, as arrays. Two instances are equal only if they are the same object.

    Discs must not overlap. An event-driven run checks this at its start.

    Attributes:
        position_m: Centres at time 0, shape ``(n, 2)``, in metres.
        velocity_m_s: Velocities, shape ``(n, 2)``, in m/s.
        radius_m: Radii, shape ``(n,)``, in metres, above 0.
        mass_kg: Masses, shape ``(n,)``, in kilograms, above 0; infinity for an immovable disc.
        walls: For each half-plane ``(x, y, nx, ny)``: a point of its surface, and the unit normal that points to the
            discs' side. For each finite wall, its `Outline`.
        restitution: Coefficient of restitution of every pair of discs, 0 to 1.
        wall_restitution: Coefficient of restitution between any disc and any wall, 0 to 1.
        spin_rad_s: Spins at time 0, counterclockwise, shape ``(n,)``, in rad/s; None if all are 0.
        inertia_factor: Moments of inertia divided by mass times radius squared, shape ``(n,)``, above 0 and up to 1;
            infinity for a disc that can't turn. None if all are 1/2.
        friction: Coulomb's coefficient of friction of every pair of discs, 0 or more.
        wall_friction: Coulomb's coefficient of friction between any disc and any wall, 0 or more.
        tangential_restitution: Tangential restitution of two discs, -1 to 1; see `carom.Scene`.
        wall_tangential_restitution: Tangential restitution between any disc and any wall, -1 to 1.
        wall_materials: Coefficients of each wall; None if all walls have `wall_restitution` and `wall_friction`.
        wall_drives: Path of each wall; None if no wall is driven. `walls` contains the positions at time 0.
        belts_m_s: Speed of each wall's surface, in m/s; positive to the left of the normal that points to the disc.
            None if no surface moves.
        driven_discs: Numbers of the driven discs, ascending. Driven discs have infinite masses.
        disc_drives: Path of each driven disc.

    Examples:
        >>> import numpy as np
        >>> start = carom.DiscArrays(
        ...     position_m=np.array([[0.0, 0.0], [3.0, 0.0]]),
        ...     velocity_m_s=np.array([[1.0, 0.0], [0.0, 0.0]]),
        ...     radius_m=np.full(2, 0.5),
        ...     mass_kg=np.ones(2),
        ... )
        >>> run = carom.EventDrivenRun(start)
        >>> run.advance_to(5.0).name, run.counts["impacts"]
        ('COMPLETED', 1)
    """

    position_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    mass_kg: NDArray[np.float64]
    walls: tuple[HalfPlane | Outline, ...] = ()
    restitution: float = 1.0
    wall_restitution: float = 1.0
    spin_rad_s: NDArray[np.float64] | None = None
    inertia_factor: NDArray[np.float64] | None = None
    friction: float = 0.0
    wall_friction: float = 0.0
    tangential_restitution: float = 0.0
    wall_tangential_restitution: float = 0.0
    wall_materials: tuple[Material, ...] | None = None
    wall_drives: tuple[Drive, ...] | None = None
    belts_m_s: tuple[float, ...] | None = None
    driven_discs: tuple[int, ...] = ()
    disc_drives: tuple[Drive, ...] = ()

    def __post_init__(self) -> None:
        """Check shapes and values.

        Raises:
            InputError: A shape is wrong. A value is not finite, or is outside the limits of `carom.support.limits`. A
                radius or mass is not positive. An immovable disc has a velocity, or a disc that can't turn has a spin.
                A coefficient is outside its range.
        """
        for name in ("position_m", "velocity_m_s", "radius_m", "mass_kg"):
            if not isinstance(getattr(self, name), np.ndarray):
                raise InputError(f"{name} must be a NumPy array, got {format_value(getattr(self, name))}")
        n = len(self.position_m)
        if n == 0:
            raise InputError("position_m must hold at least one disc")
        shapes: dict[str, tuple[int, ...]] = {"position_m": (n, 2), "velocity_m_s": (n, 2)}
        shapes |= dict.fromkeys(("radius_m", "mass_kg", "spin_rad_s", "inertia_factor"), (n,))
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise InputError(f"{name} must have the shape {shape}, got {array.shape}")
        if not (np.all(self.radius_m > 0) and np.all(self.mass_kg > 0)):
            raise InputError("radius_m and mass_kg must be above 0 everywhere")
        self._require_walls()
        self._require_sound_turning()
        self.require_ordinary()
        if np.any(self.velocity_m_s[self._is_stationary]):
            raise InputError("velocity_m_s must be (0, 0) for an immovable disc (mass_kg = inf)")

    def _require_walls(self) -> None:
        for k, wall in enumerate(self.walls):
            if isinstance(wall, Outline):
                continue
            if not (isinstance(wall, tuple) and len(wall) == 4 and all(isinstance(one, int | float) for one in wall)):
                raise InputError(
                    f"walls[{k}] must be four numbers (x, y, nx, ny) or an Outline, got {format_value(wall)}",
                    hints=["scene.arrays contains the walls of a scene in this form"],
                )
            if not abs(math.hypot(*wall[2:]) - 1.0) <= _UNIT_WITHIN:
                raise InputError(f"walls[{k}] must have a normal of length 1, got {wall[2:]}")

    def _require_sound_turning(self) -> None:
        for law, least, most in (("restitution", 0, 1), ("friction", 0, LARGEST), ("tangential_restitution", -1, 1)):
            for name in (law, f"wall_{law}"):
                if not least <= (value := getattr(self, name)) <= most:
                    raise InputError(f"{name} must be from {least} to {format_number(most, 3)}, got {value}")
        spin, inertia = self.spins, self.inertia
        if not np.all(((inertia >= 1.0 / ORDINARY) & (inertia <= 1)) | (inertia == math.inf)):
            raise InputError(
                f"inertia_factor must be from {format_number(1 / ORDINARY, 3)} to 1, or infinite, for every disc"
            )
        if np.any(spin[self._is_stationary | (self.movable & (inertia == math.inf))]):
            raise InputError("spin_rad_s must be 0 for a disc that can't turn (mass_kg or inertia_factor = inf)")

    def require_ordinary(self) -> None:
        """Refuse numbers that are so large, and radii and masses that are so small, that results would be wrong.

        Raises:
            InputError: The message names the attribute, the value and the limits.
        """
        for name, array, lower in (
            ("position_m", self.position_m, 0.0),
            ("velocity_m_s", self.velocity_m_s, 0.0),
            ("radius_m", self.radius_m, 1.0 / ORDINARY),
            ("mass_kg", self.mass_kg[~np.isinf(self.mass_kg)], 1.0 / ORDINARY),
            ("radius_m times spin_rad_s", self.surface_speed_m_s, 0.0),
            ("walls", self._wall_lengths, 0.0),
        ):
            require_within(name, array, lower, ORDINARY)

    @classmethod
    def of_valid(cls, **fields: Any) -> DiscArrays:
        """Return a scene's state as read-only arrays, without checks, because the scene has checked the same values."""
        start = object.__new__(cls)
        start.__dict__.update(fields)
        for array in fields.values():
            if isinstance(array, np.ndarray):
                array.flags.writeable = False
        return start

    def __len__(self) -> int:
        return len(self.position_m)

    @property
    def movable(self) -> NDArray[np.bool_]:
        """Whether impacts move each disc, shape ``(n,)``."""
        return np.isfinite(self.mass_kg)

    @property
    def _is_stationary(self) -> NDArray[np.bool_]:
        is_fixed = ~self.movable
        is_fixed[list(self.driven_discs)] = False
        return is_fixed

    @property
    def driven(self) -> bool:
        """Whether a wall or disc is driven, or the surface of a wall moves."""
        return bool(self.driven_discs) or self.wall_drives is not None or self.belts_m_s is not None

    def drive_of_wall(self, k: int) -> Drive:
        """Return the path of wall `k`."""
        return STANDS if self.wall_drives is None else self.wall_drives[k]

    def belt_of_wall(self, k: int) -> float:
        """Return the speed of the surface of wall `k`, in m/s."""
        return 0.0 if self.belts_m_s is None else self.belts_m_s[k]

    @property
    def spins(self) -> NDArray[np.float64]:
        """Spin of each disc at the start, shape ``(n,)``, in rad/s."""
        return np.zeros(len(self)) if self.spin_rad_s is None else self.spin_rad_s

    @property
    def inertia(self) -> NDArray[np.float64]:
        """Moment of inertia of each disc divided by mass times radius squared, shape ``(n,)``."""
        return np.full(len(self), 0.5) if self.inertia_factor is None else self.inertia_factor

    @property
    def surface_speed_m_s(self) -> NDArray[np.float64]:
        """Spin times radius of each disc, shape ``(n,)``, in m/s, positive if counterclockwise."""
        return self.radius_m * self.spins

    @property
    def has_disc_friction(self) -> bool:
        """Whether friction can act between two discs."""
        return self.friction > 0.0 and len(self) > 1

    @property
    def has_wall_friction(self) -> bool:
        """Whether friction can act between a disc and a wall."""
        return any(material.friction > 0.0 for material in self.materials)

    @property
    def has_friction(self) -> bool:
        """Whether friction can act between any two bodies."""
        return self.has_disc_friction or self.has_wall_friction

    @cached_property  # computing this property takes a quarter of the time for solving two discs
    def turns(self) -> bool:
        """Whether discs spin, or friction can make them spin. In other cases, a run stores no spins."""
        return self.has_friction or bool(self.spins.any())

    @cached_property
    def is_ordinary(self) -> bool:
        """Whether the absolute value of each number is 0, infinite, or from ``1 / ORDINARY`` to `ORDINARY`."""
        lengths = (self.position_m, self.radius_m, self._wall_lengths)
        measures = (*lengths, self.velocity_m_s, self.driven_speeds, self.mass_kg, self.surface_speed_m_s)
        size = np.abs(np.concatenate([array.ravel() for array in measures]))
        return bool((((size >= 1.0 / ORDINARY) & (size <= ORDINARY)) | (size == 0.0) | (size == math.inf)).all())

    @property
    def _wall_lengths(self) -> NDArray[np.float64]:
        return np.array([length for wall in self.walls for length in list_wall_lengths(wall)])

    @property
    def driven_speeds(self) -> NDArray[np.float64]:
        """All velocity components of driven bodies and all belt speeds, in m/s. Some numbers are negative."""
        drives = (*(self.wall_drives or ()), *self.disc_drives)
        speeds = [part for drive in drives for leg in drive.legs for part in leg.velocity]
        return np.array([*speeds, *(self.belts_m_s or ())], np.float64)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Coefficients of each wall."""
        if self.wall_materials is not None:
            return self.wall_materials
        return (Material(self.wall_restitution, self.wall_friction),) * len(self.walls)

    def restitution_of(self, second: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the coefficient of restitution of each impact. `second` contains the numbers of the second bodies."""
        return _select(second, [material.restitution for material in self.materials], self.restitution)

    def friction_of(self, second: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the coefficient of friction of each impact. `second` contains the numbers of the second bodies."""
        return _select(second, [material.friction for material in self.materials], self.friction)

    def belt_speeds_of(self, second: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the speed of the second body's surface at each impact, in m/s; 0 for discs."""
        return _select(second, [self.belt_of_wall(k) for k in range(len(self.walls))], 0.0)

    @cached_property
    def has_half_planes(self) -> bool:
        """Whether no wall is a chain or circle."""
        return all(isinstance(wall, tuple) for wall in self.walls)

    @property
    def has_plain_walls(self) -> bool:
        """Whether all walls are half-planes, and all have the scene's coefficients of restitution and friction."""
        return self.wall_materials is None and self.has_half_planes

    def half_planes(self) -> tuple[HalfPlane, ...]:
        """Return the walls, which must be half-planes with the scene's coefficients.

        Raises:
            InputError: A wall is not a half-plane, or has its own coefficients.
        """
        if self.wall_materials is not None:
            raise InputError("walls have their own restitution or friction, which the caller does not support")
        planes = tuple(wall for wall in self.walls if isinstance(wall, tuple))
        if len(planes) < len(self.walls):
            number, shape = next((k, wall) for k, wall in enumerate(self.walls) if not isinstance(wall, tuple))
            raise InputError(f"wall {number} is not a half-plane; the caller does not support {shape.description}")
        return planes


def _select(second: NDArray[np.int64], of_walls: list[float], of_discs: float) -> NDArray[np.float64]:
    """Return the value for each impact's second body: an entry of `of_walls` for a wall, `of_discs` for a disc."""
    return np.where(second < 0, np.array(of_walls or [math.nan])[np.maximum(-1 - second, 0)], of_discs)


def list_wall_lengths(wall: HalfPlane | Outline) -> tuple[float, ...]:
    """Return the coordinates and radii of a wall, in metres. Some coordinates are negative."""
    return wall[:2] if isinstance(wall, tuple) else wall.lengths
