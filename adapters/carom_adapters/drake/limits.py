"""Limits of Drake: its settings by name, and the range of scenes."""

from __future__ import annotations

from carom.engines.api import Capabilities

#: ``point_stiffness`` (N/m) belongs to every body, ``target_accuracy`` and ``integration_scheme`` to the simulator, all
#: by Drake's names. Settings that a profile omits keep Drake's defaults.
SETTINGS = ("point_stiffness", "target_accuracy", "integration_scheme")

#: Least values of settings. Drake fails below them.
LEAST = {"point_stiffness": 1e-300, "target_accuracy": 1e-15}

#: Within these limits, an overlap, which is speed * sqrt(mass / stiffness), is less than a radius with the stiffness of
#: `tuned`.
CAPABILITIES = Capabilities(
    gravity=True,
    # Drake has no coefficient: without dissipation a contact is elastic.
    restitution_combine="one",
    max_speed_m_s=100.0,
    min_radius_m=0.01,
    min_mass_kg=1e-3,
    max_mass_kg=1e3,
    dimensions=3,
)
