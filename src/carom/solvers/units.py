"""Units of a run.

A scene with extremely large or small numbers is converted to units in which the numbers are neither large nor small.
The units are powers of two times SI units, so the conversion causes no rounding.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.model.damping import Damping
from carom.model.disc_arrays import DiscArrays
from carom.model.prescribed_motion import Drive
from carom.model.scene import Scene
from carom.model.sizes import Sizes
from carom.model.trace import SPIN_DTYPE, Outcome, Vector
from carom.solvers.run import Progress, ScaledScene, SeenRun, Start
from carom.support.limits import ORDINARY

Array = NDArray[np.float64]
_LEAST = 1.0 / ORDINARY
#: Binary exponent of the greatest speed in the new units. The exponent is above 0, because other speeds are mostly
#: smaller. The exponent is far below that of `ORDINARY`, so that gravity is not too large even if it causes this speed
#: in a short scene.
_FASTEST = 100


class Units(NamedTuple):
    """Exponents of the units of length, time and mass, which are powers of two times a metre, second and kilogram."""

    length: int
    time: int
    mass: int

    def convert_scene(self, scene: Scene) -> Start:
        """Convert a scene from SI units to the units of this object. The result is the start of a run."""
        if self == SI:
            return scene
        start, speed = scene.arrays, self.length - self.time
        scaled = {field.name: getattr(start, field.name) for field in fields(start)}
        for name, exponent in (
            *(("position_m", -self.length), ("radius_m", -self.length), ("mass_kg", -self.mass)),
            *(("velocity_m_s", -speed), ("spin_rad_s", self.time)),
        ):
            scaled[name] = np.ldexp(scaled[name], exponent)
        scaled["walls"] = tuple(
            (*_scale_vector(wall[:2], -self.length), *wall[2:])
            if isinstance(wall, tuple)
            else wall.scale_lengths(self.length)
            for wall in start.walls
        )
        for name in ("wall_drives", "disc_drives"):
            if drives := scaled[name]:
                scaled[name] = tuple(self._convert_drive(drive) for drive in drives)
        if start.belts_m_s is not None:
            scaled["belts_m_s"] = tuple(_scale_by_power(belt, -speed) for belt in start.belts_m_s)
        return ScaledScene(
            DiscArrays.of_valid(**scaled),
            _scale_vector(scene.gravity_m_s2, self.time - speed),
            scene.wall_rolling_resistance,
            _scale_by_power(scene.table_deceleration_m_s2, self.time - speed),
            self.from_seconds(scene.duration_s),
        )

    def _convert_drive(self, drive: Drive) -> Drive:
        speed = self.length - self.time
        return Drive.along((self.from_seconds(leg.begin_s), _scale_vector(leg.velocity, -speed)) for leg in drive.legs)

    def from_seconds(self, time_s: float) -> float:
        """Convert a time from seconds to the units of this object."""
        return _scale_by_power(time_s, -self.time)

    def to_seconds(self, time: float) -> float:
        """Convert a time from the units of this object to seconds."""
        return _scale_by_power(time, self.time)

    def from_hertz(self, rate: float) -> float:
        """Convert a frequency from 1/s to the units of this object."""
        return _scale_by_power(rate, self.time)

    def convert_damping(self, per_s: float) -> Damping:
        """Convert a damping rate from 1/s to the units of this object. The result is at most the largest float."""
        return Damping(min(self.from_hertz(per_s), sys.float_info.max))

    def convert_rows(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        """Convert rows of impacts, spins or modes from the units of this object to SI units."""
        in_si = rows.copy()
        speed = self.length - self.time
        powers = dict.fromkeys(SPIN_DTYPE.names or (), -self.time) | {
            "time_s": self.time,
            "position": self.length,
            "acceleration": speed - self.time,
            "spin": -self.time,
            "spin_rate": -2 * self.time,
        }
        for name in rows.dtype.names or ():
            if name.startswith("velocity") or name in powers:
                in_si[name] = np.ldexp(rows[name], powers.get(name, speed))
        return in_si


SI = Units(0, 0, 0)


def choose_units(scene: Scene) -> Units:
    """Return the units in which to run a scene. If all numbers have ordinary sizes, SI units are returned."""
    if _is_ordinary(scene):
        return SI
    sizes = Sizes.of(scene.arrays, scene.gravity_m_s2, scene.duration_s)
    length = _compute_middle_exponent(sizes.radius, max(sizes.length, sizes.way))
    if sizes.speed > 0.0:
        time = length + _FASTEST - _compute_exponent(sizes.speed)
    else:
        time = _compute_exponent(sizes.duration)
    return Units(length, time, _compute_middle_exponent(sizes.lightest, sizes.heaviest))


def run_in_ordinary_units(scene: Scene, make: Callable[[Start, Units], Any]) -> Any:
    """Return a run that computes in the units of `choose_units` and has results in SI units.

    The function `make` builds the run that computes.
    """
    units = choose_units(scene)
    run = make(units.convert_scene(scene), units)
    return run if units == SI else RunInUnits(run, units)


class RunInUnits(SeenRun):
    """A PIC or PIT run that computes in other units and has results in SI units; implements `carom.solvers.run.Run`."""

    def __init__(self, run: Any, units: Units) -> None:
        super().__init__(run, lambda rows, _: units.convert_rows(rows))
        self._of_frames = run
        self._units = units

    @property
    def frames(self) -> int:
        """Number of frames of a PIT run so far."""
        return self._run.counts["frames"]

    def advance_frames(self, frames: int) -> None:
        """Compute this many frames of PIT. Afterwards, `time_s` is the time of the next frame."""
        self._of_frames.advance_frames(frames)

    @property
    def time_s(self) -> float:
        """Time that the run has reached, in seconds from the start."""
        return self._units.to_seconds(self._run.time_s)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Apply every impact up to and including `time_s`, or stop after `max_impacts` impacts in all."""
        report = None if progress is None else lambda impacts, time: progress(impacts, self._units.to_seconds(time))
        return self._run.advance_to(self._units.from_seconds(time_s), max_impacts, report)

    def positions(self) -> Array:
        """Return the current centres, in metres, shape ``(n, 2)``."""
        return np.ldexp(self._run.positions(), self._units.length)

    def velocities(self) -> Array:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""
        return np.ldexp(self._run.velocities(), self._units.length - self._units.time)

    def spins(self) -> Array | None:
        """Return the current spins, in rad/s; None if no disc turns."""
        spins = self._run.spins()
        return None if spins is None else np.ldexp(spins, -self._units.time)


def _is_ordinary(scene: Scene) -> bool:
    other_numbers = (scene.duration_s, *scene.gravity_m_s2)
    return scene.arrays.is_ordinary and all(
        _LEAST <= abs(number) <= ORDINARY or number == 0.0 for number in other_numbers
    )


def _compute_middle_exponent(smallest: float, largest: float) -> int:
    """Return the mean of the binary exponents of two numbers, rounded down."""
    return (_compute_exponent(smallest) + _compute_exponent(largest)) // 2


def _compute_exponent(number: float) -> int:
    return math.frexp(number)[1]


def _scale_by_power(number: float, exponent: int) -> float:
    try:
        return math.ldexp(number, exponent)
    except OverflowError:
        return math.copysign(math.inf, number)


def _scale_vector(vector: Vector, exponent: int) -> Vector:
    return (_scale_by_power(vector[0], exponent), _scale_by_power(vector[1], exponent))
