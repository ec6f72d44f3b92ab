"""Settings that are tried without a profile: which an engine has, and what is asked for as the kind that each is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from carom.engines.registry import EngineInfo, load_adapter
from carom.errors import AdapterError, InputError, UnknownNameError
from carom.execution.engine_run import profile_settings
from carom.execution.job import AdapterTask, SettingOverrides
from carom.execution.pool import TaskRunner
from carom.model.trace import Setting, setting_text
from carom.support.escaping import named_hints

#: Set by other means: the step is a part of a job.
STEP = "dt_s"

_BOOLS = {"true": True, "false": False}
_KINDS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}


@dataclass(frozen=True)
class KnownSettingsTask(AdapterTask):
    """Ask an adapter for every setting that one of its profiles has, with a value of each.

    Attributes:
        profiles: Names of the profiles whose values count first.
        dt_s: Step, seconds.
    """

    profiles: tuple[str, ...]
    dt_s: float

    def carry_out(self) -> Mapping[str, Setting]:
        """Return the values by name; of a profile that fails none, since the caller is told why."""
        adapter = load_adapter(self.engine)
        found: dict[str, Setting] = {}
        for profile in dict.fromkeys((*self.profiles, *adapter.profiles)):
            try:
                found = {**profile_settings(adapter, profile, self.dt_s), **found}
            except (AdapterError, UnknownNameError):
                continue
        return found


def resolve_settings(
    info: EngineInfo, asked: Mapping[str, Setting], profiles: Sequence[str], dt_s: float, runner: TaskRunner
) -> SettingOverrides:
    """Return the settings that an engine is to try, each as the kind that it is, in order of name.

    Args:
        info: What is known of the engine.
        asked: The settings, by name; a text is read as the kind that the setting is.
        profiles: The profiles instead of whose settings they are tried.
        dt_s: A step at which the profiles are asked for theirs, seconds.
        runner: Where the adapter is asked.

    Raises:
        UnknownNameError: The engine has no such setting.
        InputError: A value is not of the setting's kind.
    """
    if not asked or not info.profiles:  # of an adapter that declares nothing its rows say why
        return ()
    answer = runner.run(KnownSettingsTask(info.name, tuple(profiles), dt_s))
    if answer.value is None:
        raise InputError(f"{info.name} was asked which settings it has, and {answer.said}")
    known = {**{name: knob.example for name, knob in info.knobs.items()}, **answer.value}
    return tuple(sorted((name, _read(info.name, name, value, known)) for name, value in asked.items()))


def _read(engine: str, name: str, value: Setting, known: Mapping[str, Setting]) -> Setting:
    if name == STEP:
        raise InputError(f"{STEP} is the step, which is asked for as one: --dt, or dt in Python")
    if name not in known:
        names = ", ".join(sorted(known.keys() - {STEP})) or "none"
        hints = named_hints(name, known, f"there are: {names}")
        raise UnknownNameError(f"{engine} has no setting {name!r}", hints=hints)
    kind = type(known[name])
    found = _as_kind(value, kind)
    if found is None:
        raise InputError(f"setting {name!r} of {engine} must be {_KINDS[kind]}, got {setting_text(value)!r}")
    return found


def _as_kind(value: Setting, kind: type[Setting]) -> Setting | None:
    """Return a value as the kind that a setting is, None where it is none."""
    if kind is str or kind is bool:
        found = _BOOLS.get(value.lower()) if kind is bool and isinstance(value, str) else value
        return found if isinstance(found, kind) else None
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        return None
    try:
        number: int | float = kind(value)  # type: ignore[assignment] # int or float, and what neither reads raises
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
