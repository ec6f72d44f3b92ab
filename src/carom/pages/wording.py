"""How the report writes numbers and lists: the only place where a number becomes text."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from carom.trace import Setting

#: Numbers that are not a number, or were not measured.
ABSENT = "n/a"

#: A step is written 1/n where its inverse is whole to this, relative: a float holds 1/240 to 1e-16.
WHOLE = 1e-9


def number(value: float, digits: int = 2) -> str:
    """Return a number to this many significant digits: 0.075, 1.5e-16, 120."""
    if math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if value == 0.0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")  # before the exponent is read: 0.0999 to one digit is 0.1
    exponent = math.floor(math.log10(abs(rounded)))
    if -4 <= exponent < 6:
        text = f"{value:.{max(0, digits - 1 - exponent)}f}"
        return re.sub(r"\.?0+$", "", text) if "." in text else text
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return f"{re.sub(r'[.]?0+$', '', mantissa) if '.' in mantissa else mantissa}e{int(power)}"


def seconds(value: float) -> str:
    """Return a length of time: 0.0375 s."""
    return ABSENT if math.isnan(value) else f"{number(value, 3)} s"


def step(dt_s: float) -> str:
    """Return a step, as a part of a second where it is one: 1/240 s."""
    if 0.0 < dt_s < 1.0 and abs(1.0 / dt_s - round(1.0 / dt_s)) < WHOLE / dt_s:
        return f"1/{round(1.0 / dt_s)} s"
    return seconds(dt_s)


def step_option(dt_s: float) -> str:
    """Return a step as an option takes it, to the last bit: 1/240 where that is the very number."""
    whole = round(1.0 / dt_s)
    return f"1/{whole}" if whole and 1.0 / whole == dt_s else repr(dt_s)


def part(share: float) -> str:
    """Return a part of a whole, as a fraction where it is one: 1/16."""
    inverse = round(1.0 / share)
    return f"1/{inverse}" if inverse > 1 and math.isclose(share * inverse, 1.0, rel_tol=WHOLE) else number(share)


def steps(error_s: float, dt_s: float) -> str:
    """Return an error of time in steps: 0.9 steps."""
    if math.isnan(error_s) or dt_s <= 0.0:
        return ABSENT
    shown = number(error_s / dt_s, 3)
    return f"{shown} step" if shown in {"1", "-1"} else f"{shown} steps"


def percent(share: float) -> str:
    """Return a share in per cent."""
    return ABSENT if math.isnan(share) else f"{number(100.0 * share)} %"


def share(part: float) -> str:
    """Return a share in per cent, and nothing where there is none."""
    return "" if math.isnan(part) else percent(part)


def ratio(value: float | None) -> str:
    """Return how many times as long something takes."""
    return ABSENT if value is None else f"{number(value)} ×"  # noqa: RUF001 - the multiplication sign is meant


def count(n: int, one: str, many: str = "") -> str:
    """Return a number of things: 1 impact, 2 impacts."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def lost(missed: int, invented: int) -> str:
    """Return how many impacts are missed and invented, and nothing of none: -1 +2."""
    return " ".join([f"-{missed}"] * bool(missed) + [f"+{invented}"] * bool(invented))


def listed(words: Sequence[str], last: str = "and") -> str:
    """Return words as a list in a sentence: a, b and c."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def capitalised(sentence: str) -> str:
    """Return a sentence with its first letter in upper case, the rest as it is."""
    return sentence[:1].upper() + sentence[1:]


def setting(value: Setting) -> str:
    """Return the value of an engine's setting, to full precision where it is a choice and not a measurement."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, 6)
    return str(value)
