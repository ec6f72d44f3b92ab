"""Options of `carom run`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from carom.errors import InputError
from carom.execution.shared_options import LimitOptions, declare_engines, declare_profiles, declare_seed, declare_steps
from carom.support.limits import CERTIFY_SECONDS, MOST_PHASES
from carom.support.options import (
    ValueKind,
    build_flag_kind,
    build_seconds_kind,
    build_whole_number_kind,
    declare_option,
)

if TYPE_CHECKING:
    from carom.model.scene import Scene
    from carom.model.trace import Setting

#: Each default step size of a scene is smaller than the previous one by this factor. The factor is large enough to show
#: how errors decrease with the step size.
REFINEMENT = 4
REFINEMENTS = 3


def compute_default_dts(scene: Scene) -> tuple[float, ...]:
    """Return the default step sizes of a scene: one frame, and a quarter and a sixteenth of a frame."""
    return tuple(1.0 / (scene.frame_rate_hz * REFINEMENT**k) for k in range(REFINEMENTS))


def _to_mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping | tuple):  # the default of `settings` is an empty tuple
        raise TypeError
    return dict(value)


def parse_settings(words: Sequence[str]) -> dict[str, Setting]:
    """Parse settings in the form ``name=value``. Values are returned as text.

    Raises:
        InputError: A word has no ``=`` or no name, or a setting occurs twice.
    """
    found: dict[str, Setting] = {}
    for word in words:
        name, sign, value = word.partition("=")
        if not (name and sign):
            raise InputError(f"--set must be NAME=VALUE, such as iterations=20, got {word!r}")
        if name in found:
            raise InputError(f"--set: {name} is given twice, as {found[name]} and {value}")
        found[name] = value
    return found


@dataclass(frozen=True)
class Options(LimitOptions):
    """Options of a cross-check, without its scenes.

    Attributes:
        engines: Names of adapters; by default all adapters with installed engines.
        dts: Step sizes, in seconds; by default the result of `compute_default_dts` for each scene.
        profiles: Names of profiles, or "all". By default, each engine runs with those profiles of
            `carom.execution.methods.DEFAULT_PROFILES` that it offers. If two profiles of an engine have the same
            settings, only the later profile is run. By default, the profile `located` is run only at a scene's largest
            step size, since its results do not depend on the step size.
        settings: Settings that replace settings of the profiles, by name. Every requested engine must have these
            settings. A text is converted to the type of the setting.
        phases: Number of phases at which each job is run again, to measure how much errors vary.
        seed: Start of the quasi-random sequence of phases.
        certified: Whether to compare engines with certified runs. By default, engines are compared with PIC. If
            python-flint is installed, scenes of three or more discs have certified runs, which show how long PIC is
            reliable.
        certify_s: Time limit for the certified run of each scene, in seconds.
        timing: Whether to also time each job with its scene's largest step size, while nothing else runs.
        samples: Whether to store positions of the discs, which the pictures of reports need.

    Raises:
        InputError: A value is invalid.
    """

    fixed_on_resume = (
        *("engines", "dts", "profiles", "settings", "phases", "seed", "certified", "certify_s", "timing", "samples"),
        *("time_limit_s", "memory_limit_mb"),
    )

    engines: Sequence[str] | None = declare_engines()
    dts: Sequence[float] | None = declare_steps("1, 1/4 and 1/16 of a scene's frame")
    profiles: Sequence[str] | None = declare_profiles(
        help_text="Settings profile, repeatable, or 'all' for every profile.", default_text="default, tuned, located"
    )
    settings: Mapping[str, Setting] = declare_option(
        (),
        ValueKind("a mapping from names to values", "NAME=VALUE", _to_mapping, gather=parse_settings),
        "Override a setting of the profiles, repeatable. Every chosen engine must have the setting.",
        "--set",
    )
    phases: int = declare_option(
        0,
        build_whole_number_kind(0, MOST_PHASES),
        "Also run each scene at this many phases (shifts by fractions of a step), to show the spread of errors.",
        "--phases",
    )
    seed: int = declare_seed()
    certified: bool | None = declare_option(
        None,
        build_flag_kind(),
        "Compare with certified runs, which need python-flint.",
        "--certify/--no-certify",
        default_text="PIC, with certified runs for three discs or more",
    )
    certify_s: float = declare_option(
        CERTIFY_SECONDS, build_seconds_kind(), "Seconds per certified run.", "--certify-time"
    )
    timing: bool = declare_option(
        True, build_flag_kind(), "For the report, time each scene at its largest step size.", "--timing/--no-timing"
    )
    samples: bool = declare_option(True, build_flag_kind(), "Whether to keep states for drawing.")

    def list_steps(self, scene: Scene) -> tuple[float, ...]:
        """Return the step sizes with which a scene is run, beginning with the largest."""
        return tuple(sorted(set(self.dts or compute_default_dts(scene)), reverse=True))
