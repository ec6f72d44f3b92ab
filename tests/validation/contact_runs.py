"""One disc on one half-plane under gravity, at 60 digits: bounces one by one, and contact by trying every branch.

It shares no code with Carom. Of the two frictions each either acts against its motion or holds it at 0; the law has
one answer, so whichever of the nine cases does not contradict itself is it.
"""

import itertools
from typing import NamedTuple

from mpmath import mp, mpf

from carom import Scene

DIGITS = 60
#: What is below this is 0.
NOTHING = mpf(10) ** -45
#: Bounces below this are over: what friction gives back of a slip in the last is some times as much at most.
OVER = mpf(10) ** -48


class End(NamedTuple):
    """Place, velocity and spin at the end, and when how the disc moves in contact has changed."""

    place: tuple[mpf, mpf]
    velocity: tuple[mpf, mpf]
    spin: mpf
    changes: list[mpf]


def compute_friction(
    s1: mpf, q1: mpf, most: tuple[mpf, mpf], y: mpf, signs: tuple[mpf, mpf] = (0, 0)
) -> tuple[mpf, mpf]:
    """Return what friction and rolling resistance take: s = s1 - f (1 + y) - h y and q = q1 - (f + h) y.

    Where the first (second) of `signs` is not 0, friction (rolling resistance) acts against that; elsewhere against s
    (q), or holds it at 0.
    """
    s0, q0 = signs
    for slip, rim in itertools.product((1, -1, 0), repeat=2):
        f, h = slip * most[0], rim * most[1]
        if not slip and not rim:  # both held: s1 = f (1 + y) + h y, q1 = (f + h) y
            f, h = (s1 - q1, q1 / y - (s1 - q1)) if y else (s1, mpf(0))
        elif not slip:
            f = (s1 - h * y) / (1 + y)
        elif not rim:
            h = q1 / y - f if y else mpf(0)
        s, q = s1 - f * (1 + y) - h * y, q1 - (f + h) * y
        fits_slip = slip * s0 > 0 if s0 else (slip * s > NOTHING if slip else abs(f) <= most[0] + NOTHING)
        if not y or not most[1]:  # rolling resistance takes nothing: one of the three cases is enough
            fits_rim = (rim == 1 and most[1] == 0) or (not y and rim == 0)
        else:
            fits_rim = rim * q0 > 0 if q0 else (rim * q > NOTHING if rim else abs(h) <= most[1] + NOTHING)
        if fits_slip and fits_rim:
            return f, h
    raise AssertionError(f"no branch fits {s1}, {q1}, {most}")


def run_contact_scene(scene: Scene) -> End:
    """Return the end of a scene of one disc and one half-plane that gravity presses it to."""
    disc, wall = scene.discs[0], scene.half_planes()[0]
    nx, ny = map(mpf, wall.normal)
    length = mp.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    gx, gy = map(mpf, scene.gravity_m_s2)
    radius, y = mpf(disc.radius_m), 1 / mpf(disc.inertia_factor) if disc.inertia_factor < mp.inf else mpf(0)
    p, a = -(gx * nx + gy * ny), gx * ny - gy * nx
    e, mu, c = map(mpf, (scene.wall_restitution, scene.wall_friction, scene.wall_rolling_resistance))
    b = mpf(scene.wall_tangential_restitution)  # with which there is no c: what holds (1 + b) s at 0 leaves -b s
    x, z = (mpf(disc.position_m[k]) - mpf(wall.point_m[k]) for k in (0, 1))
    vx, vz = map(mpf, disc.velocity_m_s)
    gap, off = x * nx + z * ny - radius, vx * nx + vz * ny
    way, u, q = x * ny - z * nx, vx * ny - vz * nx, radius * mpf(disc.spin_rad_s)
    time, end = mpf(0), mpf(scene.duration_s)
    changes: list[mpf] = []
    on = abs(gap) < mpf(10) ** -14 and off * off < mpf(10) ** -13  # up to the rounding of its numbers
    if abs(gap) < mpf(10) ** -14:
        gap = mpf(0)
    while not on:
        wait = (off + mp.sqrt(off * off + 2 * p * gap)) / p
        if time + wait >= end:
            break
        time, way, u, w = time + wait, way + wait * (u + a * wait / 2), u + a * wait, p * wait - off
        pressed = (1 + e) * w
        f, h = compute_friction((1 + b) * (u + q), q, (mu * pressed, c * pressed), y)
        u, q, gap, off = u - f, q - (f + h) * y, mpf(0), e * w
        on = off < OVER
    if not on:
        left = end - time
        way, u, off_end = way + left * (u + a * left / 2), u + a * left, off - p * left
        height = radius + gap + left * (off - p * left / 2)
        return _build_end((nx, ny), wall.point_m, (way, height), (u, off_end), q / radius, changes)
    changes.append(time)
    while True:
        slip = mpf(0) if abs(u + q) < NOTHING else u + q
        rim = mpf(0) if abs(q) < NOTHING or not y else q
        f, h = compute_friction(a, mpf(0), (mu * p, c * p), y, (slip, rim if c else mpf(0)))
        rate, turns = a - f, -(f + h) * y
        waits = [-slip / (rate + turns)] if slip * (rate + turns) < 0 else []
        waits += [-rim / turns] if c and rim * turns < 0 else []
        wait = min([end - time, *waits])
        time, way, u, q = time + wait, way + wait * (u + rate * wait / 2), u + rate * wait, q + turns * wait
        if time >= end:
            return _build_end((nx, ny), wall.point_m, (way, radius), (u, mpf(0)), q / radius, changes)
        changes.append(time)


def _build_end(
    normal: tuple[mpf, mpf],
    point: tuple[float, float],
    place: tuple[mpf, mpf],
    velocity: tuple[mpf, mpf],
    spin: mpf,
    changes: list[mpf],
) -> End:
    (nx, ny), (way, height), (u, off) = normal, place, velocity
    x, z = way * ny + height * nx + mpf(point[0]), height * ny - way * nx + mpf(point[1])
    return End((x, z), (u * ny + off * nx, off * ny - u * nx), spin, changes)
