"""Paths of pairs made to break a lower bound, and the exact time at which they meet, as rationals can tell."""

import math
import random
import sys
from fractions import Fraction
from typing import NamedTuple

from flint import arb

from carom import Disc, Scene, Wall
from carom.solvers.certified.disc_states import BallBodies

KINDS = ("any", "graze", "head-on", "far", "slow", "fast", "heavy", "wide", "old", "mixed", "wild")


class State(NamedTuple):
    """Position and velocity of a disc at an instant: one that is within its balls."""

    time: float
    x: Fraction
    y: Fraction
    vx: Fraction
    vy: Fraction
    radius: float


def build_adversarial_pairs(
    kind: str, seed: int, length: float = 1.0, speed: float = 1.0
) -> tuple[BallBodies, list[State]]:
    """Return eight discs, of which each even one is made to meet, graze or miss the next, and their true states.

    Args:
        kind: What is unusual about them, one of `KINDS`.
        seed: Which of them.
        length: Unit of lengths, a power of two.
        speed: Unit of speeds, a power of two.
    """
    r = random.Random(f"{kind} {seed}")
    radii = [r.uniform(0.05, 1.0) * (10.0 ** r.uniform(-9, 9) if kind == "mixed" else 1.0) for _ in range(8)]
    discs = [
        # In a row at the start, since a scene's discs must be apart; the states that count are set below.
        Disc(
            position_m=(3 * sum(radii[:k], radius / 2) * length, 0.0),
            velocity_m_s=(0.0, 0.0) if kind == "heavy" and k % 2 else (speed, 0.0),
            radius_m=radius * length,
            mass_kg=math.inf if kind == "heavy" and k % 2 else 1.0,
        )
        for k, radius in enumerate(radii)
    ]
    walls = [_wall(r, kind, 40 * max(radii), length) for _ in range(3)]
    bodies = BallBodies(Scene(name=kind, discs=discs, walls=walls, duration_s=length / speed))
    states: list[State] = []
    for k in range(0, 8, 2):
        units = (length, speed)
        if kind == "wild":
            units = (length * 2.0 ** r.randint(-540, 520), speed * 2.0 ** r.randint(-540, 520))
        first, second = _pair(r, kind, radii[k : k + 2])
        ahead = [1 if second[c] > first[c] else -1 for c in (1, 2)]
        states.append(_set(bodies, k, first, r, units, ahead))
        states.append(_set(bodies, k + 1, second, r, units, [-sign for sign in ahead]))
    return bodies, states


def _wall(r: random.Random, kind: str, distance: float, length: float) -> Wall:
    """Return a wall with all discs before it, given by a point that can be very far along it."""
    turn = r.choice([0.0, math.pi / 2, r.uniform(0.0, 6.3)])
    nx, ny = math.cos(turn), math.sin(turn)
    along = 10.0 ** r.uniform(0, 15) if kind == "far" else r.uniform(-9, 9)
    point = (-distance * nx - along * ny, -distance * ny + along * nx)
    return Wall(point_m=(point[0] * length, point[1] * length), normal=(nx, ny))


def _pair(r: random.Random, kind: str, radii: list[float]) -> list[tuple[float, ...]]:
    """Return time, x, y, vx, vy of two discs in units of their own."""
    reach = sum(radii)
    apart = reach * (10.0 ** r.uniform(0, 8) if kind == "far" else 1.0 + 10.0 ** r.uniform(-12, 1))
    pace = {"slow": 1e-12, "fast": 1e12}.get(kind, 1.0) * 10.0 ** r.uniform(-1, 1)
    turn = r.uniform(0.0, 2 * math.pi)
    if kind == "graze":
        miss = reach * (1.0 + r.choice([-1, 0, 1]) * 2.0 ** -r.uniform(10, 54))
    else:
        miss = 0.0 if kind == "head-on" else reach * r.uniform(-1.2, 1.2)
    ahead = math.sqrt(max(apart * apart - miss * miss, 0.0))
    c, s = math.cos(turn), math.sin(turn)
    x, y = (r.uniform(-10, 10) * (1.0 if r.random() < 0.5 else 1e4) for _ in range(2))
    drift = (0.0, 0.0) if kind == "heavy" else (r.gauss(0, pace), r.gauss(0, pace))
    times = (r.uniform(0, 1e3) / pace, r.uniform(0, 1e3) / pace) if kind == "old" else (0.0, 0.0)
    first = (times[0], x, y, drift[0] + pace * c, drift[1] + pace * s)
    later = max(times)
    ox, oy = x + ahead * c - miss * s, y + ahead * s + miss * c
    if kind == "old":  # apart so at the later instant
        ox += first[3] * (later - times[0]) - drift[0] * (later - times[1])
        oy += first[4] * (later - times[0]) - drift[1] * (later - times[1])
    return [first, (times[1], ox, oy, *drift)]


def _set(
    bodies: BallBodies, i: int, state: tuple[float, ...], r: random.Random, units: tuple[float, float], ahead: list[int]
) -> State:
    """Give a disc balls around a state, and return a true one within them.

    The middles are no floats. Mostly the truth is on the rims, and as far `ahead`, where the other disc is, as can be:
    signs along x and y.
    """
    length, speed = units
    bodies.time[i] = state[0] * length / speed
    widths = [-300, -60, -54, -42, -30, -8, 3] if bodies.scene.name == "wide" else [-300, -70]
    signs = ahead if r.random() < 0.7 else [r.choice([-1, 0, 1]) for _ in range(2)]
    true: list[Fraction] = []
    for balls, value, unit, sign in zip(
        (bodies.x, bodies.y, bodies.vx, bodies.vy), state[1:], (length, length, speed, speed), signs * 2, strict=True
    ):
        rest, spread = (math.ulp(value) * sign * 0.4999, abs(value) * 2.0 ** r.choice(widths)) if value else (0.0, 0.0)
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
