"""Limits of ODE: names of its settings, and supported scenes."""

from __future__ import annotations

from carom.engines.api import Capabilities

#: ``cfm`` and ``erp`` are properties of the world. ``stepper`` is the method of the world that takes a step.
#: ``quick_step_iterations`` has an effect only with the stepper "quickStep". Settings that a profile omits keep ODE's
#: defaults.
SETTINGS = ("cfm", "erp", "quick_step_iterations", "stepper")
STEPPERS = ("step", "quickStep")

#: ODE divides velocities by the step size, and ends the process if the quotient overflows 32-bit floats, at 2**128. The
#: adapter replaces shorter steps by this step. They occur in a bisection if bodies already touch at the start of a
#: step.
LEAST_STEP_S = 2.0**-100

CAPABILITIES = Capabilities(
    gravity=True,
    # Restitution is a property of a contact, so each pair can have its own coefficient.
    restitution=(0.0, 1.0),
    float_bits=32,
    dimensions=3,
)
