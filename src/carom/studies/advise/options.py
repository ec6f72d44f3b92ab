"""Options of `carom advise`; see `carom.support.options`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from carom.execution.shared_options import LimitOptions, declare_engines, declare_phases, declare_profiles
from carom.support.limits import ADVICE_STEPS, MOST_STEPS
from carom.support.options import build_measure_kind, build_whole_number_kind, declare_option


def _parse_angle(text: str) -> float:
    for unit, scale in (("deg", math.pi / 180.0), ("rad", 1.0)):
        if text.endswith(unit):
            return float(text.removesuffix(unit)) * scale
    raise ValueError


_ANGLE_TEXT = "an angle such as 1deg or 0.02rad, above 0 and below 180 degrees"
# `build_measure_kind` excludes its lower limit and includes its upper limit. To include 0, the lower limit is the next
# float below 0. To exclude pi or 1, the upper limit is the next float below pi or 1.
_ANGLE = build_measure_kind(_ANGLE_TEXT, "ANGLE", 0.0, math.nextafter(math.pi, 0.0), parse=_parse_angle)
_ABOVE, _UP_TO = math.nextafter(0.0, -1.0), math.nextafter(1.0, 0.0)
_FRACTION = build_measure_kind("0 or more and below 1", "NUMBER", _ABOVE, _UP_TO, span="0 to below 1")


@dataclass(frozen=True)
class AdviceOptions(LimitOptions):
    """Options of `carom advise`, except for the scene.

    Attributes:
        engines: Names of adapters; None for all. PIC and PIT are never recommended.
        profiles: Names of profiles.
        direction_error_rad: Largest allowed error of a disc's direction after any impact.
        miss_probability: Allowed fraction of phases at which an impact is missed or invented.
        phases: Number of phases, evenly spread over a step, at which each step size is tested.
        budget_steps: Largest number of engine steps in the search for one method. The search ends if the test of the
            next step size would exceed this number.

    Raises:
        InputError: A value is invalid.
    """

    engines: Sequence[str] | None = declare_engines()
    profiles: Sequence[str] = declare_profiles("default", "tuned", "swept", "located")
    direction_error_rad: float = declare_option(
        math.radians(1.0),
        _ANGLE,
        "Maximum error of any direction, such as 1deg or 0.02rad.",
        "--direction-error",
        default_text="1deg",
    )
    miss_probability: float = declare_option(
        0.0, _FRACTION, "Allowed fraction of phases with a missed or spurious impact.", "--miss-probability"
    )
    phases: int = declare_phases(8)
    budget_steps: int = declare_option(
        ADVICE_STEPS,
        build_whole_number_kind(1, MOST_STEPS),
        "Maximum number of engine steps in the search for one engine and profile.",
        "--budget",
    )
