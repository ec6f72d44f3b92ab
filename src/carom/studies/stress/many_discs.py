"""Stress tests with many discs or many impacts."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product

from carom.catalogue.groups.classics_many_discs import stage_boxed_gas
from carom.catalogue.groups.classics_walled import build_box_walls
from carom.catalogue.staging import build_disc
from carom.model.scene import Disc, Scene, Wall
from carom.studies.stress.pairs import DT_S, RADIUS_M, RATE_HZ, SPEED_M_S, build_trial
from carom.studies.stress.stress_test import (
    PHASES,
    Trial,
    build_closed_form_check,
    build_pressure_check,
    build_velocity_check,
    check_energy,
    stress_test,
)
from carom.studies.stress.true_motion import TrueMotion, UndecidedError, compute_true_motion
from carom.support.formatting import format_metres, format_number

#: With a smaller restitution than this, three equal discs in a line collide infinitely often: S. McNamara and W. R.
#: Young, Phys. Fluids A 4, 496 (1992).
CRITICAL_RESTITUTION = 7.0 - 4.0 * math.sqrt(3.0)

_TURN = math.pi * (3.0 - math.sqrt(5.0))  # golden angle, whose multiples are evenly spread


def _build_row_trial(description: str, gaps: Sequence[float], phase: float, steps_after: int) -> Trial:
    """Make a trial of a disc that strikes a row of equal discs at rest.

    `gaps` are the gaps between the discs of the row.
    """
    places = [-(2 * RADIUS_M + SPEED_M_S * DT_S * (4 + phase)), 0.0]
    for gap in gaps:
        places.append(places[-1] + 2 * RADIUS_M + gap)
    discs = [build_disc(place, 0.0 if k else SPEED_M_S, RADIUS_M) for k, place in enumerate(places)]
    return build_trial(description, discs, None, (5 + steps_after) * DT_S)


@stress_test
def _cradle_gap(gap: float) -> Iterator[Trial]:
    description = f"Newton's cradle of five discs with gaps of {format_metres(gap)}. Only the last disc must move away."
    # The scene is twice as long as needed, so that a method that finds impacts late also finds every impact.
    steps = 40 + math.ceil(3 * gap / (SPEED_M_S / RATE_HZ))
    return (_build_row_trial(description, [gap] * 3, phase, steps) for phase in PHASES)


@stress_test
def _crowded_frame(impacts: float) -> Iterator[Trial]:
    count = round(impacts)
    # The first impact comes in the first half of a step, and all other impacts within half a step after the first. The
    # scene is long enough for a method that processes one impact per step.
    gap = 0.5 * SPEED_M_S / RATE_HZ / max(1, count - 1)
    description = f"A row of discs with {count} impacts in one step."
    return (_build_row_trial(description, [gap] * (count - 1), phase, 40 + count) for phase in (0.13, 0.42))


@stress_test
def _at_once(pairs: float) -> Iterator[Trial]:
    """Make a trial of several pairs of discs, which are far from each other.

    All pairs collide at the same instant. Each pair is a rotated copy of the first pair.
    """
    count = round(pairs)
    side, pitch = math.ceil(math.sqrt(count)), 8.0 * RADIUS_M
    along = 2 * RADIUS_M + SPEED_M_S * DT_S * 4.52
    discs: list[Disc] = []
    truth: list[TrueMotion] = []
    for k in range(count):
        row, column = divmod(k, side)
        place, turn = complex(column, row) * pitch, (1, 1j, -1, -1j)[k % 4]
        pair = [build_disc(place - along * turn, SPEED_M_S * turn, RADIUS_M), build_disc(place, 0, RADIUS_M)]
        discs += pair
        truth.append(compute_true_motion(Scene(name="pair", discs=pair, duration_s=48 * DT_S)))
    description = f"{count} pairs of discs, far from each other. All pairs collide in one step."
    final = [velocity for motion in truth for velocity in motion.final_velocity_m_s]
    change = [change for motion in truth for change in motion.greatest_change_m_s]
    yield build_trial(description, discs, build_closed_form_check(final, count, change), 48 * DT_S)


@stress_test
def _packing(gap: float) -> Iterator[Trial]:
    side, radius = 3, 0.1
    pitch = 2 * radius * (1 + gap)
    margin = pitch / 2
    discs = []
    for k, (row, column) in enumerate(product(range(side), repeat=2)):
        place = complex(margin + (column + 0.5 * (row % 2)) * pitch, margin + row * pitch * math.sqrt(3) / 2)
        discs.append(build_disc(place, cmath.rect(1.0, _TURN * k), radius))
    width = 2 * margin + (side - 0.5) * pitch
    height = 2 * margin + (side - 1) * pitch * math.sqrt(3) / 2
    packing = math.pi / (2 * math.sqrt(3)) / (1 + gap) ** 2
    gaps = f"gaps of {format_number(gap, 3)} diameters (packing fraction {packing:.4f})"
    description = f"Nine discs in a box. They are packed hexagonally with {gaps}."
    yield build_trial(description, discs, check_energy, 24 / RATE_HZ, walls=build_box_walls(width, height))


@stress_test
def _duration(impacts: float) -> Iterator[Trial]:
    side, radius, pitch, speed, rate = 3, 0.1, 0.3, 1.0, 120.0
    gas = stage_boxed_gas(side, radius_m=radius, pitch_m=pitch, speed=speed, duration_s=1.0).scene
    n, free = len(gas.discs), side * pitch - 2 * radius
    # Estimate the number of impacts per second by the kinetic theory of a thin gas, which is accurate to a factor of
    # two. The first term counts impacts with the four walls. The second term counts impacts with discs whose centres
    # are in a strip of four radii's width.
    a_second = n * (2 / math.pi) * speed * 2 / free + n / 2 * 4 * radius * (n / free**2) * (4 / math.pi) * speed
    duration_s = max(1.0, round(impacts / a_second * rate)) / rate
    description = f"Nine discs in a box, which collide approximately {format_number(impacts, 3)} times."
    fields = {"frame_rate_hz": rate, "walls": gas.half_planes()}
    yield build_trial(description, gas.discs, check_energy, duration_s, **fields)


#: Virial coefficients B_k / B_2^(k - 1) of hard discs, k = 3 to 10 (N. Clisby and B. M. McCoy, J. Stat. Phys. 122, 15
#: (2006)).
VIRIAL = (0.782004, 0.53223180, 0.33355604, 0.1988425, 0.1148728, 0.0649930, 0.0362193, 0.0199537)
PACKING = 0.3
#: `p V / (N k T)` at this packing is 2.0632, by a series with ten terms. In the series, `B_2 * density` is twice the
#: packing.
COMPRESSIBILITY = 1.0 + 2 * PACKING + sum(b * (2 * PACKING) ** k for k, b in enumerate(VIRIAL, 2))


@stress_test
def _gas_pressure(advance: float) -> Iterator[Trial]:
    """Make a trial of a hard-disc gas with known pressure. `advance` is the discs' initial speed, in radii per step."""
    side, radius, speed = 12, 0.05, 1.0
    count = side * side
    # The packing is computed for the box in which the centres can move. With this definition, a gas with walls is most
    # similar to an unbounded gas.
    free = math.sqrt(count * math.pi * radius**2 / PACKING)
    rate = speed / (advance * radius)
    pitch = free / (side - 1)
    discs = [
        build_disc(complex(radius + column * pitch, radius + row * pitch), cmath.rect(speed, _TURN * k), radius)
        for k, (row, column) in enumerate(product(range(side), repeat=2))
    ]
    width = free + 2 * radius
    description = f"{count} discs in a box (packing {PACKING}) start with {format_number(advance, 3)} radii per step."
    # Each disc has about fifteen impacts. From a thousand impacts, the pressure follows with an accuracy of 3 %.
    duration_s = round(1.25 * rate) / rate
    fields = {"frame_rate_hz": rate, "walls": build_box_walls(width, width)}
    yield build_trial(description, discs, build_pressure_check(COMPRESSIBILITY), duration_s, **fields)


@stress_test
def _restitution(restitution: float) -> Iterator[Trial]:
    discs = [build_disc(place, velocity, RADIUS_M) for place, velocity in ((-0.75, 1.0), (0.0, 0.0), (0.9, -1.0))]
    description = f"Three equal discs in a line approach each other with restitution {format_number(restitution, 4)}."
    # After infinitely many impacts in a finite time, all gaps are closed. The discs are then at rest like their centre
    # of mass.
    check = build_closed_form_check([(0.0, 0.0)] * 3, 0, [1.0] * 3)
    trial = build_trial(description, discs, check, 2.0, restitution=restitution)
    if restitution > CRITICAL_RESTITUTION:
        # Near the critical value, there are too many impacts to compute.
        with suppress(UndecidedError):
            trial = replace(trial, check_end=build_velocity_check(compute_true_motion(trial.scene, most_impacts=300)))
    yield trial


@stress_test
def _galperin(mass_ratio: float) -> Iterator[Trial]:
    radius, light_gap, heavy_gap, speed = 0.1, 0.25, 0.5, 1.0
    description = f"A disc of {format_number(mass_ratio, 4)} kg pushes a disc of 1 kg against a wall."
    discs = [build_disc(light_gap + radius, 0, radius), build_disc(heavy_gap + 3 * radius, -speed, radius, mass_ratio)]
    wall = Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0))
    root = math.sqrt(mass_ratio)
    angle = math.atan2(1.0, root)
    count = math.ceil(math.pi / angle) - 1
    # The velocities V (heavy disc) and v (light disc) form the vector `(root * V, v)` with the initial angle pi. Each
    # impact mirrors this vector. After an even number of impacts, the vector's angle is `pi - count * angle`. After an
    # odd number of impacts, this angle is mirrored.
    final_angle = math.pi - count * angle if count % 2 == 0 else (count + 1) * angle - math.pi
    final = [(root * math.sin(final_angle) * speed, 0.0), (math.cos(final_angle) * speed, 0.0)]
    # At its greatest speed, the light disc has all the energy. All impacts together reverse the velocity of the heavy
    # disc.
    change = [root * speed, 2 * speed]
    yield build_trial(description, discs, build_closed_form_check(final, count, change), 4.0, walls=[wall])


@stress_test
def _unstable_orbit(bounces: float) -> Iterator[Trial]:
    count = round(bounces)
    contact, free, axis = 0.5, 1.0, cmath.rect(1.0, 0.7)
    half = (free / 2 + contact) * axis
    description = f"A disc bounces {count} times between two immovable discs, along a slanted axis."
    fixed = [build_disc(place, 0, 0.3, math.inf) for place in (-half, half)]
    discs = [*fixed, build_disc(-0.1 * axis, 2.0 * axis, 0.2)]
    # The disc moves a fifteenth of the contact distance per step.
    yield build_trial(description, discs, None, (0.1 + count * free) / 2.0, frame_rate_hz=60.0)


MANY_DISC_TESTS = (
    *(_cradle_gap, _crowded_frame, _at_once, _packing),
    *(_duration, _gas_pressure, _restitution, _galperin, _unstable_orbit),
)
