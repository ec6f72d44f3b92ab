"""Random scenes of every kind for PIT: whatever leaves tests out must find in them what the definition finds."""

from __future__ import annotations

import math
import random

from carom.scene import Disc, Scene, Wall

Vector = tuple[float, float]

#: Odd frame rates on purpose: neither they nor their inverses are round in binary or decimal.
_RATES = (0.7, 3.0, 7.0, 13.37, 24.0, 60.0)


def _speed(rng: random.Random, scale: float) -> Vector:
    return (rng.gauss(0, scale), rng.gauss(0, scale))


def _gas(rng: random.Random) -> list[Disc]:
    """Discs of about one size, few or many, slow or so fast that they pass several others in a frame."""
    side, scale = rng.choice([1, 2, 3, 5, 6, 7]), rng.choice([0.001, 0.1, 3.0, 30.0, 300.0])
    return [
        Disc(
            position_m=(2 * column + rng.uniform(-0.2, 0.2), 2 * row + rng.uniform(-0.2, 0.2)),
            velocity_m_s=_speed(rng, scale),
            radius_m=rng.uniform(0.5, 0.79),
            mass_kg=math.exp(rng.uniform(-3, 3)),
        )
        for row in range(side)
        for column in range(side)
        if rng.random() < 0.8 or row + column == 0
    ]


def _sizes(rng: random.Random) -> list[Disc]:
    """Radii in a ratio of up to 1:100, the small ones between the large."""
    discs = [
        Disc(
            position_m=(4.0 * column, 4.0 * row),
            velocity_m_s=_speed(rng, 2.0),
            radius_m=rng.uniform(0.5, 1.5),
            mass_kg=5,
        )
        for row in range(3)
        for column in range(rng.choice([1, 3]))
    ]
    for _ in range(rng.choice([3, 20, 40])):
        place, radius = (rng.uniform(-2, 10), rng.uniform(-2, 10)), 10 ** rng.uniform(-2, -0.5)
        if all(math.dist(place, other.position_m) > radius + other.radius_m for other in discs):
            discs.append(Disc(position_m=place, velocity_m_s=_speed(rng, 5.0), radius_m=radius))
    return discs


def _lattice(rng: random.Random) -> list[Disc]:
    """Whole numbers: ties, touching starts, impacts of many at one instant."""
    side, pitch = rng.choice([2, 3, 4, 6]), rng.choice([1, 2, 3])
    return [
        Disc(
            position_m=(pitch * column, pitch * row),
            velocity_m_s=(rng.randint(-2, 2), rng.randint(-2, 2)),
            radius_m=pitch / 2 if rng.random() < 0.7 else pitch / 4,
        )
        for row in range(side)
        for column in range(side)
    ]


def _grazing(rng: random.Random) -> list[Disc]:
    """Discs shot past a row of others, each at a miss distance that is the contact distance, but for a few bits."""
    bits, down = rng.choice([8, 30, 52]), rng.choice([1, -1])
    discs = [Disc(position_m=(3.0 * k, 0.0), radius_m=0.5) for k in range(1, rng.choice([2, 9, 30]))]
    for k in range(3):
        y = down * (1.0 + rng.randint(-4, 4) * 2.0**-bits) + 8 * k
        discs.append(Disc(position_m=(-5.0 - 3 * k, y), velocity_m_s=(rng.uniform(0.5, 40), 0.0), radius_m=0.5))
    return discs


def _pile_up(rng: random.Random) -> list[Disc]:
    """Discs that all head for one place: at low frame rates many are found deep inside one another."""
    discs = []
    for ring in range(1, rng.choice([2, 3, 4])):
        count = 6 * ring
        for k in range(count):
            angle, pace = 2 * math.pi * (k + 0.3 * ring) / count, rng.uniform(1, 4)
            x, y = 3 * ring * math.cos(angle), 3 * ring * math.sin(angle)
            discs.append(Disc(position_m=(x, y), velocity_m_s=(-pace * x, -pace * y), radius_m=rng.uniform(0.6, 1.2)))
    return discs


def _far_out(rng: random.Random) -> list[Disc]:
    """The same as a gas, so far from the origin that coordinates are coarse."""
    far = 10.0 ** rng.uniform(4, 12)
    return [
        disc.model_copy(update={"position_m": (disc.position_m[0] + far, disc.position_m[1] - far)})
        for disc in _gas(rng)
    ]


def _coarse(rng: random.Random) -> list[Disc]:
    """Discs that move by a few units in the last place of their coordinates in a frame: rounding turns their paths."""
    far = 10.0 ** rng.uniform(6, 12)
    unit = math.ulp(far)
    side = max(1, round(200 * unit))
    discs = []
    for k in range(rng.choice([2, 4, 9])):
        place = (
            far + 2 * side * (k % 3) + rng.randint(0, 40) * unit,
            far + 2 * side * (k // 3) + rng.randint(0, 40) * unit,
        )
        velocity = tuple(rng.uniform(-4, 4) * unit * 24.0 for _ in range(2))
        discs.append(Disc(position_m=place, velocity_m_s=velocity, radius_m=side - 25 * unit))
    return discs


def _dust(rng: random.Random) -> list[Disc]:
    """Small discs that seldom meet: most frames and pairs are left out."""
    return [
        Disc(position_m=(10 * column, 10 * row), velocity_m_s=_speed(rng, 3.0), radius_m=rng.choice([0.5, 1.0, 2.0]))
        for row in range(6)
        for column in range(rng.choice([1, 6]))
    ]


KINDS = {
    "gas": _gas,
    "sizes": _sizes,
    "lattice": _lattice,
    "grazing": _grazing,
    "pile-up": _pile_up,
    "far out": _far_out,
    "coarse": _coarse,
    "dust": _dust,
}


def random_scene(kind: str, seed: int) -> tuple[Scene, float]:
    """Return a scene of a kind, some discs of it immovable, in a box or beside walls or free; and a frame rate."""
    rng = random.Random(f"{kind} {seed}")
    discs = KINDS[kind](rng)
    if rng.random() < 0.4:
        fixed = {"mass_kg": math.inf, "velocity_m_s": (0.0, 0.0)}
        discs = [disc.model_copy(update=fixed) if rng.random() < 0.2 else disc for disc in discs]
    # Slow scenes are looked at over a longer time; the definition makes some 100,000 tests in a tenth of a second.
    rate = rng.choice(_RATES)
    frames = min(rng.choice([10, 60, 400]), max(5, 60_000 // (len(discs) * (len(discs) + 7))))
    scene = Scene(
        name=kind,
        discs=discs,
        walls=_walls(rng, discs),
        restitution=rng.choice([1.0, 1.0, 0.5, 0.0]),
        wall_restitution=rng.choice([1.0, 1.0, 0.5, 0.0]),
        duration_s=frames / rate * rng.uniform(0.9, 1.1),
    )
    return scene, rate


def _walls(rng: random.Random, discs: list[Disc]) -> list[Wall]:
    """Return no wall, a box around the discs, or one and an oblique wall."""
    low, high = (
        tuple(choice(disc.position_m[axis] + sign * disc.radius_m for disc in discs) for axis in range(2))
        for choice, sign in ((min, -1), (max, 1))
    )
    room = rng.choice([0.0, 0.5])
    low, high = (low[0] - room, low[1] - room), (high[0] + room, high[1] + room)
    box = [
        Wall(point_m=low, normal=(1, 0)),
        Wall(point_m=low, normal=(0, 1)),
        Wall(point_m=high, normal=(-1, 0)),
        Wall(point_m=high, normal=(0, -1)),
    ]
    oblique = Wall(point_m=(high[0] + 1, high[1] + 1), normal=(-2, -3))
    return rng.choice([[], box, box, [*box, oblique], [oblique]])
