"""PIC against an oracle that shares no code with it: 50 digits, every pair anew at every step, textbook formulas.

How far float64 may be off is not guessed. The oracle also runs scenes that differ from the given one by a few units in
the fiftieth digit; how much their impacts differ is the scene's own condition, and what float64 may be off is that
condition times the rounding of float64, times a few for the operations of each impact.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any, NamedTuple

import pytest
from mpmath import mp, mpf, sqrt

from carom import Disc, Scene, SceneError, Wall, solve_pic

DIGITS = 50
NUDGE = mpf(10) ** -35
#: Float64's unit roundoff, and what is granted for the operations of one impact (about 30, in several discs).
ROUNDOFF = 2.0**-53
OPERATIONS = 64


class Event(NamedTuple):
    time: Any
    first: int
    second: int
    velocities: tuple[Any, ...]


@dataclass
class Body:
    x: Any
    y: Any
    vx: Any
    vy: Any
    r: Any
    m: Any


def bodies_of(scene: Scene, shake: random.Random | None) -> list[Body]:
    """Take over a scene's discs, each number moved by up to `NUDGE` of itself where `shake` is given."""

    def exact(value: float) -> Any:
        return mpf(value) * (1 + NUDGE * shake.choice([-1, 0, 1])) if shake else mpf(value)

    return [
        Body(*map(exact, (*disc.position_m, *disc.velocity_m_s, disc.radius_m, disc.mass_kg))) for disc in scene.discs
    ]


def pair_hit(a: Body, b: Body) -> Any:
    """Least time from now at which two discs touch while approaching; None for never. The textbook quadratic."""
    dx, dy, ux, uy = b.x - a.x, b.y - a.y, b.vx - a.vx, b.vy - a.vy
    qa, qb, qc = ux * ux + uy * uy, 2 * (dx * ux + dy * uy), dx * dx + dy * dy - (a.r + b.r) ** 2
    if qb >= 0 or qb * qb - 4 * qa * qc <= 0:
        return None
    return (-qb - sqrt(qb * qb - 4 * qa * qc)) / (2 * qa)


def wall_hit(a: Body, wall: Wall) -> Any:
    (px, py), (nx, ny) = wall.point_m, wall.normal
    speed = a.vx * nx + a.vy * ny
    return None if speed >= 0 else ((a.x - px) * nx + (a.y - py) * ny - a.r) / -speed


def oracle(scene: Scene, count: int, shake: random.Random | None = None) -> list[Event]:
    """Return the first impacts of a scene."""
    discs = bodies_of(scene, shake)
    now = mpf(0)
    events: list[Event] = []
    while len(events) < count:
        hits = [
            (t, i, j)
            for i in range(len(discs))
            for j in range(i + 1, len(discs))
            if (t := pair_hit(discs[i], discs[j])) is not None
        ]
        hits += [
            (t, i, -1 - k)
            for i, disc in enumerate(discs)
            for k, wall in enumerate(scene.half_planes())
            if (t := wall_hit(disc, wall)) is not None
        ]
        if not hits:
            break
        dt, i, j = min(hits)
        now += dt
        for disc in discs:
            disc.x += disc.vx * dt
            disc.y += disc.vy * dt
        a = discs[i]
        if j < 0:
            nx, ny = map(mpf, scene.half_planes()[-1 - j].normal)
            push = (1 + mpf(scene.wall_restitution)) * (a.vx * nx + a.vy * ny) / (nx * nx + ny * ny)
            a.vx, a.vy = a.vx - push * nx, a.vy - push * ny
            after: tuple[Any, ...] = (a.vx, a.vy)
        else:
            b = discs[j]
            nx, ny = b.x - a.x, b.y - a.y
            distance_squared = nx * nx + ny * ny
            # Momentum along the line of centres, exchanged so that the relative velocity along it turns to -e times.
            push = (1 + mpf(scene.restitution)) * ((a.vx - b.vx) * nx + (a.vy - b.vy) * ny) / distance_squared
            push = push * a.m * b.m / (a.m + b.m)
            a.vx, a.vy = a.vx - push * nx / a.m, a.vy - push * ny / a.m
            b.vx, b.vy = b.vx + push * nx / b.m, b.vy + push * ny / b.m
            after = (a.vx, a.vy, b.vx, b.vy)
        events.append(Event(now, i, j, after))
    return events


def random_scene(seed: int) -> Scene:
    """Make a small scene: 2 to 5 discs, with walls in every second scene and inelastic in every third."""
    rng = random.Random(seed)
    while True:
        discs = [
            Disc(
                position_m=(rng.uniform(-2, 2), rng.uniform(-2, 2)),
                velocity_m_s=(rng.uniform(-3, 3), rng.uniform(-3, 3)),
                radius_m=rng.uniform(0.1, 0.5),
                mass_kg=10 ** rng.uniform(-1, 1),
            )
            for _ in range(2 + seed % 4)
        ]
        walls = [Wall(point_m=(3.0 * x, 3.0 * y), normal=(-x, -y)) for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        e = 1.0 if seed % 3 else rng.uniform(0.3, 1)
        try:
            return Scene(
                name=f"random {seed}",
                discs=discs,
                walls=walls if seed % 2 else [],
                restitution=e,
                wall_restitution=e,
                duration_s=10.0,
            )
        except SceneError:
            continue  # an overlapping start: draw again


@pytest.mark.parametrize("seed", [*range(40), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(40, 80))])
def test_pic_is_off_by_no_more_than_the_scene_amplifies_rounding(seed: int) -> None:
    """Each of the first impacts of a random scene is the oracle's, as closely as its condition lets float64 be."""
    scene = random_scene(seed)
    shake = random.Random(-seed)
    with mp.workdps(DIGITS):
        truth = oracle(scene, 12)
        truth = [event for event in truth if event.time < scene.duration_s]
        nudged = [oracle(scene, len(truth), shake) for _ in range(6)]
        trace = solve_pic(scene, max_impacts=len(truth))
        assert trace.impacts[["first", "second"]].tolist() == [(e.first, e.second) for e in truth]
        for k, (event, found) in enumerate(zip(truth, trace.impacts, strict=True)):
            speed = max(abs(v) for v in event.velocities)
            others = [run[k] for run in nudged]
            assert all((o.first, o.second) == (event.first, event.second) for o in others)
            granted = OPERATIONS * (k + 1) * ROUNDOFF
            condition = max(abs(o.time - event.time) for o in others) / NUDGE
            assert abs(found["time_s"] - event.time) <= granted * (condition + event.time)
            after = [*found["velocity_first_after"], *found["velocity_second_after"]][: len(event.velocities)]
            for component, value in enumerate(after):
                condition = max(abs(o.velocities[component] - event.velocities[component]) for o in others) / NUDGE
                assert abs(value - event.velocities[component]) <= granted * (condition + speed)
