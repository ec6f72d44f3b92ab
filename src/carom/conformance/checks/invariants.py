"""Checks of invariants: the momentum of free discs, and the energy in elastic impacts."""

from __future__ import annotations

import math

import numpy as np

from carom.conformance.adapter_under_test import Subject, find_greatest_speed, list_masses
from carom.conformance.checks.common import format_vector
from carom.conformance.suite_scenes import build_crowd
from carom.conformance.violation import Setup, require
from carom.engines.api import Observation
from carom.model.energy import kinetic_energy
from carom.support.formatting import format_number

#: Largest change of the energy that is ignored, as a fraction. In engines with 32-bit floats, rounding changes the
#: energy by 1e-7.
ENERGY = 1e-6


def check_momentum(subject: Subject, profile: str) -> None:
    """The total momentum of discs in a scene without walls is the same after every step."""
    setup = Setup(build_crowd(), profile)
    observations = subject.watch_cached(setup).states
    masses = list_masses(setup.scene)
    momenta = [(np.array(masses) @ observation.velocity_m_s).tolist() for observation in observations]
    start = momenta[0]
    # The suite allows this rounding error for runs of any length. In this short run, nine discs have a few impacts
    # each.
    allowed = subject.rounding * sum(masses) * find_greatest_speed(setup.scene)
    for step, found in enumerate(momenta):
        problem = f"momentum is not conserved in step {step}"
        expected = f"{format_vector(start)} kg m/s to within {format_number(allowed)}"
        require(math.dist(start, found) <= allowed, problem, expected, f"{format_vector(found)} kg m/s", setup)
    _require_something_happened(setup, observations[0], observations[-1])


def check_energy(subject: Subject, profile: str) -> None:
    """Elastic impacts change the kinetic energy by no more than the error that the profile declares."""
    setup = Setup(build_crowd(), profile)
    observations = subject.watch_cached(setup).states
    start = kinetic_energy(setup.scene, observations[0].velocity_m_s)
    # An engine with soft contacts stores energy in contacts, so energies are compared when there is no contact.
    last = next((observation for observation in reversed(observations) if not observation.contacts), observations[-1])
    found = kinetic_energy(setup.scene, last.velocity_m_s)
    allowed = max(ENERGY, subject.adapter.profiles[profile].accuracy.energy)
    problem = "energy is gained" if found > start else "energy is lost"
    found_text = f"{format_number(found, 10)} J, a relative change of {format_number((found - start) / start, 3)}"
    expected = f"{format_number(start, 10)} J, changed by at most this fraction: {format_number(allowed)}"
    require(abs(found - start) <= allowed * start, problem, expected, found_text, setup)
    _require_something_happened(setup, observations[0], last)


def _require_something_happened(setup: Setup, start: Observation, end: Observation) -> None:
    happened = start.velocity_m_s.tobytes() != end.velocity_m_s.tobytes()
    require(happened, "no disc changes its velocity", "impacts", "none", setup)
