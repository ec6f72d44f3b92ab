"""Which methods are attacked: engines and profiles, each once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from carom.errors import AdapterError, UnknownNameError
from carom.registry import engines, load_adapter
from carom.runner.drive import profile_settings

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
    known = {info.name: info for info in engines()}
    for name in engine_names or ():
        if name not in known:
            raise UnknownNameError(f"no engine is named {name!r}; there are: {', '.join(known)}")
    chosen = [info for info in known.values() if not engine_names or info.name in engine_names]
    offered = {profile for info in chosen for profile in info.profiles}
    for profile in profiles:
        if profile not in offered:
            raise UnknownNameError(
                f"no engine asked for has a profile {profile!r}; there are: {', '.join(sorted(offered))}"
            )
    found = []
    for info in chosen:
        if not info.profiles:  # its adapter can't be loaded: one column says why
            found.append(Method(info.name, profiles[-1], info.version, info.unavailable))
            continue
        distinct: dict[object, str] = {}
        for profile in profiles:
            if profile in info.profiles:
                try:
                    settings = profile_settings(load_adapter(info.name), profile, dt_s)
                    distinct[tuple(sorted(settings.items()))] = profile
                except AdapterError:  # its cells will say why
                    distinct[profile] = profile
        found += [Method(info.name, profile, info.version, info.unavailable) for profile in distinct.values()]
    return found
