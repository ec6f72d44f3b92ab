"""Brute force at hundreds of digits: event-driven discs in mpmath, sharing no code and no formula with Carom.

Every pair is predicted again after every impact, all discs are moved at every impact, and the time of impact is the
root ``(-b - sqrt(b^2 - a c)) / a`` of the textbook.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf
from tests.random_scenes import draw_scene

from carom import CertifiedTrace, Scene, Wall
from carom.solvers.certified.result import Ending

DIGITS = 400


class Happened(NamedTuple):
    """One impact: time, bodies, and the velocities and spins after it, all of `DIGITS` digits."""

    time: Any
    first: int
    second: int
    after: tuple[Any, ...]
    spins: tuple[Any, Any]


def draw_lossy_scene(number: int, **more: Any) -> Scene:
    """Return a drawn scene whose impacts have one order: nothing starts or stays in contact, no wall is given twice."""
    restitutions = (0.25, 0.5, 0.9, 1.0, 1.0)
    return draw_scene("anywhere", number, repeated=False, restitutions=restitutions, rooms_m=(0.5, 1.0), **more)


def run_brute_force(scene: Scene, most: int) -> list[Happened]:
    """Return the first impacts of a scene."""
    p = [[mpf(c) for c in disc.position_m] for disc in scene.discs]
    v = [[mpf(c) for c in disc.velocity_m_s] for disc in scene.discs]
    r = [mpf(disc.radius_m) for disc in scene.discs]
    m = [None if disc.immovable else mpf(disc.mass_kg) for disc in scene.discs]
    g = [mpf(c) for c in scene.gravity_m_s2]
    spin = [mpf(disc.spin_rad_s) for disc in scene.discs]
    now, happened = mpf(0), list[Happened]()
    just_met = (-1, -1)
    while len(happened) < most:
        found = []
        rate = mpf(scene.damping_per_s)
        for i in range(len(p)):
            waits = [(_pair_wait(p, v, r, m, i, j), i, j) for j in range(i + 1, len(p))]
            waits = [wait for wait in waits if wait[1:] != just_met]
            for k, wall in enumerate(scene.half_planes()):
                if any(g):
                    waits.append((_fall_wait(p[i], v[i], r[i], g, wall), i, -1 - k))
                elif (i, -1 - k) != just_met:
                    waits.append((_wall_wait(p[i], v[i], r[i], m[i], wall, now), i, -1 - k))
            if rate:
                waits = [(_slowed_wait(wait, rate), *bodies) for wait, *bodies in waits]
            found += [wait for wait in waits if wait[0] is not None]
        if not found:
            break
        wait, i, j = min(found)
        if now + wait > mpf(scene.duration_s):
            break
        now += wait
        kept = mp.exp(-rate * wait)
        far = (1 - kept) / rate if rate else wait  # as far as this many seconds at one speed
        for place, speed in zip(p, v, strict=True):
            for c in (0, 1):
                place[c] += speed[c] * far + g[c] * wait**2 / 2
                speed[c] = speed[c] * kept + g[c] * wait
        spin = [one * kept for one in spin]
        before = [list(speed) for speed in v]
        if j < 0:
            _bounce(v[i], scene.half_planes()[-1 - j], mpf(scene.wall_restitution))
        else:
            _collide(p, v, m, i, j, mpf(scene.restitution))
        _apply_friction(scene, before, v, spin, i, j)
        after = (*v[i], *(v[j] if j >= 0 else map(mpf, scene.half_planes()[-1 - j].velocity_m_s)))
        just_met = (i, j)
        happened.append(Happened(now, i, j, after, (spin[i], spin[j] if j >= 0 else mpf(0))))
    return happened


def _slowed_wait(wait: Any, rate: Any) -> Any:
    """Return when a damped disc is where it would be after `wait` at one speed; None where it never gets so far."""
    return None if wait is None or rate * wait >= 1 else -mp.log(1 - rate * wait) / rate


def _pair_wait(p: Any, v: Any, r: Any, m: Any, i: int, j: int) -> Any:
    if m[i] is None and m[j] is None:
        return None
    dx, dy, ux, uy = p[j][0] - p[i][0], p[j][1] - p[i][1], v[j][0] - v[i][0], v[j][1] - v[i][1]
    a, b, c = ux**2 + uy**2, dx * ux + dy * uy, dx**2 + dy**2 - (r[i] + r[j]) ** 2
    if b >= 0 or b**2 - a * c <= 0:
        return None
    return (-b - mp.sqrt(b**2 - a * c)) / a


def _wall_wait(p: Any, v: Any, r: Any, m: Any, wall: Wall, now: Any) -> Any:
    (nx, ny), (ux, uy) = map(mpf, wall.normal), map(mpf, wall.velocity_m_s)
    length = mp.sqrt(nx**2 + ny**2)
    nx, ny = nx / length, ny / length
    speed = (v[0] - ux) * nx + (v[1] - uy) * ny
    if m is None or speed >= 0:
        return None
    return ((p[0] - wall.point_m[0] - ux * now) * nx + (p[1] - wall.point_m[1] - uy * now) * ny - r) / -speed


def _fall_wait(p: Any, v: Any, r: Any, g: Any, wall: Wall) -> Any:
    """Return the least root from now on of ``w + s t + a t^2 / 2`` at which it falls; all discs are movable."""
    angle = mp.atan2(mpf(wall.normal[1]), mpf(wall.normal[0]))
    nx, ny = mp.cos(angle), mp.sin(angle)
    w = (p[0] - wall.point_m[0]) * nx + (p[1] - wall.point_m[1]) * ny - r
    s, a = v[0] * nx + v[1] * ny, g[0] * nx + g[1] * ny
    if abs(a) < mpf(10) ** -(DIGITS - 50):  # the sine of a quarter turn is not 0
        return None if s >= 0 else w / -s
    discriminant = s**2 - 2 * a * w
    if discriminant <= 0:
        return None
    roots = [(-s + sign * mp.sqrt(discriminant)) / a for sign in (1, -1)]
    ahead = [t for t in roots if t >= 0 and s + a * t < 0]
    return min(ahead) if ahead else None


def _bounce(v: Any, wall: Wall, e: Any) -> None:
    angle = mp.atan2(mpf(wall.normal[1]), mpf(wall.normal[0]))
    (c, s), (ux, uy) = (mp.cos(angle), mp.sin(angle)), map(mpf, wall.velocity_m_s)
    x, y = v[0] - ux, v[1] - uy
    along, across = -s * x + c * y, -e * (c * x + s * y)
    v[0], v[1] = ux + c * across - s * along, uy + s * across + c * along


def _collide(p: Any, v: Any, m: Any, i: int, j: int, e: Any) -> None:
    """Turn into the frame of the normal, solve momentum and restitution for both normal speeds, and turn back."""
    dx, dy = p[j][0] - p[i][0], p[j][1] - p[i][1]
    distance = mp.sqrt(dx**2 + dy**2)
    c, s = dx / distance, dy / distance
    ni, ti = c * v[i][0] + s * v[i][1], -s * v[i][0] + c * v[i][1]
    nj, tj = c * v[j][0] + s * v[j][1], -s * v[j][0] + c * v[j][1]
    apart = e * (ni - nj)
    if m[i] is None:
        nj = ni + apart
    elif m[j] is None:
        ni = nj - apart
    else:
        centre = (m[i] * ni + m[j] * nj) / (m[i] + m[j])
        ni, nj = centre - m[j] * apart / (m[i] + m[j]), centre + m[i] * apart / (m[i] + m[j])
    v[i][0], v[i][1] = c * ni - s * ti, s * ni + c * ti
    v[j][0], v[j][1] = c * nj - s * tj, s * nj + c * tj


def _apply_friction(scene: Scene, before: Any, v: Any, spin: Any, i: int, j: int) -> None:
    """Apply friction to two bodies after their normal impulse, which follows from `before` and `v`."""
    push = [new - old for new, old in zip(v[i], before[i], strict=True)]
    moved, sign = i, 1
    if not any(push):  # the first never moves, or they did not approach
        if j < 0 or v[j] == before[j]:
            return
        push, moved, sign = [new - old for new, old in zip(v[j], before[j], strict=True)], j, -1
    size = mp.sqrt(push[0] ** 2 + push[1] ** 2)
    tx, ty = sign * push[1] / size, -sign * push[0] / size  # the first is pushed away from the second: -n turned
    friction, regain = scene.friction, scene.tangential_restitution
    if j < 0:
        friction, regain = scene.wall_friction, scene.wall_tangential_restitution
    ux, uy = map(mpf, scene.half_planes()[-1 - j].velocity_m_s if j < 0 else (0.0, 0.0))
    slip, yields, rubbed = -(ux * tx + uy * ty), mpf(0), []
    for body, side in ((i, 1), (j, -1)):
        if body < 0:
            continue
        disc = scene.discs[body]
        slip += side * (before[body][0] * tx + before[body][1] * ty) + mpf(disc.radius_m) * spin[body]
        if not disc.immovable:
            turning = mpf(0) if math.isinf(disc.inertia_factor) else 1 / (mpf(disc.inertia_factor) * mpf(disc.mass_kg))
            yields += 1 / mpf(disc.mass_kg) + turning
            rubbed.append((body, side, 1 / mpf(disc.mass_kg), turning / mpf(disc.radius_m)))
    most = mpf(friction) * size * mpf(scene.discs[moved].mass_kg)
    rub = max(-most, min(most, (1 + mpf(regain)) * slip / yields))
    for body, side, lightness, turning in rubbed:
        v[body][0] -= side * rub * lightness * tx
        v[body][1] -= side * rub * lightness * ty
        spin[body] -= rub * turning


def find_outside_radii(values: Any, radii: Any, truths: Sequence[Any], digits: int = 0) -> list[int]:
    """Return the indices of values outside their radii about the truth, which has some digits, or all but 5."""
    told = zip(np.ravel(values).tolist(), np.ravel(radii).tolist(), truths, strict=True)
    slack = mpf(10) ** -(digits or mp.dps - 5)
    return [
        k
        for k, (value, radius, truth) in enumerate(told)
        if not abs(mpf(value) - truth) <= mpf(radius) + slack * (1 + abs(truth))
    ]


def find_contradictions(certified: CertifiedTrace, happened: list[Happened]) -> list[str]:
    """Return how a certified run differs from a run of `DIGITS` digits by more than its radii."""
    found = []
    if certified.ending in (Ending.COMPLETED, Ending.MAX_IMPACTS) and len(certified) != len(happened):
        found.append(f"{len(certified)} impacts for {len(happened)}")
    for k, (impact, radius, event) in enumerate(zip(certified.trace.impacts, certified.radii, happened, strict=False)):
        if (impact["first"], impact["second"]) != (event.first, event.second):
            found.append(f"impact {k}: bodies {impact['first']}, {impact['second']} for {event.first}, {event.second}")
            break
        values = [impact["time_s"], *impact["velocity_first_after"], *impact["velocity_second_after"]]
        radii = [radius["time_s"], *radius["velocity_first_after"], *radius["velocity_second_after"]]
        truths = [event.time, *event.after]
        if certified.trace.spins is not None and certified.spin_radii is not None:
            values += [certified.trace.spins[k][name] for name in ("first_after", "second_after")]
            radii += [certified.spin_radii[k][name] for name in ("first_after", "second_after")]
            truths += event.spins
        for value, within, truth in zip(values, radii, truths, strict=True):
            if not abs(mpf(float(value)) - truth) <= mpf(float(within)) + mpf(10) ** -100:
                found.append(f"impact {k}: {value} within {within} for {mp.nstr(truth, 25)}")
    return found
