"""Limits of ODE: its settings by name, and the range of scenes."""

from __future__ import annotations

from carom.engines.api import Capabilities

#: ``cfm`` and ``erp`` belong to the world, ``stepper`` is the world's method that takes a step, and
#: ``quick_step_iterations`` is for the stepper "quickStep". Settings that a profile omits keep ODE's defaults.
SETTINGS = ("cfm", "erp", "quick_step_iterations", "stepper")
STEPPERS = ("step", "quickStep")

#: ODE divides velocities by the step, and ends the process if the quotient overflows 32-bit floats, at 2**128. The
#: adapter replaces shorter steps by this step. A bisection asks for such steps if bodies touch at once.
LEAST_STEP_S = 2.0**-100

CAPABILITIES = Capabilities(
    gravity=True,
    # A surface belongs to a contact, so each pair has its own coefficient.
    restitution=(0.0, 1.0),
    float_bits=32,
    dimensions=3,
)
