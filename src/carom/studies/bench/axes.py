"""Axes of a bench's diagrams: the quantities to plot, and the kinds of error."""

from __future__ import annotations

from enum import StrEnum

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
    """Kinds of error. Each value is the name on the command line."""

    IMPACT = "impact"
    TIME = "time"
    VELOCITY = "velocity"
    DIRECTION = "direction"
    POSITION = "position"

    @property
    def label(self) -> str:
        """Label of an axis, with the unit."""
        return _TEXTS[self][0]

    @property
    def is_percent(self) -> bool:
        """Whether the error is shown in per cent. Angles are shown in radians."""
        return self is not ErrorKind.DIRECTION

    @property
    def meaning(self) -> str:
        """Full name of the error."""
        return _TEXTS[self][1]


_TEXTS = {
    ErrorKind.IMPACT: (
        "largest impact error, % of greatest speed or duration",
        "error of the worst impact (the larger of time error / duration and velocity error / greatest speed)",
    ),
    ErrorKind.TIME: (
        "largest time error of an impact, % of the duration",
        "time error of the worst impact, divided by the scene's duration",
    ),
    ErrorKind.VELOCITY: (
        "largest velocity error, % of greatest speed",
        "velocity error of the worst impact, divided by the scene's greatest speed",
    ),
    ErrorKind.DIRECTION: ("largest direction error, rad", "direction error of the worst impact, radians"),
    ErrorKind.POSITION: (
        "largest position error at the end, % of a radius",
        "position error of the worst disc at the end, divided by the largest radius",
    ),
}
