"""Scenes of the group `classics` with discs on one line.

Answers follow from mirror images, or from the exchange of velocities by equal masses.
"""

from __future__ import annotations

import cmath
import math
from itertools import combinations

from carom.catalogue.closed_forms import compute_wedge_impacts
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import upright
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage, stage_struck_row


def _sorting() -> Staged:
    """Five equal discs move on a line, each faster than the next disc: ten impacts sort their velocities."""
    # Equal masses exchange velocities. So each velocity passes from disc to disc, like a point ("ghost") that moves
    # through all discs at constant speed. The coordinate of a ghost leaves out the diameters of all discs on its left.
    radius = 0.1
    ghost = [0.0, 0.45, 1.5, 1.85, 3.1]
    velocity = [2.5, 1.6, 0.5, -0.8, -1.9]
    n = len(ghost)
    discs = [build_disc(g + 2 * radius * k, v, radius) for k, (g, v) in enumerate(zip(ghost, velocity, strict=True))]
    crossings = sorted(
        ((ghost[b] - ghost[a]) / (velocity[a] - velocity[b]), a, b)
        for a, b in combinations(range(n), 2)
        if velocity[a] > velocity[b]
    )
    impacts = []
    for time, a, b in crossings:
        crossing_x = ghost[a] + velocity[a] * time
        # The number of the left disc of the pair is the number of ghosts to the left of the crossing.
        left = sum(ghost[k] + velocity[k] * time < crossing_x for k in range(n) if k not in (a, b))
        impacts.append(build_impact(time, left, left + 1, velocity[b], velocity[a]))
    source = (
        "Equal masses on a line exchange velocities, so impacts occur where points that keep these velocities would "
        "meet (D. W. Jepsen, J. Math. Phys. 6, 405, 1965)"
    )
    return stage(discs, impacts, source, duration_s=1.75)


def _galperin_100() -> Staged:
    """A disc of 100 kg drives a disc of 1 kg against a wall, which causes 31 impacts."""
    light, heavy, speed = 1.0, 100.0, 1.5
    radius_light, radius_heavy = 0.1, 0.3
    # Distances of the discs' centres from the wall, minus the radii and diameters of discs in between.
    gap_light, gap_heavy = 0.5, 1.2
    discs = [
        build_disc(gap_light + radius_light, 0, radius_light, light),
        build_disc(gap_heavy + 2 * radius_light + radius_heavy, -speed, radius_heavy, heavy),
    ]
    # With each coordinate multiplied by the square root of the mass, the pair of discs is one point in the plane. The
    # point moves in a wedge: on one side, at angle 0, a disc touches the wall, and on the other side the discs touch.
    root_light, root_heavy = math.sqrt(light), math.sqrt(heavy)
    start = complex(root_heavy * gap_heavy, root_light * gap_light)
    bounces = compute_wedge_impacts(start, -root_heavy * speed, math.atan2(root_light, root_heavy))
    impacts = []
    for b in bounces:
        body, heavy_after = (1, b.velocity.real / root_heavy) if b.upper else (-1, None)
        impacts.append(build_impact(b.time_s, 0, body, b.velocity.imag / root_light, heavy_after))
    source = (
        "Unfolding of a wedge of angle atan(1/10): the number of impacts, 31, consists of the first two digits of pi "
        "(G. Galperin, Playing pool with pi, Regular and Chaotic Dynamics 8(4), 375-394, 2003)"
    )
    return stage(discs, impacts, source, walls=[upright(0.0, 1)], duration_s=2.0)


def _three_in_line() -> Staged:
    """Three unequal masses on a line collide six times, which is the largest number that their masses allow."""
    m0, m1, m2 = 3.0, 0.5, 2.0
    r0, r1, r2 = 0.3, 0.15, 0.25
    pair, everything = m0 + m1, m0 + m1 + m2
    angle = math.acos(math.sqrt(m0 * m2 / ((m0 + m1) * (m1 + m2))))
    max_crossings = math.ceil(math.pi / angle)
    # The path must cross `max_crossings` rays, so its direction must be beyond the last ray. Seen from the apex, a
    # straight path turns by less than half a turn. Start and direction are in the middle of the ranges that these
    # conditions allow.
    direction = (max_crossings * angle + math.pi + angle) / 2
    start_argument = (direction - math.pi + angle) / 2
    start, velocity = cmath.rect(1.2, start_argument), cmath.rect(1.5, direction)
    # Jacobi coordinates: the imaginary part is the gap between the first two discs. The real part is the distance of
    # the third disc from the centre of mass of the first two discs. Each part is multiplied by the square root of its
    # reduced mass.
    root_pair, root_third = math.sqrt(m0 * m1 / pair), math.sqrt(pair * m2 / everything)

    def to_line_coordinates(z: complex) -> tuple[complex, complex, complex]:
        gap, third = z.imag / root_pair, z.real / root_third
        centre = -m2 * third / everything
        return (centre - m1 * gap / pair, centre + m0 * gap / pair, centre + third)

    x0, x1, x2 = to_line_coordinates(start)
    v0, v1, v2 = to_line_coordinates(velocity)
    left, right = build_disc(x0 - (r0 + r1), v0, r0, m0), build_disc(x2 + (r1 + r2), v2, r2, m2)
    impacts = []
    for bounce in compute_wedge_impacts(start, velocity, angle):
        after = to_line_coordinates(bounce.velocity)
        first = 1 if bounce.upper else 0
        impacts.append(build_impact(bounce.time_s, first, first + 1, after[first], after[first + 1]))
    source = (
        "Three masses on a line move like a point in a wedge of angle a = acos sqrt(m1 m3 / ((m1 + m2)(m2 + m3))). A "
        "straight line can cross the rays of the unfolded wedge ceil(pi / a) times, here 6 times (S. Tabachnikov, "
        "Geometry and Billiards, 2005)"
    )
    return stage([left, build_disc(x1, v1, r1, m1), right], impacts, source, duration_s=2.0)


def _between_fixed() -> Staged:
    """A disc bounces between two immovable discs along their axis. Small errors of position grow at each impact."""
    radius, fixed, half_distance, speed = 0.2, 0.3, 1.2, 3.7
    reach = half_distance - radius - fixed
    left, right = (build_disc(x, 0, fixed, math.inf) for x in (-half_distance, half_distance))
    discs = [left, build_disc(0, speed, radius), right]
    scene = build_scene(discs, duration_s=2.25)
    impacts = []
    for n in range(int((scene.duration_s * speed + reach) / (2 * reach))):
        time = (2 * n + 1) * reach / speed
        impacts.append(build_impact(time, 1, 2, -speed, 0) if n % 2 == 0 else build_impact(time, 0, 1, 0, speed))
    source = "Every impact reverses the velocity, so all times between impacts are equal"
    return build_staged(scene, impacts, source)


def _cradle_gaps() -> Staged:
    """Newton's cradle with gaps: the velocity passes from disc to disc."""
    return stage_struck_row([0.83, 0.17, 0.31, 0.23], radius_m=0.125, speed=2.0, duration_s=1.5)


def _cradle_touching() -> Staged:
    """Newton's cradle with touching discs: four impacts at one instant."""
    # Floats represent all numbers exactly, so the discs touch exactly, and all four impacts have bit-identical times.
    convention = (
        "Four impacts share one instant, and conservation of momentum and energy allows several outcomes. Impacts are "
        "applied to one pair at a time, as if there were tiny gaps, so only the last disc leaves"
    )
    return stage_struck_row([0.84375, 0.0, 0.0, 0.0], convention, radius_m=0.125, speed=2.0, duration_s=1.25)
