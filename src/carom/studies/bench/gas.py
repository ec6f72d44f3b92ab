"""Hard-disc gas for growth benches: equal discs in a square box."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.model.disc_arrays import DiscArrays

if TYPE_CHECKING:
    from carom.model.scene import Scene


def build_hard_disc_gas(discs: int, packing: float, seed: int = 1) -> DiscArrays:
    """Return discs of radius 0.5 m and mass 1 kg on a hexagonal lattice in a square box, with a total momentum of 0.

    Args:
        discs: Number of discs.
        packing: Fraction of the box's area that the discs cover.
        seed: Seed of the random velocities. The velocities have the Maxwell distribution. The total kinetic energy is 1
            joule times the number of discs.

    Raises:
        InputError: The discs do not fit.
    """
    radius_m = 0.5
    side = math.sqrt(discs * math.pi * radius_m**2 / packing)
    rows = np.arange(1, discs + 1)
    columns = -(-discs // rows)
    step_x = (side - 2 * radius_m) / np.maximum(1.0, columns - 0.5)
    step_y = (side - 2 * radius_m) / np.maximum(1, rows - 1)
    gap = np.minimum(np.minimum(step_x, np.hypot(step_x / 2, step_y)), 2 * step_y)
    best = int(np.argmax(gap))
    if gap[best] <= 2 * radius_m:
        raise InputError(f"{discs} discs do not fit at packing {packing}")
    row, column = np.divmod(np.arange(discs), columns[best])
    x = radius_m + column * step_x[best] + (row % 2) * step_x[best] / 2
    y = radius_m + row * step_y[best]
    velocity = np.random.default_rng(seed).normal(size=(discs, 2))
    velocity -= velocity.mean(axis=0)
    velocity *= math.sqrt(2 * discs / np.sum(velocity**2))
    walls = ((0.0, 0.0, 1.0, 0.0), (side, 0.0, -1.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, side, 0.0, -1.0))
    return DiscArrays(np.stack([x, y], axis=1), velocity, np.full(discs, radius_m), np.ones(discs), walls)


def build_gas_scene(discs: int, packing: float, *, duration_s: float = 1e4, gravity: bool = False) -> Scene:
    """Return a hard-disc gas as a scene, in which no bodies touch at the start.

    Args:
        discs: Number of discs.
        packing: Fraction of the box's area that the discs cover.
        duration_s: Duration, in seconds.
        gravity: Whether the discs fall.
    """
    from carom.model.scene import Disc, Scene, Wall

    shrink = 1 - 2.0**-10
    gas = build_hard_disc_gas(discs, packing / shrink**2)
    states = zip(gas.position_m, gas.velocity_m_s, gas.radius_m, strict=True)
    return Scene(
        name=f"gas of {discs} discs, packing {packing:g}{', falling' if gravity else ''}",
        gravity_m_s2=(0.0, -9.81) if gravity else (0.0, 0.0),
        discs=[Disc(position_m=x, velocity_m_s=v, radius_m=float(radius) * shrink) for x, v, radius in states],
        walls=[Wall(point_m=(x, y), normal=(nx, ny)) for x, y, nx, ny in gas.half_planes()],
        duration_s=duration_s,
    )
