"""Converts scenes to an engine's units, and the engine's observations back to metres and seconds.

Engines contain constant lengths and speeds, such as a contact margin, or a speed below which nothing bounces. In
smaller units, all numbers of the scene are larger. So smaller units make constants negligible, even if users can't
change the constants. Units are powers of two, so that the conversion does not round.
"""

from __future__ import annotations

import math
from dataclasses import replace

from carom.engines.api.interfaces import Contact, Observation
from carom.errors import AdapterError
from carom.model.scene import Scene
from carom.model.units import convert_units


def scaled(scene: Scene, *, length: float = 1.0, time: float = 1.0) -> Scene:
    """Return a scene in other units. One metre is `length` new units, and one second is `time` new units.

    Masses stay the same. The caller must also multiply the step size by `time`.

    Raises:
        AdapterError: A unit is not a power of two.
    """
    _check_units(length, time)
    converted: Scene = convert_units(scene, 1.0 / length, 1.0 / time)
    return converted


def unscaled(seen: Observation, *, length: float = 1.0, time: float = 1.0) -> Observation:
    """Convert an observation from the units of `scaled` to metres and seconds.

    Raises:
        AdapterError: A unit is not a power of two.
    """
    _check_units(length, time)
    if length == time == 1.0:
        return seen
    speed = length / time

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


def _check_units(length: float, time: float) -> None:
    for name, unit in (("length", length), ("time", time)):
        if not (math.isfinite(unit) and math.frexp(unit)[0] == 0.5):
            raise AdapterError(f"{name} must be a power of two, to avoid rounding, got {unit}")
