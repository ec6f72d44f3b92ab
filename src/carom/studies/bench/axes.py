"""Axes of a bench's diagrams: the quantities to plot, and the kinds of error."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from carom.execution.score_jobs import Measures


#: Target errors. A bench reports the run time for each target error that an engine reaches.
TARGETS = (0.1, 0.01, 1e-3, 1e-4, 1e-6)


class Diagram(StrEnum):
    """The quantities on the axes of a diagram. Each value is the name on the command line."""

    ERROR_TIME = "error-time"
    ERROR_DT = "error-dt"
    TIME_DT = "time-dt"

    @property
    def heading(self) -> str:
        """The diagram's heading."""
        quantity = "Run time" if self is Diagram.TIME_DT else "Error"
        return f"{quantity} against {'run time' if self is Diagram.ERROR_TIME else 'the step'}"


class ErrorKind(StrEnum):
    """Kinds of error. Each value is the name on the command line.

    Attributes:
        label: Label of an axis, with the unit.
        meaning: Full name of the error.
    """

    label: str
    meaning: str

    IMPACT = (
        "impact",
        "largest impact error, % of greatest speed or duration",
        "error of the worst impact (the larger of time error / duration and velocity error / greatest speed)",
    )
    TIME = (
        "time",
        "largest time error of an impact, % of the duration",
        "time error of the worst impact, divided by the scene's duration",
    )
    VELOCITY = (
        "velocity",
        "largest velocity error, % of greatest speed",
        "velocity error of the worst impact, divided by the scene's greatest speed",
    )
    DIRECTION = ("direction", "largest direction error, rad", "direction error of the worst impact, radians")
    POSITION = (
        "position",
        "largest position error at the end, % of a radius",
        "error of the worst final position, divided by the largest radius",
    )

    def __new__(cls, name: str, label: str, meaning: str) -> Self:
        """Create a member whose value is the name."""
        kind = str.__new__(cls, name)
        kind._value_, kind.label, kind.meaning = name, label, meaning
        return kind

    @property
    def is_percent(self) -> bool:
        """Whether the error is shown in per cent. Angles are shown in radians."""
        return self is not ErrorKind.DIRECTION


def compute_error(measures: Measures, kind: ErrorKind) -> float:
    """Return a run's error of one kind; NaN if no impact was matched. Missed impacts are counted separately."""
    total, time = measures.total, abs(measures.total.time_s) / measures.duration_s
    both = (time, total.velocity)
    return {
        ErrorKind.IMPACT: math.nan if any(map(math.isnan, both)) else max(both),
        ErrorKind.TIME: time,
        ErrorKind.VELOCITY: total.velocity,
        ErrorKind.DIRECTION: total.direction_rad,
        ErrorKind.POSITION: total.final_position,
    }[kind]
