"""Stress tests with friction, and with a disc on a wall under gravity: rest, rolling, and critical slopes.

Each scene with gravity is a disc of unit mass on the wall y = 0. On a slope, gravity is tilted instead of the wall,
because a tilted wall would have rounded coordinates. On a slope that is slightly steeper or flatter than a critical
slope, a disc must move almost as on the critical slope.

Impacts with friction are head-on or with a wall. Therefore the normal is correct even if an impact is found late, so
late detection is no reason to fail. There is one exception: in the long chain of sticking impacts, late detection may
lose an impact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from carom.catalogue.groups.classics_walled import FLOOR
from carom.catalogue.staging import build_disc
from carom.model.scene import Wall
from carom.studies.stress.pairs import DT_S, RADIUS_M, RATE_HZ, SPEED_M_S, STEPS_BEFORE, build_trial
from carom.studies.stress.stress_test import (
    PHASES,
    TraceCheck,
    Trial,
    build_closed_form_check,
    build_stress_test,
    stress_test,
    stress_test_at_phases,
)
from carom.support.formatting import format_number

_G, _K = 10.0, 0.5
#: Duration of a contact. In this time, gravity and friction change a velocity by far more than the error of an
#: integrator.
_LASTS_S = 0.5

#: Coefficient of friction of all slopes and of the floor with rolling resistance, and the tangents of critical slopes.
#: The critical slopes are, in order, the steepest slopes on which a block stays at rest, a disc rolls without slipping,
#: rolling resistance holds a disc, and a disc that bounces with restitution 1/2 stops sliding.
_FRICTION = 0.3
_STEEPEST = {
    "sliding-slope": _FRICTION,
    "slipping-slope": _FRICTION * (1.0 + 1.0 / _K),
    "rolling-slope": 0.2,
    "bouncing-slope": 0.75 * _FRICTION * (1.0 + 1.0 / _K),
}


def _build_floor_trial(
    description: str,
    check: TraceCheck,
    duration_s: float = _LASTS_S,
    *,
    up: float = 0.0,
    velocity: complex = 0,
    spin_rad_s: float = 0.0,
    inertia_factor: float = _K,
    tangent: float = 0.0,
    **laws: float,
) -> Trial:
    """Make a trial of a disc `up` metres above the line y = 0.

    `tangent` is the tangent of the angle between gravity and the vertical. `laws` contains further fields of the scene.
    """
    long = math.hypot(1.0, tangent)
    place = complex(0.0, RADIUS_M + up)
    discs = [build_disc(place, velocity, RADIUS_M, spin_rad_s=spin_rad_s, inertia_factor=inertia_factor)]
    fields = {"gravity_m_s2": (_G * tangent / long, -_G / long), "wall_restitution": 0.0, **laws}
    return build_trial(description, discs, check, duration_s, walls=[FLOOR], **fields)


def _build_contact_check(along: float, rim: float, change: float) -> TraceCheck:
    """Return a function that checks a disc's final rim speed and its final velocity along the wall.

    Errors are divided by `change`.
    """
    return build_closed_form_check([(along, 0.0)], 0, [change], final_rim_m_s=[rim], cause="contact")


@stress_test_at_phases
def _lively(value: float, phase: float) -> Trial:
    """Make a trial of a ball that bounces three times, and then flies for as long as its first fall."""
    e, bounces, fall_s = 1.0 - value, 3, (96 + phase) * DT_S
    hops_s = math.fsum(2.0 * fall_s * e**n for n in range(1, bounces))
    last_s, speed = fall_s + hops_s, e**bounces * _G * fall_s
    description = f"A ball that loses {format_number(value, 3)} of its speed at each bounce bounces three times."
    check = build_closed_form_check([(0.0, speed - _G * fall_s)], bounces, [(1.0 + e) * _G * fall_s])
    return _build_floor_trial(description, check, last_s + fall_s, up=0.5 * _G * fall_s**2, wall_restitution=e)


@stress_test_at_phases
def _rests(value: float, phase: float) -> Trial:
    """Make a trial of a ball that bounces and comes to rest at least half a second before the end of the scene."""
    e, fall_s = 1.0 - value, (24 + phase) * DT_S
    description = f"A ball that loses {format_number(value, 3)} of its speed at each bounce bounces until it rests."
    ends_s = math.ceil((fall_s * (1.0 + e) / value + 0.5) * RATE_HZ) * DT_S  # the scene ends at the end of a step
    check = build_closed_form_check([(0.0, 0.0)], 0, [(1.0 + e) * _G * fall_s])
    return _build_floor_trial(description, check, ends_s, up=0.5 * _G * fall_s**2, wall_restitution=e)


def _build_slope_trial(kind: str, value: float, side: float) -> Trial:
    """Make a trial of a disc on a slope whose tangent is `1 + side * value` times that of a critical slope."""
    steepest, e = _STEEPEST[kind], 0.5
    tangent = steepest * (1.0 + side * value)
    normal_pull, pull = (_G * part / math.hypot(1.0, tangent) for part in (1.0, tangent))
    beyond = max(0.0, tangent - steepest)
    relative = format_number(side * value, 3)
    description = f"A disc on a slope. Relative distance from the critical slope {steepest:g}: {relative}."
    slip, fields = normal_pull * beyond * _LASTS_S, dict[str, Any]()
    along = (pull * _LASTS_S + _K * slip) / (1.0 + _K)
    rim = slip - along
    if kind == "sliding-slope":
        along, rim, fields = slip, 0.0, {"inertia_factor": math.inf}
    elif kind == "rolling-slope":
        along = slip / (1.0 + _K)
        rim, fields = 0.0 - along, {"wall_rolling_resistance": steepest}
    elif kind == "bouncing-slope":
        # If the first bounce has this speed, the bounces last until the end of the scene. Between two bounces, the disc
        # flies with take-off speed w, and gravity adds `2 w tan(slope)` to the speed at which the disc slides. The next
        # bounce reduces this speed by `f (1 + e)(1 + 1/k) w`, with friction f, restitution e and inertia factor k. At
        # the critical slope, gravity and a bounce change this speed by equal amounts. In total, bounces change the
        # speed as much as lasting contact would.
        hits = 0.5 * _LASTS_S * normal_pull * (1.0 - e) / e
        fields = {"velocity": complex(0.0, -hits), "wall_restitution": e}
    check = _build_contact_check(along, rim, pull * _LASTS_S)
    return _build_floor_trial(description, check, tangent=tangent, wall_friction=_FRICTION, **fields)


def _build_slope_trials(kind: str, value: float) -> Sequence[Trial]:
    return [_build_slope_trial(kind, value, side) for side in (1.0, -1.0)]


@stress_test
def _slide_friction(value: float) -> Iterator[Trial]:
    """Make trials of a disc that is thrown along a floor with backspin. The disc slides, then rolls.

    At the start, the disc's rim speed is equal to its speed.
    """
    for friction in _list_with_reciprocal(value):
        description = f"A disc with backspin is thrown along a floor with friction of {format_number(friction, 3)}."
        moving = {"velocity": SPEED_M_S, "spin_rad_s": SPEED_M_S / RADIUS_M}
        speed_loss = min(friction * _G * _LASTS_S, 2.0 * SPEED_M_S / (1.0 + 1.0 / _K))
        check = _build_contact_check(SPEED_M_S - speed_loss, SPEED_M_S - speed_loss / _K, SPEED_M_S)
        yield _build_floor_trial(description, check, **moving, wall_friction=friction)


@stress_test
def _rolling_resistance(value: float) -> Iterator[Trial]:
    """Make trials of a disc that rolls along a floor.

    With rolling resistance c, inertia factor k and gravity g, the disc decelerates by c g/(1 + k), but not by more than
    friction allows.
    """
    for resists in _list_with_reciprocal(value):
        description = f"A disc rolls along a floor with rolling resistance of {format_number(resists, 3)}."
        moving = {"velocity": SPEED_M_S, "spin_rad_s": -SPEED_M_S / RADIUS_M}
        laws = {"wall_friction": _FRICTION, "wall_rolling_resistance": resists}
        along = max(0.0, SPEED_M_S - min(resists / (1.0 + _K), _FRICTION) * _G * _LASTS_S)
        turns = SPEED_M_S - (resists - _FRICTION) * _G * _LASTS_S / _K
        rim = -along if resists <= _FRICTION * (1.0 + _K) else -max(0.0, turns)
        check = _build_contact_check(along, rim, SPEED_M_S)
        yield _build_floor_trial(description, check, **moving, **laws)


def _list_with_reciprocal(value: float) -> Sequence[float]:
    """Return a coefficient and its reciprocal; for 0, only the coefficient."""
    return [value, 1.0 / value] if value else [value]


#: A coefficient of friction that every engine supports, and with which the disc of `_inertia` never slides.
_GRIP = 10.0


def _compute_tangential_impulse(friction: float, normal_impulse: float, slip: float, inverse_mass: float) -> float:
    """Return the smaller of two impulses: the impulse of sliding friction, and the impulse that stops the slip."""
    return math.copysign(min(abs(slip) / inverse_mass, friction * normal_impulse), slip)


def _build_wall_trial(description: str, phase: float, friction: float, inertia: float) -> Trial:
    """Make a trial of a disc with unit mass and no spin that hits a floor at 45 degrees."""
    speed, before_s = SPEED_M_S, (STEPS_BEFORE + phase) * DT_S
    place = complex(-speed * before_s, RADIUS_M + speed * before_s)
    discs = [build_disc(place, complex(speed, -speed), RADIUS_M, inertia_factor=inertia)]
    impulse = _compute_tangential_impulse(friction, 2.0 * speed, speed, 1.0 + 1.0 / inertia)
    final, rim = (speed - impulse, speed), -impulse / inertia
    check = build_closed_form_check([final], 1, [2.0 * speed], final_rim_m_s=[rim])
    return build_trial(description, discs, check, walls=[FLOOR], wall_friction=friction)


def _build_head_on_trial(description: str, phase: float, friction: float, spin_rad_s: float) -> Trial:
    """Make a trial of a spinning disc of unit mass that hits an equal disc at rest head-on."""
    speed = SPEED_M_S
    start_x = -2.0 * RADIUS_M - speed * (STEPS_BEFORE + phase) * DT_S
    discs = [build_disc(start_x, speed, RADIUS_M, spin_rad_s=spin_rad_s), build_disc(0, 0, RADIUS_M)]
    rim = RADIUS_M * spin_rad_s
    impulse = _compute_tangential_impulse(friction, speed, rim, 2.0 * (1.0 + 1.0 / _K))
    final, rims = [(0.0, -impulse), (speed, impulse)], [rim - impulse / _K, -impulse / _K]
    check = build_closed_form_check(final, 1, [max(speed, impulse / _K)] * 2, final_rim_m_s=rims)
    return build_trial(description, discs, check, friction=friction)


@stress_test
def _friction(value: float) -> Iterator[Trial]:
    description = f"A disc hits a floor, or a spinning disc hits a disc, with friction of {format_number(value, 3)}."
    yield from (_build_wall_trial(description, phase, value, 0.5) for phase in PHASES)
    yield from (_build_head_on_trial(description, phase, value, 5.0) for phase in PHASES)


@stress_test
def _spin(value: float) -> Iterator[Trial]:
    description = f"A disc that spins at {format_number(value, 3)} rad/s hits a disc head-on, with friction of 0.1."
    return (_build_head_on_trial(description, phase, 0.1, value) for phase in PHASES)


@stress_test
def _inertia(value: float) -> Iterator[Trial]:
    description = f"A disc with inertia {format_number(value, 3)} m R^2 hits a floor, and leaves it without slip."
    return (_build_wall_trial(description, phase, _GRIP, value) for phase in PHASES)


@stress_test
def _grip_chain(value: float) -> Iterator[Trial]:
    """Make a trial of a superball that bounces between two plates.

    The superball moves from one plate to the other in twelve steps.
    """
    rounds = max(1, round(value / 2))
    height = 12.0 / RATE_HZ
    description = f"A superball bounces {2 * rounds} times between two rough plates."
    discs = [build_disc(complex(0.0, RADIUS_M + height / 2), 1 - 1j, RADIUS_M)]
    walls = [FLOOR, Wall(point_m=(0.0, 2.0 * RADIUS_M + height), normal=(0.0, -1.0))]
    laws = {"wall_friction": 1e3, "wall_tangential_restitution": 1.0}
    # For a ball of radius R, inertia factor k, velocity v along the plates and spin w, two bounces, one on each plate,
    # rotate the vector `(v, sqrt(k) R w)` by an angle with the cosine `((1 - k)^2 - 4 k)/(1 + k)^2`.
    angle = rounds * math.acos(-7.0 / 9.0)
    final, rim = [(math.cos(angle), -1.0)], [math.sin(angle) * math.sqrt(2.0)]
    check = build_closed_form_check(final, 2 * rounds, [2.0], final_rim_m_s=rim)
    yield build_trial(description, discs, check, 2 * rounds * height, walls=walls, **laws)


@stress_test
def _rolling(value: float) -> Iterator[Trial]:
    """Make a trial of a disc that is thrown along a floor and bounces until it rolls."""
    speed, drop_s = 1.0, 0.1
    fall = _G * drop_s
    # With restitution e, all bounces together have a normal impulse of (1 + e)/(1 - e) times the momentum before the
    # first bounce. The coefficient of friction is a fifth larger than necessary for the disc to roll in the end.
    needed = speed / (1.0 + 1.0 / _K)
    friction = 1.2 * needed / fall * (1.0 - value) / (1.0 + value)
    bounces_s = 2.0 * drop_s * value / (1.0 - value)
    description = f"A disc on a floor bounces with restitution {format_number(value, 3)}, slides, and finally rolls."
    lasts_s = math.ceil((drop_s + bounces_s + 0.2) * RATE_HZ) / RATE_HZ
    laws = {"wall_friction": friction, "wall_restitution": value}
    final = speed / (1.0 + _K)
    check = build_closed_form_check([(final, 0.0)], 0, [fall], final_rim_m_s=[-final])
    yield _build_floor_trial(description, check, lasts_s, up=0.5 * _G * drop_s**2, velocity=speed, **laws)


FRICTION_TESTS = (_friction, _spin, _inertia, _grip_chain, _rolling)


_SLOPES = [build_stress_test(name, partial(_build_slope_trials, name)) for name in _STEEPEST]
CONTACT_TESTS = (_lively, _rests, *_SLOPES, _slide_friction, _rolling_resistance)
