"""Random discs on parabolas, and fixed discs: far and close misses, grazes, contact, and extreme sizes."""

import math
import random
from collections.abc import Callable
from typing import NamedTuple

from carom.core.wall_features import Point


class Encounter(NamedTuple):
    """A disc (x, y, vx, vy, radius), a fixed one (x, y, radius), and the speed at which the disc has just left it."""

    disc: tuple[float, float, float, float, float]
    fixed: tuple[float, float, float]
    acceleration: Point
    leaving: float | None = None


def _direction(angle: float) -> Point:
    return math.cos(angle), math.sin(angle)


def _aimed(place: Point, target: Point, acceleration: Point, time: float) -> Point:
    """Return the velocity that leads from a place to a target in a time."""
    (x, y), (tx, ty), (ax, ay) = place, target, acceleration
    return (tx - x) / time - 0.5 * ax * time, (ty - y) / time - 0.5 * ay * time


def _gravity(rnd: random.Random, size: float) -> Point:
    strength = 9.81 * size * 10 ** rnd.uniform(-2, 2)
    if rnd.random() < 0.5:
        return 0.0, -strength
    x, y = _direction(rnd.uniform(0, 2 * math.pi))
    return strength * x, strength * y


def _passing(rnd: random.Random, miss: float | None) -> Encounter:
    """Return a disc that passes a fixed one at this distance, over the sum of the radii, or anyhow."""
    size = 10 ** rnd.uniform(-3, 3)
    acceleration = _gravity(rnd, size)
    radius, fixed_radius = rnd.uniform(0.1, 1) * size, rnd.uniform(0, 1) * size
    reach = radius + fixed_radius
    x, y = rnd.choice([0.0, 0.0, 1e3, 1e6]) * size, rnd.choice([0.0, 1e3]) * size
    nx, ny = _direction(rnd.uniform(0, 2 * math.pi))
    distance = reach * rnd.uniform(1.001, 8)
    place = nx * distance, ny * distance
    speed = math.sqrt(size * math.hypot(*acceleration))
    velocity = rnd.gauss(0, 3) * speed, rnd.gauss(0, 3) * speed
    if miss is not None:
        tx, ty = _direction(rnd.uniform(0, 2 * math.pi))
        time = rnd.uniform(0.1, 3) * size / speed
        velocity = _aimed(place, (tx * reach * miss, ty * reach * miss), acceleration, time)
    return Encounter((x + place[0], y + place[1], *velocity, radius), (x, y, fixed_radius), acceleration)


def draw_free(rnd: random.Random) -> Encounter:
    return _passing(rnd, None)


def draw_aimed(rnd: random.Random) -> Encounter:
    return _passing(rnd, rnd.uniform(0, 1.1))


def draw_near_miss(rnd: random.Random) -> Encounter:
    return _passing(rnd, 1 + rnd.choice([-1, 1]) * 10 ** rnd.uniform(-16, -6))


def draw_graze(rnd: random.Random) -> Encounter:
    """Return a disc whose apex is above a fixed one, and touches it or misses it by little."""
    radius, fixed_radius, g = rnd.uniform(0.1, 1), rnd.uniform(0.05, 1), 9.81
    reach, time = radius + fixed_radius, rnd.uniform(0.3, 1.5)
    speed = math.sqrt(g * reach) * rnd.uniform(1.05, 5)
    above = reach * (1 + rnd.choice([-1, 0, 1]) * 10 ** rnd.uniform(-16, -4))
    return Encounter(
        (-speed * time, above - 0.5 * g * time * time, speed, g * time, radius), (0.0, 0.0, fixed_radius), (0.0, -g)
    )


def draw_contact(rnd: random.Random) -> Encounter:
    """Return a disc on the rim of a fixed one, up to rounding, that leaves it, slides along it or rests."""
    size = 10 ** rnd.uniform(-3, 3)
    acceleration = _gravity(rnd, size)
    radius, fixed_radius = rnd.uniform(0.1, 1) * size, rnd.uniform(0, 1) * size
    reach = radius + fixed_radius
    speed = math.sqrt(reach * math.hypot(*acceleration))
    nx, ny = _direction(rnd.uniform(0, 2 * math.pi))
    distance = reach * (1 + rnd.choice([0, 0, -1, 1]) * 10 ** rnd.uniform(-17, -8))
    leaving = rnd.choice([None, 0.0, abs(rnd.gauss(0, 1)) * speed, 10 ** rnd.uniform(-12, 0) * speed])
    away = rnd.choice([0.0, rnd.gauss(0, 1) * speed]) if leaving is None else leaving
    along = rnd.choice([0.0, rnd.gauss(0, 1), 0.99, 1.0, 1.01]) * speed
    velocity = nx * away - ny * along, ny * away + nx * along
    return Encounter((nx * distance, ny * distance, *velocity, radius), (0.0, 0.0, fixed_radius), acceleration, leaving)


def draw_whole_numbers(rnd: random.Random) -> Encounter:
    """Return a case of whole numbers over 1, 2 or 4, with double roots and roots that are floats."""
    unit = rnd.choice([1, 2, 4])
    x, y, vx, vy, ay = (rnd.randint(-12, 12) / unit for _ in range(5))
    ax = rnd.randint(-12, 12) / unit if rnd.random() < 0.3 else 0.0
    leaving = rnd.choice([None, None, None, 0.0, rnd.randint(0, 12) / unit])
    radius, fixed_radius = rnd.randint(1, 8) / unit, rnd.randint(0, 8) / unit
    return Encounter((x, y, vx, vy, radius), (0.0, 0.0, fixed_radius), (ax, ay), leaving)


def draw_on_table(rnd: random.Random) -> Encounter:
    """Return a disc as seen from another, each of which a table slows down: they may be slowed almost alike."""
    deceleration = 10 ** rnd.uniform(-2, 1)
    first = rnd.gauss(0, 3), rnd.gauss(0, 3)
    part = 1 + rnd.choice([0, 1e-16, 1e-12, 1e-3])
    second = rnd.choice([(0.0, 0.0), (rnd.gauss(0, 3), rnd.gauss(0, 3)), (first[0] * part, first[1]), first])
    radius, fixed_radius = rnd.uniform(0.1, 0.5), rnd.uniform(0.1, 0.5)
    distance = (radius + fixed_radius) * rnd.choice([1 + 10 ** rnd.uniform(-16, 0), rnd.uniform(1, 10)])
    vx, vy = (a - b for a, b in zip(first, second, strict=True))
    speed = math.hypot(vx, vy)
    x, y = _direction(rnd.uniform(0, 2 * math.pi))
    if speed and rnd.random() < 0.5:
        x, y = -vx / speed + rnd.uniform(-0.1, 0.1), -vy / speed + rnd.uniform(-0.1, 0.1)
    slowed = [(-deceleration * u / math.hypot(*v) if math.hypot(*v) else 0.0) for v in (first, second) for u in v]
    acceleration = slowed[0] - slowed[2], slowed[1] - slowed[3]
    leaving = rnd.choice([None, None, 0.0, abs(rnd.gauss(0, 1))])
    return Encounter((x * distance, y * distance, vx, vy, radius), (0.0, 0.0, fixed_radius), acceleration, leaving)


def draw_any_size(rnd: random.Random) -> Encounter:
    """Return a case whose lengths, speeds and accelerations are from 1e-100 to 1e100."""
    size, speed, pull = (10 ** rnd.uniform(-100, 100) for _ in range(3))
    if rnd.random() < 0.6:  # comparable: what falls by its own size has about this speed
        pull = speed / size * speed * 10 ** rnd.uniform(-2, 2)
        pull = pull if 1e-150 < pull < 1e150 else 1.0
    x, y = rnd.uniform(-5, 5) * size, rnd.uniform(-5, 5) * size
    velocity = rnd.gauss(0, 1) * speed, rnd.gauss(0, 1) * speed
    if rnd.random() < 0.5:
        velocity = -x / size * speed * rnd.uniform(0.5, 1), -y / size * speed
    radius, fixed_radius = rnd.uniform(0.1, 1) * size, rnd.uniform(0, 1) * size * rnd.choice([1, 1, 1e-20])
    leaving = rnd.choice([None, None, 0.0, abs(rnd.gauss(0, 1)) * speed])
    return Encounter((x, y, *velocity, radius), (0.0, 0.0, fixed_radius), (rnd.choice([0.0, pull]), -pull), leaving)


ENCOUNTERS: tuple[Callable[[random.Random], Encounter], ...] = (
    draw_free,
    draw_aimed,
    draw_near_miss,
    draw_graze,
    draw_contact,
    draw_whole_numbers,
    draw_on_table,
    draw_any_size,
)
