"""Conversion of scenes to other units. The end of a field's name is the unit of the field's numbers."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from carom.support.fields import Model

#: Powers of metre and second in each unit.
_POWERS = {"m": (1, 0), "m_s": (1, -1), "m_s2": (1, -2), "s": (0, 1), "rad_s": (0, -1), "per_s": (0, -1), "hz": (0, -1)}
_UNIT = re.compile(f"_({'|'.join(sorted(_POWERS, key=len, reverse=True))})$")


@lru_cache
def _find_powers(field: str) -> tuple[int, int]:
    unit = _UNIT.search(field)
    return _POWERS[unit[1]] if unit else (0, 0)


def convert_units(value: Any, length: float = 1.0, time: float = 1.0, *, field: str = "") -> Any:
    """Return a scene, a part of a scene, or the content of a scene file in other units. The result is not checked.

    Args:
        value: The scene, its part or the content of its file. Values of wrong types stay unchanged.
        length: The new unit of length, expressed in the old unit.
        time: The new unit of time, expressed in the old unit.
        field: Name of the field that contains the value.
    """
    if isinstance(value, Model):
        return value.model_copy(update=convert_units(dict(value), length, time))
    if isinstance(value, dict):
        return {name: convert_units(item, length, time, field=name) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)([convert_units(item, length, time, field=field) for item in value])
    metres, seconds = _find_powers(field)
    if not (metres or seconds) or isinstance(value, bool) or not isinstance(value, int | float):
        return value
    try:
        return value / (length**metres * time**seconds)
    except OverflowError:  # the integer is too large for a float
        return value
