"""Parses conditions on versions, such as ``7.1`` or ``>=7,<8``, that users give to select releases."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from functools import partial
from typing import Any

from carom.errors import InputError
from carom.support.escaping import format_value, parse_release_numbers

#: Function that returns whether the numbers of a release meet a condition.
VersionCondition = Callable[[tuple[int, ...]], bool]

#: Versions that are safe arguments for pip and npm. Other texts could be read as options, paths or ranges.
_VERSION = re.compile(r"[0-9][0-9A-Za-z.+!_-]{0,63}")

#: Operators of conditions, each with a function that compares a release with the limit. Longer operators come first, so
#: that ">=" is not read as ">".
_SIGNS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}


def require_version(version: str) -> str:
    """Return the version unchanged if it is a safe argument for pip and npm.

    Raises:
        InputError: The argument is not a version.
    """
    if not _VERSION.fullmatch(version):
        raise InputError(
            f"a version must begin with a digit and have only letters, digits, . + ! _ -, got {format_value(version)}"
        )
    return version


def _parse_version(version: str) -> tuple[int, ...]:
    return parse_release_numbers(require_version(version))


def _build_condition(meets: Callable[[Any, Any], bool], limit: tuple[int, ...]) -> VersionCondition:
    return lambda release: meets(release, limit)


def parse_version_condition(text: str) -> VersionCondition | None:
    """Parse a condition such as ">=7" or "3.0..4.0". Return None for a plain version.

    Raises:
        InputError: The text contains an invalid version.
    """
    low, dots, high = text.partition("..")
    if dots:
        first, last = _parse_version(low), _parse_version(high)
        return lambda one: first <= one <= last
    for sign, meets in _SIGNS.items():
        if text.startswith(sign):
            return _build_condition(meets, _parse_version(text.removeprefix(sign).strip()))
    return None


def parse_version_conditions(text: str) -> tuple[VersionCondition, ...]:
    """Return the conditions of a range such as ">=7,<8".

    A plain version such as "7.1" is a condition that only this release meets.

    Raises:
        InputError: The text is empty, or a part is neither a condition nor a version.
    """
    words = map(str.strip, text.split(","))
    return tuple(parse_version_condition(word) or partial(operator.eq, _parse_version(word)) for word in words)
