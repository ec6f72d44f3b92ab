"""Functions shared by checks: declared capabilities, comparison of velocities, and formatting of vectors."""

from __future__ import annotations

import math
from collections.abc import Sequence

from carom.conformance.adapter_under_test import Subject, find_greatest_speed
from carom.conformance.suite_scenes import DT_S
from carom.conformance.violation import NotApplicable, Setup, require
from carom.engines.api import Capabilities, Observation
from carom.model.scene import Scene
from carom.solvers.pic import solve_pic
from carom.support.formatting import format_number


def require_declared(subject: Subject, field: str) -> Capabilities:
    """Return an adapter's capabilities if the adapter declares the capability `field`.

    Raises:
        NotApplicable: The adapter declares this capability as False.
    """
    capabilities = subject.capabilities()
    if not getattr(capabilities, field):
        raise NotApplicable(f"{field} is declared to be False")
    return capabilities


def require_supported(subject: Subject, scene: Scene, profile: str = "tuned", dt_s: float = DT_S) -> Setup:
    """Return the setup of a check: the scene, the profile and the step size.

    Raises:
        NotApplicable: The declared capabilities exclude the scene.
    """
    setup = Setup(scene, profile, dt_s)
    if reason := subject.find_unsupported_reason(setup):
        raise NotApplicable(reason)
    return setup


def end_like_pic(
    subject: Subject, scene: Scene, label: str, *, dt_s: float = DT_S, stepwise_m_s: float = 0.0
) -> Observation:
    """Run a scene, compare the velocities at the end with those of PIC, and return the final state.

    Head-on impacts have the same result with any step size, so only rounding and declared errors are allowed.
    `stepwise_m_s` is the additional error that is allowed because the engine integrates in steps.

    Raises:
        NotApplicable: The declared capabilities exclude the scene.
        Violation: An error exceeds the sum of the allowed errors.
    """
    setup = require_supported(subject, scene, dt_s=dt_s)
    end = subject.watch(setup).states[-1]
    promise = subject.adapter.profiles[setup.profile].accuracy.velocity
    allowed = (subject.rounding + promise) * find_greatest_speed(scene) + stepwise_m_s
    exact = solve_pic(scene).final_velocity_m_s.tolist()
    for i, (velocity, found) in enumerate(zip(exact, end.velocity_m_s.tolist(), strict=True)):
        error = math.dist(velocity, found)
        found_text = f"{format_vector(found)} m/s, off by {format_number(error, 3)}"
        wrong, expected_text = f"{label}: disc {i} ends with a wrong velocity", f"{format_vector(velocity)} m/s"
        require(error <= allowed, wrong, f"{expected_text} to within {format_number(allowed)}", found_text, setup)
    return end


def format_vector(vector: Sequence[float]) -> str:
    """Format a vector as (x, y), as short as possible."""
    return f"({', '.join(format_number(x, 10) for x in vector)})"
