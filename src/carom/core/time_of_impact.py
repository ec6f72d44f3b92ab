"""Public function for times of impact of discs in straight uniform motion, for arrays.

The core computes each time: `core/straight/pair_time.h` describes the method and its guarantee. With very large or
small numbers, a fourth-degree term of the formulas could exceed the range of floats. Very large or small numbers are
first multiplied by powers of two, which is exact. If no power of two makes all numbers moderate, the time is computed
in rational numbers.

Exact signs, such as that of the closing speed, decide whether discs collide.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.core import primitives
from carom.errors import InputError
from carom.support.checks import check_finite, check_vectors

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Relative positions, relative velocities and sums of radii are of moderate size if their exponents (those of
#: `math.frexp`) are from -100 to 100. `CAROM_PAIR_MOST` and `CAROM_PAIR_LEAST` of the core are the same limits.
_EXPONENT = 100
_MOST, _LEAST = 2.0**_EXPONENT, 2.0 ** -(_EXPONENT + 1)
#: Number of bits to which a square root is computed in rational numbers: three more than those of a float. So a time
#: has an error of at most an eighth of a unit in its last place before it is rounded to a float.
_ROOT_BITS = 56


def time_of_impact(
    p1: ArrayLike, v1: ArrayLike, r1: ArrayLike, p2: ArrayLike, v2: ArrayLike, r2: ArrayLike
) -> NDArray[np.float64] | float:
    """Return the seconds until discs 1 and 2 collide. Numbers may have any size.

    The error is at most 2 units in the last place.

    Args:
        p1: Centre of disc 1, in metres; shape ``(..., 2)``.
        v1: Velocity of disc 1, in m/s; shape ``(..., 2)``.
        r1: Radius of disc 1, in metres; shape ``(...)``.
        p2: Centre of disc 2.
        v2: Velocity of disc 2.
        r2: Radius of disc 2.

    Returns:
        Seconds, in the broadcast shape of all arguments; a float if no argument is an array. The time is 0 where the
        discs approach while they touch or overlap. The time is infinity where the discs never collide, or where the
        time exceeds the largest float.

    Raises:
        InputError: A value is not finite, a radius is not positive, or a last axis does not have the length 2.

    Examples:
        >>> carom.time_of_impact((0, 0), (1, 0), 0.5, (3, 0), (0, 0), 0.5)
        2.0
    """
    position1, velocity1 = check_vectors("p1", p1), check_vectors("v1", v1)
    position2, velocity2 = check_vectors("p2", p2), check_vectors("v2", v2)
    radius1, radius2 = _check_radii("r1", r1), _check_radii("r2", r2)
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
        times[k] = compute_scaled_pair_time(*row)
    return times.reshape(shape) if shape else float(times[0])


def _check_radii(name: str, value: ArrayLike) -> NDArray[np.float64]:
    array = check_finite(name, value)
    if not np.all(array > 0):
        raise InputError(f"{name} must be above 0 everywhere, got {np.min(array)}")
    return array


def compute_scaled_pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float:
    """Return the seconds until two discs collide; infinity for never, or if the time exceeds the largest float."""
    row = (x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)
    dx, dy, reach = Fraction(x2) - Fraction(x1), Fraction(y2) - Fraction(y1), Fraction(r1) + Fraction(r2)
    ux, uy = Fraction(vx2) - Fraction(vx1), Fraction(vy2) - Fraction(vy1)
    length = _EXPONENT - _compute_exponent(max(abs(dx), abs(dy), reach))
    speed = _EXPONENT - _compute_exponent(max(abs(ux), abs(uy)))
    scaled = _scale(row, (length, length, speed, speed, length) * 2)
    if scaled is None or not _are_moderate(*(scaled[k + 5] - scaled[k] for k in range(4)), scaled[4] + scaled[9]):
        return _solve_rational(dx, dy, ux, uy, reach)
    try:
        return math.ldexp(primitives.pair_time(*scaled), speed - length)
    except OverflowError:
        return math.inf


def _are_moderate(*numbers: float) -> bool:
    return all(_LEAST <= abs(number) < _MOST or number == 0.0 for number in numbers)


def _compute_exponent(number: Fraction) -> int:
    """Return the exponent of a number, as `math.frexp` does. The denominator must be a power of two."""
    return number.numerator.bit_length() - number.denominator.bit_length() + 1 if number else 0


def _scale(row: tuple[float, ...], exponents: tuple[int, ...]) -> tuple[float, ...] | None:
    """Return numbers multiplied by powers of two, or None if a product would be rounded."""
    try:
        scaled = tuple(math.ldexp(number, exponent) for number, exponent in zip(row, exponents, strict=True))
        exact = all(math.ldexp(scaled[k], -exponents[k]) == number for k, number in enumerate(row))
    except OverflowError:
        return None
    return scaled if exact else None


def _solve_rational(dx: Fraction, dy: Fraction, ux: Fraction, uy: Fraction, reach: Fraction) -> float:
    b, c = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    if b >= 0:
        return math.inf
    if c <= 0:
        return 0.0
    d = b * b - (ux * ux + uy * uy) * c
    if d <= 0:
        return math.inf
    try:
        return float(c / (_compute_root(d) - b))
    except OverflowError:
        return math.inf


def _compute_root(square: Fraction) -> Fraction:
    """Return the square root of a positive number, to about `_ROOT_BITS` bits."""
    shift = _ROOT_BITS - _compute_exponent(square) // 2
    return Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift))) / Fraction(2) ** shift
