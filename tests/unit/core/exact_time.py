"""The exact time of impact of two discs, in ball arithmetic."""

import math

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

#: Bits of the ball arithmetic: a difference of products of two-part differences needs some 430.
PRECISION = 600


def compute_exact_time(row: NDArray[np.float64], precision: int = PRECISION) -> arb | None:
    """Return a ball around the exact time of impact; 0 for overlapping and approaching, None for never."""
    ctx.prec = precision
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = (arb(float(value)) for value in row)
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, c, a = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach, ux * ux + uy * uy
    d = b * b - a * c
    if not b < 0:
        return None
    if not c > 0:
        return arb(0)
    return c / (d.sqrt() - b) if d > 0 else None


def compute_ulp_error(found: float, exact: arb) -> float:
    """Return the distance of a float from the exact value in units of its last place."""
    ctx.prec = PRECISION
    return float(abs(arb(found) - exact)) / math.ulp(float(exact.mid()))
