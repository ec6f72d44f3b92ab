"""Stress tests with friction and spin, which vary a coefficient, a spin, an inertia, or the number of sticking impacts.

All impacts are head-on or with a wall. Therefore the normal is correct even if an impact is found late, so late
detection is no reason to fail. There is one exception: in the long chain of sticking impacts, late detection may lose
an impact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from carom.catalogue.groups.classics_walled import FLOOR
from carom.catalogue.staging import build_disc
from carom.model.scene import Wall
from carom.studies.stress.pairs import DT_S, RADIUS_M, RATE_HZ, SPEED_M_S, STEPS_BEFORE, build_trial
from carom.studies.stress.stress_test import PHASES, Trial, build_closed_form_check, stress_test
from carom.support.formatting import format_number

#: A coefficient of friction with which the disc of `_inertia` never slides. Every engine supports this coefficient.
_GRIP = 10.0


def _compute_tangential_impulse(
    friction: float, normal_impulse: float, slip: float, inverse_effective_mass: float
) -> float:
    """Return the impulse of friction: the impulse that stops the slip, or that of sliding friction if it is smaller."""
    return math.copysign(min(abs(slip) / inverse_effective_mass, friction * normal_impulse), slip)


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
    speed, k = SPEED_M_S, 0.5
    start_x = -2.0 * RADIUS_M - speed * (STEPS_BEFORE + phase) * DT_S
    discs = [build_disc(start_x, speed, RADIUS_M, spin_rad_s=spin_rad_s), build_disc(0, 0, RADIUS_M)]
    rim = RADIUS_M * spin_rad_s
    impulse = _compute_tangential_impulse(friction, speed, rim, 2.0 * (1.0 + 1.0 / k))
    final, rims = [(0.0, -impulse), (speed, impulse)], [rim - impulse / k, -impulse / k]
    check = build_closed_form_check(final, 1, [max(speed, impulse / k)] * 2, final_rim_m_s=rims)
    return build_trial(description, discs, check, friction=friction)


@stress_test
def _friction(value: float) -> Iterator[Trial]:
    description = (
        f"With friction of {format_number(value, 3)}, a disc hits a floor at 45 degrees, and a spinning disc hits "
        "a disc at rest head-on."
    )
    yield from (_build_wall_trial(description, phase, value, 0.5) for phase in PHASES)
    yield from (_build_head_on_trial(description, phase, value, 5.0) for phase in PHASES)


@stress_test
def _spin(value: float) -> Iterator[Trial]:
    description = (
        f"A disc that spins at {format_number(value, 3)} rad/s hits a disc at rest head-on. The friction is 0.1."
    )
    return (_build_head_on_trial(description, phase, 0.1, value) for phase in PHASES)


@stress_test
def _inertia(value: float) -> Iterator[Trial]:
    description = (
        f"A disc with a moment of inertia of {format_number(value, 3)} m R^2 hits a floor at 45 degrees. It "
        "sticks during the impact, and leaves the floor without slip."
    )
    return (_build_wall_trial(description, phase, _GRIP, value) for phase in PHASES)


@stress_test
def _grip_chain(value: float) -> Iterator[Trial]:
    """Make a trial of a superball that bounces between two plates.

    It moves from one plate to the other in twelve steps.
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
    speed, pull, drop_s, k = 1.0, 10.0, 0.1, 0.5
    fall = pull * drop_s
    # With restitution e, all bounces together have a normal impulse of (1 + e)/(1 - e) times the momentum before the
    # first bounce. The coefficient of friction is a fifth larger than necessary for the disc to roll in the end.
    needed = speed / (1.0 + 1.0 / k)
    friction = 1.2 * needed / fall * (1.0 - value) / (1.0 + value)
    bounces_s = 2.0 * drop_s * value / (1.0 - value)
    description = (
        f"A disc thrown along a floor bounces with restitution {format_number(value, 3)}, slides, and finally rolls."
    )
    discs = [build_disc(complex(0.0, RADIUS_M + 0.5 * pull * drop_s**2), speed, RADIUS_M)]
    lasts_s = math.ceil((drop_s + bounces_s + 0.2) * RATE_HZ) / RATE_HZ
    laws = {"wall_friction": friction, "wall_restitution": value, "gravity_m_s2": (0.0, -pull)}
    final = speed / (1.0 + k)
    check = build_closed_form_check([(final, 0.0)], 0, [fall], final_rim_m_s=[-final])
    yield build_trial(description, discs, check, lasts_s, walls=[FLOOR], **laws)


FRICTION_TESTS = (_friction, _spin, _inertia, _grip_chain, _rolling)
