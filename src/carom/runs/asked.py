"""What may be asked of a study, by the name of the field: one table for all, from Python and the shell alike."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from carom.arguments import count, number, shown
from carom.errors import InputError
from carom.limits import MOST_JOBS, MOST_PHASES, MOST_ROUNDS, require_megabytes, require_seconds

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

__all__ = ["LEAST_ROUNDS", "require_asked", "require_one"]

#: Fewer rounds than this have no spread worth a name.
LEAST_ROUNDS = 3

#: NumPy's generators take no larger one.
MOST_SEED = 2**63 - 1


def require_asked(options: DataclassInstance) -> None:
    """Refuse a field of a study's options that makes no sense; a list that is given becomes a tuple.

    Raises:
        InputError: The message names the field and the value.
    """
    for field in dataclasses.fields(options):
        value = require_one(field.name, getattr(options, field.name), optional=field.default is None)
        object.__setattr__(options, field.name, value)


def require_one(name: str, value: Any, *, optional: bool = False) -> Any:
    """Return the value of a field by this name as a study takes it; one of a name that is not known as it is.

    Raises:
        InputError: The message names the field and the value.
    """
    if name not in _KINDS or (optional and value is None):
        return value
    return _KINDS[name](name, value)


def _whole(least: int, most: int) -> Callable[[str, Any], int]:
    def whole(name: str, value: Any) -> int:
        found = count(name, value, least=least)
        if found > most:
            raise InputError(f"{name} must be a whole number, {most} at most, got {shown(value)}")
        return found

    return whole


def _positive(name: str, value: Any) -> float:
    return number(name, value, positive=True)


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{name} must be True or False, got {shown(value)}")
    return value


def _seconds(name: str, value: Any) -> float:
    require_seconds(name, value)
    return float(value)


def _megabytes(name: str, value: Any) -> float:
    require_megabytes(name, value)
    return float(value)


def _items(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise InputError(f"{name} must be a list, also where there is one of them, got {value!r}")
    return tuple(value)


def _names(name: str, value: Any) -> tuple[str, ...]:
    found = _items(name, value)
    for k, word in enumerate(found):
        if not isinstance(word, str):
            raise InputError(f"{name}[{k}] must be a name, got {word!r}")
    return found


def _steps(name: str, value: Any) -> tuple[float, ...]:
    found = _items(name, value)
    for k, dt_s in enumerate(found):
        _step(f"{name}[{k}]", dt_s)
    return found


def _step(name: str, value: Any) -> float:
    if isinstance(value, bool) or not (isinstance(value, int | float) and 0 < value < math.inf):
        raise InputError(f"{name} must be a positive number of seconds, got {value!r}")
    return value


#: How a field is checked. A name means the same in every study.
_KINDS: Mapping[str, Callable[[str, Any], Any]] = {
    **dict.fromkeys(("engines", "profiles"), _names),
    **dict.fromkeys(("timing", "samples", "quick", "certified"), _flag),
    **dict.fromkeys(("time_limit_s", "certify_s", "budget_s"), _seconds),
    "memory_limit_mb": _megabytes,
    "dts": _steps,
    **dict.fromkeys(("dt", "dt_s"), _step),
    "target": _positive,
    "phases": _whole(0, MOST_PHASES),
    "rounds": _whole(LEAST_ROUNDS, MOST_ROUNDS),
    "trials": _whole(1, MOST_SEED),
    "jobs": _whole(1, MOST_JOBS),
    "seed": _whole(0, MOST_SEED),
}
