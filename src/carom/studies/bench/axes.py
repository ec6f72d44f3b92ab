"""Axes of a bench's diagrams: the kinds of error, each a number without unit, and what they are plotted against."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.execution.scoring import Measures


#: Errors whose cost is reported, where an engine reaches them.
TARGETS = (0.1, 0.01, 1e-3, 1e-4, 1e-6)


class Diagram(StrEnum):
    """The quantities on the axes; the value is the name on the command line."""

    ERROR_TIME = "error-time"
    ERROR_DT = "error-dt"
    TIME_DT = "time-dt"

    @property
    def heading(self) -> str:
        """The diagram's heading."""
        what = "Run time" if self is Diagram.TIME_DT else "Error"
        return f"{what} against {'run time' if self is Diagram.ERROR_TIME else 'the step'}"


class ErrorKind(StrEnum):
    """Kind of error; the value is its name on the command line."""

    IMPACT = "impact"
    TIME = "time"
    VELOCITY = "velocity"
    DIRECTION = "direction"
    POSITION = "position"

    @property
    def label(self) -> str:
        """Label of an axis, with the unit."""
        return _LABELS[self]

    @property
    def in_percent(self) -> bool:
        """Whether it is a ratio; an angle is not."""
        return self is not ErrorKind.DIRECTION

    @property
    def meaning(self) -> str:
        """Full name of the error."""
        return _MEANINGS[self]


_LABELS = {
    ErrorKind.IMPACT: "largest impact error, % of top speed or duration",
    ErrorKind.TIME: "largest time error of an impact, % of the duration",
    ErrorKind.VELOCITY: "largest velocity error, % of top speed",
    ErrorKind.DIRECTION: "largest direction error, rad",
    ErrorKind.POSITION: "largest position error at the end, % of a radius",
}
_MEANINGS = {
    ErrorKind.IMPACT: "error of the worst impact: time over the duration or velocity over the speed, the larger",
    ErrorKind.TIME: "time error of the worst impact, over the scene's duration",
    ErrorKind.VELOCITY: "velocity error of the worst impact, over the scene's greatest speed",
    ErrorKind.DIRECTION: "direction error of the worst impact, radians",
    ErrorKind.POSITION: "error of the worst final position, over the largest radius",
}


def error_of(measures: Measures, kind: ErrorKind) -> float:
    """Return the error of a run; NaN where no impact was matched. Missed impacts are counted separately."""
    time = abs(measures.total.time_s) / measures.duration_s
    match kind:
        case ErrorKind.TIME:
            return time
        case ErrorKind.VELOCITY:
            return measures.total.velocity
        case ErrorKind.DIRECTION:
            return measures.total.direction_rad
        case ErrorKind.POSITION:
            return measures.total.final_position
        case ErrorKind.IMPACT:
            both = (time, measures.total.velocity)
            return math.nan if any(map(math.isnan, both)) else max(both)
