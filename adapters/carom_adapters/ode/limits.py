"""Limits of ODE: names of its settings, and supported scenes."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Capabilities, Scene, Setting, require_sound, require_supported

#: ``cfm`` and ``erp`` are properties of the world. ``stepper`` is the method of the world that takes a step.
#: ``quick_step_iterations`` has an effect only with the stepper "quickStep". Settings that a profile omits keep ODE's
#: defaults.
SETTINGS = ("cfm", "erp", "quick_step_iterations", "stepper")
STEPPERS = ("step", "quickStep")

#: ODE divides velocities by the step size, and ends the process if the quotient overflows 32-bit floats, at 2^128. So
#: the adapter takes steps of at least `LEAST_STEP_S`. The bisection of the profile `located` requests shorter steps if
#: bodies already touch.
LEAST_STEP_S = 2.0**-100

CAPABILITIES = Capabilities(
    gravity=True,
    # Restitution is a property of a contact, so each pair can have its own coefficient.
    restitution=(0.0, 1.0),
    float_bits=32,
    dimensions=3,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Check that ODE supports a scene and settings.

    Raises:
        AdapterError: A number is invalid, or the scene needs more than ODE supports.
    """
    require_sound("ODE", scene, settings, SETTINGS, words={"stepper": STEPPERS})
    require_supported("ODE", scene, CAPABILITIES, float(settings["dt_s"]))
