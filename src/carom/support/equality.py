"""Compares results that contain arrays, for which the default ``==`` of a dataclass raises an error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


class ByValue:
    """Base class of results that are compared by their fields. Subclasses are frozen dataclasses with ``eq=False``.

    Fields declared with ``compare=False`` are ignored. Arrays are equal if their types, shapes and bits are equal. NaN
    equals NaN, but 0 does not equal -0. Results can't be hashed, because arrays can be changed in place.
    """

    __hash__ = None  # type: ignore[assignment] # disables hashing

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _are_fields_equal(self, other)


def _are_fields_equal(one: Any, other: Any) -> bool:
    return all(
        _are_equal(getattr(one, field.name), getattr(other, field.name)) for field in fields(one) if field.compare
    )


def _are_equal(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        alike = isinstance(one, np.ndarray) and isinstance(other, np.ndarray) and one.dtype == other.dtype
        return alike and one.shape == other.shape and one.tobytes() == other.tobytes()
    if type(one) is not type(other):
        return bool(one == other)
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(_are_equal(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(_are_equal, one, other))
    if is_dataclass(one) and not isinstance(one, type):
        return _are_fields_equal(one, other)
    return bool(one == other or (isinstance(one, float) and one != one and other != other))
