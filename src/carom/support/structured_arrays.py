"""Builds dtypes of structured NumPy arrays from classes that describe a row, and joins arrays."""

from collections.abc import Collection, Sequence
from enum import IntEnum
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

_FORMATS: dict[Any, str] = {bool: "?", int: "i8", float: "f8", tuple[float, float]: "2f8"}


def build_dtype(record: type[Any], omitted: Collection[str] = ()) -> np.dtype[np.void]:
    """Return the dtype of a structured array whose rows have the fields of the class `record`, except for `omitted`.

    Raises:
        KeyError: A field is not a number, a flag, an integer enumeration or a pair of floats.
    """
    hints = ((name, hint) for name, hint in get_type_hints(record).items() if name not in omitted)
    return np.dtype([(name, _FORMATS[int if _is_enumeration(hint) else hint]) for name, hint in hints])


def join_rows(arrays: Sequence[NDArray[np.void]]) -> NDArray[np.void]:
    """Join structured arrays of the same dtype. At least one array is required.

    `np.concatenate` compares the fields of all dtypes, which takes longer than copying a few rows.
    """
    return np.frombuffer(b"".join([rows.tobytes() for rows in arrays]), arrays[0].dtype)


def _is_enumeration(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, IntEnum)
