"""What checks share: their step, and the comparison of velocities."""

from __future__ import annotations

import math
from collections.abc import Sequence

from carom.adapter import Observation
from carom.conformance.scenes import DT_S
from carom.conformance.subject import Subject, greatest_speed
from carom.conformance.violation import NotApplicable, Setup, Violation
from carom.scene import Scene

__all__ = ["numbers", "own_setup", "require_supported", "require_velocities"]


def own_setup(scene: Scene, profile: str, dt_s: float = DT_S) -> Setup:
    """Return the run of a scene of the suite's own."""
    return Setup(scene, profile, dt_s)


def require_supported(subject: Subject, setup: Setup) -> None:
    """Leave a check whose scene is excluded by a declared capability.

    Raises:
        NotApplicable: With the capability as the reason.
    """
    if reason := subject.unsupported(setup):
        raise NotApplicable(reason)


def require_velocities(
    subject: Subject, setup: Setup, seen: Observation, expected: Sequence[tuple[float, float]], what: str
) -> None:
    """Hold final velocities of head-on impacts, exact at any step, against the known ones.

    Raises:
        Violation: One is off by more than rounding and what the profile promises.
    """
    promise = subject.adapter.profiles[setup.profile].accuracy.velocity
    allowed = (subject.rounding + promise) * greatest_speed(setup.scene)
    for i, (wanted, found) in enumerate(zip(expected, seen.velocity_m_s.tolist(), strict=True)):
        error = math.dist(wanted, found)
        if not error <= allowed:
            raise Violation(
                f"{what}: disc {i} leaves with a wrong velocity",
                expected=f"{numbers(wanted)} m/s to {allowed:.2g}",
                found=f"{numbers(found)} m/s, off by {error:.3g}",
                setup=setup,
            )


def numbers(vector: Sequence[float]) -> str:
    """Return a vector as (x, y), no longer than it has to be."""
    return f"({', '.join(f'{x:.10g}' for x in vector)})"
