"""Bug reports about walls and tables: balls that stick, corners, slow and repeated bounces, and a break shot."""

from __future__ import annotations

import cmath
import math

from carom.catalogue.closed_forms import compute_after_impact, dot, unit
from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.catalogue.groups.classics_walled import UNFOLDING, build_box_walls, compute_box_bounces, upright
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage

_MIRROR = "Each wall reverses the velocity along its normal and multiplies it by the restitution"


def wall_on_the_right(
    *, radius_m: float, velocity: complex, gap_m: float, duration_s: float, rate_hz: float, restitution: float = 1.0
) -> Staged:
    """Build a scene in which a disc starts at the origin and meets one wall."""
    discs = [build_disc(0, velocity, radius_m)]
    walls = [upright(radius_m + gap_m, -1)]
    scene = build_scene(discs, walls=walls, wall_restitution=restitution, duration_s=duration_s, frame_rate_hz=rate_hz)
    after = complex(-restitution * velocity.real, velocity.imag)
    return build_staged(scene, [build_impact(gap_m / velocity.real, 0, -1, after)], _MIRROR)


def in_a_box(
    *, start: complex, velocity: complex, radius: float, width: float, height: float, duration: float
) -> Staged:
    """Build a scene with a disc in an elastic box. `start` is relative to the box's lower left corner."""
    discs, walls = [build_disc(start, velocity, radius)], build_box_walls(width, height)
    inner = start - complex(radius, radius)
    impacts = compute_box_bounces(inner, velocity, width - 2 * radius, height - 2 * radius, duration)
    return stage(discs, impacts, UNFOLDING, walls=walls, duration_s=duration)


def pooltool_217() -> Staged:
    """A ball moves straight into a corner, and meets two walls at one instant."""
    radius, side, part = 0.028575, 4.5, math.sqrt(2.0)
    discs = [build_disc(1 + 1j, complex(part, part), radius)]
    time = (side - radius - 1) / part
    impacts = [build_impact(time, 0, -4, complex(part, -part)), build_impact(time, 0, -2, complex(-part, -part))]
    corner = "at a right angle, the impact with one wall does not change the velocity towards the other wall"
    return stage(discs, impacts, f"{_MIRROR}; {corner}", walls=build_box_walls(side, side), duration_s=3.5)


def pooltool_217_touching() -> Staged:
    """A ball touches a cushion, and is shot towards the cushion."""
    radius, side = 0.03125, 4.5
    discs = [build_disc(complex(side - radius, 1), 1.5 + 0.5j, radius)]
    scene = build_scene(discs, walls=build_box_walls(side, side), duration_s=1.0)
    return build_staged(scene, [build_impact(0.0, 0, -2, -1.5 + 0.5j)], f"{_MIRROR}; this impact is at the start")


def nimble_143() -> Staged:
    """A ball bounces off a wall, and meets the ball that follows it."""
    radius, wall, first, second, v1, v2 = 0.1, 1.1, 0.5, 0.0, 1.0, 0.5
    discs = [build_disc(first, v1, radius), build_disc(second, v2, radius)]
    scene = build_scene(discs, walls=[upright(wall, -1)], duration_s=1.25, frame_rate_hz=100.0)
    at_wall = (wall - radius - first) / v1
    pair_impact_s = at_wall + (wall - radius - (second + v2 * at_wall) - 2 * radius) / (v1 + v2)
    impacts = [build_impact(at_wall, 0, -1, -v1), build_impact(pair_impact_s, 0, 1, v2, -v1)]
    # After this impact the first ball moves to the wall once more.
    meeting_x = wall - radius - v1 * (pair_impact_s - at_wall)
    second_wall_s = pair_impact_s + (wall - radius - meeting_x) / v2
    impacts.append(build_impact(second_wall_s, 0, -1, -v2))
    impacts = [known for known in impacts if known.time_s < scene.duration_s]
    return build_staged(scene, impacts, f"{_MIRROR}; equal masses exchange velocities")


def pooltool_154() -> Staged:
    """A cue ball breaks a loosely racked triangle of fifteen balls."""
    radius, gap, speed, angle = 0.028575, 1e-3, 3.262213, math.radians(81.83468)
    pitch = 2 * radius + gap
    apex = 0.5 + 1.5j
    velocity = cmath.rect(speed, angle)
    start = 0.5 + 0.5j
    rack = [complex(k - row / 2, row * math.sqrt(3) / 2) * pitch for row in range(5) for k in range(row + 1)]
    places = [start, *(apex + place for place in rack)]
    discs = [build_disc(place, 0 if k else velocity, radius) for k, place in enumerate(places)]
    scene = build_scene(discs, duration_s=1.0, frame_rate_hz=240.0)
    hits = []
    for k, place in enumerate(places[1:], 1):
        along = dot(place - start, velocity) / speed
        missed = abs(place - start) ** 2 - along**2
        if missed < 4 * radius**2:
            hits.append(((along - math.sqrt(4 * radius**2 - missed)) / speed, k))
    time, target = min(hits)
    normal = unit(places[target] - start - velocity * time)
    known = build_impact(time, 0, target, *compute_after_impact(1.0, velocity, 1.0, 0, normal))
    source = "A quadratic equation gives the first impact; after this impact, energy is conserved and no bodies overlap"
    return Staged(scene, KnownAnswer(source, (known,), final_kinetic_energy_j=0.5 * speed**2))


def dyn4j_87() -> Staged:
    """A billiard ball bounces between two walls, and loses a tenth of its speed at each bounce."""
    radius, speed, left, right, restitution = 0.028575, 2.0, -0.4, 1.9, 0.9
    place, time, impacts, duration = -0.3, 0.0, list[KnownImpact](), 4.0
    while (time := time + ((right - radius - place) if speed > 0 else (place - left - radius)) / abs(speed)) < duration:
        place, wall = (right - radius, -2) if speed > 0 else (left + radius, -1)
        speed *= -restitution
        impacts.append(build_impact(time, 0, wall, speed))
    walls = [upright(left, 1), upright(right, -1)]
    scene = build_scene([build_disc(-0.3, 2, radius)], walls=walls, wall_restitution=restitution, duration_s=duration)
    crossing = "each crossing takes the distance divided by the speed, which each wall multiplies by e"
    return build_staged(scene, impacts, f"{_MIRROR}: {crossing}")


def gama_556() -> Staged:
    """A ball bounces off a wall, and almost immediately meets the ball that follows it."""
    radius, wall, gap, slit, speed = 0.25, 2.0, 0.5, 0.01, 2.0
    first = wall - radius - gap
    second = first - 2 * radius - slit
    discs = [build_disc(first, speed, radius), build_disc(second, speed, radius)]
    scene = build_scene(discs, walls=[upright(wall, -1)], duration_s=0.75)
    at_wall = gap / speed
    pair_impact_s = at_wall + slit / (2 * speed)  # each ball moves at `speed` towards the other
    second_wall_s = pair_impact_s + slit / (2 * speed)  # the first ball moves back to the wall
    impacts = [
        build_impact(at_wall, 0, -1, -speed),
        build_impact(pair_impact_s, 0, 1, speed, -speed),
        build_impact(second_wall_s, 0, -1, -speed),
    ]
    return build_staged(scene, impacts, f"{_MIRROR}; equal masses exchange velocities")
