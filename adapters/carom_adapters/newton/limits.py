"""Limits of Newton: names of its settings, and supported scenes."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Capabilities, Scene, Setting, require_sound, require_supported

#: Settings that are arguments of the solver, with the names of the solver's attributes. The settings also include two
#: properties of other objects. ``gap`` is a property of each shape. ``speculative_contact_gap_max`` is a property of
#: the collision pipeline, and has no value by default. Settings that a profile omits keep Newton's defaults.
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
    # In each step with contacts, Newton stops bodies that are slower than 0.1 mm/s. So two bodies with a closing speed
    # of up to 0.2 mm/s may not bounce.
    restitution_threshold_m_s=2e-4,
    float_bits=32,
    dimensions=3,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Check that Newton supports a scene and settings.

    Raises:
        AdapterError: A number is invalid, or the scene needs more than Newton supports.
    """
    require_sound("Newton", scene, settings, SETTINGS, at_least=LEAST)
    require_supported("Newton", scene, CAPABILITIES, float(settings["dt_s"]))
