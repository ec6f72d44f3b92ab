"""Formats numbers and lists for display. All rounding for display happens here."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V")

#: Text that is shown for NaN. Numbers that were not measured are NaN.
ABSENT = "n/a"

#: A number is written as 1/n if its relative difference from 1/n is at most this number.
WHOLE = 1e-9


def format_count(n: int, one: str, many: str = "") -> str:
    """Format a number of things: 1 impact, 2 impacts."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def format_number(value: float, digits: int = 2) -> str:
    """Return a number rounded to `digits` significant digits: 0.075, 1.5e-16, 120."""
    if math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if value == 0.0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")  # rounding can change the exponent, for example from 0.0999 to 0.1
    exponent = math.floor(math.log10(abs(rounded)))
    if -4 <= exponent < 6:
        text = f"{value:.{max(0, digits - 1 - exponent)}f}"
        return re.sub(r"\.?0+$", "", text) if "." in text else text
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return f"{re.sub(r'[.]?0+$', '', mantissa) if '.' in mantissa else mantissa}e{int(power)}"


def format_seconds(value: float) -> str:
    """Format a length of time, such as 0.0375 s."""
    return ABSENT if math.isnan(value) else f"{format_number(value, 3)} s"


def format_instant(value: float) -> str:
    """Format an instant, such as 0.0375123 s."""
    return ABSENT if math.isnan(value) else f"{format_number(value, 6)} s"


def format_metres(value: float) -> str:
    """Format a length, such as 0.0375 m."""
    return ABSENT if math.isnan(value) else f"{format_number(value, 3)} m"


def format_step_option(dt_s: float) -> str:
    """Format a step size exactly for a command-line option, if possible as a fraction such as 1/240."""
    steps_per_s = round(1.0 / dt_s)
    return f"1/{steps_per_s}" if steps_per_s and 1.0 / steps_per_s == dt_s else repr(dt_s)


def format_steps(error_s: float, dt_s: float) -> str:
    """Format an error of time as a number of steps, such as 0.9 steps."""
    if math.isnan(error_s) or dt_s <= 0.0:
        return ABSENT
    number = format_number(error_s / dt_s, 3)
    return f"{number} step" if number in {"1", "-1"} else f"{number} steps"


def format_step(dt_s: float) -> str:
    """Format a step size, as a fraction of a second where possible, such as 1/240 s."""
    if 0.0 < dt_s < 1.0 and abs(1.0 / dt_s - round(1.0 / dt_s)) < WHOLE / dt_s:
        return f"1/{round(1.0 / dt_s)} s"
    return format_seconds(dt_s)


def format_time_left(left_s: float) -> str:
    """Format the remaining time for a progress line; empty if there is no time limit, or if no time is left."""
    return f", at most {left_s:.0f} s left" if 0.5 < left_s < math.inf else ""


def format_fraction(share: float) -> str:
    """Format a number above 0 and at most 1, as 1/n where possible, such as 1/16."""
    inverse = round(1.0 / share)
    return f"1/{inverse}" if inverse > 1 and math.isclose(share * inverse, 1.0, rel_tol=WHOLE) else format_number(share)


def format_percent(share: float) -> str:
    """Format a number from 0 to 1 in per cent. NaN becomes `ABSENT`."""
    return ABSENT if math.isnan(share) else f"{format_number(100.0 * share)} %"


def format_percent_or_blank(part: float) -> str:
    """Format a number from 0 to 1 in per cent. NaN becomes an empty text."""
    return "" if math.isnan(part) else format_percent(part)


def format_ratio(value: float | None) -> str:
    """Format a quotient of two run times. None becomes `ABSENT`."""
    return ABSENT if value is None else f"{format_number(value)} ×"  # noqa: RUF001 - this is the multiplication sign


def format_missed_and_invented(missed: int, invented: int) -> str:
    """Format numbers of impacts: -1 +2 for one missed and two invented impacts. A number that is 0 is omitted."""
    return " ".join(f"{sign}{count}" for sign, count in (("-", missed), ("+", invented)) if count)


def join_words(words: Sequence[str], last: str = "and") -> str:
    """Join words as in a sentence: a, b and c."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def group_by(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Group values by key. The keys are in the order of their first values."""
    found: dict[K, list[V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def capitalise(sentence: str) -> str:
    """Return a sentence with its first letter in upper case and the rest unchanged."""
    return sentence[:1].upper() + sentence[1:]


def format_setting(value: str | float) -> str:
    """Format the value of an engine's setting."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format_number(value, 6)
    return str(value)
