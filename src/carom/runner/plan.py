"""What a run needs, and why a method can't give it: derived from the scene and the declared capabilities alone."""

from __future__ import annotations

from carom.adapter import Adapter, Capabilities, ContactTimes, unsupported_reason

__all__ = ["capabilities_of", "missing_profile_reason", "unsupported_reason"]


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
