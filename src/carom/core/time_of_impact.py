"""Time of impact of arrays of discs, in straight uniform motion: the public form.

The core computes each time (`core/straight/pair_time.h` describes the method and its guarantee), and
`carom.core.pair_time_any_size` scales numbers that are not of moderate size.

All decisions depend on whether the discs approach. No time or distance is compared with a tolerance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.core import primitives
from carom.core.pair_time_any_size import scaled_pair_time
from carom.errors import InputError
from carom.support.checks import finite, vectors

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def time_of_impact(
    p1: ArrayLike, v1: ArrayLike, r1: ArrayLike, p2: ArrayLike, v2: ArrayLike, r2: ArrayLike
) -> NDArray[np.float64] | float:
    """Return the seconds from now until discs 1 and 2 collide, to within 2 units in the last place, at any size.

    Args:
        p1: Centre of disc 1, metres; shape ``(..., 2)``.
        v1: Velocity of disc 1, metres a second; shape ``(..., 2)``.
        r1: Radius of disc 1, metres; shape ``(...)``.
        p2: Centre of disc 2.
        v2: Velocity of disc 2.
        r2: Radius of disc 2.

    Returns:
        Seconds, in the broadcast shape of all arguments; a float if no argument is an array. 0 where the discs touch or
        overlap and approach; infinity where they never collide, or only after more seconds than the largest float.

    Raises:
        InputError: A value is not finite, a radius is not positive, or a last axis is not of length 2.

    Examples:
        >>> carom.time_of_impact((0, 0), (1, 0), 0.5, (3, 0), (0, 0), 0.5)
        2.0
    """
    position1, velocity1 = vectors("p1", p1), vectors("v1", v1)
    position2, velocity2 = vectors("p2", p2), vectors("v2", v2)
    radius1, radius2 = _radii("r1", r1), _radii("r2", r2)
    both = (position1, velocity1, position2, velocity2)
    try:
        shape = np.broadcast_shapes(*(v.shape[:-1] for v in both), radius1.shape, radius2.shape)
    except ValueError as error:
        raise InputError(f"the shapes of positions, velocities and radii do not broadcast: {error}") from None
    p1, v1, p2, v2 = (np.broadcast_to(v, (*shape, 2)).reshape(-1, 2) for v in both)
    r1, r2 = (np.broadcast_to(r, shape).reshape(-1) for r in (radius1, radius2))
    times = np.empty(len(r1))
    primitives.fill_pair_times(p1, v1, r1, p2, v2, r2, times)
    left = np.flatnonzero(np.isnan(times))
    for k, row in zip(left, np.column_stack([a[left] for a in (p1, v1, r1, p2, v2, r2)]).tolist(), strict=True):
        times[k] = scaled_pair_time(*row)
    return times.reshape(shape) if shape else float(times[0])


def _radii(name: str, value: ArrayLike) -> NDArray[np.float64]:
    array = finite(name, value)
    if not np.all(array > 0):
        raise InputError(f"{name} must be above 0 everywhere, got {np.min(array)}")
    return array
