"""Limits of Newton: its settings by name, and the range of scenes."""

from __future__ import annotations

from carom.engines.api import Capabilities

#: Arguments of the solver, by the names under which the solver stores them. ``gap`` belongs to each shape, and
#: ``speculative_contact_gap_max`` to the collision, where it is off by default. Settings that a profile omits keep
#: Newton's defaults.
OF_THE_SOLVER = (
    "iterations",
    "rigid_contact_relaxation",
    "rigid_contact_restitution_iterations",
    "rigid_contact_con_weighting",
    "enable_restitution",
)
SPECULATIVE = "speculative_contact_gap_max"
SETTINGS = (*OF_THE_SOLVER, "gap", SPECULATIVE)
LEAST = {"iterations": 1, "rigid_contact_restitution_iterations": 0, "gap": 0.0, SPECULATIVE: 0.0}

CAPABILITIES = Capabilities(
    gravity=True,
    restitution=(0.0, 1.0),
    # In each step with contacts, Newton stops bodies slower than 0.1 mm/s. So two bodies that close at up to twice that
    # speed may not bounce. If a disc at rest gets such a slow first push, the push may be lost. When bodies separate,
    # half of the push may be lost.
    restitution_threshold_m_s=2e-4,
    float_bits=32,
    dimensions=3,
)
