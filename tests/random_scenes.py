"""Scenes drawn at random, each from its kind and its number alone: what the solvers are compared by, in one place.

A kind is an arrangement and motion of the discs. Walls, the law of impact, immovable discs, friction with spin and
gravity are drawn independently, so each kind comes with each of them.
"""

import math
import random
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from carom import Chain, Disc, Ring, Scene, SceneError, Wall
from carom.model.disc_arrays import DiscArrays
from carom.model.trace import Vector
from carom.model.walls import Leg

#: Odd frame rates on purpose: neither they nor their inverses are round in binary or decimal.
RATES = (0.7, 3.0, 7.0, 13.37, 24.0, 60.0)
#: Directions of walls; with these lengths most are not representable exactly.
OBLIQUE = [(3.0, 4.0), (-4.0, 3.0), (1.0, 1.0), (-1.0, 2.0), (-5.0, -12.0), (2.0, -3.0)]
#: The kinds of few discs, followed over many impacts; of the others the smallest are as large.
SMALL = ("whole", "anywhere")


def draw_scene(
    kind: str,
    number: int,
    *,
    rough: bool = False,
    gravity: Vector = (0.0, 0.0),
    immovable: bool = True,
    repeated: bool = True,
    restitutions: Sequence[float] = (0.0, 0.5, 1.0, 1.0),
    rooms_m: Sequence[float] = (0.0, 0.5, 1.0),
) -> Scene:
    """Return the scene of a kind and a number.

    Args:
        kind: One of `KINDS`.
        number: Of the scene.
        rough: With friction and spin.
        gravity: In m/s^2.
        immovable: Some discs may be so.
        repeated: A wall may be given up to three times, by different points.
        restitutions: Choices for discs and for walls, of which one is drawn for each.
        rooms_m: Between the outermost discs and a box, of which one is drawn; at 0 they start in contact with it.
    """
    rng = random.Random(f"{kind} {number}")
    while True:
        discs = KINDS[kind](rng)
        fixed = rng.choice([0.0, 0.0, 0.2, 0.3]) if immovable else 0.0
        discs = [make_immovable(disc) if rng.random() < fixed else disc for disc in discs]
        times = rng.choice([1, 1, 1, 2, 3]) if repeated else 1
        walls = _draw_walls(rng, discs, whole=kind == "whole", times=times, room=rng.choice(rooms_m))
        rate = rng.choice(RATES)
        # Plain looping makes some 100,000 tests in a tenth of a second.
        frames = min(rng.choice([10, 60, 400]), max(5, 60_000 // (len(discs) * (len(discs) + 7))))
        fields: dict[str, Any] = {
            "name": f"{kind} {number}",
            "discs": discs,
            "walls": walls,
            "restitution": rng.choice(restitutions),
            "wall_restitution": rng.choice(restitutions),
            "gravity_m_s2": gravity,
            "frame_rate_hz": rate if kind not in SMALL else min(rate, 13.37),
            "duration_s": 30.0 if kind in SMALL else frames / rate * rng.uniform(0.9, 1.1),
        }
        if rough:
            fields |= _draw_roughness(rng, discs, whole=kind == "whole")
        try:
            return Scene(**fields)
        except SceneError:
            continue  # an overlapping start: draw again


def draw_small_scene(number: int, **more: Any) -> Scene:
    """Return the scene of a number, of few discs: on whole numbers where that is even, else anywhere."""
    return draw_scene(SMALL[number % 2], number, **more)


def number_of_impacts(number: int) -> int:
    """Return over how many impacts the scene of a number is followed: few, but in two of 25 beyond an epoch."""
    return 250 if number % 25 in {0, 1} else 4 + number % 23


def make_immovable(disc: Disc) -> Disc:
    """Return the disc, immovable."""
    return disc.model_copy(update={"mass_kg": math.inf, "velocity_m_s": (0.0, 0.0)})


# Kinds: arrangement and motion ------------------------------------------------------------------------------------


def _build_disc(place: Vector, velocity: Vector = (0.0, 0.0), radius: float = 0.5, mass: float = 1.0) -> Disc:
    return Disc(position_m=place, velocity_m_s=velocity, radius_m=radius, mass_kg=mass)


def _draw_gauss_vector(rng: random.Random, scale: float) -> Vector:
    return (rng.gauss(0, scale), rng.gauss(0, scale))


def _draw_whole_numbers(rng: random.Random) -> list[Disc]:
    """A few discs on whole numbers and halves: impacts, contact, edges of cells and walls come at one instant."""
    half, side = rng.choice([1, 1, 2]), rng.choice([8, 12])
    radii = rng.choice([[0.5], [0.5], [1.0], [0.5, 1.0], [0.25, 0.5, 1.0]])
    discs = []
    for _ in range(rng.randint(3, 8)):
        place = (float(rng.randint(1, side - 1)), float(rng.randint(1, side - 1)))
        velocity = (rng.randint(-2 * half, 2 * half) / half, rng.randint(-2 * half, 2 * half) / half)
        discs.append(_build_disc(place, velocity, rng.choice(radii), rng.choice([1.0, 1.0, 1.0, 2.0, 4.0])))
    if rng.random() < 0.4:  # two that only set how wide the cells are
        end = float(rng.choice([side, side, 9, 16]))
        discs += [make_immovable(_build_disc((0.0, 0.0))), make_immovable(_build_disc((end, end)))]
    rng.shuffle(discs)
    return discs


def _draw_anywhere(rng: random.Random) -> list[Disc]:
    """A few discs of all sizes and masses anywhere, heading for the middle."""
    side, smallest, discs = rng.choice([8, 12]), rng.choice([0.1, 0.5, 0.9]), []
    for _ in range(rng.randint(2, 8)):
        x, y, pull = rng.uniform(1.0, side - 1.0), rng.uniform(1.0, side - 1.0), rng.uniform(0.0, 0.5)
        velocity = (rng.gauss(0.0, 1.0) - pull * (x - side / 2), rng.gauss(0.0, 1.0) - pull * (y - side / 2))
        mass = rng.choice([1.0, math.exp(rng.uniform(-2.0, 2.0)), 10 ** rng.uniform(-3.0, 3.0)])
        discs.append(_build_disc((x, y), velocity, rng.uniform(smallest, 1.0), mass))
    return discs


def _draw_gas(rng: random.Random) -> list[Disc]:
    """Discs of about one size, few or many, slow or so fast that they pass several others in a frame."""
    side, scale = rng.choice([1, 2, 3, 5, 6, 7]), rng.choice([0.001, 0.1, 3.0, 30.0, 300.0])
    return [
        _build_disc(
            (2 * column + rng.uniform(-0.2, 0.2), 2 * row + rng.uniform(-0.2, 0.2)),
            _draw_gauss_vector(rng, scale),
            rng.uniform(0.5, 0.79),
            math.exp(rng.uniform(-3, 3)),
        )
        for row in range(side)
        for column in range(side)
        if rng.random() < 0.8 or row + column == 0
    ]


def _draw_sizes(rng: random.Random) -> list[Disc]:
    """Radii in a ratio of up to 1:100, the small ones between the large."""
    columns = rng.choice([1, 3])
    discs = [
        _build_disc((4.0 * column, 4.0 * row), _draw_gauss_vector(rng, 2.0), rng.uniform(0.5, 1.5), 5.0)
        for row in range(3)
        for column in range(columns)
    ]
    for _ in range(rng.choice([3, 20, 40])):
        place, radius = (rng.uniform(-2, 10), rng.uniform(-2, 10)), 10 ** rng.uniform(-2, -0.5)
        if all(math.dist(place, other.position_m) > radius + other.radius_m for other in discs):
            discs.append(_build_disc(place, _draw_gauss_vector(rng, 5.0), radius))
    return discs


def _draw_lattice(rng: random.Random) -> list[Disc]:
    """Whole numbers, and all neighbours touch or nearly do: impacts of many at one instant."""
    side, pitch = rng.choice([2, 3, 4, 6]), rng.choice([1, 2, 3])
    return [
        _build_disc(
            (pitch * column, pitch * row),
            (rng.randint(-2, 2), rng.randint(-2, 2)),
            pitch / 2 if rng.random() < 0.7 else pitch / 4,
        )
        for row in range(side)
        for column in range(side)
    ]


def _draw_grazing(rng: random.Random) -> list[Disc]:
    """Discs shot past a row of others, each at a miss distance that is the contact distance except for a few bits."""
    bits, down = rng.choice([8, 30, 52]), rng.choice([1, -1])
    discs = [_build_disc((3.0 * k, 0.0)) for k in range(1, rng.choice([2, 9, 30]))]
    for k in range(3):
        y = down * (1.0 + rng.randint(-4, 4) * 2.0**-bits) + 8 * k
        discs.append(_build_disc((-5.0 - 3 * k, y), (rng.uniform(0.5, 40), 0.0)))
    return discs


def _draw_pile_up(rng: random.Random) -> list[Disc]:
    """Discs that all head for one place: at low frame rates many are found deep inside one another."""
    discs = []
    for ring in range(1, rng.choice([2, 3, 4])):
        for k in range(6 * ring):
            angle, pace = 2 * math.pi * (k + 0.3 * ring) / (6 * ring), rng.uniform(1, 4)
            x, y = 3 * ring * math.cos(angle), 3 * ring * math.sin(angle)
            discs.append(_build_disc((x, y), (-pace * x, -pace * y), rng.uniform(0.6, 1.2)))
    return discs


def _draw_star(rng: random.Random) -> list[Disc]:
    """Discs that fly at an immovable one, to which those that lose all speed stick and slide along."""
    discs = [make_immovable(_build_disc((0.0, 0.0)))]
    for k in range(5):
        way = complex(math.cos(angle := 2 * math.pi * k / 5 + rng.uniform(-0.1, 0.1)), math.sin(angle))
        place = way * complex(rng.uniform(2, 6), rng.uniform(-0.8, 0.8))
        discs.append(_build_disc((place.real, place.imag), (-way.real, -way.imag), 0.4))
    return discs


def _draw_far_out(rng: random.Random) -> list[Disc]:
    """The same as a gas, so far from the origin that coordinates are coarse."""
    far = 10.0 ** rng.uniform(4, 12)
    gas = _draw_gas(rng)
    places = [(disc.position_m[0] + far, disc.position_m[1] - far) for disc in gas]
    return [disc.model_copy(update={"position_m": place}) for disc, place in zip(gas, places, strict=True)]


def _draw_coarse(rng: random.Random) -> list[Disc]:
    """Discs that move by a few units in the last place of their coordinates in a frame: rounding turns their paths."""
    far = 10.0 ** rng.uniform(6, 12)
    unit = math.ulp(far)
    side = max(1, round(200 * unit))
    return [
        _build_disc(
            (
                far + 2 * side * (k % 3) + rng.randint(0, 40) * unit,
                far + 2 * side * (k // 3) + rng.randint(0, 40) * unit,
            ),
            (rng.uniform(-4, 4) * unit * 24.0, rng.uniform(-4, 4) * unit * 24.0),
            side - 25 * unit,
        )
        for k in range(rng.choice([2, 4, 9]))
    ]


def _draw_dust(rng: random.Random) -> list[Disc]:
    """Small discs that seldom meet: most frames and pairs are left out."""
    columns = rng.choice([1, 6])
    return [
        _build_disc((10 * column, 10 * row), _draw_gauss_vector(rng, 3.0), rng.choice([0.5, 1.0, 2.0]))
        for row in range(6)
        for column in range(columns)
    ]


KINDS: dict[str, Callable[[random.Random], list[Disc]]] = {
    "whole": _draw_whole_numbers,
    "anywhere": _draw_anywhere,
    "gas": _draw_gas,
    "sizes": _draw_sizes,
    "lattice": _draw_lattice,
    "grazing": _draw_grazing,
    "pile-up": _draw_pile_up,
    "star": _draw_star,
    "far out": _draw_far_out,
    "coarse": _draw_coarse,
    "dust": _draw_dust,
}


# Walls and friction ---------------------------------------------------------------------------------------------------


def _draw_walls(rng: random.Random, discs: list[Disc], *, whole: bool, times: int, room: float) -> list[Wall]:
    """Return no walls, a box round the discs, some sides of one, or oblique walls, or both."""
    low, high = (
        tuple(choice(disc.position_m[axis] + sign * disc.radius_m for disc in discs) for axis in range(2))
        for choice, sign in ((min, -1), (max, 1))
    )
    (x0, y0), (x1, y1) = (low[0] - room, low[1] - room), (high[0] + room, high[1] + room)
    widest = 2 * max(disc.radius_m for disc in discs)
    x1, y1 = (
        far + 1.0 if far - near <= widest + 0.1 else far for near, far in ((x0, x1), (y0, y1))
    )  # holds no disc fast
    box = [((x0, y0), (1.0, 0.0)), ((x1, y1), (-1.0, 0.0)), ((x0, y0), (0.0, 1.0)), ((x1, y1), (0.0, -1.0))]
    kind = rng.randrange(5)
    given: list[tuple[Vector, Vector]] = [[], box, box, rng.sample(box, 2), []][kind]
    if kind == 4 or rng.random() < 0.2:
        middle, reach = ((x0 + x1) / 2, (y0 + y1) / 2), max(x1 - x0, y1 - y0) / 2
        for nx, ny in rng.sample(OBLIQUE, rng.randint(1, 3)):
            length, away = math.hypot(nx, ny), reach * rng.choice([1.0, 1.2, 1.5])
            given = [*given, ((middle[0] - away * nx / length, middle[1] - away * ny / length), (nx, ny))]
    walls = []
    for (x, y), (nx, ny) in given * times:
        along = float(rng.randint(-3, 3)) if whole else rng.uniform(-3.0, 3.0)
        along = along if rng.random() < 0.5 else 0.0
        walls.append(Wall(point_m=(x - along * ny, y + along * nx), normal=(nx, ny)))
    rng.shuffle(walls)
    return walls


def _draw_roughness(rng: random.Random, discs: list[Disc], *, whole: bool) -> dict[str, Any]:
    """Return friction, and the discs with spins; on whole numbers these are whole, and stick and slide tie."""
    turning = []
    for disc in discs:
        inertia = rng.choice([0.5, 0.5, 0.5, 1.0, 0.25, math.inf] if whole else [0.5, 0.4, 1.0, 1e-3, math.inf])
        spin = float(rng.randint(-4, 4)) if whole else rng.gauss(0.0, 3.0)
        spin = spin if math.isfinite(disc.mass_kg) and math.isfinite(inertia) else 0.0
        turning.append(disc.model_copy(update={"inertia_factor": inertia, "spin_rad_s": spin}))
    coefficients = [0.0, 0.125, 0.5, 1.0, 16.0] if whole else [0.0, 0.01, 0.3, 1.0, 1e19]
    return {
        "discs": turning,
        "friction": rng.choice(coefficients),
        "wall_friction": rng.choice(coefficients),
        "tangential_restitution": rng.choice([0.0, 0.0, 0.5, 1.0, -1.0]),
        "wall_tangential_restitution": rng.choice([0.0, 0.0, 0.5, 1.0, -0.5]),
    }


# Finite walls ---------------------------------------------------------------------------------------------------------


def _draw_resting_table(rnd: random.Random) -> Scene:
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


def _draw_driven_table(rnd: random.Random) -> Scene:
    """Return a table of which walls are driven or are belts, perhaps with mallets."""
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

    scene = _draw_resting_table(rnd)
    walls = [
        wall.model_copy(update={"legs": rnd.choice(((), legs())), "surface_speed_m_s": rnd.choice((0.0, 0.0, 0.5))})
        for wall in scene.walls
    ]
    discs = [*scene.discs, *[mallet() for _ in range(rnd.choice((0, 1, 2, 4)))]]
    rnd.shuffle(discs)
    return Scene(**{**dict(scene), "discs": discs, "walls": walls})


#: Kinds of finite walls, with laws of their own.
TABLES: dict[str, Callable[[random.Random], Scene]] = {"table": _draw_resting_table, "driven table": _draw_driven_table}


def draw_table(kind: str, number: int) -> Scene:
    """Return the table of a kind and a number: drawn again where bodies overlap, or a chain crosses itself."""
    rng = random.Random(f"{kind} {number}")
    while True:
        try:
            return TABLES[kind](rng).model_copy(update={"name": f"{kind} {number}"})
        except SceneError:
            continue


def draw_table_friction_scene(number: int) -> Scene:
    """Return the table of a number that slows up to five discs down, some at rest or immovable, among walls or none."""
    rng, discs = random.Random(number), []
    for i in range(rng.choice((1, 2, 3, 5))):
        mass = rng.choice((1.0, 2.0, 5.0, math.inf) if i else (1.0, 2.0))
        moves = mass < math.inf and rng.random() < 0.7
        place = (1.3 * (i % 3) + rng.uniform(-0.1, 0.1), 1.3 * (i // 3) + rng.uniform(-0.1, 0.1))
        velocity = (rng.uniform(-3, 3), rng.uniform(-3, 3)) if moves else (0.0, 0.0)
        discs.append(Disc(position_m=place, velocity_m_s=velocity, radius_m=rng.uniform(0.2, 0.5), mass_kg=mass))
    return Scene(
        name=f"slowing {number}",
        discs=discs,
        walls=list(rng.choice(SURROUNDS)),
        restitution=rng.choice((1.0, 0.8)),
        wall_restitution=rng.choice((1.0, 0.7)),
        table_deceleration_m_s2=rng.uniform(0.2, 1.5),
        duration_s=rng.uniform(1.0, 6.0),
    )


def draw_slope_scene(number: int, *, gives_back: bool = False) -> Scene:
    """Return the scene of a number: a disc that is thrown on a slope, with spin; now and then it begins in contact.

    Rolling resistance may brake it, or else, by `gives_back`, friction gives back of a slip, turned round or not.
    """
    rng = random.Random(f"thrown {number} {gives_back}")
    angle = rng.choice([0.0, 1.0]) * rng.uniform(-0.6, 0.6)
    nx, ny = math.sin(angle), math.cos(angle)
    up, u, into = rng.choice([0.0, rng.uniform(0.1, 1.0)]), rng.uniform(-3.0, 3.0), rng.uniform(0.0, 2.0)
    inertia = rng.choice([0.4, 0.5, 1.0, *[math.inf] * gives_back])
    disc = Disc(
        position_m=((0.5 + up) * nx, (0.5 + up) * ny),
        velocity_m_s=(u * ny - into * nx, -u * nx - into * ny) if up else (u * ny, -u * nx),
        radius_m=0.5,
        spin_rad_s=rng.choice([0.0, rng.uniform(-6.0, 6.0)]) if math.isfinite(inertia) else 0.0,
        inertia_factor=inertia,
    )
    return Scene(
        name=f"thrown {number}",
        discs=[disc],
        walls=[Wall(point_m=(0.0, 0.0), normal=(nx, ny))],
        wall_restitution=rng.choice([0.0, 0.3, 0.6, rng.uniform(0.05, 0.85)]),
        wall_friction=rng.choice([0.0, 0.06, 0.1, 0.3, 0.8, 2.0]),
        wall_rolling_resistance=0.0 if gives_back else rng.choice([0.0, 0.0, 0.05, 0.4]),
        wall_tangential_restitution=rng.choice([-1.0, -0.5, 0.2, 0.5, 0.9, 1.0]) if gives_back else 0.0,
        gravity_m_s2=(0.0, -10.0),
        duration_s=rng.uniform(2.0, 5.0),
    )


SURROUNDS: tuple[list[Wall | Chain | Ring], ...] = (
    [],
    [
        Wall(point_m=(-1, 0), normal=(1, 0)),
        Wall(point_m=(4, 0), normal=(-1, 0)),
        Wall(point_m=(0, -1), normal=(0, 1)),
        Wall(point_m=(0, 3), normal=(0, -1)),
    ],
    [Chain(points_m=((-1, -1), (4, -1.2), (4.2, 3), (-1, 3.1)), closed=True)],
    [Ring(centre_m=(1.2, 0.8), radius_m=3.0)],
)


# Many discs, as arrays ------------------------------------------------------------------------------------------------


def draw_jittered_discs(
    rng: np.random.Generator,
    discs: int,
    *,
    walls: bool = True,
    spread: float = 3.0,
    restitution: float = 1.0,
    wall_restitution: float = 1.0,
    immovable: int = 0,
    tilt: float = 0.0,
) -> DiscArrays:
    """Return discs of unequal radius and mass on the places of a lattice, jittered, with random velocities, in a box.

    The radii span a factor `spread`; all is turned by `tilt` radians.
    """
    columns = math.ceil(math.sqrt(discs))
    radius = rng.uniform(0.45 / spread, 0.45, discs)
    place = np.stack([np.arange(discs) % columns, np.arange(discs) // columns], axis=1) + 0.5
    position = place + rng.uniform(-1, 1, (discs, 2)) * (0.49 - radius)[:, None]
    velocity, mass = rng.normal(size=(discs, 2)), np.exp(rng.uniform(-2, 2, discs))
    mass[:immovable] = math.inf
    velocity[:immovable] = 0.0
    turn = np.array([[math.cos(tilt), math.sin(tilt)], [-math.sin(tilt), math.cos(tilt)]])
    sides = np.array(build_box(columns, columns))
    sides = np.hstack([sides[:, :2] @ turn, sides[:, 2:] @ turn])
    return DiscArrays(
        position @ turn,
        velocity @ turn,
        radius,
        mass,
        tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in sides) if walls else (),
        restitution,
        wall_restitution,
    )


def build_box(width: float, height: float) -> tuple[tuple[float, float, float, float], ...]:
    """Return the four walls of a box with a corner at the origin, as rows of arrays."""
    return ((0.0, 0.0, 1.0, 0.0), (width, 0.0, -1.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, height, 0.0, -1.0))


def build_scene(start: DiscArrays, duration_s: float) -> Scene:
    """Return the scene of discs as arrays, without friction."""
    columns = (start.position_m, start.velocity_m_s, start.radius_m, start.mass_kg)
    return Scene(
        name="drawn",
        discs=[
            _build_disc(tuple(p), tuple(v), r, m) for p, v, r, m in zip(*(c.tolist() for c in columns), strict=True)
        ],
        walls=[Wall(point_m=w[:2], normal=w[2:]) for w in start.half_planes()],
        restitution=start.restitution,
        wall_restitution=start.wall_restitution,
        duration_s=duration_s,
    )
