"""Options of `carom history`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

from carom.execution.shared_options import (
    LimitOptions,
    declare_no_scheduler,
    declare_profiles,
    declare_seed,
    declare_steps,
)
from carom.support.limits import MOST_PHASES
from carom.support.options import (
    build_flag_kind,
    build_megabytes_kind,
    build_name_kind,
    build_whole_number_kind,
    declare_option,
)

#: Smallest number of phases with which a change is attributed to the engine. With fewer phases, a release may look
#: better or worse by chance.
FEWEST_PHASES = 8


@dataclass(frozen=True)
class HistoryOptions(LimitOptions):
    """Options of `carom history`, except for its engine and scenes.

    Attributes:
        versions: Releases to run, as versions or as conditions such as ">=6" or "3.0..4.0" (default: all).
        most: Largest number of releases to run. If more releases meet the conditions, only the newest of them are run.
            Releases that the user names by version are run in addition.
        installed: Whether the installed engine also runs, after all releases.
        profiles: Names of profiles.
        dts: Step sizes, in seconds (default: one frame of each scene).
        phases: Number of additional phases at which a changed run is repeated.
        seed: Start of the quasi-random sequence of phases.
        kept_mb: Largest total size of all cached releases, in megabytes.

    Raises:
        InputError: A value is invalid.
    """

    versions: Sequence[str] | None = declare_option(
        None,
        build_name_kind(),
        "Releases to run, such as 5.7.0, '>=6' or 3.0..4.0; repeatable or comma-separated.",
        "--versions",
        many=True,
        default_text="all",
    )
    most: int = declare_option(
        12, build_whole_number_kind(1, 1000), "Maximum number of releases to run; the newest are preferred.", "--most"
    )
    installed: bool = declare_option(
        False, build_flag_kind(), "Also run the installed engine, after all releases.", "--with-installed"
    )
    profiles: Sequence[str] = declare_profiles("default", "tuned")
    dts: Sequence[float] | None = declare_steps("one frame of each scene")
    phases: int = declare_option(
        FEWEST_PHASES,
        build_whole_number_kind(FEWEST_PHASES, MOST_PHASES),
        "Number of phases (shifts by fractions of a step) at which changed runs are repeated.",
        "--phases",
    )
    seed: int = declare_seed()
    kept_mb: float = declare_option(
        2000.0, build_megabytes_kind(), "Maximum size of downloaded releases to keep, in megabytes.", "--keep"
    )
    _: KW_ONLY
    scheduler: str | None = declare_no_scheduler("each release is installed into a folder of this machine")
