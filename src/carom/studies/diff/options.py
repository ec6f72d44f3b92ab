"""Options of `carom diff`; see `carom.support.options`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from carom.execution.shared_options import FailOn
from carom.support.options import DeclaredOptions, ValueKind, build_enum_kind, declare_option


def _parse_two_names(value: Any) -> tuple[str, str]:
    old, new = value
    if not (isinstance(old, str) and isinstance(new, str) and old and new):
        raise ValueError
    return old, new


_SAID = "OLD=NEW, such as pymunk=mujoco or pymunk/default=pymunk/tuned"
_PAIRS = ValueKind(_SAID, "OLD=NEW", _parse_two_names, lambda text: text.split("=", 1))


@dataclass(frozen=True)
class DiffOptions(DeclaredOptions):
    """Options of `carom diff`, except for the two reports.

    Attributes:
        match: Pairs of names to compare: an engine ("pymunk") or method ("pymunk/tuned") in the old report, and one in
            the new report. Engines and methods without a pair are not compared. By default, methods with the same name
            are compared. If each report has only one method, these two methods are compared.
        fail_on: The comparison fails if a run became worse, and its new grade is this grade or worse.

    Raises:
        InputError: A value is invalid.
    """

    match: Sequence[tuple[str, str]] | None = declare_option(
        None,
        _PAIRS,
        "Compare only the old engine or method OLD with the new one NEW, such as pymunk=mujoco; repeatable.",
        "--engine",
        "-e",
        many=True,
        default_text="same names",
    )
    fail_on: FailOn = declare_option(
        FailOn.INACCURATE,
        build_enum_kind(FailOn),
        "Exit with code 1 if a run became worse, and its new grade is this grade or worse.",
        "--fail-on",
    )
