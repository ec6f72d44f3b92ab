"""Limits of Rapier: its settings by name, and the range of scenes."""

from __future__ import annotations

from carom.engines.api import Capabilities, ContactTimes

#: Attributes of `IntegrationParameters`, by Rapier's names.
PARAMETERS = (
    "length_unit",
    "num_solver_iterations",
    "normalized_prediction_distance",
    "normalized_max_linear_velocity",
    "contact_recycling",
    "warmstart_coefficient",
)

#: Frequencies (Hz) at which overlaps are pushed apart: for contacts between moving bodies, and with fixed bodies.
SOFTNESSES = {
    "contact_natural_frequency": "contact_softness",
    "static_contact_natural_frequency": "static_contact_softness",
}

#: ``can_sleep`` and ``soft_ccd_prediction`` (metres) belong to every disc, by Rapier's names. ``first_part`` is the
#: fraction of a step that is taken first, as a separate step: see the profile `located`.
OTHER_SETTINGS = (*SOFTNESSES, "can_sleep", "soft_ccd_prediction", "first_part")

#: Beyond these limits Rapier divides by zero or fails otherwise. The square of a step stays within 32-bit floats.
LEAST = dict.fromkeys((*PARAMETERS, *OTHER_SETTINGS), 0.0) | {
    "num_solver_iterations": 1,
    "length_unit": 2.0**-126,
    "dt_s": 1e-12,
}
MOST = {"dt_s": 1e12}

#: Default of `normalized_max_linear_velocity`. A faster body is silently slowed down to this speed.
SHIPPED_SPEED_M_S = 400.0

#: If values are between these powers of ten, squares and impulses stay within 32-bit floats (1e-38 to 1e38).
LARGEST_SPEED_M_S = 1e9
LARGEST_COORDINATE_M = 1e9
SMALLEST_RADIUS_M = 1e-6
SMALLEST_MASS_KG = 1e-15
LARGEST_MASS_KG = 1e15

CAPABILITIES = Capabilities(
    segments=True,
    posts=True,
    wall_materials=True,
    driven_walls=True,
    driven_discs=True,
    legs=True,
    gravity=True,
    restitution=(0.0, 1.0),
    restitution_combine="pair",
    contact_times=ContactTimes.STEP,
    max_speed_m_s=LARGEST_SPEED_M_S,
    max_coordinate_m=LARGEST_COORDINATE_M,
    min_radius_m=SMALLEST_RADIUS_M,
    min_mass_kg=SMALLEST_MASS_KG,
    max_mass_kg=LARGEST_MASS_KG,
    float_bits=32,
    dimensions=3,
)
