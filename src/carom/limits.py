"""The sizes of numbers that Carom computes with. They are stated here, and every way in keeps them.

- No number that measures something is larger than `LARGEST` in magnitude, so that its square is a float; and a radius,
  mass, duration or rate is not smaller than `SMALLEST`.
- Sizes from ``1 / ORDINARY`` to `ORDINARY` are computed with as they are: the formulas are of fourth degree at most, so
  their terms, and what the rounding of these leaves, stay within the range of floats.
- PIC refuses an impact of two discs so far out that floats do not tell their centres apart: `carom.solvers.resolution`.
- What belongs to one scene spans no more than `SPAN` (`carom.sizes`), so that there are units in which it is ordinary.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LARGEST", "MOST_STEPS", "ORDINARY", "SMALLEST", "SPAN", "beyond", "require_within"]

LARGEST = 2.0**511
SMALLEST = 1.0 / LARGEST
ORDINARY = 2.0**200
#: A little less than the square of `ORDINARY`: units are powers of two, and take sizes to the middle only roughly.
SPAN = 2.0**396

#: Steps or frames of a run. Who asks for more has mistaken a unit.
MOST_STEPS = 2**32


def beyond(least: float, most: float) -> str:
    """Return what to say of a number that is not between two limits."""
    span = f"lie between {least:.3g} and {most:.3g}" if least > 0.0 else f"be at most {most:.3g} in magnitude"
    return f"must {span} (measure in other units)"


def require_within(name: str, array: NDArray[np.float64], least: float, most: float) -> None:
    """Refuse an argument that is not finite, or not between two limits in magnitude, everywhere.

    Raises:
        InputError: The message names the argument, the first such value, and the limits.
    """
    size = np.abs(array)
    wrong = ~((size <= most) & (size >= least))
    if wrong.any():
        value = array[wrong].flat[0]
        raise InputError(f"{name} {beyond(least, most) if np.isfinite(value) else 'must be finite'}, got {value}")
