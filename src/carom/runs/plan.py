"""The plan of a cross-check: which scene runs on which engine, with which profile and at which step.

Derived from the scenes and from what the adapters declare; no engine is started. What is run and what ``--explain``
prints are read off the same plan.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from carom.adapter import Adapter, Capabilities, ContactTimes, unsupported_reason
from carom.errors import AdapterError, UnknownNameError
from carom.registry import EngineInfo, engines, load_adapter
from carom.runs.drive import profile_settings
from carom.runs.results import Cell
from carom.scene import Scene

__all__ = [
    "ALL_PROFILES",
    "DEFAULT_PROFILES",
    "capabilities_of",
    "chosen_engines",
    "default_dts",
    "distinct_profiles",
    "missing_profile_reason",
    "planned_cells",
    "profiles_to_plan",
    "unsupported_reason",
]

DEFAULT_PROFILES = ("default", "tuned", "located")

#: Stands for every profile that an engine offers.
ALL_PROFILES = "all"

#: Each step of a scene's series is this part of the one before: far enough apart to show an order of convergence.
REFINEMENT = 4
REFINEMENTS = 3


def default_dts(scene: Scene) -> tuple[float, ...]:
    """Return the steps at which a scene is run unless others are asked for: its own frame, a quarter, a sixteenth."""
    return tuple(1.0 / (scene.frame_rate_hz * REFINEMENT**k) for k in range(REFINEMENTS))


def chosen_engines(names: Sequence[str] | None) -> list[EngineInfo]:
    """Return what is known of the engines of these names, or of all.

    Raises:
        UnknownNameError: There is no such engine.
    """
    known = {info.name: info for info in engines()}
    for name in names or ():
        if name not in known:
            raise UnknownNameError(f"no engine is named {name!r}; there are: {', '.join(known)}")
    return [info for info in known.values() if names is None or info.name in names]


def profiles_to_plan(infos: Sequence[EngineInfo], asked: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the profiles to run: those asked for, all that are offered, or those of `DEFAULT_PROFILES`.

    Raises:
        UnknownNameError: No engine asked for has such a profile.
    """
    offered = {profile: None for info in infos for profile in info.profiles}
    for profile in asked or ():
        if profile not in (*offered, ALL_PROFILES) and all(info.profiles for info in infos):
            raise UnknownNameError(f"no engine asked for has a profile {profile!r}; there are: {', '.join(offered)}")
    if asked is not None and ALL_PROFILES in asked:
        asked = tuple(offered)
    chosen = tuple(asked) if asked is not None else tuple(name for name in DEFAULT_PROFILES if name in offered)
    return chosen or DEFAULT_PROFILES  # no adapter asked for can be loaded: its rows say why


def planned_cells(
    scenes: Sequence[Scene], infos: Sequence[EngineInfo], dts: Sequence[float] | None, asked: Sequence[str] | None
) -> Iterator[Cell]:
    """Return the cells of a cross-check; arguments as those of `carom.cross_check`.

    Raises:
        UnknownNameError: No engine asked for has such a profile.
    """
    profiles = profiles_to_plan(infos, asked)
    for scene in scenes:
        steps = tuple(dts) if dts else default_dts(scene)
        for info in infos:
            for refinement, dt_s in enumerate(sorted(set(steps), reverse=True)):
                for profile in distinct_profiles(info, profiles, dt_s):
                    if dts or refinement == 0 or not _is_located(info, profile):
                        yield Cell(scene, info.name, profile, dt_s, refinement)


def _is_located(info: EngineInfo, profile: str) -> bool:
    return bool(info.profiles) and load_adapter(info.name).profiles[profile].located


def distinct_profiles(info: EngineInfo, profiles: Sequence[str], dt_s: float) -> list[str]:
    """Return the profiles to run of an engine, without those that would only run the same settings again."""
    if not info.profiles:  # the adapter can't be loaded: one row says why
        return [profiles[-1]]
    return distinct_settings(load_adapter(info.name), profiles, dt_s)


def distinct_settings(adapter: Adapter, profiles: Sequence[str], dt_s: float) -> list[str]:
    """Return which profiles of an adapter to run: of those with the same settings at a step only the last."""
    by_settings: dict[object, str] = {}
    for profile in profiles:
        if profile in adapter.profiles:
            try:
                settings: object = (
                    adapter.profiles[profile].located,
                    *sorted(profile_settings(adapter, profile, dt_s).items()),
                )
            except AdapterError:  # its row will say why
                settings = profile
            by_settings[settings] = profile
    return sorted(by_settings.values(), key=list(profiles).index)


def capabilities_of(adapter: Adapter, profile: str) -> Capabilities:
    """Return what an engine can do with a profile: the profile's own word, or else the adapter's."""
    known = adapter.profiles.get(profile)
    return known.capabilities if known is not None and known.capabilities is not None else adapter.capabilities


def missing_profile_reason(profile: str, capabilities: Capabilities) -> str:
    """Return why a method that declares these capabilities has no profile of this name, as far as that can be told."""
    if profile.startswith("cylinder") and capabilities.dimensions == 2:
        return "its discs are two-dimensional: there is nothing to tip over"
    if profile == "no-ccd" and not capabilities.continuous_detection:
        return "it has no continuous detection that could be left out"
    if capabilities.contact_times is ContactTimes.SOLVED:
        return "it solves for the instant of an impact: there is no step to cut and nothing to sweep"
    if profile == "located":
        return "its steps are not cut: to look only at their boundaries is what it stands for"
    return "its adapter offers no such profile"
