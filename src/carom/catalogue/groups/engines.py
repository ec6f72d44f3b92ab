"""Scenes of undocumented behaviour of engines, described on the pages of docs/engines. These run only when named."""

from __future__ import annotations

import math

from carom.catalogue.closed_forms import after_wall, answered, disc, impact, meeting, scene_of
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_many_discs import boxed_gas
from carom.catalogue.groups.classics_walled import box_walls


def _slow_pair() -> Staged:
    """A disc meets an equal one at rest at .9 m/s: some engines make impacts inelastic at such low speeds."""
    return meeting((0.9, 0), (0.25, 0.25), time_s=0.51, duration_s=1.5)


def _slow_wall() -> Staged:
    """A disc meets a wall at .9 m/s: some engines make impacts inelastic at such low speeds."""
    radius, time, velocity = 0.25, 0.51, 0.9 + 0j
    side = 4.0
    start = complex(side - radius, side / 2) - velocity * time
    scene = scene_of([disc(start, velocity, radius)], walls=box_walls(side, side), duration_s=1.5)
    (wall,) = (k for k, one in enumerate(scene.half_planes()) if complex(*one.normal) == -1)
    after = after_wall(velocity, -1)
    return answered(scene, [impact(time, 0, -1 - wall, after)], "The velocity along the normal is reversed")


def _crawl() -> Staged:
    """Two discs approach at .08 m/s: this shows springs and thresholds that do not act at a metre a second."""
    return meeting((0.04, -0.04), (0.25, 0.25), time_s=1.01, duration_s=3.0)


def _near_miss() -> Staged:
    """A disc passes another at a distance of 1 mm: margins that act before bodies touch cause an impact."""
    radius, speed, nearest, gap = 0.25, 3.0, 0.6, 0.001
    discs = [disc(-speed * nearest, speed, radius), disc(complex(0, 2 * radius + gap), 0, radius)]
    scene = scene_of(discs, duration_s=1.25)
    return answered(scene, [], "The least distance of the centres exceeds the sum of the radii by the gap")


def _hard_bounce() -> Staged:
    """Large discs meet head-on at 200 m/s: an engine that limits the speed of a bounce returns less."""
    return meeting((200, 0), (5.0, 5.0), time_s=0.51, duration_s=1.0)


def _flight() -> Staged:
    """A disc flies at 600 m/s and meets nothing: an engine with a speed limit slows it down without a warning."""
    scene = scene_of([disc(0, 600, 0.5)], duration_s=0.5)
    return answered(scene, [], "A body on which no force acts keeps its velocity")


def _bullet_at_fixed() -> Staged:
    """A disc of 5 cm at 100 m/s hits an immovable one: continuous detection against fixed bodies is for this."""
    return meeting((100, 0), (0.05, 0.05), mass_kg=(1.0, math.inf), time_s=0.1241, duration_s=0.25)


def _bullet_at_free() -> Staged:
    """A disc of 5 cm at 100 m/s hits a free one at rest: some continuous detection acts on fixed bodies only."""
    return meeting((100, 0), (0.05, 0.05), time_s=0.1241, duration_s=0.25)


def _two_bullets() -> Staged:
    """Two discs of 5 cm meet head-on at 50 m/s each: continuous detection of both may still not stop them."""
    return meeting((50, -50), (0.05, 0.05), time_s=0.1241, duration_s=0.25)


def _film() -> Staged:
    """An oblique impact at 20 m/s and 24 frames a second: a method turns the path within the step, or at its end."""
    return meeting((20, 0), (0.25, 0.25), offset=0.6, time_s=0.41, duration_s=1.0, frame_rate_hz=24.0)


def _gas_of_25() -> Staged:
    """Twenty-five discs in a box for 20 s: this shows how much energy an engine loses or gains at its impacts."""
    return boxed_gas(5, radius_m=0.2, pitch_m=1.0, speed=2.0, duration_s=20.0)
