"""The group `gravity`: scenes with uniform gravity. Formulas give the answers.

The first scene has no impact, so all errors come from how an engine integrates free fall. In the other scenes, impacts
also cause errors; `docs/theory/contact.md` explains how to distinguish errors of impacts from errors of free fall.
"""

from __future__ import annotations

import math

from carom.catalogue.closed_forms import compute_after_impact, compute_fall, compute_normal, dot
from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import FLOOR, build_box_walls
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, to_vector
from carom.model.scene import Wall

#: Standard acceleration of free fall, in metres per second squared (3rd CGPM, 1901), downwards.
FALL = complex(0.0, -9.80665)


def _free_fall() -> Staged:
    """A disc is thrown and meets nothing, so any error at the end comes from the integrator."""
    start, velocity, duration = 0.3 + 1.7j, 2.1 + 4.3j, 1.25
    scene = build_scene([build_disc(start, velocity, 0.15)], pull=abs(FALL), duration_s=duration)
    final = [compute_fall(start, velocity, duration, FALL)]
    return build_staged(scene, [], "Galileo's parabola: x + v t + g t^2/2", final=final)


def _compute_hops(
    first_s: float, speed: float, pull: float, restitution: float, end_s: float
) -> list[tuple[float, float]]:
    """Return time and speed after each bounce until `end_s`.

    The first bounce is at `first_s`, with the impact speed `speed`. A body that leaves at the speed u comes back after
    ``2 u / pull``. So the time of bounce n + 1 is ``first_s + 2 speed (e + ... + e^n) / pull``.
    """
    bounces: list[tuple[float, float]] = []
    n = 0
    while True:
        powers = math.fsum(restitution**k for k in range(1, n + 1))
        time = first_s + 2 * speed * powers / pull
        if time > end_s:
            return bounces
        n += 1
        bounces.append((time, speed * restitution**n))


def _stage_bouncing(height: float, restitution: float, duration_s: float) -> Staged:
    """Build a scene in which a disc is dropped on a level floor with a constant sideways velocity."""
    radius, drift = 0.2, 0.4
    pull = abs(FALL)
    first, speed = math.sqrt(2 * height / pull), math.sqrt(2 * height * pull)
    discs = [build_disc(complex(0, height + radius), drift, radius)]
    scene = build_scene(discs, walls=[FLOOR], wall_restitution=restitution, pull=abs(FALL), duration_s=duration_s)
    bounces = _compute_hops(first, speed, pull, restitution, duration_s)
    last, leaving = bounces[-1]
    final = compute_fall(complex(drift * last, radius), complex(drift, leaving), duration_s - last, FALL)
    source = (
        "A body thrown up at u comes back after 2 u / g. If the first bounce is at the speed v, bounce n + 1 is "
        "2 v (e + ... + e^n) / g later"
    )
    return build_staged(scene, [build_impact(t, 0, -1, complex(drift, u)) for t, u in bounces], source, final=[final])


def _bouncing_ball() -> Staged:
    """An elastic ball falls on the floor and bounces to the same height, for ever."""
    return _stage_bouncing(0.5, 1.0, 2.75)


def _ladder() -> Staged:
    """A ball of restitution 0.8 bounces lower each time. The scene ends shortly before the ball would come to rest."""
    # The fall takes 0.267 s. After 9 times this time, all of the infinitely many bounces would be over.
    return _stage_bouncing(0.35, 0.8, 1.93)


def _box() -> Staged:
    """A ball is thrown in a box. Only exact times give the correct order of impacts on the floor and the side walls."""
    radius, width, height, duration = 0.2, 2.4, 4.0, 3.0
    start, velocity = 0.7 + 1.1j, 1.9 + 1.3j  # relative to the corner of the region in which the centre moves
    pull = abs(FALL)
    discs = [build_disc(start + complex(radius, radius), velocity, radius)]
    scene = build_scene(discs, walls=build_box_walls(width, height), pull=abs(FALL), duration_s=duration)
    landing = math.sqrt(velocity.imag**2 + 2 * pull * start.imag)
    floor = _compute_hops((velocity.imag + landing) / pull, landing, pull, 1.0, duration)
    length = width - 2 * radius
    count = math.floor((start.real + velocity.real * duration) / length)
    sides = [((n * length - start.real) / velocity.real, n) for n in range(1, count + 1)]
    events = [(t, True, n) for t, n in sides] + [(t, False, n) for n, (t, _) in enumerate(floor)]
    impacts, across = [], velocity.real
    for time, is_side, n in sorted(events):
        if is_side:
            across = -across
            earlier = [t for t, _ in floor if t < time]
            up = landing - pull * (time - earlier[-1]) if earlier else velocity.imag - pull * time
            impacts.append(build_impact(time, 0, -2 if n % 2 else -1, complex(across, up)))
        else:
            impacts.append(build_impact(time, 0, -3, complex(across, landing)))
    unfolded = (start.real + velocity.real * duration) / length
    folded = abs(unfolded - 2 * round(unfolded / 2)) * length
    last = floor[-1][0]
    end, speed = compute_fall(folded, complex(across, landing), duration - last, FALL)
    final = (complex(folded, end.imag) + complex(radius, radius), speed)
    source = (
        "Sideways there is no gravity, and mirror images of the box make the motion straight; vertically, each hop "
        "takes 2 u / g"
    )
    return build_staged(scene, impacts, source, final=[final])


def _falling_pair() -> Staged:
    """Two discs collide while they fall. For an observer who also falls, the discs collide as without gravity."""
    m1, m2, r1, r2, time, duration, e = 2.0, 3.0, 0.2, 0.3, 0.55, 1.25, 0.9
    v1, v2 = 3 + 1j, -1 + 2.5j  # at the impact, for a falling observer
    normal = compute_normal(v1 - v2, 0.35)
    impact_point = 0.4 + 2.2j
    p1, p2 = impact_point - r1 * normal, impact_point + r2 * normal
    after1, after2 = compute_after_impact(m1, v1, m2, v2, normal, e)
    discs = [build_disc(p1 - v1 * time, v1, r1, m1), build_disc(p2 - v2 * time, v2, r2, m2)]
    scene = build_scene(discs, restitution=e, pull=abs(FALL), duration_s=duration)
    gained_velocity, rest = FALL * time, duration - time
    drop = FALL * (duration**2 / 2)
    final = [(p + v * rest + drop, v + FALL * duration) for p, v in ((p1, after1), (p2, after2))]
    source = "For a falling observer there is no gravity, so g t and g t^2/2 are added to the motion without gravity"
    impact = build_impact(time, 0, 1, after1 + gained_velocity, after2 + gained_velocity)
    return build_staged(scene, [impact], source, final=final)


def _incline() -> Staged:
    """A ball of restitution 3/4 bounces down a slope of 3 in 4."""
    radius, height, e, duration = 0.25, 0.9, 0.75, 2.3
    normal = complex(3, 4) / 5  # the slope descends to the right
    along = -1j * normal
    pull, slide = -dot(FALL, normal), dot(FALL, along)
    first, speed = math.sqrt(2 * height / pull), math.sqrt(2 * height * pull)
    discs = [build_disc((height + radius) * normal, 0, radius)]
    walls = [Wall(point_m=to_vector(-3 * along), normal=(3.0, 4.0))]
    scene = build_scene(discs, walls=walls, wall_restitution=e, pull=abs(FALL), duration_s=duration)
    bounces = _compute_hops(first, speed, pull, e, duration)
    last, leaving = bounces[-1]
    up, falling = compute_fall(complex(0, radius), complex(0, leaving), duration - last, complex(0, -pull))
    final = (up.imag * normal + slide * duration**2 / 2 * along, falling.imag * normal + slide * duration * along)
    source = (
        "Perpendicular to the slope, the ball bounces under g cos(slope); along the slope, its acceleration is g "
        "sin(slope)"
    )
    impacts = [build_impact(t, 0, -1, u * normal + slide * t * along) for t, u in bounces]
    return build_staged(scene, impacts, source, final=[final])
