"""Converts scenes to an engine's units, and the engine's observations back to metres and seconds.

Engines contain constant lengths and speeds, such as a contact margin, or a speed below which nothing bounces. In
smaller units, all numbers of the scene are larger. So smaller units make constants negligible, even if users can't
change the constants. Units are powers of two, so that the conversion does not round.
"""

from __future__ import annotations

import math
import operator
from dataclasses import replace
from functools import partial
from typing import Any

from carom.engines.api.interfaces import Contact, Observation, Vector
from carom.errors import AdapterError
from carom.model.scene import Disc, Scene
from carom.model.walls import Unit, convert_lengths, convert_speeds


def scaled(scene: Scene, *, length: float = 1.0, time: float = 1.0) -> Scene:
    """Return a scene in other units. One metre is `length` new units, and one second is `time` new units.

    Masses stay the same. The caller must also multiply the step size by `time`.

    Raises:
        AdapterError: A unit is not a power of two.
    """
    speed = _compute_speed_unit(length, time)
    to_length, to_speed, to_time = (partial(operator.mul, unit) for unit in (length, speed, time))
    of_scene = {
        **convert_bodies(scene, to_length, to_speed, to_time),
        "gravity_m_s2": _convert_vector(scene.gravity_m_s2, partial(operator.mul, speed / time)),
        "damping_per_s": scene.damping_per_s / time,
        "table_deceleration_m_s2": scene.table_deceleration_m_s2 * (speed / time),
        "duration_s": scene.duration_s * time,
        "frame_rate_hz": scene.frame_rate_hz / time,
    }
    return scene.model_copy(update=of_scene)


def convert_bodies(scene: Scene, length: Unit, speed: Unit, time: Unit) -> dict[str, Any]:
    """Return the fields `discs` and `walls` of a scene in other units.

    `length`, `speed` and `time` each convert one number.

    The bodies are not checked again.
    """

    def convert_disc(disc: Disc) -> Disc:
        changed = {
            "position_m": _convert_vector(disc.position_m, length),
            "velocity_m_s": _convert_vector(disc.velocity_m_s, speed),
            "radius_m": length(disc.radius_m),
            "spin_rad_s": disc.spin_rad_s / time(1.0),
            "legs": convert_speeds(disc.legs, speed, time),
        }
        return disc.model_copy(update=changed)

    walls = tuple(convert_lengths(wall, length, speed, time) for wall in scene.walls)
    return {"discs": tuple(map(convert_disc, scene.discs)), "walls": walls}


def unscaled(seen: Observation, *, length: float = 1.0, time: float = 1.0) -> Observation:
    """Convert an observation from the units of `scaled` to metres and seconds.

    Raises:
        AdapterError: A unit is not a power of two.
    """
    speed = _compute_speed_unit(length, time)
    if length == time == 1.0:
        return seen

    def convert_contact(contact: Contact) -> Contact:
        # `velocities` and `spins_rad_s` are None here: the engines that report them use the scene's units.
        normal, tangential = contact.impulse_n_s, contact.tangential_impulse_n_s
        return replace(
            contact,
            time_s=contact.time_s / time,
            impulse_n_s=None if normal is None else normal / speed,
            tangential_impulse_n_s=None if tangential is None else tangential / speed,
        )

    return Observation(
        seen.position_m / length,
        seen.velocity_m_s / speed,
        tuple(map(convert_contact, seen.contacts)),
        seen.warning,
        None if seen.spin_rad_s is None else seen.spin_rad_s * time,
    )


def _convert_vector(vector: Vector, unit: Unit) -> Vector:
    x, y = vector
    return (unit(x), unit(y))


def _compute_speed_unit(length: float, time: float) -> float:
    """Return one metre per second in the new unit of speed."""
    for name, unit in (("length", length), ("time", time)):
        if not (math.isfinite(unit) and math.frexp(unit)[0] == 0.5):
            raise AdapterError(f"{name} must be a power of two, to avoid rounding, got {unit}")
    return length / time
