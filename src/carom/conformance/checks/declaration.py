"""Checks of declarations: they are complete and valid, and can be read without importing the engine.

The suite tests only adapters whose declarations have passed `carom.execution.validate_adapter`, so types are correct.
"""

from __future__ import annotations

import math
import subprocess
import sys

from carom.conformance.adapter_under_test import Subject
from carom.conformance.suite_scenes import DT_S
from carom.conformance.violation import require
from carom.engines.api import Accuracy

PROFILES = ("default", "tuned")


def check_declares_capabilities(subject: Subject) -> None:
    """The adapter has all attributes of the interface, with valid values, and the same name as its entry point."""
    adapter = subject.adapter
    problem = "the adapter's declaration is incomplete or invalid"
    require(adapter.name == subject.name, problem, f"the entry point's name, {subject.name!r}", repr(adapter.name))
    engine, capabilities = adapter.engine, adapter.capabilities
    require(bool(engine.name), problem, "an Engine with a name", engine)
    low, high = capabilities.restitution
    require(0 <= low <= high <= 1, problem, "0 <= least <= greatest restitution <= 1", capabilities.restitution)
    low, high = capabilities.friction
    require(0 <= low <= high < math.inf, problem, "0 <= least <= greatest friction, and finite", capabilities.friction)
    min_factor = capabilities.min_inertia_factor
    require(0 <= min_factor <= 1, problem, "min_inertia_factor of 0 to 1", min_factor)
    for name in ("max_turn_rad", "max_spin_rad_s", "max_speed_m_s", "max_coordinate_m", "max_move_m"):
        limit = getattr(capabilities, name)
        require(limit > 0, problem, f"{name} above 0", limit)
    for name in ("radius_m", "mass_kg"):
        least, greatest = getattr(capabilities, f"min_{name}"), getattr(capabilities, f"max_{name}")
        require(0 <= least <= greatest, problem, f"0 <= min_{name} <= max_{name}", capabilities)
    threshold = capabilities.restitution_threshold_m_s
    require(0 <= threshold < math.inf, problem, "restitution_threshold_m_s of 0 or more", threshold)
    require(capabilities.dimensions in {2, 3}, problem, "dimensions of 2 or 3", capabilities.dimensions)


def check_declares_profiles(subject: Subject) -> None:
    """The profiles `default` and `tuned` exist, and every profile is complete.

    A profile needs a description, settings that include `dt_s`, and a declared accuracy.
    """
    profiles = subject.adapter.profiles
    for name in PROFILES:
        require(name in profiles, "a profile is missing", name, ", ".join(profiles))
    for name, profile in profiles.items():
        text = profile.description.strip()
        require(bool(text), f"profile {name!r} has no description", "one sentence", repr(text))
        subject.settings(name, DT_S)  # raises an error if a setting is not a plain value, or dt_s is missing
        promise = profile.accuracy
        require(isinstance(promise, Accuracy), f"profile {name!r} has an invalid accuracy", "Accuracy", promise)
        for part in (promise.late_steps, promise.velocity, promise.energy, promise.margin_m):
            sound = part >= 0 and math.isfinite(part)
            require(sound, f"profile {name!r} has an invalid accuracy", "finite numbers, 0 or more", promise)


def check_imports_no_engine(subject: Subject) -> None:
    """Loading the adapter and reading its declarations and settings does not import the engine."""
    module = subject.adapter.engine.module
    if not module:
        return
    program = (
        "import sys\n"
        f"sys.path[:] = {sys.path!r}\n"
        "from carom.engines.registry import load_adapter\n"
        f"adapter = load_adapter({subject.name!r})\n"
        "adapter.name, adapter.engine, adapter.capabilities\n"
        f"[profile.settings({DT_S}) for profile in adapter.profiles.values()]\n"
        f"sys.exit({module!r} in sys.modules)"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own text
    problem = "loading the adapter imports the engine"
    require(done.returncode == 0, problem, f"{module} is not imported", done.stderr.strip() or f"{module} is imported")
