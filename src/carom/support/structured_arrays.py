"""Builds the dtypes of structured NumPy arrays from classes that describe a row."""

from collections.abc import Collection
from enum import IntEnum
from typing import Any, get_type_hints

import numpy as np

_FORMATS: dict[Any, str] = {bool: "?", int: "i8", float: "f8", tuple[float, float]: "2f8"}


def build_dtype(record: type[Any], omitted: Collection[str] = ()) -> np.dtype[np.void]:
    """Return the dtype of a structured array whose rows have the fields of the class `record`, except for `omitted`.

    Raises:
        KeyError: The type of a field is not supported: only numbers, flags, integer enumerations and pairs of floats.
    """
    hints = ((name, hint) for name, hint in get_type_hints(record).items() if name not in omitted)
    return np.dtype([(name, _FORMATS[int if _is_enumeration(hint) else hint]) for name, hint in hints])


def _is_enumeration(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, IntEnum)
