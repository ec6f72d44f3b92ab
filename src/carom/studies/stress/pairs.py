"""Stress tests with one pair of bodies: two discs, or a disc and a finite wall.

With two discs, each test varies a length, a speed, a mass, or the obliqueness of the impact. With a wall, each test
varies the speed of the disc or the wall, the wall's width, its number of pieces or of velocity changes, or the angle of
a corner. In another test, a disc grazes the wall's end, and the distance from a miss varies.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Any

from carom.catalogue.groups.classics_walled import edges
from carom.catalogue.staging import build_disc, to_vector
from carom.model.scene import Chain, Disc, Scene, Wall
from carom.model.walls import Leg, build_drive
from carom.studies.stress.stress_test import (
    PHASES,
    StressTest,
    TraceCheck,
    Trial,
    build_closed_form_check,
    build_stress_test,
    build_velocity_check,
    stress_test_at_phases,
)
from carom.studies.stress.true_motion import compute_true_motion
from carom.support.formatting import format_metres, format_number

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
    """Return a stress test in which two discs meet, with a trial for each phase.

    Each further keyword argument has the name of an argument of `_build_meeting_trial`, and is a function that computes
    this argument from the stress test's value.
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

#: Half the length of a wall. Discs only reach the ends in stress tests on ends of walls.
_HALF_LENGTH_M = 4.0
#: Initial distance of a disc from a corner, and the disc's speed. The disc returns after 30 steps. In each step, the
#: disc moves 2/15 of its radius.
_CORNER_M, _CORNER_SPEED_M_S = 0.5, 2 * 0.5 / (30 * DT_S)


def _build_upright_wall(**fields: Any) -> Chain:
    return edges(-1j * _HALF_LENGTH_M, 1j * _HALF_LENGTH_M, **fields)


def _compute_impact_time(phase: float) -> float:
    """Return the time of the impact, in seconds."""
    return (STEPS_BEFORE + phase) * DT_S


def _build_one_impact_trial(
    sentence: str, phase: float, start: complex, velocity: complex, wall: Chain, after: complex
) -> Trial:
    """Make a trial of a disc that meets a wall once. `after` is the known velocity after the impact."""
    discs = [build_disc(start, velocity, RADIUS_M)]
    check = build_closed_form_check([to_vector(after)], 1, [abs(after - velocity)])
    return build_trial(f"{sentence} Phase {phase:g} of a step.", discs, check, walls=[wall])


@stress_test_at_phases
def _thin_wall(value: float, phase: float) -> Trial:
    speed = value * RADIUS_M * RATE_HZ
    description = f"A disc that moves {format_number(value, 3)} radii per step meets a wall without thickness head-on."
    start = -RADIUS_M - speed * _compute_impact_time(phase)
    return _build_one_impact_trial(description, phase, start, speed, _build_upright_wall(), -speed)


@stress_test_at_phases
def _paddle(value: float, phase: float) -> Trial:
    speed = value * RADIUS_M * RATE_HZ
    description = f"A thin wall moves {format_number(value, 3)} radii per step, and strikes a disc at rest head-on."
    start, wall = RADIUS_M + speed * _compute_impact_time(phase), _build_upright_wall(velocity_m_s=(speed, 0.0))
    return _build_one_impact_trial(description, phase, start, 0, wall, 2.0 * speed)


@stress_test_at_phases
def _wall_width(value: float, phase: float) -> Trial:
    description = f"A disc meets a wall of half width {format_metres(value)} head-on."
    start = -value - RADIUS_M - SPEED_M_S * _compute_impact_time(phase)
    wall = _build_upright_wall(half_width_m=value)
    return _build_one_impact_trial(description, phase, start, SPEED_M_S, wall, -SPEED_M_S)


@stress_test_at_phases
def _wall_end(value: float, phase: float) -> Trial:
    """Make a trial of a disc that grazes a wall's end.

    The impact's normal points from this end to the disc's centre.
    """
    height = RADIUS_M * (1.0 - value)
    offset = Decimal(height) / Decimal(RADIUS_M)  # the scene contains the same rounded height
    along = (1 - offset * offset).sqrt()
    after = complex(float(2 * offset * offset - 1), float(2 * offset * along)) * SPEED_M_S
    description = f"A disc grazes a wall's end. It would miss if it were {format_number(value, 3)} radii higher."
    start = complex(-RADIUS_M * float(along) - SPEED_M_S * _compute_impact_time(phase), height)
    wall = edges(-1j * _HALF_LENGTH_M, 0)
    return _build_one_impact_trial(description, phase, start, SPEED_M_S, wall, after)


@stress_test_at_phases
def _seam(value: float, phase: float) -> Trial:
    pieces = int(value)
    joint = _HALF_LENGTH_M * (2 * (pieces // 2) / pieces - 1)
    velocity = SPEED_M_S * (4 - 1j)
    description = f"A disc obliquely strikes a floor of {pieces} pieces, at a point where two pieces meet."
    start = complex(joint, RADIUS_M) - velocity * _compute_impact_time(phase)
    floor = edges(-_HALF_LENGTH_M, _HALF_LENGTH_M, pieces=pieces)
    return _build_one_impact_trial(description, phase, start, velocity, floor, velocity.conjugate())


@stress_test_at_phases
def _corner(value: float, phase: float) -> Trial:
    """Make a trial of a disc that is thrown into a corner, slightly past the apex.

    The scene's walls have a finite length, but the correct motion is computed for half-planes.
    """
    angle = math.radians(value)
    inwards = cmath.exp(0.5j * angle)
    # The disc's centre moves in a smaller corner, which is at a distance of one radius from both sides.
    apex = RADIUS_M / math.sin(0.5 * angle) * inwards
    start = apex + (_CORNER_M + phase * _CORNER_SPEED_M_S * DT_S) * inwards
    # The velocity points past the apex by an eighth of the corner's angle, so the disc never meets both sides at once.
    velocity = -_CORNER_SPEED_M_S * inwards * cmath.exp(0.125j * angle)
    side = abs(apex) + _HALF_LENGTH_M
    description = f"A disc is thrown into a corner of {format_number(value, 3)} degrees. Phase {phase:g} of a step."
    across = -1j * cmath.exp(1j * angle)
    sides = [Wall(point_m=(0.0, 0.0), normal=normal) for normal in ((0.0, 1.0), to_vector(across))]
    trial = build_trial(description, [build_disc(start, velocity, RADIUS_M)], walls=sides)
    walls = (edges(side, 0, side * cmath.exp(1j * angle)),)
    return replace(trial, scene=trial.scene.model_copy(update={"walls": walls}))


@stress_test_at_phases
def _legs(value: float, phase: float) -> Trial:
    """Make a trial of a wall that moves forwards and backwards in turn, until it strikes a disc at rest.

    Each backward motion is a third as long as a forward motion. The impact comes in the middle of the last forward
    motion, when the wall is farther forward than ever before.
    """
    legs, until_s = int(value), _compute_impact_time(phase)
    leg_duration_s = until_s / (legs - 0.5)
    speeds = [SPEED_M_S * (3.0 if (legs - k) % 2 else -1.0) for k in range(legs)]
    path = tuple(Leg(from_s=k * leg_duration_s, velocity_m_s=(speed, 0.0)) for k, speed in enumerate(speeds))
    displacement, _ = build_drive(path, (0.0, 0.0)).moved_at(until_s)
    description = f"A wall that reverses its motion {legs - 1} times strikes a disc at rest."
    wall = _build_upright_wall(legs=path)
    return _build_one_impact_trial(description, phase, RADIUS_M + displacement, 0, wall, 2.0 * speeds[-1])


WALL_TESTS = (_thin_wall, _wall_end, _seam, _wall_width, _paddle, _legs, _corner)
