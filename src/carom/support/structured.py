"""Structured NumPy arrays whose rows are records."""

from enum import IntEnum
from typing import Any, get_type_hints

import numpy as np

_FORMATS: dict[Any, str] = {bool: "?", int: "i8", float: "f8", tuple[float, float]: "2f8"}


def build_dtype(record: type[Any]) -> np.dtype[np.void]:
    """Return the dtype of a structured array with a row per record.

    Only numbers, flags, integer enumerations and pairs of floats have a field.
    """
    hints = get_type_hints(record).items()
    formats = ((name, _FORMATS.get(int if _is_enumeration(hint) else hint)) for name, hint in hints)
    return np.dtype([(name, found) for name, found in formats if found is not None])


def _is_enumeration(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, IntEnum)
