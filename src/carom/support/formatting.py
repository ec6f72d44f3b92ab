"""Number formatting. All rounding for display happens here."""

from __future__ import annotations

import math
import re

#: Text that is shown for NaN. Numbers that were not measured are NaN.
ABSENT = "n/a"


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
