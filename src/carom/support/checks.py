"""Checks of numeric arguments. Error messages contain the name and the value of the argument."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from carom.errors import InputError
from carom.support.escaping import format_value

Array = NDArray[np.float64]

#: Types for `isinstance`. A new tuple of types at each call would slow down small scenes by a tenth.
_TEXTS = (str, bytes)
_TRUTH_VALUES = (bool, np.bool_)


def check_number(name: str, value: Any, *, least: float = -math.inf, positive: bool = False) -> float:
    """Return an argument as a finite float.

    Args:
        name: Name of the argument.
        value: Value of the argument: a number of any type except bool.
        least: Lower bound.
        positive: Whether the value must be above 0.

    Raises:
        InputError: The value is not a finite number, is a bool, or is out of bounds.
    """
    try:
        if isinstance(value, _TRUTH_VALUES + _TEXTS):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if least <= number < math.inf and (number > 0.0 or not positive):
        return number
    span = f", {least:g} or more" if least > -math.inf else ""
    kind = "positive" if positive else "finite"
    raise InputError(f"{name} must be a {kind} number{span}, got {format_value(value)}")


def check_instance(name: str, value: Any, kind: type) -> None:
    """Check the type of an argument.

    Raises:
        InputError: The value is not an instance of `kind`.
    """
    if not isinstance(value, kind):
        raise InputError(f"{name} must be a {kind.__name__}, got {format_value(value)}")


def check_count(name: str, value: Any) -> int:
    """Return an argument as a whole number, 0 or more.

    Raises:
        InputError: The value is not a whole number, is a bool, or is negative.
    """
    try:
        if isinstance(value, _TRUTH_VALUES):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        number = -1
    if number < 0:
        raise InputError(f"{name} must be a whole number, 0 or more, got {format_value(value)}")
    return number


def check_times(name: str, values: Any) -> list[float]:
    """Return an argument as a list of times in ascending order. Each time is finite and at least 0.

    Raises:
        InputError: The value is not a list of finite numbers of at least 0 in ascending order.
    """
    try:
        if isinstance(values, _TEXTS):
            raise TypeError
        items = list(values)
    except TypeError:
        raise InputError(f"{name} must be a list of times, got {format_value(values)}") from None
    times = [check_number(f"{name}[{k}]", value, least=0.0) for k, value in enumerate(items)]
    for k in range(1, len(times)):
        if times[k] < times[k - 1]:
            raise InputError(f"{name} must be in ascending order, got {times[k]} after {times[k - 1]} ({name}[{k}])")
    return times


def check_floats(name: str, value: ArrayLike) -> Array:
    """Return an argument as an array of floats.

    Raises:
        InputError: The value does not consist of numbers.
    """
    try:
        array = np.asarray(value)
        # refuses text, booleans, complex numbers and times, for example
        if array.dtype.kind not in "fiu" and array.dtype != object:
            raise TypeError(f"of type {array.dtype}")
        return np.asarray(array, np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be numbers: {error}; got {format_value(value)}") from None


def check_finite(name: str, value: ArrayLike) -> Array:
    """Return an argument as an array of finite floats.

    Raises:
        InputError: The value does not consist of finite numbers.
    """
    array = check_floats(name, value)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite everywhere, got {array[~np.isfinite(array)].flat[0]}")
    return array


def check_vectors(name: str, value: ArrayLike) -> Array:
    """Return an argument as an array of finite vectors, with x and y along the last axis.

    Raises:
        InputError: A number is not finite, or the last axis does not have length 2.
    """
    array = check_finite(name, value)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise InputError(f"{name} must have x and y along its last axis, got shape {array.shape}")
    return array
