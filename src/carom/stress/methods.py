"""Which methods are attacked: engines and profiles, each once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from carom.runs.plan import chosen_engines, distinct_profiles, profiles_to_plan

__all__ = ["Method", "methods"]


@dataclass(frozen=True)
class Method:
    """One engine with one profile.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        version: Version of the engine, empty where it is unavailable.
        unavailable: Why the engine can't be used here, empty where it can.
    """

    engine: str
    profile: str
    version: str = ""
    unavailable: str = ""

    @property
    def name(self) -> str:
        """Engine and profile, as tables have it."""
        return f"{self.engine}/{self.profile}"


def methods(engine_names: Sequence[str] | None, profiles: Sequence[str], dt_s: float) -> list[Method]:
    """Return the methods to attack; of profiles with the same settings at this step only the last.

    Raises:
        UnknownNameError: There is no such engine, or no engine asked for has such a profile.
    """
    chosen = chosen_engines(engine_names or None)
    wanted = profiles_to_plan(chosen, profiles)
    return [
        Method(info.name, profile, info.version, info.unavailable)
        for info in chosen
        for profile in distinct_profiles(info, wanted, dt_s)
    ]
