"""Limits of numbers, files and options, for files, command line and Python alike.

- A number that measures something is at most `LARGEST` in magnitude, so that its square is a float. A radius, edge,
  mass, duration or rate is at least `SMALLEST`.
- Sizes from ``1 / ORDINARY`` to `ORDINARY` need no change of units. The formulas are of fourth degree at most, so their
  terms, and the rounding errors of these, stay within the range of floats.
- PIC refuses an impact of two discs so far from the origin that floats can't distinguish their centres, see
  `carom.core.resolution`.
- The sizes of one scene span no more than `SPAN` (`carom.model.sizes`), so there are units in which they are ordinary.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.support.formatting import number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST = 2.0**511
SMALLEST = 1.0 / LARGEST
ORDINARY = 2.0**200
#: A little less than the square of `ORDINARY`: units are powers of two, so they centre the sizes only roughly.
SPAN = 2.0**396

#: Most steps or frames of a run. A larger number is most likely a mistaken unit.
MOST_STEPS = 2**32

#: Default budget of engine steps for one method's search for a step length. For an error of 1 degree, an engine that
#: checks for overlap once per step needs 240,000 on `paper/missed`, and 430,000 on the puck of
#: docs/how-to/which-step.md.
ADVICE_STEPS = 600_000

#: Most discs and walls of a scene file. Such files load in seconds, in less than 500 MB.
MOST_DISCS = 100_000
MOST_WALLS = 1_000

#: Most legs of a driven body: PIC visits each until the next impact.
MOST_LEGS = 10_000
#: Most discs in one picture. Drawings of more discs would show nothing, and take megabytes.
MOST_DISCS_DRAWN = 64
#: Most bytes and values of a file by its ending. `values_in` counts values, and in TOML also lines. The largest scene
#: fits into JSON easily; each value takes up to 100 bytes of memory. TOML takes ten times as long to read. Each line of
#: a JSON lines file is within the limits of JSON; 1e5 rows of results take 310 MB and half of these values.
MOST_BYTES = {".json": 40 * 2**20, ".toml": 16 * 2**20, ".jsonl": 512 * 2**20}
MOST_VALUES = {".json": 2**21, ".toml": 2**19, ".jsonl": 2**25}
#: Most parts of a dotted key of TOML. The time of reading grows with the square of their number. A scene needs one
#: part.
MOST_KEY_PARTS = 4

#: Limits of options: twenty times what the largest machines can use, or an hour of run time at worst.
MOST_JOBS = 1024
MOST_PHASES = 1024
MOST_ROUNDS = 1024
#: Most steps of a series. With more steps, neighbouring steps would be too similar to differ in their errors.
MOST_SERIES = 256
#: Default time limit of an engine, seconds, after which it is terminated.
DEFAULT_TIME_LIMIT_S = 60.0
#: Longest limit or budget, seconds: four months. No system can wait for 1e10 seconds.
LONGEST_S = 1e7
#: Most megabytes of a worker: more than any machine has, and a number that every system accepts.
MOST_MB = 1e9


def beyond(least: float, most: float) -> str:
    """Return the message for a number that is not between two limits."""
    span = (
        f"be between {number(least, 3)} and {number(most, 3)}"
        if least > 0.0
        else f"be at most {number(most, 3)} in magnitude"
    )
    return f"must {span} (measure in other units)"


def require_within(name: str, array: NDArray[np.float64], least: float, most: float) -> None:
    """Refuse an argument with a value that is not finite, or not between two limits in magnitude.

    Raises:
        InputError: The message names the argument, the first such value, and the limits.
    """
    size = abs(array)
    wrong = ~((size <= most) & (size >= least))
    if wrong.any():
        value = array[wrong].flat[0]
        raise InputError(f"{name} {beyond(least, most) if math.isfinite(value) else 'must be finite'}, got {value}")


def require_megabytes(name: str, value: float) -> None:
    """Refuse a limit of memory that is not a number of megabytes above 0 and up to `MOST_MB`.

    Raises:
        InputError: The message names the option or argument, and the value.
    """
    if not (isinstance(value, int | float) and 0.0 < value <= MOST_MB):
        raise InputError(f"{name} must be a positive number of megabytes, {MOST_MB:g} at most, got {value!r}")


def values_in(data: bytes) -> int:
    """Return how many values a text of JSON can contain at most, without parsing it."""
    return 1 + data.count(b",") + data.count(b"[") + data.count(b"{")
