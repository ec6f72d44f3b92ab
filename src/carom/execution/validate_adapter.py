"""Validates everything an adapter returns: declarations, settings, states and contacts.

A mistake in what an adapter returns raises an `AdapterError` with the field and the value, so that it is not taken for
a fault of the engine. A non-finite state is accepted, since the engine itself can produce it. Values that can't be
scored are refused, such as a moving velocity of a static wall, or a number whose square overflows.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import cache
from typing import Any, NamedTuple, TypeGuard, TypeVar, get_type_hints

import numpy as np
from pydantic import TypeAdapter, ValidationError

from carom.engines.api import Adapter, Capabilities, Contact, Engine, Knob, Observation, Profile
from carom.engines.api.checks import COMBINE_RULES, MANTISSA_BITS
from carom.errors import AdapterError
from carom.execution.state_rows import StateRows
from carom.model.scene import Scene
from carom.model.trace import Setting, Vector, wall_index
from carom.support.formatting import number
from carom.support.limits import LARGEST, beyond

Kind = TypeVar("Kind")

#: Sections of the adapter reference: allowed values of each field, and declarations.
FIELDS, DECLARED = "field-by-field", "3-what-you-declare"

#: Largest number of characters of a text, and largest number of settings or counts. People read all of these.
MOST_CHARACTERS = 2000
MOST_ENTRIES = 1000
#: Limit of whole numbers. Python can't even print much larger numbers.
MOST_WHOLE = 2**64

_FLOAT64 = np.dtype(np.float64)


def adapter_error(message: str, section: str = FIELDS) -> AdapterError:
    """Return the exception for a mistake in an adapter, with a reference to the documentation."""
    return AdapterError(f"{message}; see docs/reference/adapters.md#{section}")


def plain_text(value: object, what: str, most: int = MOST_CHARACTERS) -> str:
    """Return a text from an adapter, of at most `most` characters, as a plain string.

    Raises:
        AdapterError: The value is not a text, is too long, or is not valid Unicode. In the message, the value is called
            `what`.
    """
    if not isinstance(value, str):
        raise adapter_error(f"{what} must be a text, got {_shown(value)}")
    text = str.__str__(value)
    if len(text) > most:
        raise adapter_error(f"{what} must have at most {most} characters, got {len(text)}")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise adapter_error(f"{what} must be Unicode text, got {text!a}") from None
    return text


def plain_settings(settings: object, of: str) -> dict[str, Setting]:
    """Return settings as plain numbers, bools and strings. In messages, the owner of the settings is `of`.

    Raises:
        AdapterError: The settings are not a mapping, or a name or value has another type.
    """
    return {
        plain_text(name, f"a name among the settings {of}"): _plain(name, value, of)
        for name, value in _entries(settings, f"settings {of}")
    }


def _entries(found: object, what: str) -> Iterable[tuple[object, object]]:
    if not isinstance(found, Mapping):
        raise adapter_error(f"{what} must be a mapping, got {_shown(found)}")
    if len(found) > MOST_ENTRIES:
        raise adapter_error(f"{what} must be at most {MOST_ENTRIES}, got {len(found)}")
    return found.items()


def _plain(name: object, value: object, of: str) -> Setting:
    if isinstance(value, np.generic):
        value = value.item()
    for kind in (bool, float):
        if isinstance(value, kind):
            return kind(value)
    if isinstance(value, int):
        return _whole(value, f"setting {name!r} {of}")
    if isinstance(value, str):
        return plain_text(value, f"setting {name!r} {of}")
    raise adapter_error(f"setting {name!r} {of} must be a number, a bool or a string, got {_shown(value)}")


def plain_counts(counts: object) -> dict[str, int]:
    """Return work counts as plain numbers.

    Raises:
        AdapterError: The counts are not a mapping of texts to whole numbers.
    """
    return {
        plain_text(name, "a name among the counts"): _whole(count, f"count {name!r}", least=0)
        for name, count in _entries(counts, "counts of a world")
    }


class Declarations(NamedTuple):
    """Validated declarations of an adapter."""

    engine: Engine
    capabilities: Capabilities
    profiles: Mapping[str, Profile]
    knobs: Mapping[str, Knob]


def validate_adapter(adapter: Adapter) -> Declarations:
    """Validate and return the declarations of an adapter.

    Raises:
        AdapterError: A field has a wrong type or value.
    """
    plain_text(adapter.name, "the name of an adapter")
    engine = _check_fields(adapter.engine, Engine, "engine")
    plain_text(engine.name, "engine.name")
    for field, release in (("oldest", engine.oldest), ("newest_tried", engine.newest_tried)):
        if plain_text(release, f"engine.{field}") and not re.fullmatch(r"[0-9]+(\.[0-9]+)*", release):
            raise adapter_error(
                f"engine.{field} must be numbers with dots between them, got {_shown(release)}", DECLARED
            )
    profiles: object = adapter.profiles
    if not isinstance(profiles, Mapping) or not profiles:
        raise adapter_error(f"profiles must be a mapping with at least one profile, got {_shown(profiles)}", DECLARED)
    for name, profile in _entries(profiles, "profiles"):
        where = f"profiles[{plain_text(name, 'the name of a profile')!r}]"
        if not isinstance(profile, Profile):
            raise adapter_error(f"{where} must be a Profile, got {_shown(profile)}", DECLARED)
        plain_text(profile.description, f"{where}.description")
        if not callable(profile.settings) or not isinstance(profile.located, bool):
            raise adapter_error(f"settings of {where} must be callable, and located must be True or False", DECLARED)
        if not isinstance(profile.changed, Mapping):
            raise adapter_error(
                f"{where}.changed must be a mapping of names to reasons, got {_shown(profile.changed)}", DECLARED
            )
        for changed, reason in _entries(profile.changed, f"{where}.changed"):
            plain_text(changed, f"a name in {where}.changed")
            plain_text(reason, f"{where}.changed[{changed!r}]")
        if profile.capabilities is not None:
            _check_capabilities(profile.capabilities, f"{where}.capabilities")
    capabilities = _check_capabilities(adapter.capabilities, "capabilities")
    return Declarations(engine, capabilities, profiles, _check_knobs(adapter))


def _check_knobs(adapter: Adapter) -> Mapping[str, Knob]:
    """Validate and return the optional knobs of an adapter."""
    found: object = getattr(adapter, "knobs", {})
    return {
        plain_text(name, "the name of a knob"): _check_fields(knob, Knob, f"knobs[{name!r}]")
        for name, knob in _entries(found, "knobs")
    }


def _check_capabilities(found: object, where: str) -> Capabilities:
    capabilities = _check_fields(found, Capabilities, where)
    for name in (field.name for field in fields(Capabilities)):
        value = getattr(capabilities, name)
        numbers = value if isinstance(value, tuple) else (value,)
        if any(isinstance(number, float) and math.isnan(number) for number in numbers) or (
            isinstance(value, tuple) and not value[0] <= value[1]
        ):
            kind = "a least and a greatest" if isinstance(value, tuple) else "a number"
            raise adapter_error(f"{where}.{name} must be {kind}, got {_shown(value)}", DECLARED)
    if capabilities.float_bits not in MANTISSA_BITS:
        narrow = capabilities.float_bits < min(MANTISSA_BITS)
        advice = "; declare 32 for narrower floats, for which larger rounding is allowed" if narrow else ""
        raise adapter_error(
            f"{where}.float_bits must be one of {sorted(MANTISSA_BITS)}, got {capabilities.float_bits}{advice}",
            DECLARED,
        )
    for name in ("restitution_combine", "friction_combine"):
        if getattr(capabilities, name) not in COMBINE_RULES:
            rules = ", ".join(COMBINE_RULES)
            raise adapter_error(f"{where}.{name} must be one of {rules}, got {getattr(capabilities, name)!r}", DECLARED)
    return capabilities


def _check_fields(found: object, kind: type[Kind], where: str) -> Kind:
    """Return a dataclass of the adapter interface, after checking that each field has its declared type."""
    if not isinstance(found, kind):
        raise adapter_error(f"{where} must be {kind.__name__}(...), got {_shown(found)}", DECLARED)
    hints, values = get_type_hints(kind), {}
    for name in (field.name for field in fields(kind)):  # type: ignore[arg-type] # always a dataclass
        value = _to_python(getattr(found, name))
        try:
            values[name] = _type_adapter(hints[name]).validate_python(value, strict=True)
        except ValidationError as error:
            raise adapter_error(f"{where}.{name}: {error.errors()[0]['msg']}, got {_shown(value)}", DECLARED) from None
    return kind(**values)


@cache
def _type_adapter(hint: Any) -> TypeAdapter[Any]:
    """Return the validator of a type, which many fields share."""
    return TypeAdapter(hint)


def _to_python(value: object) -> object:
    """Return a NumPy number as a Python number, and a list as a tuple."""
    if isinstance(value, np.generic):
        value = value.item()
    return tuple(value) if isinstance(value, list) else value


class Validator:
    """Validates the observations of one run.

    Args:
        scene: The scene of the run.
        dt_s: Step of the run, seconds.
        float_bits: Declared width of the method's floats.
    """

    def __init__(self, scene: Scene, dt_s: float, float_bits: int) -> None:
        arrays = scene.arrays
        self._discs, self._walls, self._dt_s = len(scene.discs), len(scene.walls), dt_s
        self._drives = [arrays.drive_of_wall(k) for k in range(len(scene.walls))]
        self._movable = np.isfinite(arrays.mass_kg)
        self._needs_spins = arrays.turns and bool(np.isfinite(arrays.inertia).any())
        # The tolerance is half of the method's digits. A normal whose length differs more from 1 is a mistake, not
        # rounding.
        self._rounding = 2.0 ** (-MANTISSA_BITS[float_bits] / 2)

    def read(self, found: object, rows: StateRows, row: int) -> bool:
        """Copy the arrays of an observation to a row, and return whether each number is finite.

        Raises:
            AdapterError: A field has a wrong type or value.
        """
        if not isinstance(found, Observation):
            raise adapter_error(f"observe() must return an Observation, got {_shown(found)}")
        if found.spin_rad_s is not None:
            _check_array(found.spin_rad_s, "spin_rad_s of an Observation", (self._discs,))
            rows.spin_rad_s[row] = found.spin_rad_s
        elif self._needs_spins:
            raise adapter_error(
                f"spin_rad_s must have the shape ({self._discs},) in a scene whose discs turn, got none"
            )
        rows.has_spins = found.spin_rad_s is not None
        _check_array(found.position_m, "position_m of an Observation", (self._discs, 2))
        rows.position_m[row] = found.position_m
        _check_array(found.velocity_m_s, "velocity_m_s of an Observation", (self._discs, 2))
        rows.velocity_m_s[row] = found.velocity_m_s
        if found.warning != "":  # most steps have no warning
            plain_text(found.warning, "the warning of an observation")
        # If the sum of squares is within the limit, each number is. This fast check runs after every step.
        numbers = rows.numbers[row]
        if numbers.dot(numbers) <= LARGEST:
            return True
        finite = np.isfinite(numbers)
        if (far := (np.abs(numbers) > LARGEST) & finite).any():
            raise adapter_error(f"{rows.name_of(int(far.argmax()))} {beyond(0.0, LARGEST)}, got {numbers[far][0]:g}")
        return bool(finite.all())

    def contacts(self, found: object, begin_s: float, end_s: float) -> tuple[Contact, ...]:
        """Return checked contacts of the step, or piece of a step, between two times.

        Raises:
            AdapterError: A field of a contact has a wrong type or value.
        """
        if not isinstance(found, Iterable):
            raise adapter_error(f"contacts of an observation must be a tuple, got {_shown(found)}")
        return tuple(self._contact(contact, begin_s, end_s) for contact in found)

    def _wall_numbers(self) -> str:
        if not self._walls:
            return " (the scene has no walls)"
        return f" or a wall, -1 - k of wall k (-1{f' to {-self._walls}' if self._walls > 1 else ''})"

    def _contact(self, found: object, begin_s: float, end_s: float) -> Contact:
        if not isinstance(found, Contact):
            raise adapter_error(f"a contact must be a Contact, got {_shown(found)}")
        first, second = _whole(found.first, "first of a contact"), _whole(found.second, "second of a contact")
        if not (0 <= first < self._discs and (first < second < self._discs or -self._walls <= second < 0)):
            raise adapter_error(
                f"a contact is of bodies {first} and {second}: first must be a disc (0 to {self._discs - 1}), second a "
                f"disc of a higher number{self._wall_numbers()}"
            )
        of = f"of a contact of bodies {first} and {second}"
        time_s = _number(found.time_s, "time_s", of)
        # Engines sum their own clocks. One more step on either side allows more than the rounding of that sum.
        if not begin_s - self._dt_s <= time_s <= end_s + self._dt_s:
            step = f"{number(begin_s, 9)} to {number(end_s, 9)} s"
            raise adapter_error(f"time_s {of} must be within the step that reports it, {step}, got {number(time_s, 9)}")
        x, y = _vector(found.normal, "normal", of)
        if not abs(math.hypot(x, y) - 1.0) <= self._rounding:
            raise adapter_error(f"normal {of} must have the length 1, got {x:g}, {y:g}")
        optional: dict[str, Any] = {
            name: None if (value := getattr(found, name)) is None else _number(value, name, of)
            for name in ("impulse_n_s", "tangential_impulse_n_s")
        }
        acts = found.velocities is not None or any(optional.values())
        if acts and not self._movable[first] and (second < 0 or not self._movable[second]):
            raise adapter_error(
                f"a contact is of bodies {first} and {second}, neither of which can move: they never collide"
            )
        if found.velocities is None:
            return Contact(first, second, time_s, (x, y), **optional)
        if self._needs_spins and found.spins_rad_s is None:
            raise adapter_error(
                f"a contact of bodies {first} and {second} has velocities but no spins_rad_s, in a scene whose discs "
                "turn"
            )
        pairs = _items(found.velocities, f"velocities {of}", 4)
        velocities: Any = tuple(_vector(pair, "velocities", of) for pair in pairs)
        spins: Any = None
        if found.spins_rad_s is not None:
            spins = tuple(_numbers(found.spins_rad_s, f"spins_rad_s {of}", 4))
        if second < 0:
            path = self._drives[wall_index(second)]
            due_in_step = path.velocities_within(min(begin_s, time_s), max(end_s, time_s))
            drive = min(due_in_step, key=lambda due: math.dist(due, velocities[1]))
            of_wall = {"velocities": (*velocities[1], *velocities[3]), "spins_rad_s": (spins[1::2] if spins else ())}
            for name, numbers in of_wall.items():
                due = drive * 2 if name == "velocities" else (0.0, 0.0)
                if any(abs(got - v) > self._rounding * abs(v) for got, v in zip(numbers, due, strict=False)):
                    shown = ", ".join(f"{number:g}" for number in numbers)
                    does = (
                        "0 for a wall, which neither moves nor turns"
                        if not any(due)
                        else f"{drive[0]:g}, {drive[1]:g} before and after, the velocity of the driven wall"
                    )
                    raise adapter_error(f"{name} {of} must be {does}, got {shown}")
            velocities = (velocities[0], drive, velocities[2], drive)
        return Contact(first, second, time_s, (x, y), velocities=velocities, spins_rad_s=spins, **optional)


def _check_array(found: object, name: str, shape: tuple[int, ...]) -> None:
    """Refuse anything except an array of numbers of a shape."""
    if not isinstance(found, np.ndarray) or (found.dtype is not _FLOAT64 and found.dtype.kind not in "fiu"):
        raise adapter_error(f"{name} must be an array of floats, got {_shown(found)}")
    if found.shape != shape:
        raise adapter_error(f"{name} must have the shape {shape}, got {found.shape}")


def _items(found: object, what: str, count: int) -> tuple[object, ...]:
    items = tuple(found) if isinstance(found, tuple | list | np.ndarray) else ()
    if len(items) != count:
        raise adapter_error(f"{what} must have {count} items, got {_shown(found)}")
    return items


def _is_plain(found: object) -> TypeGuard[float]:
    """Whether a value is a Python float within the limits, as nearly all numbers are."""
    return type(found) is float and abs(found) <= LARGEST


def _number(found: object, name: str, of: str) -> float:
    if _is_plain(found):
        return found
    return _numbers((found,), f"{name} {of}", 1)[0]


def _vector(found: object, name: str, of: str) -> Vector:
    if type(found) is tuple and len(found) == 2:
        x, y = found
        if _is_plain(x) and _is_plain(y):
            return x, y
    x, y = _numbers(found, f"{name} {of}", 2)
    return x, y


def _numbers(found: object, what: str, count: int) -> list[float]:
    items = _items(found, what, count)
    try:
        numbers = [float(item) for item in items if not isinstance(item, str | bytes)]  # type: ignore[arg-type] # anything else raises
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if len(numbers) != count:
        raise adapter_error(f"{what} must be numbers, got {_shown(found)}")
    if not all(map(math.isfinite, numbers)):
        raise adapter_error(f"{what} must be finite, got {', '.join(f'{number:g}' for number in numbers)}")
    if any(abs(number) > LARGEST for number in numbers):
        raise adapter_error(f"{what} {beyond(0.0, LARGEST)}, got {', '.join(f'{number:g}' for number in numbers)}")
    return numbers


def _whole(value: object, what: str, *, least: int = -MOST_WHOLE) -> int:
    try:
        number = operator.index(value)  # type: ignore[arg-type] # anything else raises
    except TypeError:
        raise adapter_error(f"{what} must be a whole number, got {_shown(value)}") from None
    if not least <= number <= MOST_WHOLE:
        limits = f"from {least} to 2**64" if least >= 0 else "at most 2**64 in magnitude"
        raise adapter_error(f"{what} must be {limits}, got {_shown(number)}")
    return number


def _shown(value: object) -> str:
    """Return the type of a value, and the beginning of its text if it is a plain value."""
    kind = type(value).__name__
    if value is None or type(value) in (bool, int, float, str, bytes, tuple, list, dict):
        text = ascii(value) if not isinstance(value, int) or abs(value) < 2**64 else "a huge one"
        return f"{text[:60]} ({kind})" if value is not None else "None"
    return f"a {kind}"
