"""Decimal numbers of which every digit is proven."""

from __future__ import annotations

import math

__all__ = ["proven_decimal"]


def proven_decimal(value: float, radius: float) -> str:
    """Return a value known to within `radius` with as many digits as are proven.

    With k decimals the truth is within ``radius + 10^-k / 2`` of what is shown; k is chosen so that this is at most one
    unit in the last digit. Where not even the first digit is proven, a bound stands instead.
    """
    if radius == 0.0:
        return repr(value)
    decimals = math.floor(-math.log10(2.0 * radius))
    if 10.0**-decimals < 2.0 * radius:  # the logarithm was rounded up
        decimals -= 1
    significant = decimals + math.floor(math.log10(abs(value))) if value else -1
    if significant < 0:
        return f"0 (within {abs(value) + radius:.1e})"
    if 1e-4 <= abs(value) < 1e16:
        return f"{value:.{decimals}f}" if decimals >= 0 else f"{round(value, decimals):.0f}"
    return f"{value:.{significant}e}"
