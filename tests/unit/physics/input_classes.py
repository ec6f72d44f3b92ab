"""Random pairs of discs of the classes of input on which formulas for the time of impact fail, and the exact answer."""

from __future__ import annotations

import math

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

CLASSES = (
    "random",
    "grazing 1e-14..1e-4",
    "grazing 1e-15",
    "offset by 1e8",
    "far apart",
    "slow",
    "tiny",
    "near contact",
    "near contact and grazing",
)

#: Bits of the ball arithmetic: a difference of products of two-part differences needs some 430.
PRECISION = 600


def pairs_of_class(name: str, count: int, seed: int) -> NDArray[np.float64]:
    """Return `count` rows ``x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2`` of approaching discs."""
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.1, 1.0, (2, count)) * (1e-9 if name == "tiny" else 1.0)
    reach = radius.sum(axis=0)
    miss = rng.uniform(-1.0, 1.0, count) * reach
    distance = np.hypot(miss, reach) * rng.uniform(1.0, 10.0, count)
    speed = rng.uniform(0.1, 2.0, count) * (1e-9 if name == "slow" else 1.0)
    if name == "grazing 1e-14..1e-4":
        miss = reach * (1 - 10 ** rng.uniform(-14, -4, count))
    if name == "grazing 1e-15":
        miss = reach * (1 + rng.uniform(-8e-15, 8e-15, count))
    if name == "far apart":
        distance = reach * 10 ** rng.uniform(1, 8, count)
    if name == "tiny":
        distance = distance * 1e9
    if name == "near contact":
        distance = reach * (1 + 10 ** rng.uniform(-16, -6, count))
    if name == "near contact and grazing":
        miss = reach * (1 - 10 ** rng.uniform(-15, -4, count))
        distance = reach * (1 + 10 ** rng.uniform(-16, -8, count))
    along = np.sqrt(np.maximum(distance**2 - miss**2, 0.0))
    turn = rng.uniform(0, 2 * math.pi, count)
    ahead, aside = np.stack([np.cos(turn), np.sin(turn)]), np.stack([-np.sin(turn), np.cos(turn)])
    origin = rng.uniform(-1e8, 1e8, (2, count)) if name == "offset by 1e8" else np.zeros((2, count))
    velocity = rng.normal(size=(2, count)) * speed
    second = origin - ahead * along + aside * miss
    closing = velocity + ahead * speed
    return np.stack([*origin, *velocity, radius[0], *second, *closing, radius[1]], axis=1)


def exact_time(row: NDArray[np.float64]) -> arb | None:
    """Return a ball around the exact time of impact; 0 for overlapping and approaching, None for never."""
    ctx.prec = PRECISION
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = (arb(float(value)) for value in row)
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, c, a = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach, ux * ux + uy * uy
    d = b * b - a * c
    if not b < 0:
        return None
    if not c > 0:
        return arb(0)
    return c / (d.sqrt() - b) if d > 0 else None


def ulps(found: float, exact: arb) -> float:
    """Return the distance of a float from the exact value in units of its last place."""
    ctx.prec = PRECISION
    return float(abs(arb(found) - exact)) / math.ulp(float(exact.mid()))
