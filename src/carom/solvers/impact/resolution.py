"""How well the instant of an impact is known, given what rounding does to positions and to the clock.

Each coordinate is known to a unit in the last place (a product and a sum of half a unit each), the distance of two
bodies so to five such units of all sizes together (`size_of` each, root and radii included). Divided by the speed of
approach that is a time.

In a graze the speed of approach can be anything down to 0. There the overlap is a parabola in time, of curvature
``u^2 / R`` for a relative speed u and a contact distance R, and an error of the gap moves its zero by no more than half
its width at that depth: ``sqrt(2 R error) / u``. The lesser of the two holds.

`core/resolution.h` is the compiled form; a test compares bits.
"""

from __future__ import annotations

import math

from carom.errors import InputError
from carom.number_text import number

#: A unit in the last place of 1: at least one of any number, in parts of it.
ULP = 2.0**-52

#: Each coordinate at an impact is at most three roundings off (its way, the sum, the time): here the place of a centre
#: seen from the other is off by at most 3/16 of their distance.
FARTHEST = 2.0**49


def are_told_apart(x1: float, y1: float, x2: float, y2: float, reach: float) -> bool:
    """Return whether floats tell apart the centres of two discs in contact: further out an impact has no normal."""
    return abs(x1) + abs(y1) + abs(x2) + abs(y2) <= FARTHEST * reach


def too_far_out() -> InputError:
    """Return the refusal of an impact of two discs whose centres are not told apart."""
    return InputError(
        f"two discs met more than {number(FARTHEST / 2, 3)} radii from the origin, where floats do not tell their "
        "centres apart: end the run before that, or move the scene to the origin"
    )


def size_of(x: float, y: float, radius: float) -> float:
    """Return the sum of a body's coordinates (of a wall those of its point) and its radius, signs left out."""
    return abs(x) + abs(y) + radius


def gap_resolution(sizes: float) -> float:
    """Return how well the gap between two bodies is known, metres, from the sum of `size_of` of both."""
    return 5.0 * ULP * sizes


def pair_resolution(sizes: float, reach: float, ux: float, uy: float, speed: float) -> float:
    """Return to how many seconds the instant of an impact of two discs is known, infinity for to none.

    Of both: the sum of `size_of`, of the radii, the relative velocity before, and its part along the normal, of which
    rounding can leave 0 or less in a graze.
    """
    error = gap_resolution(sizes)
    fast = math.sqrt(ux * ux + uy * uy)
    graze = reach * math.sqrt(2.0 * (error / reach)) / fast if fast > 0.0 else math.inf
    return min(error / speed, graze) if speed > 0.0 else graze


def wall_resolution(sizes: float, speed: float) -> float:
    """Return to how many seconds the instant of an impact on a wall is known, infinity for to none."""
    return gap_resolution(sizes) / speed if speed > 0.0 else math.inf


def clock_resolution(time_s: float) -> float:
    """Return to how many seconds a time since the start is known: the roundings of a root and of a sum with it."""
    return 2.0 * ULP * time_s
