"""The group `paper`: the four cases of the source paper, figures 2 to 9.

Each scene is computed backwards from its impacts. The frame rate is 24 frames per second, as in a film. The instants of
the impacts are chosen between frames such that the periodic interference test (PIT) fails as in the paper.
"""

from __future__ import annotations

from functools import partial

from carom.catalogue.closed_forms import compute_after_impact, compute_normal
from carom.catalogue.entry import Staged
from carom.catalogue.staging import build_disc, build_impact, stage, stage_meeting

_FILM_HZ = 24.0

_BACKWARDS = (
    "Computed backwards from an impact with chosen normal and instant; conservation of momentum and energy gives the "
    "velocities"
)

_seen = partial(stage_meeting, duration_s=1.0, frame_rate_hz=_FILM_HZ, source=_BACKWARDS)


def _missed() -> Staged:
    """Two discs meet and separate between two frames, so PIT misses their impact (figures 2 and 3)."""
    # The discs overlap and approach over a distance of R sqrt(1 - .8^2) = .3 m, which takes 0.6 of a frame at 12 m/s.
    # The impact is 0.2 of a frame after one check, so the next check is too late.
    return _seen((6 + 0.75j, -6 - 0.25j), (0.25, 0.25), offset=0.8, time_s=10.2 / _FILM_HZ)


def _late() -> Staged:
    """Two discs meet just after a frame. PIT finds the impact a frame late, so paths are wrong (figures 4 and 5)."""
    # The overlap lasts several frames, so PIT can't miss the impact. PIT's next check is 0.9 of a frame after the
    # impact.
    return _seen((4 + 0.5j, -2), (0.4, 0.5), offset=0.15, time_s=9.1 / _FILM_HZ)


def _wrong_direction() -> Staged:
    """A green disc strikes a blue disc, which bounces off a red disc. PIT computes a wrong angle (figures 6 and 7)."""
    radius, heavy = 0.3, 4.0
    green, blue = 7, -1 + 0j
    time_1, time_2 = 8.6 / _FILM_HZ, 16.1 / _FILM_HZ
    normal_1 = compute_normal(green - blue, -0.2)
    green_after, blue_between = compute_after_impact(1.0, green, 1.0, blue, normal_1)
    # The blue disc is struck at the origin, and then meets the red disc.
    normal_2 = compute_normal(blue_between, 0.3)
    blue_after, red_after = compute_after_impact(1.0, blue_between, heavy, 0, normal_2)
    red = blue_between * (time_2 - time_1) + 2 * radius * normal_2
    discs = [
        build_disc(-2 * radius * normal_1 - green * time_1, green, radius),
        build_disc(-blue * time_1, blue, radius),
        build_disc(red, 0, radius, heavy),
    ]
    impacts = [build_impact(time_1, 0, 1, green_after, blue_between), build_impact(time_2, 1, 2, blue_after, red_after)]
    return stage(discs, impacts, _BACKWARDS, duration_s=1.25, frame_rate_hz=_FILM_HZ)


def _multiple() -> Staged:
    """A heavy disc clips four light ones within one frame: PIT finds only some of the impacts (figures 8 and 9)."""
    heavy, radius, small = 8.0, 0.35, 0.12
    velocity, centre, time = 14 + 0j, 0j, 8.1 / _FILM_HZ
    discs = [build_disc(-velocity * time, velocity, radius, heavy)]
    impacts = []
    for disc_number, side in enumerate((1, -1, 1, -1), start=1):
        normal = compute_normal(velocity, 0.85 * side)
        discs.append(build_disc(centre + (radius + small) * normal, 0, small))
        velocity, struck_after = compute_after_impact(heavy, velocity, 1.0, 0, normal)
        impacts.append(build_impact(time, 0, disc_number, velocity, struck_after))
        # The four impacts are at 0.10, 0.38, 0.66 and 0.94 of one frame.
        centre += velocity * (0.28 / _FILM_HZ)
        time += 0.28 / _FILM_HZ
    return stage(discs, impacts, _BACKWARDS, duration_s=0.75, frame_rate_hz=_FILM_HZ)
