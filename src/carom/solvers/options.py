"""Options of a PIC run, and checks of arguments that `carom.solve_pic` and the run classes share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from carom.errors import InputError
from carom.solvers.units import Units
from carom.support.checks import check_count, check_number
from carom.support.escaping import format_value

ALWAYS = (-math.inf, math.inf)
#: The compiled code interprets this number of impacts as no limit.
NO_LIMIT = 2**62


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of a run: which impacts to record, and the contact time.

    Attributes:
        record: "all" records all impacts, "none" records no impact. The impacts of each disc are counted in both cases.
        window_s: Start and end, in seconds, of the time in which impacts are recorded.
        contact_duration_s: Contact time of the TC model, in seconds. `EventDrivenRun` explains this model. 0 turns the
            model off.

    Raises:
        InputError: An option is outside its range. The message names the option.
    """

    record: str = "all"
    window_s: tuple[float, float] = ALWAYS
    contact_duration_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the values."""
        if self.record not in ("all", "none"):
            raise InputError(f"record must be 'all' or 'none', got {format_value(self.record)}")
        if self.window_s is not ALWAYS:
            object.__setattr__(self, "window_s", _check_window(self.window_s))
        duration_s = check_number("contact_duration_s", self.contact_duration_s, least=0.0)
        object.__setattr__(self, "contact_duration_s", duration_s)

    @classmethod
    def of(cls, record: str, window_s: tuple[float, float], contact_duration_s: float) -> RunOptions:
        """Return checked options.

        If all options have their default values, the existing object `PLAIN` is returned. A new object would take
        noticeable time in scenes of two discs.
        """
        if record == "all" and window_s is ALWAYS and type(contact_duration_s) is float and contact_duration_s == 0.0:
            return PLAIN
        return cls(record, window_s, contact_duration_s)

    def convert_units(self, units: Units) -> RunOptions:
        """Return the same options in other units."""
        if self is PLAIN:
            return self
        begin, end = map(units.from_seconds, self.window_s)
        return RunOptions(self.record, (begin, end), units.from_seconds(self.contact_duration_s))


def _check_window(window_s: Any) -> tuple[float, float]:
    try:
        begin, end = map(float, window_s)
    except (TypeError, ValueError, OverflowError):
        begin = end = math.nan
    if math.isnan(begin) or math.isnan(end):
        raise InputError(f"window_s must be a pair of times, got {format_value(window_s)}")
    return begin, end


#: The default options.
PLAIN = RunOptions()


def require_goal(time_s: float, max_impacts: int | None) -> None:
    """Check the time and the number of impacts up to which a run must advance. The time may be infinite.

    NaN is refused, because a run up to NaN would never end.

    Raises:
        InputError: The message names the argument and its value.
    """
    if isinstance(time_s, (bool, str)) or not _is_time(time_s):
        raise InputError(f"time_s must be a number of seconds, got {format_value(time_s)}")
    if max_impacts is not None:
        check_count("max_impacts", max_impacts)


def _is_time(value: Any) -> bool:
    try:
        return not math.isnan(value)
    except (TypeError, OverflowError):  # an integer too large for a float
        return False
