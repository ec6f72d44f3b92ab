"""Gases of all kinds for the campaign, each drawn from its number alone."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.random_scenes import build_box

from carom import DiscArrays
from carom.solvers.run import ScaledScene

Floats = NDArray[np.float64]

LEAST_DISCS, MOST_DISCS = 64, 10_000
LEAST_PACKING, MOST_PACKING = 0.1, 0.7
#: Least packing of gases by the TC model, which is for those in which discs meet again and again at short distances.
DENSE_PACKING = 0.4
#: Contact times of the TC model, in seconds: at first about a tenth of a second is between a disc's impacts.
LEAST_CONTACT_S, MOST_CONTACT_S = 1e-6, 1e-1
#: Discs of gases that fall: a run under gravity is for some hundred discs at most.
FEWEST_FALLING, MOST_FALLING = 4, 64
#: Sizes of gravity, in metres per second squared: a disc of a metre falls slowly, or bounces in heaps.
LEAST_GRAVITY, MOST_GRAVITY = 0.1, 30.0
#: Radii differ by this factor at most.
LARGEST_RATIO = 10.0
#: Share of the plane that a lattice of equal discs covers where they touch, six about each.
DENSEST = math.pi / math.sqrt(12.0)


class Kind(StrEnum):
    """What is special about a gas; its value is how the table names it."""

    EQUAL = "equal discs"
    UNEQUAL = "unequal radii and masses"
    IMMOVABLE = "10 to 40 % immovable"
    INELASTIC = "restitution .95 to .999"
    LATTICE = "whole numbers: ties"
    TILTED = "tilted box far from the origin"
    MIXED = "all of these at once"
    OPEN = "no walls"
    ROUGH = "friction and spin, all inertias"
    CONTACT = "TC model, restitution .1 to .9"
    FALLING = "gravity, on a floor"


_UNEQUAL = frozenset({Kind.UNEQUAL, Kind.MIXED, Kind.OPEN, Kind.ROUGH, Kind.CONTACT, Kind.FALLING})
_PARTLY_IMMOVABLE = frozenset({Kind.IMMOVABLE, Kind.MIXED, Kind.ROUGH, Kind.CONTACT, Kind.FALLING})


@dataclass(frozen=True)
class Gas:
    """One gas of the campaign.

    Attributes:
        number: What it is drawn from.
        kind: What is special about it.
        packing: Share of the box that its discs cover; 0 without walls.
        start: Its discs and walls.
        impacts: How many impacts it is followed over, at most; of rough gases, which lose their energy, fewer.
        contact_duration_s: Contact time of the TC model, in seconds; 0 for none.
        gravity_m_s2: Acceleration of every disc that moves.
    """

    number: int
    kind: Kind
    packing: float
    start: DiscArrays
    impacts: int
    contact_duration_s: float = 0.0
    gravity_m_s2: tuple[float, float] = (0.0, 0.0)

    @property
    def scene(self) -> ScaledScene:
        """Its discs, walls and gravity, from which a run can start; it is followed by impacts, and not by time."""
        return ScaledScene(self.start, self.gravity_m_s2, 0.0, 0.0, math.inf)


def draw_gas(number: int, kind: Kind | None = None, *, most_discs: int = MOST_DISCS) -> Gas:
    """Return the gas of a number.

    Args:
        number: From 0 on; kinds take turns.
        kind: One kind instead of the number's own.
        most_discs: Number of discs at most, at least 64.

    Returns:
        The gas; of those that fall one of fewer discs.
    """
    rng = np.random.default_rng(number)
    kinds = list(Kind)
    kind = kinds[number % len(kinds)] if kind is None else kind
    fewest, most = (FEWEST_FALLING, MOST_FALLING) if kind is Kind.FALLING else (LEAST_DISCS, most_discs)
    discs = round(_from_logarithms(rng, fewest, most))
    packing = float(rng.uniform(LEAST_PACKING, MOST_PACKING))
    if kind is Kind.CONTACT:
        packing = float(rng.uniform(DENSE_PACKING, MOST_PACKING))
    if kind is Kind.LATTICE:
        return Gas(number, kind, *_on_whole_numbers(rng, discs, packing), 100 * discs)
    radius = np.full(discs, 0.5)
    mass = np.ones(discs)
    if kind in _UNEQUAL:
        radius *= rng.uniform(_least_radius(packing), 1.0, discs)
        mass = radius**2 * np.exp(rng.uniform(-1.0, 1.0, discs))
    place, side = _stretched_lattice(rng, radius, packing)
    velocity = rng.normal(size=(discs, 2))
    if kind in _PARTLY_IMMOVABLE:
        still = rng.random(discs) < rng.uniform(0.1, 0.4)
        mass[still], velocity[still] = math.inf, 0.0
    walls = np.array(build_box(side, side))
    if kind in {Kind.TILTED, Kind.MIXED}:
        angle, shift = rng.uniform(0.0, math.tau), rng.uniform(-1e4, 1e4, 2)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        place, velocity = place @ turn + shift, velocity @ turn
        walls = np.hstack([walls[:, :2] @ turn + shift, walls[:, 2:] @ turn])
    if kind is Kind.OPEN:
        velocity -= 2.0 * (place - place.mean(axis=0)) / math.sqrt(discs)  # they head for the middle, and fly apart
        walls, packing = walls[:0], 0.0
    restitution, wall_restitution = 1.0, 1.0
    if kind in {Kind.INELASTIC, Kind.MIXED}:
        restitution, wall_restitution = map(float, rng.uniform(0.95, 0.999, 2))
    rubs = kind is Kind.ROUGH or (kind in {Kind.CONTACT, Kind.FALLING} and rng.random() < 0.5)
    rough = _roughness(rng, radius, mass) if rubs else {}
    contact_duration_s = 0.0
    if kind is Kind.ROUGH:
        restitution, wall_restitution = map(float, rng.choice([1.0, 0.9, 0.5], 2))
    if kind is Kind.CONTACT:
        restitution, wall_restitution = map(float, rng.uniform(0.1, 0.9, 2))
        contact_duration_s = _from_logarithms(rng, LEAST_CONTACT_S, MOST_CONTACT_S)
    gravity_m_s2 = (0.0, 0.0)
    if kind is Kind.FALLING:
        restitution, wall_restitution = map(float, rng.choice([1.0, 1.0, 0.98, 0.8], 2))
        gravity_m_s2 = _draw_gravity(rng)
    sides = tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in walls)
    start = DiscArrays(place, velocity, radius, mass, sides, restitution, wall_restitution, **rough)
    covered = _packing(start, side) if len(walls) else 0.0
    return Gas(number, kind, covered, start, 200 * discs, contact_duration_s, gravity_m_s2)


def _from_logarithms(rng: np.random.Generator, least: float, most: float) -> float:
    """Return a number whose logarithm is drawn evenly."""
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def _draw_gravity(rng: np.random.Generator) -> tuple[float, float]:
    """Return a gravity of any size, straight down or aslant."""
    size = _from_logarithms(rng, LEAST_GRAVITY, MOST_GRAVITY)
    angle = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)]))
    return size * math.sin(angle), -size * math.cos(angle)


def _roughness(rng: np.random.Generator, radius: Floats, mass: Floats) -> dict[str, Any]:
    """Return spins, inertias and coefficients: each law of friction has its turn, from smooth to superballs."""
    discs = len(radius)
    inertia = rng.choice([0.5, 0.4, 1.0, 1e-6, math.inf, float(rng.uniform(0.01, 1.0))], discs)
    spin = rng.normal(size=discs) * float(rng.choice([0.0, 1.0, 1e3])) / radius
    spin[np.isinf(inertia) | np.isinf(mass)] = 0.0
    coefficients = {name: float(rng.choice([0.0, 0.05, 0.5, 10.0, 1e19])) for name in ("friction", "wall_friction")}
    coefficients["friction"] = coefficients["friction"] or 0.1  # something rubs
    back = ("tangential_restitution", "wall_tangential_restitution")
    coefficients |= {name: float(rng.choice([-1.0, 0.0, 0.4, 1.0])) for name in back}
    return {"spin_rad_s": spin, "inertia_factor": inertia, **coefficients}


def _packing(start: DiscArrays, side: float) -> float:
    return float(math.pi * np.sum(start.radius_m**2)) / side**2


def _least_radius(packing: float) -> float:
    """Return the least of radii, spread evenly up to 1, that cover so much of the plane on a lattice of the largest."""
    # The mean of squares is (1 + a + a^2) / 3. A tenth is left for what a box cuts off a lattice.
    mean_square = min(1.1 * packing / DENSEST, 1.0)
    return max(1.0 / LARGEST_RATIO, (math.sqrt(12.0 * mean_square - 3.0) - 1.0) / 2.0 if mean_square > 0.25 else 0.0)


def _stretched_lattice(rng: np.random.Generator, radius: Floats, packing: float) -> tuple[Floats, float]:
    """Return places for discs, and the side of a box, of a packing or the nearest that a hexagonal lattice allows."""
    discs, largest = len(radius), float(radius.max())
    side = math.sqrt(math.pi * float(np.sum(radius**2)) / packing)
    rows = np.arange(1, discs + 1)
    columns = -(-discs // rows)
    while True:
        across = (side - 2.0 * largest) / np.maximum(1.0, columns - 0.5)
        along = (side - 2.0 * largest) / np.maximum(1.0, rows - 1.0)
        nearest = np.minimum(np.minimum(across, 2.0 * along), np.hypot(across / 2.0, along))
        best = int(np.argmax(nearest))
        if nearest[best] > 2.001 * largest:
            break
        side *= 1.01
    row, column = np.divmod(rng.permutation(discs), columns[best])
    x = largest + (column + (row % 2) / 2.0) * across[best]
    return np.stack([x, largest + row * along[best]], axis=1), side


def _on_whole_numbers(rng: np.random.Generator, discs: int, packing: float) -> tuple[float, DiscArrays]:
    """Return a gas whose places, sizes and velocities are halves and wholes, so that impacts come at one instant."""
    columns = math.ceil(math.sqrt(discs))
    pitch = max(2, round(math.sqrt(math.pi / packing)))  # for discs of radius 1, touching where it is 2
    row, column = np.divmod(np.arange(discs), columns)
    place = np.stack([column, row], axis=1) * float(pitch) + pitch // 2
    velocity = rng.integers(-2, 3, (discs, 2)).astype(np.float64)
    mass = rng.choice([1.0, 1.0, 2.0, math.inf], discs)
    velocity[np.isinf(mass)] = 0.0
    side = float(pitch * columns + pitch % 2)
    start = DiscArrays(place, velocity, np.full(discs, 1.0), mass, build_box(side, side))
    return _packing(start, side), start
