"""Options of `carom stress`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

from carom.execution.shared_options import LimitOptions, declare_engines, declare_profiles
from carom.support.limits import DEFAULT_TIME_LIMIT_S
from carom.support.options import build_flag_kind, build_seconds_kind, declare_option

#: Time limit of a run in a quick campaign, in seconds. A scene of a quick campaign normally takes less than a second.
QUICK_TIME_LIMIT_S = 10.0


@dataclass(frozen=True)
class StressOptions(LimitOptions):
    """Options of `carom stress`, except for the names of tests.

    Attributes:
        engines: Names of adapters; None for all.
        profiles: Names of profiles.
        quick: Whether to run a quick campaign, with fewer values, smaller ranges and a coarser bisection.
        time_limit_s: Time limit of a run, in seconds. A run that takes longer fails. The default is shorter in a quick
            campaign.

    Raises:
        InputError: A value is invalid.
    """

    fixed_on_resume = ("quick", "time_limit_s")

    engines: Sequence[str] | None = declare_engines()
    profiles: Sequence[str] = declare_profiles("default", "tuned")
    quick: bool = declare_option(
        False,
        build_flag_kind(),
        "Run a quick campaign of less than a minute, with fewer values and smaller ranges.",
        "--quick",
    )
    _: KW_ONLY
    time_limit_s: float = declare_option(
        None,
        build_seconds_kind(),
        "Time limit of a run in seconds; a run that takes longer fails.",
        "--time-limit",
        default_text=f"{DEFAULT_TIME_LIMIT_S:g}; {QUICK_TIME_LIMIT_S:g} with --quick",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.time_limit_s is None:
            object.__setattr__(self, "time_limit_s", QUICK_TIME_LIMIT_S if self.quick else DEFAULT_TIME_LIMIT_S)
