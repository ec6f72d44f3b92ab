"""Limits of Drake: names of its settings, and supported scenes."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Capabilities, Scene, Setting, require_sound, require_supported

#: The settings have Drake's names: ``point_stiffness`` (N/m) is a property of every body, and ``target_accuracy`` and
#: ``integration_scheme`` are properties of the simulator. Settings that a profile omits keep Drake's defaults.
SETTINGS = ("point_stiffness", "target_accuracy", "integration_scheme")

#: Smallest allowed values of settings. Drake fails with smaller values.
LEAST = {"point_stiffness": 1e-300, "target_accuracy": 1e-15}

#: Contacts are soft: two bodies overlap by up to speed * sqrt(mass / stiffness). With the largest speed and mass below,
#: and the stiffness of `tuned`, bodies overlap by up to 3 cm.
CAPABILITIES = Capabilities(
    gravity=True,
    # Drake has no coefficient of restitution. Without dissipation, contacts are elastic.
    restitution_combine="one",
    max_speed_m_s=100.0,
    min_radius_m=0.01,
    min_mass_kg=1e-3,
    max_mass_kg=1e3,
    dimensions=3,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Check that Drake supports a scene and settings.

    Raises:
        AdapterError: A number is invalid, or the scene needs more than Drake supports.
    """
    require_sound("Drake", scene, settings, SETTINGS, LEAST)
    require_supported("Drake", scene, CAPABILITIES, float(settings["dt_s"]))
