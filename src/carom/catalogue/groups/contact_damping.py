"""Damped scenes of the group `contact`. Formulas give the answers.

Damping is the law ``v' = -c v``. After the time t, a disc has the velocity ``v exp(-c t)`` and has moved by ``v s``,
where ``s = (1 - exp(-c t)) / c``. So answers are computed for constant velocities, with s as the time. Then s is
converted to ``t = -ln(1 - c s) / c``; see `docs/theory/damping.md`. The group runs only if the user names it.
"""

from __future__ import annotations

import math

from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import FLOOR, build_box_walls, upright
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged
from carom.model.scene import Disc
from carom.model.trace import wall_body

#: Part of the motion along one axis: start time, start position and velocity.
_Leg = tuple[float, float, float]


_LAW = "Linear damping: a velocity falls as exp(-c t), and the distance is v (1 - exp(-c t))/c"


def _to_clock_time(undamped_s: float, damping_per_s: float) -> float:
    return -math.log(1.0 - damping_per_s * undamped_s) / damping_per_s


def _to_undamped_time(clock_s: float, damping_per_s: float) -> float:
    return (1.0 - math.exp(-damping_per_s * clock_s)) / damping_per_s


def _damped_box() -> Staged:
    """A damped disc bounces around in a box whose walls remove a fifth of its speed."""
    radius, side, restitution, damping, duration = 0.5, 5.0, 0.8, 0.4, 3.0
    place, velocity = (1.0, 2.0), (6.0, -4.0)
    end = _to_undamped_time(duration, damping)
    # The motions along the two axes are independent. For each axis, a list contains the parts ("legs") of the undamped
    # motion from wall to wall.
    legs: tuple[list[_Leg], list[_Leg]] = ([(0.0, place[0], velocity[0])], [(0.0, place[1], velocity[1])])
    hits = []
    for axis, axis_legs in enumerate(legs):
        since, start, speed = axis_legs[0]
        while True:
            wall, target = (1, side - radius) if speed > 0.0 else (0, radius)
            since, start, speed = since + (target - start) / speed, target, -restitution * speed
            if since > end:
                break
            axis_legs.append((since, start, speed))
            hits.append((since, wall_body(2 * axis + wall)))

    def moving(undamped_s: float) -> tuple[complex, complex]:
        """Return position and velocity of the damped disc just after the undamped time `undamped_s`."""
        current_legs = [max(leg for leg in axis_legs if leg[0] <= undamped_s) for axis_legs in legs]
        kept_fraction = 1.0 - damping * undamped_s
        (x, u), (y, v) = (
            (start + speed * (undamped_s - since), speed * kept_fraction) for since, start, speed in current_legs
        )
        return complex(x, y), complex(u, v)

    impacts = [
        build_impact(_to_clock_time(undamped_s, damping), 0, wall, moving(undamped_s)[1])
        for undamped_s, wall in sorted(hits)
    ]
    discs = [Disc(position_m=place, velocity_m_s=velocity, radius_m=radius)]
    walls = build_box_walls(side, side)
    scene = build_scene(discs, walls=walls, wall_restitution=restitution, damping_per_s=damping, duration_s=duration)
    return build_staged(scene, impacts, _LAW, final=[moving(end)])


def _damped_stop() -> Staged:
    """A damped disc never reaches a wall that is exactly where the disc would stop after infinite time."""
    speed, damping, duration, radius = 1.0, 0.5, 20.0, 0.25
    walls = [upright(speed / damping + radius, -1)]
    scene = build_scene([build_disc(0, speed, radius)], walls=walls, damping_per_s=damping, duration_s=duration)
    distance_m, kept_fraction = speed * _to_undamped_time(duration, damping), math.exp(-damping * duration)
    return build_staged(scene, [], f"{_LAW}: the whole distance is v/c", final=[(distance_m, speed * kept_fraction)])


def _damped_pair() -> Staged:
    """A damped disc catches up with a heavier disc, and the impact makes the heavier disc faster."""
    fast, slow, mass, restitution, damping, duration = 4.0, 1.0, 3.0, 0.5, 0.8, 1.5
    gap, radius = 1.5, 0.5
    undamped_s, end = gap / (fast - slow), _to_undamped_time(duration, damping)
    centre = (fast + mass * slow) / (1.0 + mass)
    separation_speed = restitution * (fast - slow)
    after = [centre - separation_speed * mass / (1.0 + mass), centre + separation_speed / (1.0 + mass)]
    starts = (0.0, 2.0 * radius + gap)
    kept_fraction, left = 1.0 - damping * undamped_s, math.exp(-damping * duration)
    final = [
        (start + before * undamped_s + speed * (end - undamped_s), speed * left)
        for start, before, speed in zip(starts, (fast, slow), after, strict=True)
    ]
    discs = [build_disc(starts[0], fast, radius), build_disc(starts[1], slow, radius, mass)]
    scene = build_scene(discs, restitution=restitution, damping_per_s=damping, duration_s=duration)
    hit = build_impact(_to_clock_time(undamped_s, damping), 0, 1, after[0] * kept_fraction, after[1] * kept_fraction)
    return build_staged(scene, [hit], f"{_LAW}; Newton's law of restitution", final=final)


def _damped_slide() -> Staged:
    """A damped spinning disc hits a floor and slides during the impact. Its spin decays like its velocity."""
    (u, v), spin, friction, restitution, damping, duration = (3.0, -2.0), 4.0, 0.1, 0.5, 0.5, 1.2
    height = 1.6  # height of the centre; the disc has radius 1 and inertia factor 1/2
    undamped_s, end = (height - 1.0) / -v, _to_undamped_time(duration, damping)
    pushed = (1.0 + restitution) * -v
    # The disc's lowest point moves to the right, so friction accelerates the disc to the left, and reduces its spin.
    u_after, v_after, spin_after = u - friction * pushed, -restitution * v, spin - 2.0 * friction * pushed
    kept_fraction, left = 1.0 - damping * undamped_s, math.exp(-damping * duration)
    discs = [build_disc(complex(0.0, height), complex(u, v), 1.0, spin_rad_s=spin)]
    laws = {"wall_restitution": restitution, "wall_friction": friction, "damping_per_s": damping}
    scene = build_scene(discs, walls=[FLOOR], duration_s=duration, **laws)
    after = complex(u_after * kept_fraction, v_after * kept_fraction)
    hit = build_impact(_to_clock_time(undamped_s, damping), 0, -1, after, None, spin_after * kept_fraction)
    source = f"{_LAW}; Cross, Am. J. Phys. 70 (2002) 1093: sliding reduces v by f (1 + e) times the normal speed"
    place = complex(u * undamped_s + u_after * (end - undamped_s), 1.0 + v_after * (end - undamped_s))
    final = [(place, complex(u_after * left, v_after * left))]
    return build_staged(scene, [hit], source, final=final, spins=(spin_after * left,))
