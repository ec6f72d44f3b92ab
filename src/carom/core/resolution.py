"""Resolution of gaps and times: the uncertainty that results from the rounding of positions and times.

A coordinate has an error of at most one unit in the last place: half a unit from a product, and half from a sum. The
gap between two bodies has an error of at most five units in the last place of the sum of their sizes (`size_of`). The
bound of five units includes the rounding of the root and of the radii.

`core/impact_record.h` has the same bounds for gaps, and derives bounds of times of impact from them.
"""

from __future__ import annotations

from carom.errors import InputError
from carom.support.formatting import format_number

#: Distance from 1 to the next float. A number's unit in the last place is at most this fraction of the number.
ULP = 2.0**-52

#: Largest allowed ratio, at an impact of two discs, of the sum of their absolute coordinates to the sum of their radii.
#: See CAROM_FARTHEST in core/constants.h.
FARTHEST = 2.0**49


def size_of(x: float, y: float, radius: float) -> float:
    """Return ``|x| + |y| + radius`` of a disc. For a wall, (x, y) is the point that defines its surface."""
    return abs(x) + abs(y) + radius


def gap_resolution(sizes: float) -> float:
    """Return the resolution of the gap between two bodies, in metres.

    `sizes` is the sum of `size_of` for both bodies.
    """
    return 5.0 * ULP * sizes


def clock_resolution(time_s: float) -> float:
    """Return the resolution of a time since the start, which includes the roundings of a root and of a sum."""
    return 2.0 * ULP * time_s


def too_far_out() -> InputError:
    """Return the exception for discs that met so far from the origin that floats can't represent their distance."""
    return InputError(
        f"two discs met more than {format_number(FARTHEST / 2, 3)} radii from the origin, where floats cannot "
        "represent "
        "the distance of their centres: end the run earlier, or move the scene to the origin"
    )
