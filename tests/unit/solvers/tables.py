"""Random tables of finite walls for the solvers' tests."""

from __future__ import annotations

import math
import random
from typing import Any

from carom import Chain, Disc, Ring, Scene, Wall
from carom.errors import SceneError
from carom.walls import Leg


def random_scene(rnd: random.Random) -> Scene:
    """Return some discs in a room of edges and arcs, with bars, islands, rings, half-planes, and walls' own materials.

    Half of them are of quarters: discs touch, meet corners and slide along arcs exactly.
    """
    exact = rnd.random() < 0.5

    def number(low: float, high: float) -> float:
        return rnd.randint(int(4 * low), int(4 * high)) / 4 if exact else rnd.uniform(low, high)

    def material() -> dict[str, float]:
        return rnd.choice(({}, {}, {"restitution": rnd.choice((0.0, 0.5, 1.0))}, {"friction": 0.25}))

    bulges = [rnd.choice((0.0, 0.0, 1.0, 0.5, -0.25, number(-0.5, 0.5))) for _ in range(6)]
    room = Chain(
        points_m=[(-8, -8), (8, -8), (8, 8), (0, 8), (0, 6), (-8, 6)], bulges=bulges, closed=True, **material()
    )
    bar = [(number(-5, 5), number(-5, 5)) for _ in range(rnd.choice((2, 3)))]
    more = (
        lambda: Chain(points_m=bar, half_width_m=rnd.choice((0.0, 0.25)), **material()),
        lambda: Chain(points_m=[(3, 3), (5, 3), (4, 5)], closed=True, solid=True),
        lambda: Ring(centre_m=(number(-5, 5), number(-5, 5)), radius_m=rnd.choice((0.0, 0.5, 1.0)), **material()),
        lambda: Ring(centre_m=(0, 0), radius_m=rnd.choice((7.0, 12.0))),
        lambda: Wall(point_m=(0, -6.5), normal=(0, 1), **material()),
    )
    discs: list[Disc] = []
    for _ in range(rnd.randint(1, 8)):
        place, radius = (number(-6, 6), number(-6, 5)), rnd.choice((0.125, 0.25, 0.5))
        if all(math.dist(place, disc.position_m) >= radius + disc.radius_m for disc in discs):
            fields: dict[str, float] = {"mass_kg": rnd.choice((1.0, 2.0)), "spin_rad_s": rnd.choice((0.0, 0.0, 1.5))}
            discs.append(Disc(position_m=place, velocity_m_s=(number(-2, 2), number(-2, 2)), radius_m=radius, **fields))
    return Scene(
        name="random table",
        discs=discs,
        walls=[room, *(make() for make in more if rnd.random() < 0.4)],
        restitution=rnd.choice((1.0, 0.9)),
        wall_restitution=rnd.choice((1.0, 1.0, 0.9, 0.0)),
        wall_friction=rnd.choice((0.0, 0.0, 0.25)),
        friction=rnd.choice((0.0, 0.25)),
        duration_s=40.0,
    )


def driven(rnd: random.Random) -> Scene | None:
    """Return a random table of which walls are driven or are belts, perhaps with mallets; None where bodies overlap."""
    exact = rnd.random() < 0.5

    def part(size: float) -> float:
        return rnd.randint(-4, 4) / 4 * size if exact else rnd.uniform(-size, size)

    def legs() -> tuple[Leg, ...]:
        starts, speed = [0.0], rnd.choice((0.1, 1.0))
        for _ in range(rnd.choice((0, 0, 1, 4, 39))):
            starts.append(starts[-1] + rnd.choice((0.25, 1.0, rnd.uniform(0.01, 2.0))))
        return tuple(Leg(from_s=begin, velocity_m_s=(part(speed), part(speed))) for begin in starts)

    def mallet() -> Disc:
        place, radius = (rnd.randint(-24, 24) / 4, rnd.randint(-24, 20) / 4), rnd.choice((0.25, 0.5))
        return Disc(position_m=place, radius_m=radius, mass_kg=math.inf, driven=True, legs=legs())

    try:
        scene = random_scene(rnd)
        walls = [
            wall.model_copy(update={"legs": rnd.choice(((), legs())), "surface_speed_m_s": rnd.choice((0.0, 0.0, 0.5))})
            for wall in scene.walls
        ]
        discs = [*scene.discs, *[mallet() for _ in range(rnd.choice((0, 0, 1, 2)))]]
        rnd.shuffle(discs)
        return Scene(**{**dict(scene), "discs": discs, "walls": walls})
    except SceneError:
        return None


def drawn(seed: str) -> tuple[Scene, dict[str, Any]] | None:
    """Return a random table, and options; None where bodies overlap, or a chain crosses itself."""
    rnd = random.Random(seed)
    try:
        return random_scene(rnd), {"contact_s": rnd.choice((0.0, 0.0, 1e-3)), "cells": rnd.choice((1.0, 1.0, math.inf))}
    except SceneError:
        return None
