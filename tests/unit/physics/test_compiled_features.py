"""Compiled times of impact with faces, vertices and arcs, and normals there, have the bits of the plain ones."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from tests.lengths import long_after

from carom.outline import Edge, circle_of
from carom.physics.feature_time import feature_time, normal_at
from carom.physics.features import Arc, Face, Feature, Mover, Point
from carom.physics.numbered import numbers_of

probe = pytest.importorskip("tests.probe")

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
        yield Arc.of_circle(a, 2.0, half_width, inside=inside)


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
