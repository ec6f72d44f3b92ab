"""Stress tests with one pair of discs. Each test varies a length, a speed, a mass, or the obliqueness of the impact."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from carom.catalogue.staging import build_disc
from carom.model.scene import Disc, Scene
from carom.studies.stress.stress_test import (
    PHASES,
    StressTest,
    TraceCheck,
    Trial,
    build_stress_test,
    build_velocity_check,
)
from carom.studies.stress.true_motion import compute_true_motion
from carom.support.formatting import format_number

#: Frame rate and step size of most stress tests.
RATE_HZ = 240.0
DT_S = 1.0 / RATE_HZ

#: Numbers of steps before and after the impact. If an engine models a contact by a spring, the contact lasts several
#: steps. At MuJoCo's usual stiffness of 1000 /s², a contact lasts 24 steps.
STEPS_BEFORE, STEPS_AFTER = 4, 40
MEETING_S = (STEPS_BEFORE + STEPS_AFTER) * DT_S

#: Default radius, and default speed: a hundredth of a diameter per step, which is easy for every method.
RADIUS_M = 0.25
SPEED_M_S = 0.01 * 2 * RADIUS_M * RATE_HZ


def build_trial(
    description: str,
    discs: Sequence[Disc],
    check: TraceCheck | None = None,
    duration_s: float = MEETING_S,
    **fields: Any,
) -> Trial:
    """Make a trial of a stress test.

    By default, the scene lasts `MEETING_S`, and the check compares the result with the exact motion.

    Args:
        description: Description of the scene.
        discs: The discs.
        check: Function that checks a trace.
        duration_s: Duration of the scene, in seconds.
        fields: Values of further fields of the scene, by name.
    """
    fields = {"frame_rate_hz": RATE_HZ, "duration_s": duration_s, **fields}
    scene = Scene(name="stress test", description=description, discs=discs, **fields)
    return Trial(scene, check or build_velocity_check(compute_true_motion(scene)))


def _build_meeting_trial(
    description: str,
    phase: float,
    *,
    speed: float = SPEED_M_S,
    radius: float = RADIUS_M,
    offset: float = 0.0,
    mass: float = 1.0,
    origin: float = 0.0,
) -> Trial:
    """Make a trial of a disc that moves to the right and meets a disc of equal size at rest."""
    contact = 2 * radius
    across = offset * contact
    along = math.sqrt(max(contact * contact - across * across, 0.0)) + speed * DT_S * (STEPS_BEFORE + phase)
    striker = build_disc(complex(origin - along, origin), speed, radius)
    return build_trial(description, [striker, build_disc(complex(origin, origin + across), 0, radius, mass)])


def _build_stress_test(name: str, template: str, **functions: Callable[[float], float]) -> StressTest:
    """Return a stress test in which two discs meet. It has a trial for each phase.

    Each further keyword is the name of an argument of `_build_meeting_trial`. Its function computes the argument from
    the stress test's value.
    """

    def trials(value: float) -> Sequence[Trial]:
        sizes = {key: function(value) for key, function in functions.items()}
        sentence = template.format(value=format_number(value, 3))
        return [_build_meeting_trial(f"{sentence} Phase {phase:g} of a step.", phase, **sizes) for phase in PHASES]

    return build_stress_test(name, trials)


_GRAZING = "A disc grazes a disc at rest. It would miss if it were {value} contact distances further away."
_TUNNELLING = "A disc that moves {value} radii per step meets a disc at rest head-on."
_SIZE = "Discs of radius {value} m meet head-on. The speed is a fiftieth of the radius per step."
_SIZES = {"radius": lambda value: value, "speed": lambda value: 0.02 * value * RATE_HZ}
PAIR_TESTS = (
    _build_stress_test("grazing", _GRAZING, offset=lambda value: 1.0 - value),
    _build_stress_test("mass-ratio", "A disc of 1 kg meets a disc of {value} kg head-on.", mass=lambda value: value),
    _build_stress_test("tunnelling", _TUNNELLING, speed=lambda value: value * RADIUS_M * RATE_HZ),
    _build_stress_test("small", _SIZE, **_SIZES),
    _build_stress_test("large", _SIZE, **_SIZES),
    _build_stress_test("far-away", "Two discs meet head-on {value} m from the origin.", origin=lambda value: value),
    _build_stress_test("slow", "Two discs meet head-on at {value} m/s.", speed=lambda value: value),
)
