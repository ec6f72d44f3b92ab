"""The group `engines`: scenes that show undocumented behaviour of engines. The group runs only if the user names it."""

from __future__ import annotations

import math

from carom.catalogue.closed_forms import compute_after_wall
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_many_discs import stage_boxed_gas
from carom.catalogue.groups.classics_walled import build_box_walls
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage, stage_meeting


def _slow_pair() -> Staged:
    """A disc at 0.9 m/s meets an equal disc at rest: some engines make impacts inelastic at such low speeds."""
    return stage_meeting((0.9, 0), (0.25, 0.25), time_s=0.51, duration_s=1.5)


def _slow_wall() -> Staged:
    """A disc at 0.9 m/s meets a wall: some engines make impacts inelastic at such low speeds."""
    radius, time, velocity = 0.25, 0.51, 0.9 + 0j
    side = 4.0
    start = complex(side - radius, side / 2) - velocity * time
    scene = build_scene([build_disc(start, velocity, radius)], walls=build_box_walls(side, side), duration_s=1.5)
    impacts = [build_impact(time, 0, -2, compute_after_wall(velocity, -1))]
    return build_staged(scene, impacts, "An impact reverses the velocity along the normal")


def _crawl() -> Staged:
    """Two discs approach at 0.08 m/s: at such low speeds, some engines make contacts soft or inelastic."""
    return stage_meeting((0.04, -0.04), (0.25, 0.25), time_s=1.01, duration_s=3.0)


def _near_miss() -> Staged:
    """A disc passes another at a distance of 1 mm: engines whose contacts act before bodies touch deflect the disc."""
    radius, speed, nearest, gap = 0.25, 3.0, 0.6, 0.001
    discs = [build_disc(-speed * nearest, speed, radius), build_disc(complex(0, 2 * radius + gap), 0, radius)]
    scene = build_scene(discs, duration_s=1.25)
    return build_staged(scene, [], "The smallest distance of the centres exceeds the sum of the radii by the gap")


def _hard_bounce() -> Staged:
    """Large discs meet head-on at 200 m/s: they bounce too slowly in an engine that limits the speed of a bounce."""
    return stage_meeting((200, 0), (5.0, 5.0), time_s=0.51, duration_s=1.0)


def _flight() -> Staged:
    """A disc flies at 600 m/s and meets nothing: an engine with a speed limit slows it down without a warning."""
    return stage([build_disc(0, 600, 0.5)], [], "A body on which no force acts keeps its velocity", duration_s=0.5)


def _bullet_at_fixed() -> Staged:
    """A disc of radius 5 cm at 100 m/s hits an immovable disc: engines need continuous detection of fixed bodies."""
    return stage_meeting((100, 0), (0.05, 0.05), mass_kg=(1.0, math.inf), time_s=0.1241, duration_s=0.25)


def _bullet_at_free() -> Staged:
    """A disc of radius 5 cm at 100 m/s hits a free disc: continuous detection of some engines ignores free bodies."""
    return stage_meeting((100, 0), (0.05, 0.05), time_s=0.1241, duration_s=0.25)


def _two_bullets() -> Staged:
    """Two discs of radius 5 cm meet head-on at 50 m/s each: in some engines they pass through each other."""
    return stage_meeting((50, -50), (0.05, 0.05), time_s=0.1241, duration_s=0.25)


def _film() -> Staged:
    """A disc at 20 m/s hits another obliquely: with 24 steps per second, engines differ in when the disc turns."""
    return stage_meeting((20, 0), (0.25, 0.25), offset=0.6, time_s=0.41, duration_s=1.0, frame_rate_hz=24.0)


def _gas_of_25() -> Staged:
    """Twenty-five discs bounce in a box for 20 s: the scene shows how much energy an engine loses or gains."""
    return stage_boxed_gas(5, radius_m=0.2, pitch_m=1.0, speed=2.0, duration_s=20.0)
