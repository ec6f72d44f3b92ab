"""The compiled physics gives the bits of the plain Python beside it, function by function; nothing is fused."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction

import numpy as np
import pytest
from benchmarks.time_of_impact import CLASSES, pairs_of_class
from tests.lengths import each, long_after

from carom.outline import Edge, ExactCircle, circle_of
from carom.physics.double_double import two_diff, two_prod, two_sum
from carom.physics.feature_time import feature_time, normal_at
from carom.physics.features import Arc, Face, Feature, Mover, Point
from carom.physics.impact_law import normal_impulse
from carom.physics.numbered import numbers_of
from carom.physics.pair_time import encounter, exact_pair_time, pair_time
from carom.physics.wall_time import wall_time

probe = pytest.importorskip("tests.probe")


def test_every_operation_is_rounded_to_a_double() -> None:
    """The compiler evaluates doubles as doubles: no extended precision changes a bit on the way."""
    assert probe.EVALUATION_METHOD == 0


def test_compiled_error_free_transformations_are_exact() -> None:
    """A compiled sum, difference or product and its error add up to the exact result: no multiply-add was fused."""
    rng = np.random.default_rng(5)
    for _ in range(2000):
        a, b = (float(x) for x in rng.normal(size=2) * 10.0 ** rng.integers(-20, 20, 2))
        for compiled, plain, exact in (
            (probe.two_sum, two_sum, Fraction(a) + Fraction(b)),
            (probe.two_diff, two_diff, Fraction(a) - Fraction(b)),
            (probe.two_prod, two_prod, Fraction(a) * Fraction(b)),
        ):
            high, low = compiled(a, b)
            assert Fraction(high) + Fraction(low) == exact
            assert (high, low) == plain(a, b)


@each("name", CLASSES)
def test_the_compiled_time_of_impact_has_the_bits_of_the_plain_one(name: str) -> None:
    """`pair_time`, and the error-free form alone, agree on every class of input."""
    for row in pairs_of_class(name, 200, 11).T.tolist():
        assert probe.pair_time(*row) == pair_time(*row)
        assert probe.exact_time(*row) == exact_pair_time(encounter(*row))


@each("power", [-40, -20, 20, 40])
def test_a_far_graze_takes_two_to_some_power_of_the_time_at_that_part_of_the_speed(power: int) -> None:
    """A unit of time that is a power of two changes no bit, here where the last term of the refinement makes one."""
    speed = math.ldexp(1.0, power)
    start, other = (0.0, 0.0), (78000.74509667783, 82644.98196682754, 0.0, 0.0, 0.5)
    vx, vy = 0.6863840910811245, 0.7272392175280006
    time = pair_time(*start, vx, vy, 0.5, *other)
    assert 0.0 < time < math.inf
    assert pair_time(*start, vx * speed, vy * speed, 0.5, *other) * speed == time
    assert probe.pair_time(*start, vx * speed, vy * speed, 0.5, *other) * speed == time


def test_the_compiled_time_to_a_wall_has_the_bits_of_the_plain_one() -> None:
    """`wall_time` agrees, near the wall and far from the origin, for walls along the axes and aslant."""
    rng = np.random.default_rng(6)
    for k in range(2000):
        turn = rng.uniform(0, 2 * math.pi)
        nx, ny = (math.cos(turn), math.sin(turn)) if k % 2 else (0.0, 1.0)
        qx, qy = rng.uniform(-1, 1, 2) * (1e8 if k % 3 else 1.0)
        radius = rng.uniform(0.1, 1.0)
        height = radius * (1 + (10 ** rng.uniform(-16, -6) if k % 5 else rng.uniform(-0.1, 9)))
        row = [*(float(a) for a in (qx + nx * height, qy + ny * height, *rng.normal(size=2), radius, qx, qy, nx, ny))]
        assert probe.wall_time(*row) == wall_time(*row)


def test_the_compiled_impulse_has_the_bits_of_the_plain_one() -> None:
    """`normal_impulse` agrees, for discs that approach, separate, and slide past each other."""
    rng = np.random.default_rng(7)
    for _ in range(2000):
        row = [*rng.normal(size=4).tolist(), float(np.exp(rng.normal())), float(rng.uniform())]
        assert probe.pair_normal_impulse(*row) == normal_impulse(*row)
    assert (
        probe.pair_normal_impulse(1.0, 0.0, 0.0, 1.0, 1.0, 1.0) == normal_impulse(1.0, 0.0, 0.0, 1.0, 1.0, 1.0) == 0.0
    )


#: Each draws a number: of any digits, and of so few that bodies touch, slide and end together exactly.
DRAWS: dict[str, Callable[[random.Random], float]] = {
    "any": lambda rnd: rnd.gauss(0.0, 2.0),
    "quarters": lambda rnd: rnd.randint(-12, 12) / 4,
    "far from the origin": lambda rnd: rnd.gauss(1e7, 2.0),
}


def features(rnd: random.Random, draw: Callable[[random.Random], float]) -> Iterator[Feature]:
    """Yield one of each kind; arcs of a whole circle, a part, and more than half."""
    a, b = (draw(rnd), draw(rnd)), (draw(rnd), draw(rnd))
    while a == b:
        b = draw(rnd), draw(rnd)
    half_width = rnd.choice((0.0, 0.25))
    yield Face.between(a, b, half_width)
    yield Arc.vertex(a, half_width)
    for bulge in (0.5, 1.0, 2.0):
        for inside in (True, False):
            yield Arc.on(circle_of(Edge(a, b, bulge)), (a, b), half_width, inside=inside)
    for inside in (True, False):
        yield Arc.on(ExactCircle(Fraction(a[0]), Fraction(a[1]), Fraction(4)), None, half_width, inside=inside)


def near(rnd: random.Random, feature: Feature, radius: float) -> Point:
    """Return a place at which a disc almost touches a feature."""
    away = (radius + feature.half_width) * (1.0 + rnd.choice((-1.0, 1.0)) * 2.0 ** -rnd.uniform(20, 54))
    if isinstance(feature, Face):
        part, (nx, ny) = rnd.uniform(-0.2, 1.2), feature.normal
        (ax, ay), (bx, by) = feature.a, feature.b
        return ax + part * (bx - ax) + nx * away, ay + part * (by - ay) + ny * away
    turn = rnd.uniform(0.0, math.tau)
    (x, _), (y, _) = feature.centre
    distance = feature.radius[0] + (-away if feature.inside else away)
    return x + distance * math.cos(turn), y + distance * math.sin(turn)


@pytest.mark.parametrize("draws", long_after(1, [60, 400]))
@pytest.mark.parametrize("name", DRAWS)
def test_every_form_has_the_bits_of_the_plain_one(name: str, draws: int) -> None:
    """Far and near, touching, overlapping, along tangents, just left, and as seen from a wall that moves."""
    draw, rnd, seen = DRAWS[name], random.Random(name), Counter[str]()
    for _ in range(draws):
        for feature in features(rnd, draw):
            radius, velocity = rnd.choice((0.25, 0.5)), (rnd.gauss(0.0, 1.0), rnd.gauss(0.0, 1.0))
            if name == "quarters":
                velocity = rnd.randint(-2, 2) / 2, rnd.randint(-2, 2) / 2
            place = near(rnd, feature, radius) if rnd.random() < 0.5 else (draw(rnd), draw(rnd))
            driven = (rnd.gauss(0.0, 1.0), 0.0) if rnd.random() < 0.2 else (0.0, 0.0)
            disc, just_left = Mover.at(place, velocity, radius, driven), rnd.random() < 0.2
            numbers = np.array(numbers_of(feature, 3))
            touch = feature_time(disc, feature, just_left=just_left)
            assert probe.feature_time(numbers, disc, just_left) == touch, (feature, disc, just_left)
            assert probe.normal_at(numbers, disc) == normal_at(feature, disc)
            met = "glides" if touch.glides else "now" if touch.time == 0.0 else "met" if touch.time < math.inf else "no"
            kind = "Vertex" if isinstance(feature, Arc) and feature.is_vertex else type(feature).__name__
            seen[f"{kind} {met}"] += 1
    kinds = {f"{kind} {met}" for kind in ("Face", "Vertex", "Arc") for met in ("now", "met", "no")}
    assert kinds <= set(seen), seen
    assert name != "quarters" or seen["Arc glides"] > 0
