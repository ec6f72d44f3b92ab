"""Units in which a scene is ordinary: a scene of extreme sizes is run in them, and its trace given back in SI units.

The units are powers of two, so a change of them rounds nothing, and scenes that differ by powers of two have the same
digits. An ordinary scene, the rule, is run as it is.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.limits import ORDINARY
from carom.sizes import Sizes
from carom.trace import ImpactRecord, Samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.trace import Trace, Vector

    Array = NDArray[np.float64]

__all__ = ["SI", "Units", "units_of"]

_LEAST = 1.0 / ORDINARY
#: Exponent of the greatest speed: above that of 1, to leave more room for slower ones, and below that of `ORDINARY`, so
#: that a gravity which makes this speed in the shortest of scenes is not too large.
_FASTEST = 100


class Units(NamedTuple):
    """Units of length, time and mass: two to these powers of a metre, a second and a kilogram."""

    length: int
    time: int
    mass: int

    def scene(self, scene: Scene) -> Scene:
        """Return a scene in these units, unchecked; its frame rate is left as it is."""
        if self == SI:
            return scene
        speed = self.length - self.time
        discs = tuple(
            disc.model_copy(
                update={
                    "position_m": _vector(disc.position_m, -self.length),
                    "velocity_m_s": _vector(disc.velocity_m_s, -speed),
                    "radius_m": _times_power(disc.radius_m, -self.length),
                    "mass_kg": _times_power(disc.mass_kg, -self.mass),
                }
            )
            for disc in scene.discs
        )
        walls = tuple(wall.model_copy(update={"point_m": _vector(wall.point_m, -self.length)}) for wall in scene.walls)
        changed = {
            "discs": discs,
            "walls": walls,
            "gravity_m_s2": _vector(scene.gravity_m_s2, self.time - speed),
            "duration_s": self.of_seconds(scene.duration_s),
        }
        return scene.model_copy(update=changed)

    def of_seconds(self, time_s: float) -> float:
        """Return a time given in seconds, in these units."""
        return _times_power(time_s, -self.time)

    def seconds(self, time: float) -> float:
        """Return a time given in these units, in seconds."""
        return _times_power(time, self.time)

    def metres(self, lengths: Array) -> Array:
        """Return lengths given in these units, in metres."""
        return lengths if self == SI else np.ldexp(lengths, self.length)

    def metres_a_second(self, speeds: Array) -> Array:
        """Return velocities given in these units, in metres a second."""
        return speeds if self == SI else np.ldexp(speeds, self.length - self.time)

    def record(self, record: ImpactRecord) -> ImpactRecord:
        """Return an impact given in these units, in SI units."""
        if self == SI:
            return record
        velocities = (_vector(velocity, self.length - self.time) for velocity in record[4:])
        return ImpactRecord(self.seconds(record.time_s), record.first, record.second, record.normal, *velocities)

    def trace(self, trace: Trace, scene: Scene) -> Trace:
        """Return the trace of a scene, given that of the scene in these units."""
        if self == SI:
            return trace
        impacts = trace.impacts.copy()
        impacts["time_s"] = np.ldexp(impacts["time_s"], self.time)
        for name in impacts.dtype.names or ():
            if name.startswith("velocity"):
                impacts[name] = self.metres_a_second(impacts[name])
        impacts.flags.writeable = False
        samples = trace.samples
        if samples is not None:
            samples = Samples(np.ldexp(samples.time_s, self.time), self.metres(samples.position_m))
        return dataclasses.replace(
            trace,
            scene=scene,
            impacts=impacts,
            final_position_m=self.metres(trace.final_position_m),
            final_velocity_m_s=self.metres_a_second(trace.final_velocity_m_s),
            end_time_s=self.seconds(trace.end_time_s),
            dt_s=self.seconds(trace.dt_s),
            samples=samples,
        )


SI = Units(0, 0, 0)


def units_of(scene: Scene) -> Units:
    """Return the units in which to run a scene: `SI` for one whose numbers are all ordinary."""
    if _is_ordinary(scene):
        return SI
    sizes = Sizes.of(scene.arrays, scene.gravity_m_s2, scene.duration_s)
    length = _middle(sizes.radius, max(sizes.length, sizes.way))
    time = length + _FASTEST - _exponent(sizes.speed) if sizes.speed > 0.0 else _exponent(sizes.duration)
    return Units(length, time, _middle(sizes.lightest, sizes.heaviest))


def _is_ordinary(scene: Scene) -> bool:
    others = (scene.duration_s, *scene.gravity_m_s2)
    return scene.arrays.is_ordinary and all(_LEAST <= abs(number) <= ORDINARY or number == 0.0 for number in others)


def _middle(least: float, most: float) -> int:
    """Return the exponent half-way between those of two numbers."""
    return (_exponent(least) + _exponent(most)) // 2


def _exponent(number: float) -> int:
    return math.frexp(number)[1]


def _times_power(number: float, exponent: int) -> float:
    try:
        return math.ldexp(number, exponent)
    except OverflowError:
        return math.copysign(math.inf, number)


def _vector(vector: Vector, exponent: int) -> Vector:
    return (_times_power(vector[0], exponent), _times_power(vector[1], exponent))
