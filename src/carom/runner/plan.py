"""What a run needs, and why a method can't give it: derived from the scene and the declared capabilities alone."""

from __future__ import annotations

import math

from carom.adapter import Adapter, Capabilities, ContactTimes
from carom.scene import Need, Scene

__all__ = ["capabilities_of", "missing_profile_reason", "unsupported_reason"]

#: The engines count steps in a C int.
MAX_STEPS = 2**31 - 1

#: Bits of a float after the leading one, by its width (IEEE 754).
MANTISSA_BITS = {32: 23, 64: 52}


def unsupported_reason(scene: Scene, capabilities: Capabilities, dt_s: float) -> str:
    """Return why a method that declares these capabilities can't run the scene; empty where it can."""
    needs = scene.needs
    for need, supported in (
        (Need.WALLS, capabilities.walls),
        (Need.IMMOVABLE, capabilities.immovable_discs),
        (Need.GRAVITY, capabilities.gravity),
    ):
        if need in needs and not supported:
            suffix = " yet: gravity_m_s2 must be [0, 0]" if need is Need.GRAVITY else ""
            return f"the scene has {need.value}, which this method does not support{suffix}"
    low, high = capabilities.restitution
    used = [("restitution", scene.restitution)] if len(scene.discs) > 1 else []
    used += [("wall_restitution", scene.wall_restitution)] if scene.walls else []
    for name, value in used:
        if not low <= value <= high:
            return f"{name} is {value}, and this method simulates {low:g} to {high:g} as asked for"
    fastest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    if fastest > capabilities.max_speed_m_s:
        return f"a disc moves at {fastest:g} m/s, and this method's limit is {capabilities.max_speed_m_s:g} m/s"
    speeds = sorted((math.hypot(*disc.velocity_m_s) for disc in scene.discs), reverse=True)
    closing, threshold = sum(speeds[:2]), capabilities.restitution_threshold_m_s
    if 0 < closing <= threshold and any(value > 0 for _, value in used):
        slow = f"no two bodies close at more than {closing:g} m/s"
        return f"{slow}, and this method makes contacts of up to {threshold:g} m/s inelastic"
    if fastest * dt_s > capabilities.max_move_m:
        moved = f"a disc at {fastest:g} m/s moves {fastest * dt_s:g} m in a step of {dt_s:g} s"
        return f"{moved}, and this method moves none by more than {capabilities.max_move_m:g} m"
    for name, disc in ((f"discs[{i}].radius_m", disc) for i, disc in enumerate(scene.discs)):
        if not capabilities.min_radius_m <= disc.radius_m <= capabilities.max_radius_m:
            limits = f"{capabilities.min_radius_m:g} to {capabilities.max_radius_m:g} m"
            return f"{name} is {disc.radius_m:g}, and this method simulates {limits}"
    farthest = max(max(abs(c) for c in disc.position_m) + disc.radius_m for disc in scene.discs)
    if farthest > capabilities.max_coordinate_m:
        return f"a disc reaches to {farthest:g} m, and this method's limit is {capabilities.max_coordinate_m:g} m"
    # Where positions are rounded by more than a disc is large, there is no telling where it is.
    rounding, smallest = farthest * 2.0 ** -MANTISSA_BITS[capabilities.float_bits], min(d.radius_m for d in scene.discs)
    if rounding > smallest:
        floats = f"{capabilities.float_bits}-bit floats"
        return (
            f"a disc reaches to {farthest:g} m, where {floats} round by more than the smallest radius, {smallest:g} m"
        )
    if scene.duration_s / dt_s > MAX_STEPS:
        return f"{scene.duration_s:g} s in steps of {dt_s:g} s are more steps than an engine can count"
    return ""


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
