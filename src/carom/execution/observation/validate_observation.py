"""Validates the observations that an adapter returns: states and contacts.

A state with infinities or NaN is accepted, since the engine itself can produce such a state. Values that can't be
compared with the reference are refused: for example, a nonzero velocity of a static wall, or a number whose square
overflows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, TypeGuard

import numpy as np

from carom.engines.api import Contact, Observation
from carom.engines.api.checks import MANTISSA_BITS
from carom.execution.observation.state_rows import StateRows
from carom.execution.validate_adapter import (
    build_adapter_error,
    build_wrong_value_error,
    describe_value,
    to_plain_text,
    to_whole_number,
)
from carom.model.scene import Scene
from carom.model.trace import Vector, wall_index
from carom.support.formatting import format_number
from carom.support.limits import LARGEST, format_limits

_FLOAT64 = np.dtype(np.float64)


class Validator:
    """Validates the observations of one run.

    Args:
        scene: The scene of the run.
        dt_s: Step size of the run, in seconds.
        float_bits: Number of bits of the floats in which the engine computes, as its adapter declares.
    """

    def __init__(self, scene: Scene, dt_s: float, float_bits: int) -> None:
        arrays = scene.arrays
        self._discs, self._walls, self._dt_s = len(scene.discs), len(scene.walls), dt_s
        self._drives = [arrays.drive_of_wall(k) for k in range(len(scene.walls))]
        self._movable = np.isfinite(arrays.mass_kg)
        self._needs_spins = arrays.turns and bool(np.isfinite(arrays.inertia).any())
        # Largest allowed difference of a normal's length from 1. Half of the digits of the engine's floats must be
        # correct, so the limit is far above rounding errors.
        self._rounding = 2.0 ** (-MANTISSA_BITS[float_bits] / 2)

    def read(self, found: object, rows: StateRows, row: int) -> bool:
        """Copy the arrays of an observation to a row, and return whether each number is finite.

        Raises:
            AdapterError: A field has a wrong type or value.
        """
        if not isinstance(found, Observation):
            raise build_adapter_error(f"observe() must return an Observation, got {describe_value(found)}")
        if found.spin_rad_s is not None:
            _check_array(found.spin_rad_s, "spin_rad_s of an Observation", (self._discs,))
            rows.spin_rad_s[row] = found.spin_rad_s
        elif self._needs_spins:
            shape = f"the shape ({self._discs},) in a scene whose discs turn"
            raise build_adapter_error(f"spin_rad_s must have {shape}, got none")
        rows.has_spins = found.spin_rad_s is not None
        _check_array(found.position_m, "position_m of an Observation", (self._discs, 2))
        rows.position_m[row] = found.position_m
        _check_array(found.velocity_m_s, "velocity_m_s of an Observation", (self._discs, 2))
        rows.velocity_m_s[row] = found.velocity_m_s
        if found.warning != "":  # most steps have no warning
            to_plain_text(found.warning, "the warning of an observation")
        numbers = rows.numbers[row]
        sizes = np.abs(numbers)
        if np.maximum.reduce(sizes) <= LARGEST:  # false if a number is NaN
            return True
        finite = np.isfinite(numbers)
        if (far := (sizes > LARGEST) & finite).any():
            name = rows.describe_column(int(far.argmax()))
            raise build_adapter_error(f"{name} {format_limits(0.0, LARGEST)}, got {numbers[far][0]:g}")
        return bool(finite.all())

    def check_contacts(self, found: object, begin_s: float, end_s: float) -> tuple[Contact, ...]:
        """Check and return the contacts of a step, or of a piece of a step, that lasts from `begin_s` to `end_s`.

        Raises:
            AdapterError: A field of a contact has a wrong type or value.
        """
        if not isinstance(found, Iterable):
            raise build_wrong_value_error("contacts of an observation", "a tuple", found)
        return tuple(self._check_contact(contact, begin_s, end_s) for contact in found)

    def _check_contact(self, found: object, begin_s: float, end_s: float) -> Contact:
        if not isinstance(found, Contact):
            raise build_wrong_value_error("a contact", "a Contact", found)
        first = to_whole_number(found.first, "Contact.first")
        second = to_whole_number(found.second, "Contact.second")
        if not (0 <= first < self._discs and (first < second < self._discs or -self._walls <= second < 0)):
            walls = f" or a wall (-1 - k for wall k; number of walls: {self._walls})"
            raise build_adapter_error(
                f"a contact is of bodies {first} and {second}: first must be a disc (0 to {self._discs - 1}), and "
                f"second a disc with a higher number{walls if self._walls else ' (the scene has no walls)'}"
            )
        owner = f"of a contact of bodies {first} and {second}"
        time_s = _check_number(found.time_s, "time_s", owner)
        # Engines add up steps to compute times, which accumulates rounding errors. So the time may be outside the step
        # by at most one step size.
        if not begin_s - self._dt_s <= time_s <= end_s + self._dt_s:
            step = f"the step that reports it, {format_number(begin_s, 9)} to {format_number(end_s, 9)} s"
            raise build_adapter_error(f"time_s {owner} must be within {step}, got {format_number(time_s, 9)}")
        x, y = _check_vector(found.normal, "normal", owner)
        if not abs(math.hypot(x, y) - 1.0) <= self._rounding:
            raise build_adapter_error(f"normal {owner} must have the length 1, got {x:g}, {y:g}")
        impulse = _check_optional_number(found.impulse_n_s, "impulse_n_s", owner)
        tangential = _check_optional_number(found.tangential_impulse_n_s, "tangential_impulse_n_s", owner)
        acts = found.velocities is not None or impulse or tangential
        if acts and not self._movable[first] and (second < 0 or not self._movable[second]):
            bodies = f"bodies {first} and {second}, neither of which can move"
            raise build_adapter_error(f"a contact is of {bodies}: they never collide")
        if found.velocities is None:
            return Contact(first, second, time_s, (x, y), impulse, None, tangential)
        if self._needs_spins and found.spins_rad_s is None:
            lack = "has velocities but no spins_rad_s, in a scene whose discs turn"
            raise build_adapter_error(f"a contact of bodies {first} and {second} {lack}")
        pairs = _check_items(found.velocities, f"velocities {owner}", 4)
        velocities: Any = tuple(_check_vector(pair, "velocities", owner) for pair in pairs)
        spins: Any = None
        if found.spins_rad_s is not None:
            spins = tuple(_check_numbers(found.spins_rad_s, f"spins_rad_s {owner}", 4))
        if second < 0:
            due_in_step = self._drives[wall_index(second)].velocities_within(min(begin_s, time_s), max(end_s, time_s))
            drive = min(due_in_step, key=lambda due: math.dist(due, velocities[1]))
            of_wall = (
                ("velocities", (*velocities[1], *velocities[3]), drive * 2),
                ("spins_rad_s", spins[1::2] if spins else (), (0.0, 0.0)),
            )
            for name, numbers, due in of_wall:
                if any(abs(got - v) > self._rounding * abs(v) for got, v in zip(numbers, due, strict=False)):
                    required = "0 for a wall, which neither moves nor turns"
                    if any(due):
                        required = f"{drive[0]:g}, {drive[1]:g} before and after, the velocity of the driven wall"
                    raise build_adapter_error(f"{name} {owner} must be {required}, got {_format_numbers(numbers)}")
            velocities = (velocities[0], drive, velocities[2], drive)
        return Contact(first, second, time_s, (x, y), impulse, velocities, tangential, spins)


def _check_array(found: object, name: str, shape: tuple[int, ...]) -> None:
    """Raise an error if a value is not an array of numbers with the given shape."""
    if not isinstance(found, np.ndarray) or (found.dtype is not _FLOAT64 and found.dtype.kind not in "fiu"):
        raise build_wrong_value_error(name, "an array of floats", found)
    if found.shape != shape:
        raise build_adapter_error(f"{name} must have the shape {shape}, got {found.shape}")


def _check_items(found: object, name: str, count: int) -> tuple[object, ...]:
    items = tuple(found) if isinstance(found, tuple | list | np.ndarray) else ()
    if len(items) != count:
        raise build_adapter_error(f"{name} must have {count} items, got {describe_value(found)}")
    return items


def _is_plain(found: object) -> TypeGuard[float]:
    """Whether a value is a Python float within the limits, as nearly all numbers are.

    Other values need slower checks.
    """
    return type(found) is float and abs(found) <= LARGEST


def _check_number(found: object, name: str, owner: str) -> float:
    if _is_plain(found):
        return found
    return _check_numbers((found,), f"{name} {owner}", 1)[0]


def _check_optional_number(found: object, name: str, owner: str) -> float | None:
    return None if found is None else _check_number(found, name, owner)


def _check_vector(found: object, name: str, owner: str) -> Vector:
    if type(found) is tuple and len(found) == 2:
        x, y = found
        if _is_plain(x) and _is_plain(y):
            return x, y
    x, y = _check_numbers(found, f"{name} {owner}", 2)
    return x, y


def _check_numbers(found: object, name: str, count: int) -> list[float]:
    items = _check_items(found, name, count)
    try:
        numbers = [float(item) for item in items if not isinstance(item, str | bytes)]  # type: ignore[arg-type] # anything else raises
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if len(numbers) != count:
        raise build_wrong_value_error(name, "numbers", found)
    if not all(map(math.isfinite, numbers)):
        raise build_adapter_error(f"{name} must be finite, got {_format_numbers(numbers)}")
    if any(abs(number) > LARGEST for number in numbers):
        raise build_adapter_error(f"{name} {format_limits(0.0, LARGEST)}, got {_format_numbers(numbers)}")
    return numbers


def _format_numbers(numbers: Iterable[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)
