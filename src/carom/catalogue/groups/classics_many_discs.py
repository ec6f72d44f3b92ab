"""Scenes of the group `classics` with many discs: simultaneous contact, and a gas whose energy is known."""

from __future__ import annotations

import cmath
import math

from carom.catalogue.entry import KnownAnswer, Staged
from carom.catalogue.groups.classics_walled import build_box_walls
from carom.catalogue.staging import build_disc, build_impact, build_scene, stage


def _one_into_two() -> Staged:
    """A disc strikes two touching discs at one instant."""
    radius, speed, start_x = 0.25, 1.0, -1.1
    # The three centres form an equilateral triangle, so the normals are at 30 degrees to the path.
    cosine, sine = math.sqrt(3) / 2, 0.5
    targets = [build_disc(complex(0, y), 0, radius) for y in (radius, -radius)]
    discs = [build_disc(start_x, speed, radius), *targets]
    time = (-start_x - 2 * radius * cosine) / speed
    up, down = complex(cosine, sine), complex(cosine, -sine)
    # The masses are equal. So the struck disc gets the striker's velocity along the normal, and the striker keeps its
    # velocity across the normal.
    first_struck = cosine * speed * up
    between = speed - first_struck
    # The second disc gets the striker's remaining velocity along the second normal: cos 30 (1 - 3/4) + sin 30 sqrt(3)/4
    # = sqrt(3)/4.
    second_struck = math.sqrt(3) / 4 * speed * down
    impacts = [
        build_impact(time, 0, 1, between, first_struck),
        build_impact(time, 0, 2, between - second_struck, second_struck),
    ]
    convention = (
        "The striker hits both discs at one instant. The order of the impacts decides whether the striker leaves at "
        "(-1/8, -sqrt(3)/8) or at (-1/8, sqrt(3)/8) m/s. Impacts are applied to one pair at a time, with the lowest "
        "numbers of discs first"
    )
    source = "Equal masses exchange their velocities along the normal; the normals are at +30 and then at -30 degrees"
    return stage(discs, impacts, source, convention, duration_s=1.5)


def stage_boxed_gas(side: int, *, radius_m: float, pitch_m: float, speed: float, duration_s: float) -> Staged:
    """Build a gas of `side` times `side` equal discs, `pitch_m` apart in a box. Only the energy of the gas is known."""
    golden_angle = math.pi * (3 - math.sqrt(5))
    discs = []
    for k in range(side * side):
        row, column = divmod(k, side)
        # Multiples of the golden angle are evenly spread directions, and no two of them are equal. Each disc is also
        # shifted a little from a regular lattice.
        direction = cmath.exp(1j * golden_angle * k)
        centre = complex(column + 0.5, row + 0.5) * pitch_m + 0.1 * radius_m * direction**2
        discs.append(build_disc(centre, speed * direction, radius_m))
    scene = build_scene(discs, walls=build_box_walls(side * pitch_m, side * pitch_m), duration_s=duration_s)
    source = "Elastic impacts and elastic walls conserve the kinetic energy, and all discs start at the same speed"
    return Staged(scene, KnownAnswer(source, final_kinetic_energy_j=len(discs) * 0.5 * speed**2))


def _gas() -> Staged:
    """Sixteen discs bounce in a box: energy is conserved, and a run with reversed velocities returns to the start."""
    return stage_boxed_gas(4, radius_m=0.1, pitch_m=0.5, speed=1.5, duration_s=1.0)
