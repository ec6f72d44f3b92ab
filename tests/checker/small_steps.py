"""Moreau's time stepping: fall, then impact and two frictions as impulses; it knows no modes. Of the first order.

Plain floats, one disc after the other. Which branch of the two frictions holds is found by trying all nine, and taking
the one that breaks its own conditions least.
"""

import itertools
import math
from typing import NamedTuple

from carom import Chain, Scene, Wall

#: Impacts slower than what gravity makes in this many steps give nothing back: they are contact.
SLOW_STEPS = 40.0

Vector = tuple[float, float]


class Ends(NamedTuple):
    """Where small steps end: places, velocities and spins of all discs."""

    places: list[Vector]
    velocities: list[Vector]
    spins: list[float]


def run_small_steps(scene: Scene, steps: int, until_s: float) -> Ends:
    """Take a scene to `until_s` in a number of steps."""
    h, (gx, gy) = until_s / steps, scene.gravity_m_s2
    discs = scene.discs
    x, y = ([disc.position_m[k] for disc in discs] for k in (0, 1))
    u, v = ([disc.velocity_m_s[k] for disc in discs] for k in (0, 1))
    w = [disc.spin_rad_s for disc in discs]
    slow = SLOW_STEPS * h * math.hypot(gx, gy)
    mu, c = scene.wall_friction, scene.wall_rolling_resistance
    for _ in range(steps):
        for i in range(len(discs)):
            u[i], v[i] = u[i] + h * gx, v[i] + h * gy
            x[i], y[i] = x[i] + h * u[i], y[i] + h * v[i]
        for i, j in itertools.combinations(range(len(discs)), 2):
            dx, dy = x[j] - x[i], y[j] - y[i]
            distance = math.hypot(dx, dy)
            closing = ((u[i] - u[j]) * dx + (v[i] - v[j]) * dy) / distance
            if distance > discs[i].radius_m + discs[j].radius_m or closing <= 0.0:
                continue
            push = (1.0 + scene.restitution) * closing / (1.0 / discs[i].mass_kg + 1.0 / discs[j].mass_kg) / distance
            for body, sign in ((i, -1.0), (j, 1.0)):
                u[body] += sign * push * dx / discs[body].mass_kg
                v[body] += sign * push * dy / discs[body].mass_kg
        for i, disc in enumerate(discs):
            for wall in scene.walls:
                distance, nx, ny = _side(wall, x[i], y[i])
                gap, into = distance - disc.radius_m, -(u[i] * nx + v[i] * ny)
                if gap > 0.0 or into <= 0.0:
                    continue
                pressed = (1.0 + (scene.wall_restitution if into > slow else 0.0)) * into
                ratio, rim = 1.0 / disc.inertia_factor, disc.radius_m * w[i]
                f, r = _frictions(u[i] * ny - v[i] * nx + rim, rim, mu * pressed, c * pressed, ratio)
                u[i] += pressed * nx - f * ny
                v[i] += pressed * ny + f * nx
                w[i] -= (f + r) * ratio / disc.radius_m
                x[i], y[i] = x[i] - gap * nx, y[i] - gap * ny
    return Ends(list(zip(x, y, strict=True)), list(zip(u, v, strict=True)), w)


def _side(wall: object, x: float, y: float) -> tuple[float, float, float]:
    """Return how far a point is from a wall, and the unit normal from there to it."""
    if isinstance(wall, Wall):
        (qx, qy), (nx, ny) = wall.point_m, wall.normal
        return (x - qx) * nx + (y - qy) * ny, nx, ny
    if not isinstance(wall, Chain):
        raise TypeError("small steps know half-planes and chains of straight edges")
    nearest = (math.inf, 0.0, 0.0)
    for (ax, ay), (bx, by) in itertools.pairwise(wall.points_m):
        ex, ey = bx - ax, by - ay
        part = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)))
        dx, dy = x - ax - part * ex, y - ay - part * ey
        nearest = min(nearest, (math.hypot(dx, dy), dx, dy))
    distance, dx, dy = nearest
    return distance - wall.half_width_m, dx / distance, dy / distance


def _frictions(s1: float, q1: float, f_most: float, h_most: float, ratio: float) -> Vector:
    """Return f and h of the branch of nine that breaks its conditions least."""
    if not h_most or not ratio:
        return max(-f_most, min(f_most, s1 / (1.0 + ratio))), 0.0
    least = (math.inf, 0.0, 0.0)
    for slides, turns in itertools.product((0, 1, -1), repeat=2):
        f, h = slides * f_most, turns * h_most
        if not slides and not turns:
            f = s1 - q1
            h = q1 / ratio - f
        elif not slides:
            f = (s1 - h * ratio) / (1.0 + ratio)
        elif not turns:
            h = q1 / ratio - f
        s, q = s1 - f * (1.0 + ratio) - h * ratio, q1 - (f + h) * ratio
        broken = max(abs(f) - f_most, abs(h) - h_most, -slides * s, -turns * q)
        least = min(least, (broken, f, h))
    return least[1:]
