"""Small random scenes to compare solvers by, each drawn from its number alone; every second one is full of ties."""

from __future__ import annotations

import math
import random

from carom import Disc, Scene, SceneError, Wall
from carom.trace import Vector

#: Lengths of the box, metres.
SIDES = [8, 12]
#: Directions of walls; with these lengths most are not representable exactly.
OBLIQUE = [(3.0, 4.0), (-4.0, 3.0), (1.0, 1.0), (-1.0, 2.0), (-5.0, -12.0), (2.0, -3.0)]


def small_scene(number: int) -> Scene:
    """Return the scene of a number: on whole numbers where that is even, else anywhere."""
    rng = random.Random(number)
    while True:
        try:
            return _on_whole_numbers(rng, number) if number % 2 == 0 else _anywhere(rng, number)
        except SceneError:
            continue  # an overlapping start: draw again


def impacts_of(number: int) -> int:
    """Return over how many impacts the scene of a number is followed: few, but in every fiftieth beyond an epoch."""
    return 200 if number % 50 in {0, 1} else 4 + number % 23


def _on_whole_numbers(rng: random.Random, number: int) -> Scene:
    """Discs and walls on whole numbers and halves: impacts, edges of cells and walls come at one instant."""
    half, side = rng.choice([1, 1, 2]), rng.choice(SIDES)
    radii = rng.choice([[0.5], [0.5], [1.0], [0.5, 1.0], [0.25, 0.5, 1.0]])
    discs = []
    for _ in range(rng.randint(3, 8)):
        place = (float(rng.randint(1, side - 1)), float(rng.randint(1, side - 1)))
        mass = rng.choice([1.0, 1.0, 1.0, 2.0, 4.0, math.inf])
        velocity = (rng.randint(-2 * half, 2 * half) / half, rng.randint(-2 * half, 2 * half) / half)
        discs.append(_disc(place, velocity, rng.choice(radii), mass))
    if rng.random() < 0.4:  # two that only set how wide the cells are
        end = float(rng.choice([side, side, 9, 16]))
        discs += [_disc((0.0, 0.0), (0.0, 0.0), 0.5, math.inf), _disc((end, end), (0.0, 0.0), 0.5, math.inf)]
    rng.shuffle(discs)
    return _scene(rng, number, discs, _walls(rng, float(side), whole=True))


def _anywhere(rng: random.Random, number: int) -> Scene:
    """Discs of all sizes anywhere, heading for the middle."""
    discs, side = [], rng.choice(SIDES)
    smallest = rng.choice([0.1, 0.5, 0.9])
    for _ in range(rng.randint(3, 8)):
        x, y = rng.uniform(1.0, side - 1.0), rng.uniform(1.0, side - 1.0)
        pull = rng.uniform(0.0, 0.5)
        velocity = (rng.gauss(0.0, 1.0) - pull * (x - side / 2), rng.gauss(0.0, 1.0) - pull * (y - side / 2))
        mass = math.inf if rng.random() < 0.2 else math.exp(rng.uniform(-2.0, 2.0))
        discs.append(_disc((x, y), velocity, rng.uniform(smallest, 1.0), mass))
    return _scene(rng, number, discs, _walls(rng, float(side), whole=False))


def _disc(place: Vector, velocity: Vector, radius: float, mass: float) -> Disc:
    return Disc(
        position_m=place, velocity_m_s=(0.0, 0.0) if mass == math.inf else velocity, radius_m=radius, mass_kg=mass
    )


def _walls(rng: random.Random, side: float, *, whole: bool) -> list[Wall]:
    """Return no walls, a box, some sides of one, or oblique walls; each up to three times, by different points."""
    box = [((0.0, 0.0), (1.0, 0.0)), ((side, 0.0), (-1.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)), ((0.0, side), (0.0, -1.0))]
    kind = rng.randrange(5)
    given = [[], box, box, rng.sample(box, 2), []][kind]
    if kind == 4 or rng.random() < 0.2:
        for nx, ny in rng.sample(OBLIQUE, rng.randint(1, 3)):
            length, away = math.hypot(nx, ny), side / 2 + rng.randint(0, 3)  # metres from the middle
            given = [*given, ((side / 2 - away * nx / length, side / 2 - away * ny / length), (nx, ny))]
    times = rng.choice([1, 1, 1, 2, 3])
    walls = []
    for (x, y), (nx, ny) in given * times:
        along = float(rng.randint(-3, 3)) if whole else rng.uniform(-3.0, 3.0)
        along = along if rng.random() < 0.5 else 0.0
        walls.append(Wall(point_m=(x - along * ny, y + along * nx), normal=(nx, ny)))
    rng.shuffle(walls)
    return walls


def _scene(rng: random.Random, number: int, discs: list[Disc], walls: list[Wall]) -> Scene:
    return Scene(
        name=f"small scene {number}",
        discs=discs,
        walls=walls,
        restitution=rng.choice([0.0, 0.5, 1.0, 1.0]),
        wall_restitution=rng.choice([0.0, 0.5, 1.0, 1.0]),
        duration_s=30.0,
    )
