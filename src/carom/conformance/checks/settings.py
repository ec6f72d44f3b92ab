"""Checks of settings and of the initial state: a world uses the requested settings, and starts in the scene's state."""

from __future__ import annotations

import numpy as np

from carom.conformance.adapter_under_test import Subject
from carom.conformance.probes import AdapterFailure
from carom.conformance.suite_scenes import build_crowd
from carom.conformance.violation import Setup, Violation, require
from carom.engines.api.checks import MANTISSA_BITS
from carom.model.trace import Setting

UNKNOWN = "carom_no_such_setting"

#: Number of times that a value is rounded when it is converted to the engine's units and back. A velocity is rounded
#: more often, because both its length and its time are converted.
ROUNDINGS = {"position_m": 2, "velocity_m_s": 4}

_FLOATS = {32: np.float32, 64: np.float64}


def check_settings(subject: Subject, profile: str) -> None:
    """A world reports each setting of its profile with the requested value, rounded to the declared float width."""
    setup = Setup(build_crowd(), profile)
    used = subject.watch_cached(setup).settings
    bits = subject.capabilities(profile).float_bits
    for name, value in subject.settings(profile, setup.dt_s).items():
        is_reported = name in used
        found = f"{name} = {used[name]!r}" if is_reported else f"no {name}, but {', '.join(used)}"
        problem = "a setting differs from the requested one"
        require(is_reported and _are_equal(value, used[name], bits), problem, f"{name} = {value!r}", found, setup)


def _are_equal(requested: Setting, found: Setting, bits: int) -> bool:
    """Return whether two settings are equal in floats of `bits` bits."""
    if isinstance(requested, str) or isinstance(found, str) or not isinstance(requested + found, float):
        return requested == found
    with np.errstate(over="ignore"):  # values above the largest float become infinite
        return bool(_FLOATS[bits](requested) == _FLOATS[bits](found))


def check_refuses_unknown_setting(subject: Subject) -> None:
    """If a setting does not exist, `prepare` raises an AdapterError that contains the setting's name."""
    setup = Setup(build_crowd())
    answer = subject.try_to_watch(setup, {UNKNOWN: 1})
    prefix, expected = "an unknown setting is", f"prepare() to raise an AdapterError naming {UNKNOWN!r}"
    if not isinstance(answer, AdapterFailure):
        raise Violation(f"{prefix} accepted", expected, "a run to the end of the scene", setup)
    clear = answer.where == "prepare" and answer.is_carom_error and UNKNOWN in answer.message
    require(clear, f"{prefix} refused unclearly", expected, answer, setup)


def check_start(subject: Subject, profile: str) -> None:
    """Before its first step, a world is in the scene's initial state, rounded to the declared width of floats.

    The conversion to the engine's units and back may round each number a few times.
    """
    setup = Setup(build_crowd(), profile)
    start = subject.watch_cached(setup).states[0]
    # One rounding changes a number by at most half a unit in the last place.
    rounding = 2.0 ** -(MANTISSA_BITS[subject.capabilities().float_bits] + 1)
    for i, disc in enumerate(setup.scene.discs):
        for field, times in ROUNDINGS.items():
            expected, found = getattr(disc, field), tuple(getattr(start, field)[i].tolist())
            is_same = all(abs(f - a) <= times * rounding * abs(a) for a, f in zip(expected, found, strict=True))
            require(is_same, f"disc {i} starts differently from the scene", f"{field} = {expected}", found, setup)
    untouched = not (start.contacts or start.warning)
    require(untouched, "a world starts with contacts or a warning", "none", start.warning or start.contacts, setup)
