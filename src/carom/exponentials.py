"""Exponentials and logarithms as the nearest floats, by whole numbers: the same on every machine.

Those of C libraries are off by up to a unit in the last place, each in its own way. `live/damping.js` has these bits.
"""

from __future__ import annotations

import math

#: Bits after the point: of a power as near to 1 as 2**-54 are left 138, where a float has 53.
_BITS = 192
#: The natural logarithm of 2 in these bits, rounded down.
_LN2 = 0xB17217F7D1CF79ABC9E3B39803F2F6AF40F343267298B62D
#: Below the first floats have fewer bits; above the second none is as large.
_LEAST, _MOST = -708.0, 710.0


def _power(x: float) -> tuple[int, int]:
    """Return n and k with ``e^x = n / 2^k`` to some 180 bits."""
    n, d = x.as_integer_ratio()
    twos, rest = divmod((n << _BITS) // d, _LN2)
    total = term = 1 << _BITS
    k = 0
    while term:
        k += 1
        term = (term * rest >> _BITS) // k
        total += term
    return total, _BITS - twos


def exp(x: float) -> float:
    """Return ``e^x``; 0 below -708, where floats have fewer bits.

    Raises:
        OverflowError: It is beyond the largest float.
    """
    if x == 0.0:  # asked at every step of what nothing slows
        return 1.0
    if not _LEAST <= x <= _MOST:
        return math.exp(x) if not x < _LEAST else 0.0
    n, k = _power(x)
    return n / (1 << k) if k >= 0 else float(n << -k)


def expm1(x: float) -> float:
    """Return ``e^x - 1``.

    Raises:
        OverflowError: It is beyond the largest float.
    """
    if not _LEAST <= x <= _MOST:
        return math.expm1(x)
    n, k = _power(x)
    return (n - (1 << k)) / (1 << k) if k >= 0 else float((n << -k) - 1)


def log1p(x: float) -> float:
    """Return the natural logarithm of ``1 + x``, of an x above -1 and below 0.

    By one step of Newton's to the third order from that of the C library, whose last bits cancel.
    """
    near = math.log1p(x)
    n, k = _power(-near)
    a, d = x.as_integer_ratio()
    rest = (((d + a) * n << _BITS) // d >> k) - (1 << _BITS)
    b, e = near.as_integer_ratio()
    return ((b << _BITS) + e * (rest - (rest * rest >> _BITS + 1))) / (e << _BITS)
