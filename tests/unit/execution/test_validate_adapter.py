"""Values that an adapter's methods return are valid, or refused with the name of the field and the value."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at, with_discs

from carom import Scene
from carom.engines.api import AdapterError, Contact, Observation
from carom.execution.observation.state_rows import StateRows
from carom.execution.observation.validate_observation import Validator
from carom.execution.validate_adapter import MOST_CHARACTERS, to_plain_counts, to_plain_settings
from carom.support.limits import LARGEST

DT = 0.1
ALONG_X = (1.0, 0.0)
TOUCH = Contact(0, 1, 0.05, ALONG_X, 1.0)
TOLD = Contact(0, 1, 0.05, ALONG_X, None, ((1.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 0.0)))

STATE = np.array([(0.0, 0.0), (1.0, 0.0)])


def build_scene(friction: float = 0.0) -> Scene:
    discs = disc_at(0, 0, r=0.1), disc_at(1, 0, r=0.1)
    return staged("line", *discs, wall_at(9, 0, -1, 0), friction=friction, duration_s=1)


def read_observation(*contacts: object, float_bits: int = 64, friction: float = 0.0, **fields: Any) -> Observation:
    """Return the validated observation of the second step."""
    validator, rows = Validator(build_scene(friction), DT, float_bits), StateRows(1, len(STATE))
    found: Any = {"position_m": STATE, "velocity_m_s": STATE, "contacts": contacts, **fields}
    validator.read(Observation(**found), rows, 0)
    return rows.observation(0, validator.check_contacts(found["contacts"], DT, 2 * DT))


def test_valid_observation_is_copied_unchanged() -> None:
    """Values of any numeric type, also NaN, are kept to the bit; later changes of the adapter's arrays do nothing."""
    position = STATE.astype(np.float32)
    wall = Contact(np.int64(0), -1, np.float32(0.125), [0, -1], None)  # type: ignore[arg-type] # as adapters have it
    seen = read_observation(TOUCH, TOLD, wall, position_m=position)
    position[0, 0] = 9.0
    assert seen.contacts == (TOUCH, TOLD, Contact(0, -1, 0.125, (0.0, -1.0)))
    assert seen.position_m.tolist() == STATE.tolist()
    assert seen.position_m.dtype == np.float64
    assert np.isnan(read_observation(position_m=STATE * math.nan).position_m).all()  # reported as the run's outcome


@each(
    "fields, words",
    [
        ({"position_m": STATE.tolist()}, r"position_m of an Observation must be an array of floats, got '\[\[0.0"),
        ({"position_m": STATE.T[:1]}, r"position_m of an Observation must have the shape \(2, 2\), got \(1, 2\)"),
        ({"velocity_m_s": STATE + 1j}, "velocity_m_s of an Observation must be an array of floats, got a ndarray"),
        ({"spin_rad_s": np.zeros(3)}, r"spin_rad_s of an Observation must have the shape \(2,\), got \(3,\)"),
        ({"warning": 5}, r"the warning of an observation must be a text, got 5 \(int\)"),
        ({"warning": "x" * (MOST_CHARACTERS + 1)}, "must have at most 2000 characters, got 2001"),
        ({"warning": "\ud800"}, "must be Unicode text"),
        ({"contacts": 7}, r"contacts of an observation must be a tuple, got 7 \(int\)"),
        ({"contacts": (None,)}, "a contact must be a Contact, got None"),
    ],
)
def test_invalid_field_of_an_observation_is_refused(fields: dict[str, Any], words: str) -> None:
    """A wrong type or shape is refused with the field's name, its value and a link to the documentation."""
    told = words.replace("'", "") + ".*; see docs/reference/adapters.md#field-by-field"
    with pytest.raises(AdapterError, match=told):
        read_observation(**fields)


#: How many numbers a field of a contact has.
NUMBERS = {"time_s": 1, "normal": 2, "impulse_n_s": 1, "tangential_impulse_n_s": 1, "velocities": 8, "spins_rad_s": 4}


def build_contact(field: str, numbers: list[Any]) -> Contact:
    held: Any = numbers[0] if NUMBERS[field] == 1 else tuple(numbers)
    if field == "velocities":
        held = tuple((numbers[k], numbers[k + 1]) for k in range(0, 8, 2))
    return dataclasses.replace(TOLD, **{field: held})


@each("value", [math.nan, math.inf, -math.inf, 10**400, "1", None, b"1", 1j])
def test_every_number_of_a_contact_must_be_finite(value: Any) -> None:
    """A value that is not a finite number is refused with its field's name, at any place in a contact."""
    for field, place in ((field, k) for field, count in NUMBERS.items() for k in range(count)):
        if value is None and NUMBERS[field] == 1 and field != "time_s":
            continue  # None is what an engine says that does not tell
        numbers: list[Any] = [1.0, 0.0] * 4
        numbers[place] = value
        with pytest.raises(AdapterError, match=rf"{field} of a contact of bodies 0 and 1 must be (finite|numbers)"):
            read_observation(build_contact(field, numbers[: NUMBERS[field]]))


@each(
    "contact, words",
    [
        (Contact(1, 0, 0.1, ALONG_X), "bodies 1 and 0"),
        (Contact(0, 2, 0.1, ALONG_X), "bodies 0 and 2"),
        (Contact(0, -7, 0.1, ALONG_X), r"bodies 0 and -7: .* or a wall \(-1 - k for wall k; number of walls: 1\)"),
        (Contact(0.0, 1, 0.1, ALONG_X), r"Contact.first must be a whole number, got 0.0 \(float\)"),  # type: ignore[arg-type] # what is refused
        (Contact(0, 1, 0.1, (0.0, 0.0)), "normal of a contact of bodies 0 and 1 must have the length 1, got 0, 0"),
        (Contact(0, 1, 0.1, (0.6, 0.8, 0.0)), "normal of a contact .* must have 2 items"),  # type: ignore[arg-type] # what is refused
        (Contact(0, 1, -0.1, ALONG_X), "must be within the step that reports it, 0.1 to 0.2 s, got -0.1"),
        (Contact(0, 1, 0.5, ALONG_X), "must be within the step that reports it, 0.1 to 0.2 s, got 0.5"),
        (dataclasses.replace(TOLD, velocities=((1.0, 0.0),)), "velocities of a contact .* must have 4 items"),  # type: ignore[arg-type] # what is refused
    ],
)
def test_impossible_contact_is_refused(contact: Contact, words: str) -> None:
    """Unknown or swapped bodies, a normal of a length other than 1 and a time outside the step are refused."""
    with pytest.raises(AdapterError, match=f"{words}.*; see docs/reference/adapters.md#field-by-field"):
        read_observation(contact)


WALL = Contact(0, -1, DT, ALONG_X, None, ((1.0, 0.0), (0.0, 0.0), (-1.0, 0.0), (0.0, 0.0)), None, (0.0,) * 4)
BEYOND = math.nextafter(LARGEST, math.inf)


@each("place", [1, 3])
@each("value", [-5e-324, 1.0])
def test_wall_of_a_contact_has_zero_velocity_and_spin(place: int, value: float) -> None:
    """Velocities and spins of a wall in a contact must be exactly 0; even 5e-324 is refused."""
    assert read_observation(WALL).contacts == (WALL,)
    moved, turned = list[Any](WALL.velocities or ()), [0.0] * 4
    moved[place], turned[place] = (0.0, value), value
    changes: dict[str, Any] = {"velocities": tuple(moved), "spins_rad_s": tuple(turned)}
    for field, values in changes.items():
        with pytest.raises(AdapterError, match=f"{field} of a contact .* must be 0 for a wall.*{value:g}"):
            read_observation(dataclasses.replace(WALL, **{field: values}))


def test_number_without_a_finite_square_is_refused() -> None:
    """Numbers beyond the largest that can be squared are refused with their field, and not that one itself."""
    for field, sign in itertools.product(("position_m", "velocity_m_s", "spin_rad_s"), (1.0, -1.0)):
        state: Any = np.zeros(2) if field == "spin_rad_s" else np.zeros((2, 2))
        state.flat[-1] = sign * LARGEST
        read_observation(**{field: state})
        for beyond, text in ((BEYOND, "6.7039e"), (1e200, r"1e\+200"), (1.7e308, r"1.7e\+308")):
            state.flat[-1] = sign * beyond
            with pytest.raises(AdapterError, match=f"{field} of an Observation must be at most .*, got -?{text}"):
                read_observation(**{field: state})
    for field in NUMBERS.keys() - {"time_s", "normal"}:
        with pytest.raises(AdapterError, match=f"{field} of a contact of bodies 0 and 1 must be at most"):
            read_observation(build_contact(field, [BEYOND] * NUMBERS[field]))


@each("second", [1, -1])
def test_impact_of_two_immovable_bodies_is_refused(second: int) -> None:
    """A contact of two immovable bodies is accepted without an impulse, and refused with one or with velocities."""
    validator = Validator(with_discs(build_scene(), mass_kg=math.inf), DT, 64)
    for impulse_n_s in (None, 0.0):
        validator.check_contacts((Contact(0, second, DT, ALONG_X, impulse_n_s),), DT, 2 * DT)
    for contact in (Contact(0, second, DT, ALONG_X, 1.0), Contact(0, second, DT, ALONG_X, None, ((0.0, 0.0),) * 4)):
        with pytest.raises(AdapterError, match=f"bodies 0 and {second}, neither of which can move"):
            validator.check_contacts((contact,), DT, 2 * DT)


@each(
    "contact, float_bits, friction, words",
    [
        (Contact(0, 1, DT, (1.0 + 2.0**-11, 0.0)), 32, 0.0, "must have the length 1"),
        (Contact(0, 1, DT, (1.0 + 2.0**-12, 0.0)), 64, 0.0, "must have the length 1"),
        (TOLD, 64, 0.5, "spin"),
        (None, 64, 0.5, "spin"),
    ],
)
def test_normals_and_spins_depend_on_floats_and_friction(
    contact: Contact | None, float_bits: int, friction: float, words: str
) -> None:
    """A normal has half the precision of the engine's floats; with friction, states and contacts must have spins."""
    contacts, spins = ([contact], np.zeros(2)) if contact else ([], None)
    with pytest.raises(AdapterError, match=words):
        read_observation(*contacts, float_bits=float_bits, friction=friction, spin_rad_s=spins)
    read_observation(Contact(0, 1, DT, (1.0 + 2.0**-12, 0.0)), float_bits=32)


def test_settings_are_converted_to_plain_values() -> None:
    """NumPy numbers and subclasses of float become plain Python values, and NaN is accepted."""

    class Own(float):
        def __new__(cls, a: float, _b: float) -> Own:
            return super().__new__(cls, a)

    given = {"a": np.float32(0.5), "b": np.int64(3), "c": np.True_, "d": Own(1.5, 2), "e": True}
    found = [(value, type(value)) for value in to_plain_settings(given, "of it").values()]
    assert found == [(0.5, float), (3, int), (True, bool), (1.5, float), (True, bool)]
    assert math.isnan(float(to_plain_settings({"a": math.nan}, "of it")["a"]))


READ_SETTINGS = partial(to_plain_settings, owner="of it")


@each(
    "check, found, words",
    [
        (READ_SETTINGS, None, "settings of it must be a mapping, got None"),
        (READ_SETTINGS, {"k": np.zeros(2)}, "setting 'k' of it must be a number"),
        (READ_SETTINGS, {"k": "\ud800"}, "setting 'k' of it must be Unicode"),
        (READ_SETTINGS, {5: 1.0}, "a name among the settings of it must be a text"),
        (READ_SETTINGS, {"k": -(10**5000)}, "setting 'k' of it must be at most 2"),
        (READ_SETTINGS, dict.fromkeys(map(str, range(1001)), 1), "at most 1000, got 1001"),
        (to_plain_counts, {"k": -1}, r"count 'k' must be from 0 to 2\*\*64, got -1 \(int\)"),
        (to_plain_counts, {"k": 10**5000}, r"count 'k' must be from 0 to 2\*\*64, got a huge one"),
        (to_plain_counts, {"k": 1.5}, r"count 'k' must be a whole number, got 1.5 \(float\)"),
        (to_plain_counts, [1], "counts of a world must be a mapping"),
    ],
)
def test_invalid_settings_and_counts_are_refused(check: Callable[[object], object], found: object, words: str) -> None:
    """A setting or count that is not a plain value or is out of range is refused, and the message names it."""
    with pytest.raises(AdapterError, match=words):
        check(found)
