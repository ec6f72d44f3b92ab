"""Options of `carom tune`; see `carom.support.options`."""

from __future__ import annotations

from dataclasses import dataclass

from carom.errors import InputError
from carom.execution.shared_options import MOST_SEED, LimitOptions
from carom.support.escaping import format_value
from carom.support.options import (
    build_flag_kind,
    build_name_kind,
    build_step_kind,
    build_whole_number_kind,
    declare_option,
)


@dataclass(frozen=True)
class TuneOptions(LimitOptions):
    """Options of `carom tune`, except for its engine and scenes.

    Attributes:
        profile: The profile from which the search starts.
        dt_s: Step size, in seconds (default: one frame of each scene).
        trials: Number of combinations of settings to try before the best ones are refined.
        seed: Seed of the optimiser's random numbers.
        timing: Whether faster settings are preferred if accuracy is equal. With timing, only one job runs at a time.

    Raises:
        InputError: A value is invalid, or `timing` is requested on a cluster.
    """

    profile: str = declare_option("default", build_name_kind(), "Profile to start from.", "--profile", "-p")
    dt_s: float | None = declare_option(
        None, build_step_kind(), "Step size in seconds, such as 1/240.", "--dt", default_text="one frame of each scene"
    )
    trials: int = declare_option(
        100,
        build_whole_number_kind(1, MOST_SEED),
        "Number of combinations of settings to try before the best is refined.",
        "--trials",
    )
    seed: int = declare_option(0, build_whole_number_kind(0, 2**32 - 1), "Seed of the optimiser.", "--seed")
    timing: bool = declare_option(
        False, build_flag_kind(), "Prefer faster settings if accuracy is equal.", "--timing/--no-timing"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.timing and self.scheduler is not None:
            raise InputError(
                f"run times are only comparable on one machine, but the scheduler is {format_value(self.scheduler)}: "
                "omit --timing or --scheduler"
            )
