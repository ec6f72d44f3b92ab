"""Bug reports about falling and bouncing under gravity: a ball is dropped on a floor."""

from __future__ import annotations

import math

from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import FLOOR
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged


def dropped(
    *,
    height_m: float,
    duration_s: float,
    radius_m: float = 0.5,
    gravity_m_s2: float = 9.81,
    restitution: float = 1.0,
    rate_hz: float = 60.0,
    spin_rad_s: float = 0.0,
) -> Staged:
    """Build a scene in which a ball is dropped from rest, with its lowest point `height_m` above a floor."""
    discs = [build_disc(complex(0, radius_m + height_m), 0, radius_m, spin_rad_s=spin_rad_s)]
    laws = {"wall_restitution": restitution, "pull": gravity_m_s2}
    scene = build_scene(discs, walls=[FLOOR], duration_s=duration_s, frame_rate_hz=rate_hz, **laws)
    time = math.sqrt(2 * height_m / gravity_m_s2)
    speed = gravity_m_s2 * time
    impacts = []
    while time <= duration_s:
        speed *= restitution
        impacts.append(build_impact(time, 0, -1, complex(0, speed)))
        since, time = time, time + 2 * speed / gravity_m_s2
    left = duration_s - since
    source = (
        "Free fall: after a fall of t seconds, the ball hits at the speed g t and leaves at e g t; each flight takes e "
        "times as long as the flight before"
    )
    height, rising = radius_m + speed * left - gravity_m_s2 * left**2 / 2, speed - gravity_m_s2 * left
    return build_staged(scene, impacts, source, final=[(complex(0, height), complex(0, rising))])


def rapier_974() -> Staged:
    """A ball with restitution 0.8 is dropped from 2 m."""
    # The fall takes sqrt(2 h / g). The rise to the first apex takes e times as long as the fall.
    down = math.sqrt(4.0 / 9.81)
    return dropped(height_m=2.0, restitution=0.8, duration_s=down + 0.8 * down)


def planck_223() -> Staged:
    """A ball with a radius of 6.6 cm falls 2.5 m on a box."""
    height = 6.133333333333334 - 0.266 - (3.3333333333333335 + 0.066)
    return dropped(height_m=height, radius_m=0.066, gravity_m_s2=9.0, duration_s=10.0)
