"""Random pairs of discs whose paths test lower bounds, and the exact times at which they meet, by rationals."""

import math
import random
import sys
from fractions import Fraction
from typing import NamedTuple

from flint import arb

from carom import Disc, Scene, Wall
from carom.solvers.certified.disc_states import BallBodies


class State(NamedTuple):
    """Position and velocity of a disc at an instant: one that is within its balls."""

    time: float
    x: Fraction
    y: Fraction
    vx: Fraction
    vy: Fraction
    radius: float


def draw_adversarial_pairs(seed: int, length: float = 1.0, speed: float = 1.0) -> tuple[BallBodies, list[State]]:
    """Return eight discs, each even one of which meets, grazes or misses the next, and their true states."""
    rng = random.Random(seed)
    is_fixed = rng.random() < 0.2  # the second disc of each pair
    radii = [rng.uniform(0.05, 1.0) * rng.choice([1.0, 1.0, 10.0 ** rng.uniform(-9, 9)]) for _ in range(8)]
    discs = [
        # In a row at the start, because a scene's discs must not overlap. The states that count are set below.
        Disc(
            position_m=(3 * sum(radii[:k], radius / 2) * length, 0.0),
            radius_m=radius * length,
            mass_kg=math.inf if is_fixed and k % 2 else 1.0,
        )
        for k, radius in enumerate(radii)
    ]
    walls = [_draw_wall(rng, 40 * max(radii), length) for _ in range(3)]
    bodies = BallBodies(Scene(name="pairs", discs=discs, walls=walls, duration_s=length / speed))
    states: list[State] = []
    for k in range(0, 8, 2):
        # Some pairs are far too large, small, fast or slow for the others.
        units = [unit * 2.0 ** rng.choice([0] * 9 + [rng.randint(-540, 520)]) for unit in (length, speed)]
        first, second = _draw_pair(rng, radii[k] + radii[k + 1], is_fixed=is_fixed)
        ahead = [1 if second[c] > first[c] else -1 for c in (1, 2)]
        states.append(_set_state(bodies, k, first, rng, units, ahead))
        states.append(_set_state(bodies, k + 1, second, rng, units, [-sign for sign in ahead]))
    return bodies, states


def _draw_wall(rng: random.Random, distance: float, length: float) -> Wall:
    """Return a wall in front of which all discs are, given by a point that can be very far along it."""
    turn = rng.choice([0.0, math.pi / 2, rng.uniform(0.0, 6.3)])
    nx, ny = math.cos(turn), math.sin(turn)
    along = rng.choice([rng.uniform(-9, 9), 10.0 ** rng.uniform(0, 15)])
    x, y = -distance * nx - along * ny, -distance * ny + along * nx
    return Wall(point_m=(x * length, y * length), normal=(nx, ny))


def _draw_pair(rng: random.Random, reach: float, *, is_fixed: bool) -> list[tuple[float, ...]]:
    """Return time, x, y, vx, vy of two discs; the first is faster by `pace` towards where the second is."""
    pace = rng.choice([1.0, 1.0, 1e-12, 1e12]) * 10.0 ** rng.uniform(-1, 1)
    apart = reach * rng.choice([10.0 ** rng.uniform(0, 8), 1.0 + 10.0 ** rng.uniform(-12, 1)])
    graze = 1.0 + rng.choice([-1, 0, 1]) * 2.0 ** -rng.uniform(10, 54)
    miss = reach * rng.choice([0.0, graze, rng.uniform(-1.2, 1.2)])
    ahead = math.sqrt(max(apart * apart - miss * miss, 0.0))
    turn = rng.uniform(0.0, 2 * math.pi)
    c, s = math.cos(turn), math.sin(turn)
    x, y = (rng.uniform(-10, 10) * rng.choice([1.0, 1e4]) for _ in range(2))
    drift = (0.0, 0.0) if is_fixed else (rng.gauss(0, pace), rng.gauss(0, pace))
    velocity = drift[0] + pace * c, drift[1] + pace * s
    times = rng.choice([(0.0, 0.0), (rng.uniform(0, 1e3) / pace, rng.uniform(0, 1e3) / pace)])
    later = max(times)  # when they are apart by this
    ox = x + ahead * c - miss * s + velocity[0] * (later - times[0]) - drift[0] * (later - times[1])
    oy = y + ahead * s + miss * c + velocity[1] * (later - times[0]) - drift[1] * (later - times[1])
    return [(times[0], x, y, *velocity), (times[1], ox, oy, *drift)]


def _set_state(
    bodies: BallBodies, i: int, state: tuple[float, ...], rng: random.Random, units: list[float], ahead: list[int]
) -> State:
    """Give a disc balls around a state, and return a true state within them.

    The middles are no floats. Mostly the truth is on the rims, and as far `ahead`, where the other disc is, as can be:
    signs along x and y.
    """
    length, speed = units
    bodies.time[i] = state[0] * length / speed
    signs = ahead if rng.random() < 0.7 else [rng.choice([-1, 0, 1]) for _ in range(2)]
    true: list[Fraction] = []
    for balls, value, unit, sign in zip(
        (bodies.x, bodies.y, bodies.vx, bodies.vy), state[1:], (length, length, speed, speed), signs * 2, strict=True
    ):
        power = rng.choice([-300, -300, -70, -70, -60, -54, -42, -30, -8, 3])
        rest, spread = (math.ulp(value) * sign * 0.4999, abs(value) * 2.0**power) if value else (0.0, 0.0)
        balls[i] = arb(arb(value) + rest, spread) * unit
        true.append((Fraction(value) + Fraction(rest) + sign * Fraction(spread)) * Fraction(unit))
    x, y, vx, vy = true
    return State(bodies.time[i], x, y, vx, vy, bodies.scene.discs[i].radius_m)


def is_after_impact_of_pair(bound: float, first: State, second: State) -> bool:
    """Whether a time is after that at which two discs, apart and on their paths for ever, meet, by rationals."""
    start = Fraction(max(first.time, second.time))
    places = [
        (d.x + d.vx * (start - Fraction(d.time)), d.y + d.vy * (start - Fraction(d.time))) for d in (first, second)
    ]
    dx, dy = places[1][0] - places[0][0], places[1][1] - places[0][1]
    ux, uy = second.vx - first.vx, second.vy - first.vy
    reach = Fraction(first.radius) + Fraction(second.radius)
    a, b, c = ux * ux + uy * uy, dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    if b >= 0 or b * b <= a * c:
        return False  # they part, or never touch
    t = _fraction(bound) - start
    if c <= 0:
        return t > 0
    return t > 0 and (a * t * t + 2 * b * t + c < 0 or a * t + b > 0)  # they overlap by then, or they part already


def is_after_impact_on_wall(bound: float, disc: State, wall: Wall) -> bool:
    """Whether a time is after that at which a disc on its path for ever touches a wall, by rationals."""
    nx, ny = map(Fraction, wall.normal)
    toward = -(disc.vx * nx + disc.vy * ny)
    if toward <= 0:
        return False
    t = _fraction(bound) - Fraction(disc.time)
    qx, qy = map(Fraction, wall.point_m)
    along = (disc.x - qx) * nx + (disc.y - qy) * ny - toward * t
    return t > 0 and (along < 0 or along * along < Fraction(disc.radius) ** 2 * (nx * nx + ny * ny))


def _fraction(bound: float) -> Fraction:
    """Return a bound; infinity says that there is no impact up to the largest float."""
    return Fraction(min(bound, sys.float_info.max))
