"""The group `contact`: discs that something slows down between impacts, each scene with its answer in closed form.

Of a disc with the velocity v the law ``v' = -c v`` leaves ``v exp(-c t)`` after the way ``v s``, where s is
``(1 - exp(-c t)) / c``: each answer is worked out with constant velocities in s, and ``t = -ln(1 - c s) / c``.
`docs/damping.md` derives it.
The group runs when it is asked for.
"""

from __future__ import annotations

import math

from carom.scene import Disc, Wall
from carom.scenes.closed_forms import scene_of
from carom.scenes.entry import KnownAnswer, KnownImpact, Staged, listed
from carom.trace import Vector, wall_body

#: Of one axis: from when on, from where, and how fast.
_Leg = tuple[float, float, float]

_LAW = "Linear damping: a velocity falls as exp(-c t), after the way v (1 - exp(-c t))/c"


def _clock_s(undamped_s: float, damping_per_s: float) -> float:
    return -math.log(1.0 - damping_per_s * undamped_s) / damping_per_s


def _undamped_s(clock_s: float, damping_per_s: float) -> float:
    return (1.0 - math.exp(-damping_per_s * clock_s)) / damping_per_s


@listed("contact")
def _damped_box() -> Staged:
    """A damped disc goes round in a box with walls that lose a fifth of its speed."""
    radius, side, restitution, damping, duration = 0.5, 5.0, 0.8, 0.4, 3.0
    place, velocity = (1.0, 2.0), (6.0, -4.0)
    faces = (((0.0, 0.0), (1.0, 0.0)), ((side, 0.0), (-1.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)), ((0.0, side), (0.0, -1.0)))
    end = _undamped_s(duration, damping)
    # The two axes know nothing of each other; without damping:
    legs: tuple[list[_Leg], list[_Leg]] = ([(0.0, place[0], velocity[0])], [(0.0, place[1], velocity[1])])
    hits = []
    for axis, own in enumerate(legs):
        since, start, speed = own[0]
        while True:
            wall, target = (1, side - radius) if speed > 0.0 else (0, radius)
            since, start, speed = since + (target - start) / speed, target, -restitution * speed
            if since > end:
                break
            own.append((since, start, speed))
            hits.append((since, wall_body(2 * axis + wall)))

    def moving(when: float) -> tuple[Vector, Vector]:
        """Return place and velocity just after an undamped time, the velocity as the damped disc has it."""
        now = [max(leg for leg in own if leg[0] <= when) for own in legs]
        kept = 1.0 - damping * when
        (x, u), (y, v) = ((start + speed * (when - since), speed * kept) for since, start, speed in now)
        return (x, y), (u, v)

    impacts = [KnownImpact(_clock_s(when, damping), 0, wall, moving(when)[1]) for when, wall in sorted(hits)]
    (final, slow) = moving(end)
    scene = scene_of(
        [Disc(position_m=place, velocity_m_s=velocity, radius_m=radius)],
        walls=[Wall(point_m=point, normal=normal) for point, normal in faces],
        wall_restitution=restitution,
        damping_per_s=damping,
        duration_s=duration,
    )
    return Staged(scene, KnownAnswer(_LAW, tuple(impacts), len(impacts), (slow,), (final,)))


@listed("contact")
def _damped_stop() -> Staged:
    """A wall stands exactly as far away as a damped disc gets in all time, so that it is never met."""
    speed, damping, duration, radius = 1.0, 0.5, 20.0, 0.25
    scene = scene_of(
        [Disc(position_m=(0.0, 0.0), velocity_m_s=(speed, 0.0), radius_m=radius)],
        walls=[Wall(point_m=(speed / damping + radius, 0.0), normal=(-1.0, 0.0))],
        damping_per_s=damping,
        duration_s=duration,
    )
    way, kept = speed * _undamped_s(duration, damping), math.exp(-damping * duration)
    return Staged(scene, KnownAnswer(f"{_LAW}: v/c in all", (), 0, ((speed * kept, 0.0),), ((way, 0.0),)))


@listed("contact")
def _damped_pair() -> Staged:
    """A damped disc catches up with a heavier one, which its impact drives on."""
    fast, slow, mass, restitution, damping, duration = 4.0, 1.0, 3.0, 0.5, 0.8, 1.5
    gap, radius = 1.5, 0.5
    when, end = gap / (fast - slow), _undamped_s(duration, damping)
    centre = (fast + mass * slow) / (1.0 + mass)
    after = [
        centre - restitution * (fast - slow) * mass / (1.0 + mass),
        centre + restitution * (fast - slow) / (1.0 + mass),
    ]
    starts = (0.0, 2.0 * radius + gap)
    kept, left = 1.0 - damping * when, math.exp(-damping * duration)
    velocities = [(speed * kept, 0.0) for speed in after]
    final = [
        start + before * when + speed * (end - when)
        for start, before, speed in zip(starts, (fast, slow), after, strict=True)
    ]
    scene = scene_of(
        [
            Disc(position_m=(starts[0], 0.0), velocity_m_s=(fast, 0.0), radius_m=radius),
            Disc(position_m=(starts[1], 0.0), velocity_m_s=(slow, 0.0), radius_m=radius, mass_kg=mass),
        ],
        restitution=restitution,
        damping_per_s=damping,
        duration_s=duration,
    )
    known = KnownAnswer(
        f"{_LAW}; Newton's law of restitution",
        (KnownImpact(_clock_s(when, damping), 0, 1, velocities[0], velocities[1]),),
        1,
        tuple((speed * left, 0.0) for speed in after),
        tuple((x, 0.0) for x in final),
    )
    return Staged(scene, known)


@listed("contact")
def _damped_slide() -> Staged:
    """A damped disc that spins slides through its impact on a floor; its spin falls as its velocity does."""
    (u, v), spin, friction, restitution, damping, duration = (3.0, -2.0), 4.0, 0.1, 0.5, 0.5, 1.2
    height = 1.6  # of a disc of radius 1 and inertia factor 1/2
    when, end = (height - 1.0) / -v, _undamped_s(duration, damping)
    pushed = (1.0 + restitution) * -v
    # The floor's friction on a rim that moves to the right: to the left on the centre, and against the spin.
    u_after, v_after, spin_after = u - friction * pushed, -restitution * v, spin - 2.0 * friction * pushed
    kept, left = 1.0 - damping * when, math.exp(-damping * duration)
    scene = scene_of(
        [Disc(position_m=(0.0, height), velocity_m_s=(u, v), radius_m=1.0, spin_rad_s=spin)],
        walls=[Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))],
        wall_restitution=restitution,
        wall_friction=friction,
        damping_per_s=damping,
        duration_s=duration,
    )
    hit = KnownImpact(
        _clock_s(when, damping), 0, wall_body(0), (u_after * kept, v_after * kept), spin_first_after=spin_after * kept
    )
    known = KnownAnswer(
        f"{_LAW}; Cross, Am. J. Phys. 70 (2002) 1093: sliding takes f (1 + e) w_n of v",
        (hit,),
        1,
        ((u_after * left, v_after * left),),
        ((u * when + u_after * (end - when), 1.0 + v_after * (end - when)),),
        final_spin_rad_s=(spin_after * left,),
    )
    return Staged(scene, known)
