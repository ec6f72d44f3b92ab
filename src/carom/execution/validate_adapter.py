"""Validates the declarations, settings and counts that an adapter returns.

A wrong value raises an `AdapterError` that contains the field and the value, so that users do not blame the engine for
the adapter's mistake.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar, get_type_hints

import numpy as np
from pydantic import TypeAdapter, ValidationError

from carom.engines.api import Adapter, Capabilities, Engine, Knob, Profile
from carom.engines.api.checks import COMBINE_RULES, MANTISSA_BITS
from carom.errors import AdapterError
from carom.model.trace import Setting

Kind = TypeVar("Kind")

#: Sections of docs/reference/adapters.md to which messages refer.
FIELDS, DECLARED = "field-by-field", "3-what-you-declare"

#: Largest number of characters of a text, and largest number of settings or counts. Texts, settings and counts are
#: displayed.
MOST_CHARACTERS = 2000
MOST_ENTRIES = 1000
#: Largest whole number. Python refuses to print numbers of several thousand digits.
MOST_WHOLE = 2**64


def build_adapter_error(message: str, section: str = FIELDS) -> AdapterError:
    """Return the exception for a mistake in an adapter, with a reference to the documentation."""
    return AdapterError(f"{message}; see docs/reference/adapters.md#{section}")


def build_wrong_value_error(name: str, must: str, value: object, section: str = FIELDS) -> AdapterError:
    """Return the exception for a wrong value, with a message that states what the value must be."""
    return build_adapter_error(f"{name} must be {must}, got {describe_value(value)}", section)


def to_plain_text(value: object, name: str, max_characters: int = MOST_CHARACTERS) -> str:
    """Return a text from an adapter, of at most `max_characters` characters, as a plain string.

    Raises:
        AdapterError: The value is not a text, is too long, or is not valid Unicode. In the message, the value is called
            `name`.
    """
    if not isinstance(value, str):
        raise build_wrong_value_error(name, "a text", value)
    text = str.__str__(value)
    if len(text) > max_characters:
        raise build_adapter_error(f"{name} must have at most {max_characters} characters, got {len(text)}")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise build_adapter_error(f"{name} must be Unicode text, got {text!a}") from None
    return text


def to_plain_settings(settings: object, owner: str) -> dict[str, Setting]:
    """Return settings as plain numbers, bools and strings.

    `owner` describes the owner of the settings in messages, such as "of a world".

    Raises:
        AdapterError: The settings are not a mapping, or a name or value has another type.
    """
    return {
        to_plain_text(name, f"a name among the settings {owner}"): _to_plain_setting(name, value, owner)
        for name, value in _list_entries(settings, f"settings {owner}")
    }


def _list_entries(mapping: object, name: str) -> Iterable[tuple[object, object]]:
    if not isinstance(mapping, Mapping):
        raise build_wrong_value_error(name, "a mapping", mapping)
    if len(mapping) > MOST_ENTRIES:
        raise build_adapter_error(f"{name} must be at most {MOST_ENTRIES}, got {len(mapping)}")
    return mapping.items()


def _to_plain_setting(name: object, value: object, owner: str) -> Setting:
    if isinstance(value, np.generic):
        value = value.item()
    for kind in (bool, float):
        if isinstance(value, kind):
            return kind(value)
    if isinstance(value, int):
        return to_whole_number(value, f"setting {name!r} {owner}")
    if isinstance(value, str):
        return to_plain_text(value, f"setting {name!r} {owner}")
    raise build_wrong_value_error(f"setting {name!r} {owner}", "a number, a bool or a string", value)


def to_plain_counts(counts: object) -> dict[str, int]:
    """Return the counts of a world, such as its number of contact tests, as plain numbers.

    Raises:
        AdapterError: The counts are not a mapping of texts to whole numbers.
    """
    return {
        to_plain_text(name, "a name among the counts"): to_whole_number(count, f"count {name!r}", smallest=0)
        for name, count in _list_entries(counts, "counts of a world")
    }


def validate_adapter(adapter: Adapter) -> tuple[Engine, Capabilities, Mapping[str, Profile], Mapping[str, Knob]]:
    """Validate and return the declarations of an adapter: its engine, capabilities, profiles and knobs.

    Raises:
        AdapterError: A field has a wrong type or value.
    """
    to_plain_text(adapter.name, "the name of an adapter")
    engine = _check_fields(adapter.engine, Engine, "engine")
    to_plain_text(engine.name, "engine.name")
    for field, release in (("oldest", engine.oldest), ("newest_tried", engine.newest_tried)):
        if to_plain_text(release, f"engine.{field}") and not re.fullmatch(r"[0-9]+(\.[0-9]+)*", release):
            raise build_wrong_value_error(f"engine.{field}", "numbers with dots between them", release, DECLARED)
    profiles: object = adapter.profiles
    if not isinstance(profiles, Mapping) or not profiles:
        raise build_wrong_value_error("profiles", "a mapping with at least one profile", profiles, DECLARED)
    for name, profile in _list_entries(profiles, "profiles"):
        where = f"profiles[{to_plain_text(name, 'the name of a profile')!r}]"
        if not isinstance(profile, Profile):
            raise build_wrong_value_error(where, "a Profile", profile, DECLARED)
        for changed, reason in _list_entries(profile.changed, f"{where}.changed"):
            to_plain_text(changed, f"a name in {where}.changed")
            to_plain_text(reason, f"{where}.changed[{changed!r}]")
        to_plain_text(_check_fields(profile, Profile, where).description, f"{where}.description")
        if profile.capabilities is not None:
            _check_capabilities(profile.capabilities, f"{where}.capabilities")
    knobs = {
        to_plain_text(name, "the name of a setting in knobs"): _check_fields(knob, Knob, f"knobs[{name!r}]")
        for name, knob in _list_entries(getattr(adapter, "knobs", {}), "knobs")
    }
    return engine, _check_capabilities(adapter.capabilities, "capabilities"), profiles, knobs


def _check_capabilities(declared: object, where: str) -> Capabilities:
    capabilities = _check_fields(declared, Capabilities, where)
    for name, value in ((field.name, getattr(capabilities, field.name)) for field in fields(capabilities)):
        if isinstance(value, tuple) and not value[0] <= value[1]:  # true if a limit is NaN
            raise build_wrong_value_error(f"{where}.{name}", "a smallest and a largest value", value, DECLARED)
        if isinstance(value, float) and math.isnan(value):
            raise build_wrong_value_error(f"{where}.{name}", "a number", value, DECLARED)
    bits = capabilities.float_bits
    if bits not in MANTISSA_BITS:
        advice = "; declare 32 for narrower floats, for which larger rounding is allowed"
        problem = f"{where}.float_bits must be one of {sorted(MANTISSA_BITS)}, got {bits}"
        raise build_adapter_error(f"{problem}{advice if bits < min(MANTISSA_BITS) else ''}", DECLARED)
    for name in ("restitution_combine", "friction_combine"):
        if (rule := getattr(capabilities, name)) not in COMBINE_RULES:
            problem = f"{where}.{name} must be one of {', '.join(COMBINE_RULES)}, got {rule!r}"
            raise build_adapter_error(problem, DECLARED)
    return capabilities


def _check_fields(declared: object, kind: type[Kind], where: str) -> Kind:
    """Return a copy of the dataclass `declared`, after a check that each field has its declared type."""
    if not isinstance(declared, kind):
        raise build_wrong_value_error(where, f"{kind.__name__}(...)", declared, DECLARED)
    hints, values = get_type_hints(kind), {}
    for name in (field.name for field in fields(kind)):  # type: ignore[arg-type] # `kind` is always a dataclass
        value = getattr(declared, name)
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, list):
            value = tuple(value)
        try:
            values[name] = _build_type_adapter(hints[name]).validate_python(value, strict=True)
        except ValidationError as error:
            problem = f"{error.errors()[0]['msg']}, got {describe_value(value)}"
            raise build_adapter_error(f"{where}.{name}: {problem}", DECLARED) from None
    return kind(**values)


@cache
def _build_type_adapter(hint: Any) -> TypeAdapter[Any]:
    """Return the validator of a type. Many fields have the same type, so the validator is cached."""
    return TypeAdapter(hint)


def to_whole_number(value: object, name: str, *, smallest: int = -MOST_WHOLE) -> int:
    """Return a whole number from an adapter, from `smallest` to 2**64.

    Raises:
        AdapterError: The value is not a whole number, or is out of bounds. In the message, the value is called `name`.
    """
    try:
        number = operator.index(value)  # type: ignore[arg-type] # other values raise TypeError
    except TypeError:
        raise build_wrong_value_error(name, "a whole number", value) from None
    if not smallest <= number <= MOST_WHOLE:
        limits = f"from {smallest} to 2**64" if smallest >= 0 else "at most 2**64 in magnitude"
        raise build_wrong_value_error(name, limits, number)
    return number


def describe_value(value: object) -> str:
    """Return the type of a value and, for a plain value such as a number, the beginning of its text."""
    kind = type(value).__name__
    if value is None or type(value) in (bool, int, float, str, bytes, tuple, list, dict):
        text = ascii(value) if not isinstance(value, int) or abs(value) < 2**64 else "a huge one"
        return f"{text[:60]} ({kind})" if value is not None else "None"
    return f"a {kind}"
