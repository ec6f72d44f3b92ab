"""Scenes of the group `classics` with walls. Answers follow from mirror images and geometric series."""

from __future__ import annotations

import math
from typing import Any

from carom.catalogue.closed_forms import compute_after_impact, compute_normal, unit
from carom.catalogue.entry import KnownImpact, Staged
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage, stage_at_wall, to_vector
from carom.model.scene import Chain, Wall
from carom.model.trace import wall_body

UNFOLDING = "Unfolding: if each impact mirrors the box and not the path, the path is a straight line"
_MOVING_BOX = (
    "Galileo: relative to the box, walls are at rest; if impacts mirror the box and not the path, the path is a line"
)

#: A level floor at height 0.
FLOOR = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))


def upright(x_m: float, side: float) -> Wall:
    """Return a vertical wall at `x_m`. Discs are on its right (`side` is 1) or on its left (`side` is -1)."""
    return Wall(point_m=(x_m, 0.0), normal=(side, 0.0))


def edges(*points: complex, **fields: Any) -> Chain:
    """Return a wall of edges from point to point."""
    return Chain(points_m=tuple(map(to_vector, points)), **fields)


def build_box_walls(width_m: float, height_m: float) -> list[Wall]:
    """Return the walls of a box with one corner at the origin: left, right, bottom, top."""
    ceiling = Wall(point_m=(0.0, height_m), normal=(0.0, -1.0))
    return [upright(0.0, 1), upright(width_m, -1), FLOOR, ceiling]


def compute_box_bounces(
    start: complex, velocity: complex, width_m: float, height_m: float, duration_s: float
) -> list[KnownImpact]:
    """Compute the impacts of a disc with the walls of `build_box_walls`, by unfolding the path to a straight line.

    Args:
        start: Centre of the disc, relative to the corner of the region in which the centre moves.
        velocity: Velocity of the disc, with both components above 0.
        width_m: Width of the region in which the centre moves.
        height_m: Height of the region in which the centre moves.
        duration_s: Duration, in seconds.
    """
    events: list[tuple[float, int, bool]] = []
    for place, speed, length, near, is_x in (
        (start.real, velocity.real, width_m, 0, True),
        (start.imag, velocity.imag, height_m, 2, False),
    ):
        # The straight path alternately crosses mirror images of the far wall and of the near wall.
        count = math.floor((place + speed * duration_s) / length)
        events += [((n * length - place) / speed, near + n % 2, is_x) for n in range(1, count + 1)]
    impacts = []
    for time, wall, is_x in sorted(events):
        velocity = complex(-velocity.real, velocity.imag) if is_x else velocity.conjugate()
        impacts.append(build_impact(time, 0, wall_body(wall), velocity))
    return impacts


def stage_in_room(
    start: complex,
    velocity: complex,
    radius_m: float,
    width_m: float,
    height_m: float,
    duration_s: float,
    *,
    half_width_m: float = 0.0,
    drive: complex = 0,
) -> Staged:
    """Build a scene with a disc in a room: a closed chain of four edges, which may be thick and may move.

    Args:
        start: Centre of the disc at the start, relative to the corner of the region in which the centre moves.
        velocity: Velocity of the disc relative to the room.
        radius_m: Radius of the disc.
        width_m: Width of the room.
        height_m: Height of the room.
        duration_s: Duration of the scene, in seconds.
        half_width_m: Half the thickness of the edges.
        drive: Velocity of the room.
    """
    reach = radius_m + half_width_m
    corners = (0, width_m, complex(width_m, height_m), complex(0.0, height_m))
    room = edges(*corners, closed=True, half_width_m=half_width_m, velocity_m_s=to_vector(drive))
    disc = build_disc(start + complex(reach, reach), velocity + drive, radius_m)
    hits = compute_box_bounces(start, velocity, width_m - 2 * reach, height_m - 2 * reach, duration_s)
    afters = [(hit.time_s, hit.velocity_first_after) for hit in hits]
    impacts = [build_impact(time_s, 0, -1, drive + complex(*after)) for time_s, after in afters if after is not None]
    return stage([disc], impacts, _MOVING_BOX if drive else UNFOLDING, walls=[room], duration_s=duration_s)


def _box() -> Staged:
    """A disc bounces in a box. In mirror images of the box, the path is one straight line."""
    radius, width, height = 0.2, 2.4, 1.6
    start, velocity = 0.5 + 0.3j, 5.3 + 3.7j  # relative to the corner of the region in which the centre moves
    discs = [build_disc(start + complex(radius, radius), velocity, radius)]
    scene = build_scene(discs, walls=build_box_walls(width, height), duration_s=2.5)
    impacts = compute_box_bounces(start, velocity, width - 2 * radius, height - 2 * radius, scene.duration_s)
    return build_staged(scene, impacts, UNFOLDING)


def _restitution_ladder() -> Staged:
    """A disc bounces between two walls of restitution 0.8: each crossing takes 5/4 times as long as the one before."""
    radius, width, e = 0.1, 1.7, 0.8
    start_x, velocity = 0.6, 11 + 0.3j
    first, length = width - radius - start_x, width - 2 * radius
    discs = [build_disc(start_x, velocity, radius)]
    scene = build_scene(discs, walls=build_box_walls(width, width)[:2], wall_restitution=e, duration_s=3.0)
    impacts: list[KnownImpact] = []
    while True:
        n = len(impacts)
        # The sum of the crossing times is 1/e + 1/e^2 + ... + 1/e^n, because each crossing takes 1/e times as long as
        # the one before.
        time = (first + length * (e**-n - 1) / (1 - e)) / velocity.real
        if time > scene.duration_s:
            break
        across = (-1.0) ** (n + 1) * velocity.real * e ** (n + 1)
        impacts.append(build_impact(time, 0, (-2, -1)[n % 2], complex(across, velocity.imag)))
    source = (
        "Each wall multiplies the speed along its normal by e, so crossing times are a geometric series; the speed "
        "along the wall does not change"
    )
    return build_staged(scene, impacts, source)


def _slanted_wall() -> Staged:
    """A disc bounces off a slanted wall of restitution 3/4."""
    normal = unit(-3 + 4j)
    # Any point of the wall's line defines the wall; the point used here is 2 m from the impact.
    walls = [Wall(point_m=to_vector(2j * normal), normal=(-3.0, 4.0))]
    source = "Computed backwards from the impact: only the velocity along the normal changes, by the factor -e"
    return stage_at_wall(3 - 2.5j, 0.3, normal, walls, source, restitution=0.75, time_s=0.63, duration_s=1.5)


def _bank_shot() -> Staged:
    """A disc bounces off a wall and then strikes another disc."""
    radius, incoming, time_1, time_2 = 0.2, 4 - 3j, 0.34, 0.87
    outgoing = incoming.conjugate()
    impact_position = complex(0, radius) + outgoing * (time_2 - time_1)
    normal = compute_normal(outgoing, 0.4)
    after, target_after = compute_after_impact(1.0, outgoing, 1.0, 0, normal)
    striker = build_disc(complex(0, radius) - incoming * time_1, incoming, radius)
    discs = [striker, build_disc(impact_position + 2 * radius * normal, 0, radius)]
    impacts = [build_impact(time_1, 0, -1, outgoing), build_impact(time_2, 0, 1, after, target_after)]
    source = (
        "Computed backwards from both impacts: the path to the wall is the mirror image of the path away from the wall"
    )
    return stage(discs, impacts, source, walls=[FLOOR], duration_s=1.75)
