"""Time of impact of arrays of discs, in straight uniform motion: the public, vectorised form.

Element by element the result is that of `carom.physics.pair_time.pair_time`, to the bit: the same functions run on
arrays, each step on the elements that the one before left undecided. See there for the method and its guarantee.

Whether bodies approach decides everything; no time or distance is ever compared with a small number.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.physics.compilation import Recipe, addresses, compiled_unit, compiler_installed, is_cached, is_translated
from carom.physics.double_double import two_diff, two_sum
from carom.physics.pair_time import (
    approach,
    discriminant_from_gap,
    discriminant_from_miss,
    encounter,
    exact_coefficients,
    exact_root,
    pair_time,
    quick_pair_time,
    refine,
    separation,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from carom.physics.compilation import Unit

    Column = Any
    Array = NDArray[np.float64]
    Pair = tuple[Array, Array]

__all__ = [
    "CACHED_FROM",
    "COMPILED_FROM",
    "FILL",
    "LOADED_FROM",
    "TRANSLATED_FROM",
    "fill_times",
    "pair_times",
    "time_of_impact",
]

#: Elements at a time: few enough for the temporaries of a step to stay in the second-level cache, many enough for the
#: cost of calling NumPy not to dominate. Chosen, not tuned.
_CHUNK = 8192

#: Elements from which the compiled form pays for being compiled by numba and LLVM, or by LLVM alone; for being loaded
#: where that was done before (``python -m carom.bench.switch``); and for being called: so few take NumPy as long.
COMPILED_FROM = 36_000_000
TRANSLATED_FROM = 2_500_000
CACHED_FROM = 400_000
LOADED_FROM = 16


def time_of_impact(
    p1: ArrayLike, v1: ArrayLike, r1: ArrayLike, p2: ArrayLike, v2: ArrayLike, r2: ArrayLike
) -> NDArray[np.float64] | float:
    """Return the seconds from now until discs 1 and 2 collide, to within 2 units in the last place.

    Args:
        p1: Centre of disc 1, metres; shape ``(..., 2)``.
        v1: Velocity of disc 1, metres a second; shape ``(..., 2)``.
        r1: Radius of disc 1, metres; shape ``(...)``.
        p2: Centre of disc 2.
        v2: Velocity of disc 2.
        r2: Radius of disc 2.

    Returns:
        The broadcast shape of all (a float where none is an array): 0 where the discs touch or overlap and approach,
        infinity where they never collide.

    Raises:
        InputError: A value is not finite, a radius is not positive, or a last axis is not of length 2.
    """
    position1, velocity1 = _vectors("p1", p1), _vectors("v1", v1)
    position2, velocity2 = _vectors("p2", p2), _vectors("v2", v2)
    radius1, radius2 = _radii("r1", r1), _radii("r2", r2)
    vectors = (position1, velocity1, position2, velocity2)
    try:
        shape = np.broadcast_shapes(*(v.shape[:-1] for v in vectors), radius1.shape, radius2.shape)
    except ValueError as error:
        raise InputError(f"the shapes of positions, velocities and radii do not broadcast: {error}") from None
    first = (position1[..., 0], position1[..., 1], velocity1[..., 0], velocity1[..., 1], radius1)
    second = (position2[..., 0], position2[..., 1], velocity2[..., 0], velocity2[..., 1], radius2)
    if not shape:
        return pair_time(*(float(a) for a in first), *(float(a) for a in second))
    return pair_times(*(np.broadcast_to(a, shape).ravel() for a in (*first, *second))).reshape(shape)


def pair_times(*columns: Array, compiled: bool | None = None) -> Array:
    """Return `pair_time` of every row of ten columns of one length, in the order of its arguments; unchecked.

    Args:
        columns: Ten columns of floats.
        compiled: Force the compiled or the NumPy form; None chooses. They give the same bits.
    """
    count = len(columns[0])
    if compiled is None:
        compiled = compiler_installed() and _compiled_pays(count)
    if compiled:
        times = np.empty(count)
        _compiled_fill().ctypes(*addresses(*(np.ascontiguousarray(a) for a in columns), times), count)
        return times
    times = np.full(count, math.inf)
    with np.errstate(all="ignore"):  # the error-free form takes over wherever something over- or underflows
        found = [_possible(start, *(a[start : start + _CHUNK] for a in columns)) for start in range(0, count, _CHUNK)]
        rows = np.concatenate([part[0] for part in found]) if found else np.zeros(0, np.intp)
        b, d = (np.concatenate([part[k] for part in found]) if found else times for k in (1, 2))
        for start in range(0, len(rows), _CHUNK):
            some = slice(start, start + _CHUNK)
            times[rows[some]] = _contact_times(b[some], d[some], *(a[rows[some]] for a in columns))
    return times


def fill_times(
    x1: Column,
    y1: Column,
    vx1: Column,
    vy1: Column,
    r1: Column,
    x2: Column,
    y2: Column,
    vx2: Column,
    vy2: Column,
    r2: Column,
    times: Column,
    count: int,
) -> int:
    """Write `pair_time` of each row of ten columns into `times`: what the compiled form is made of."""
    for k in range(count):  # several at a time: a compiler takes this loop apart into vectors
        times[k] = quick_pair_time(x1[k], y1[k], vx1[k], vy1[k], r1[k], x2[k], y2[k], vx2[k], vy2[k], r2[k])
    for k in range(count):
        if times[k] < 0.0:
            times[k] = pair_time(x1[k], y1[k], vx1[k], vy1[k], r1[k], x2[k], y2[k], vx2[k], vy2[k], r2[k])
    return count


FILL = Recipe(fill_times, "int64", ("float64*",) * 11 + ("int64",), vectors=True)


@functools.cache
def _compiled_fill() -> Unit:
    return compiled_unit(FILL)


def _compiled_pays(count: int) -> bool:
    if _is_loaded():
        return count >= LOADED_FROM
    return (
        count >= COMPILED_FROM
        or (count >= TRANSLATED_FROM and is_translated(FILL))
        or (count >= CACHED_FROM and is_cached(FILL))
    )


def _is_loaded() -> bool:
    return _compiled_fill.cache_info().currsize > 0


def _possible(
    start: int,
    x1: Array,
    y1: Array,
    vx1: Array,
    vy1: Array,
    r1: Array,
    x2: Array,
    y2: Array,
    vx2: Array,
    vy2: Array,
    r2: Array,
) -> tuple[NDArray[np.intp], Array, Array]:
    """Return the rows, counted from `start`, that the plain form does not rule out, with their ``b`` and ``D``."""
    dx, dy, ux, uy = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1
    b, b_error = approach(dx, dy, ux, uy)
    rows = np.flatnonzero(b <= b_error)
    d, d_error = encounter(dx[rows], dy[rows], ux[rows], uy[rows], r1[rows] + r2[rows])
    possible = ~(d < -d_error)
    rows = rows[possible]
    return rows + start, b[rows], d[possible]


def _contact_times(
    b: Array,
    d: Array,
    x1: Array,
    y1: Array,
    vx1: Array,
    vy1: Array,
    r1: Array,
    x2: Array,
    y2: Array,
    vx2: Array,
    vy2: Array,
    r2: Array,
) -> Array:
    """`contact_time` of arrays."""
    x, y = two_diff(x2, x1), two_diff(y2, y1)
    ux, uy = two_diff(vx2, vx1), two_diff(vy2, vy1)
    reach = two_sum(r1, r2)
    c, _ = separation(x[0], y[0], reach[0])
    times: Array
    times, certain = refine(c / (np.sqrt(d) - b), x, y, ux, uy, reach)
    left = np.flatnonzero(~((b < 0.0) & (c > 0.0) & (d > 0.0) & (certain != 0)))
    if len(left):
        times[left] = _exact(*((high[left], low[left]) for high, low in (x, y, ux, uy, reach)))
    return times


def _exact(x: Pair, y: Pair, ux: Pair, uy: Pair, reach: Pair) -> Array:
    """`exact_pair_time` of arrays."""
    length: Any = np.frexp(np.maximum(np.maximum(abs(x[0]), abs(y[0])), reach[0]))[1]
    pace: Any = np.frexp(np.maximum(abs(ux[0]), abs(uy[0])))[1]
    x, y, reach = _scaled(x, -length), _scaled(y, -length), _scaled(reach, -length)
    raw_ux, raw_uy = ux[0], uy[0]
    ux, uy = _scaled(ux, -pace), _scaled(uy, -pace)
    b, c, a = exact_coefficients(x, y, ux, uy, reach)
    near = b[0] * b[0] < a[0] * (reach[0] * reach[0])
    from_gap = discriminant_from_gap(b, c, a)
    from_miss = discriminant_from_miss(x, y, ux, uy, reach, a)
    d: Any = (np.where(near, from_gap[0], from_miss[0]), np.where(near, from_gap[1], from_miss[1]))
    time = np.ldexp(exact_root(b, c, d, np.sqrt(d[0])), length - pace)
    time = np.where(d[0] > 0.0, time, math.inf)
    # A velocity below 2^-1022 of the other component is lost in scaling, but not its sign.
    closing = (b[0] < 0.0) | ((b[0] == 0.0) & (x[0] * raw_ux + y[0] * raw_uy < 0.0))
    times: Array = np.where(closing, np.where(c[0] <= 0.0, 0.0, time), math.inf)
    return times


def _scaled(pair: Pair, exponent: NDArray[np.int32]) -> Pair:
    return np.ldexp(pair[0], exponent), np.ldexp(pair[1], exponent)


def _vectors(name: str, value: ArrayLike) -> Array:
    array = _finite(name, value)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise InputError(f"{name} must have x and y along its last axis, got shape {array.shape}")
    return array


def _radii(name: str, value: ArrayLike) -> Array:
    array = _finite(name, value)
    if not np.all(array > 0):
        raise InputError(f"{name} must be above 0 everywhere, got {np.min(array)}")
    return array


def _finite(name: str, value: ArrayLike) -> Array:
    try:
        array: NDArray[Any] = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers: {error}") from None
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite everywhere, got {array[~np.isfinite(array)].flat[0]}")
    return array
