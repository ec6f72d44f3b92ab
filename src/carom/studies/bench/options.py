"""Options of `carom bench`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

from carom.execution.shared_options import (
    MOST_SEED,
    LimitOptions,
    declare_engines,
    declare_no_scheduler,
    declare_phases,
    declare_profiles,
)
from carom.studies.bench.axes import ErrorKind
from carom.support.limits import LARGEST, MOST_DISCS, MOST_ROUNDS, MOST_SERIES
from carom.support.options import (
    build_enum_kind,
    build_flag_kind,
    build_measure_kind,
    build_name_kind,
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


def compute_geometric_steps(coarsest_s: float, finest_s: float, count: int) -> tuple[float, ...]:
    """Return up to `count` step sizes that are evenly spread on a logarithmic axis.

    If both ends are whole numbers of steps per second, the others are rounded to whole numbers of steps per second.
    `count` is 2 or more.
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


def declare_own_methods() -> Any:
    """Declare the option to run Carom's own methods."""
    return declare_option(
        True, build_flag_kind(), "Run PIC and PIT in addition to the chosen engines.", "--own/--no-own"
    )


@dataclass(frozen=True)
class BenchPlan(LimitOptions):
    """Options of `carom bench`, except for growth benches.

    Attributes:
        engines: Names of adapters; None for all.
        dts: Step sizes, in seconds; None for default step sizes that depend on the scene's frame.
        profiles: Names of profiles.
        phases: Number of phases, evenly spread over a step, at which the error of each method is measured.
        error: Kind of error.
        target: The document names the fastest engine with at most this error.
        rounds: Number of rounds of the timing pass.
        seed: Seed of the random order of runs in a round of timing.
        budget_s: Time limit for a scene, in seconds: half of it for errors, half for run times. Runs that would take
            longer are omitted with a reason.
        timing: Whether to measure run times.
        own: Whether PIC and PIT run in addition to the chosen engines. Engines are compared with PIC, which is exact,
            and with PIT, which checks once per step.

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
    seed: int = declare_option(
        1, build_whole_number_kind(0, MOST_SEED), "Seed of the random order within a timing round.", "--seed"
    )
    budget_s: float = declare_option(
        BUDGET_S, build_seconds_kind(), "Seconds per scene, half for scoring and half for timing.", "--budget"
    )
    timing: bool = declare_option(True, build_flag_kind(), "Measure run times.", "--timing/--no-timing")
    own: bool = declare_own_methods()


@dataclass(frozen=True)
class GrowthOptions(LimitOptions):
    """Options of `carom bench --grow`, a growth bench.

    Attributes:
        engines: Names of adapters; None for all.
        profile: Name of the profile.
        sizes: Numbers of discs. By default `carom.studies.bench.growth.SIZES`, and for PIC and PIT the longer list
            `OWN_SIZES`.
        budget_s: Time limit for all runs of a gas, in seconds. A run is omitted with a reason if it would probably take
            longer than the rest of this time.
        own: Whether PIC and PIT run in addition to the chosen engines.

    Raises:
        InputError: A value is invalid.
    """

    engines: Sequence[str] | None = declare_engines()
    profile: str = declare_option("tuned", build_name_kind(), "Settings profile.", "--profile")
    sizes: Sequence[int] | None = declare_option(
        None,
        build_whole_number_kind(1, MOST_DISCS),
        "With --grow: number of discs, repeatable.",
        "--discs",
        many=True,
        default_text="10 to 10,000, for PIC and PIT to 100,000",
    )
    budget_s: float = declare_option(BUDGET_S, build_seconds_kind(), "Seconds per gas.", "--budget")
    own: bool = declare_own_methods()
    _: KW_ONLY
    scheduler: str | None = declare_no_scheduler("run time and memory are measured on this machine")
