"""Resolution of gaps and times: how well they are known, given the rounding of positions and of the clock.

Each coordinate is known to a unit in the last place (a product and a sum of half a unit each). The distance of two
bodies is known to five such units of all sizes together (`size_of` each, root and radii included).

`core/resolution.h` has the same bounds for the core, and those of times of impact, which follow from them.
"""

from __future__ import annotations

from carom.errors import InputError
from carom.support.formatting import number

#: A unit in the last place of 1: at least one of any number, in parts of it.
ULP = 2.0**-52

#: Each coordinate at an impact is at most three roundings off (its way, the sum, the time): here the place of a centre
#: seen from the other is off by at most 3/16 of their distance.
FARTHEST = 2.0**49


def size_of(x: float, y: float, radius: float) -> float:
    """Return the sum of a body's coordinates (of a wall: those of its point) and its radius, as absolute values."""
    return abs(x) + abs(y) + radius


def gap_resolution(sizes: float) -> float:
    """Return the resolution of the gap between two bodies, metres, from the sum of `size_of` of both."""
    return 5.0 * ULP * sizes


def clock_resolution(time_s: float) -> float:
    """Return the resolution of a time since the start: the roundings of a root and of a sum with it."""
    return 2.0 * ULP * time_s


def too_far_out() -> InputError:
    """Return the error for an impact of two discs whose centres floats do not tell apart."""
    return InputError(
        f"two discs met more than {number(FARTHEST / 2, 3)} radii from the origin, where floats do not tell their "
        "centres apart: end the run before that, or move the scene to the origin"
    )
