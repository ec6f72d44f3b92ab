"""Limits of Rapier: names of its settings, and supported scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import Scene, Setting, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of `IntegrationParameters`, with Rapier's names.
PARAMETERS = (
    "length_unit",
    "num_solver_iterations",
    "normalized_prediction_distance",
    "normalized_max_linear_velocity",
    "contact_recycling",
    "warmstart_coefficient",
)

#: Frequencies (Hz) at which overlapping bodies are pushed apart: for contacts of two moving bodies, and for contacts
#: with a fixed body.
SOFTNESSES = {
    "contact_natural_frequency": "contact_softness",
    "static_contact_natural_frequency": "static_contact_softness",
}

#: ``can_sleep`` and ``soft_ccd_prediction`` (metres) are properties of every disc, with Rapier's names. With
#: ``first_part``, each step is taken in two parts, and the setting is the first part's fraction of the step; see the
#: profile `located`.
OTHER_SETTINGS = (*SOFTNESSES, "can_sleep", "soft_ccd_prediction", "first_part")

#: Smallest values of settings. With smaller values, Rapier divides by zero or fails in other ways. The square of the
#: step size must be in the range of 32-bit floats.
LEAST = dict.fromkeys((*PARAMETERS, *OTHER_SETTINGS), 0.0) | {
    "num_solver_iterations": 1,
    "length_unit": 2.0**-126,
    "dt_s": 1e-12,
}
MOST = {"dt_s": 1e12}

#: Default of `normalized_max_linear_velocity`. Rapier silently slows a faster body down to this speed.
SHIPPED_SPEED_M_S = 400.0

CAPABILITIES = replace(
    GENERAL,
    # The limits of speed, coordinate, radius and mass keep squares and impulses in the range of 32-bit floats (1e-38 to
    # 1e38).
    max_speed_m_s=1e9,
    max_coordinate_m=1e9,
    min_radius_m=1e-6,
    min_mass_kg=1e-15,
    max_mass_kg=1e15,
    float_bits=32,
    dimensions=3,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Check that Rapier supports a scene and settings.

    Raises:
        AdapterError: A number is invalid, or the scene needs more than Rapier supports.
    """
    require_sound("Rapier", scene, settings, (*PARAMETERS, *OTHER_SETTINGS), LEAST, MOST)
    require_supported("Rapier", scene, CAPABILITIES, float(settings["dt_s"]))
