"""Options of `carom bench`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from carom.execution.shared_options import (
    MOST_SEED,
    LimitOptions,
    declare_engines,
    declare_phases,
    declare_profiles,
)
from carom.support.limits import LARGEST, MOST_DISCS, MOST_ROUNDS, MOST_SERIES
from carom.support.options import (
    build_enum_kind,
    build_flag_kind,
    build_measure_kind,
    build_seconds_kind,
    build_step_kind,
    build_whole_number_kind,
    declare_option,
    parse_fraction,
)

#: Smallest number of rounds from which a useful spread can be computed.
LEAST_ROUNDS = 3

#: Number of step sizes of a series, by default.
SERIES_STEPS = 6

#: Default time limit of a bench for each scene, or of a growth bench for each gas, in seconds.
BUDGET_S = 80.0

#: Target errors. A bench reports the run time for each target error that an engine reaches.
TARGETS = (0.1, 0.01, 1e-3, 1e-4, 1e-6)


class Diagram(StrEnum):
    """The quantities on the axes of a diagram. Each member's value is the name on the command line."""

    ERROR_TIME = "error-time"
    ERROR_DT = "error-dt"
    TIME_DT = "time-dt"

    @property
    def heading(self) -> str:
        """The diagram's heading."""
        quantity = "Run time" if self is Diagram.TIME_DT else "Error"
        return f"{quantity} against {'run time' if self is Diagram.ERROR_TIME else 'the step'}"


class ErrorKind(StrEnum):
    """Kinds of error. Each member's value is the name on the command line."""

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


def compute_geometric_steps(coarsest_s: float, finest_s: float, count: int) -> tuple[float, ...]:
    """Return up to `count` step sizes that are evenly spread on a logarithmic axis.

    If both ends are whole numbers of steps per second, all step sizes between the ends are rounded to whole numbers of
    steps per second. `count` is 2 or more.
    """
    coarsest_s, finest_s = max(coarsest_s, finest_s), min(coarsest_s, finest_s)
    rates = [(1 / coarsest_s) * (coarsest_s / finest_s) ** (k / (count - 1)) for k in range(count)]
    ends = rates[0], rates[-1]
    if all(round(rate) >= 1 and abs(rate - round(rate)) < 1e-9 * rate for rate in ends):
        rates = [float(round(rate)) for rate in rates]
        return tuple(1.0 / rate for rate in dict.fromkeys(rates))
    return (coarsest_s, *(1.0 / rate for rate in rates[1:-1]), finest_s)


def parse_step_series(text: str) -> tuple[float, ...]:
    """Parse a step size such as ``1/240``, or a geometric series such as ``1/60..1/10000:6``.

    Raises:
        ValueError: The text is neither a step nor a series.
    """
    if ".." not in text:
        return (parse_fraction(text),)
    ends, _, count = text.partition(":")
    coarsest, _, finest = ends.partition("..")
    if count and not (count.isascii() and count.isdigit() and len(count) < 10 and 2 <= int(count) <= MOST_SERIES):
        raise ValueError
    first, last = (build_step_kind().convert(parse_fraction(end)) for end in (coarsest, finest))
    return compute_geometric_steps(first, last, int(count) if count else SERIES_STEPS)


@dataclass(frozen=True)
class BenchPlan(LimitOptions):
    """Options of `carom bench`. A growth bench ignores the options of errors and of rounds.

    Attributes:
        engines: Names of adapters; None for all.
        dts: Step sizes, in seconds; None for default step sizes that depend on the scene's frame.
        profiles: Names of profiles.
        phases: Number of phases, evenly spread over a step, at which the error of each method is measured.
        error: Kind of error.
        target: The document names the fastest engine with at most this error.
        rounds: Number of rounds of the timing pass.
        seed: Seed of the random order of runs in a round of timing.
        budget_s: Time limit for a scene, in seconds: half of it for errors, half for run times. In a growth bench, time
            limit for all runs of a gas. Runs that would take longer are omitted with a reason.
        timing: Whether to measure run times.
        own: Whether PIC and PIT run in addition to the chosen engines. Engines are compared with PIC, which is exact,
            and with PIT, which checks once per step.
        sizes: Numbers of discs of a growth bench. By default `carom.studies.bench.growth.SIZES`, and for PIC and PIT
            the longer list `OWN_SIZES`.

    Raises:
        InputError: A value is invalid.
    """

    engines: Sequence[str] | None = declare_engines()
    dts: Sequence[float] | None = declare_option(
        None,
        build_step_kind(
            parse_step_series, f", or in the shell a series such as 1/60..1/10000:6 (at most {MOST_SERIES} steps)"
        ),
        f"Step size in seconds, or a series such as 1/60..1/10000:6 of up to {MOST_SERIES} step sizes; repeatable.",
        "--dt",
        many=True,
        default_text="six step sizes, from a scene's frame to 1/167 of the frame",
    )
    profiles: Sequence[str] = declare_profiles("default", "tuned")
    phases: int = declare_phases(4)
    error: ErrorKind = declare_option(ErrorKind.IMPACT, build_enum_kind(ErrorKind), "Error to plot.", "--error")
    target: float = declare_option(
        0.01,
        build_measure_kind("a positive number", "NUMBER", 0.0, LARGEST),
        "Name the fastest engine with at most this error.",
        "--target",
    )
    rounds: int = declare_option(
        7, build_whole_number_kind(LEAST_ROUNDS, MOST_ROUNDS), "Number of timing rounds.", "--rounds"
    )
    seed: int = declare_option(1, build_whole_number_kind(0, MOST_SEED), "Seed of the order in a round.", "--seed")
    budget_s: float = declare_option(
        BUDGET_S, build_seconds_kind(), "Seconds per scene, half for scoring and half for timing.", "--budget"
    )
    timing: bool = declare_option(True, build_flag_kind(), "Measure run times.", "--timing/--no-timing")
    own: bool = declare_option(True, build_flag_kind(), "Also run PIC and PIT.", "--own/--no-own")
    sizes: Sequence[int] | None = declare_option(
        None,
        build_whole_number_kind(1, MOST_DISCS),
        "With --grow: number of discs, repeatable.",
        "--discs",
        many=True,
        default_text="10 to 10,000, for PIC and PIT to 100,000",
    )
