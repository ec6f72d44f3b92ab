"""Limits of numbers, files and options, for files, command line and Python alike.

- No number that measures something is larger than `LARGEST` in magnitude, so that its square is a float; and a radius,
  edge, mass, duration or rate is not smaller than `SMALLEST`.
- Sizes from ``1 / ORDINARY`` to `ORDINARY` need no change of units. The formulas are of fourth degree at most, so their
  terms, and the rounding errors of these, stay within the range of floats.
- PIC refuses an impact of two discs so far out that floats do not distinguish their centres, see
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
#: A little less than the square of `ORDINARY`: units are powers of two, and take sizes to the middle only roughly.
SPAN = 2.0**396

#: Steps or frames of a run. A larger number is most likely a mistaken unit.
MOST_STEPS = 2**32

#: Default budget of engine steps for one method's search for a step. For 1 degree an engine that checks for overlap
#: once per step takes 240,000 on `paper/missed`, and 430,000 on the puck of docs/how-to/which-step.md.
ADVICE_STEPS = 600_000

#: Discs and walls of a scene file. They load in seconds, in less than 500 MB.
MOST_DISCS = 100_000
MOST_WALLS = 1_000

#: Legs of a driven body: PIC visits each until the next impact.
MOST_LEGS = 10_000
#: More discs than this in one picture show nothing, and weigh megabytes.
MOST_DISCS_DRAWN = 64
#: Bytes and values of a file by its ending; `values_in` counts them, in TOML with the lines. The largest scene fits
#: into JSON easily; each value takes up to 100 bytes of memory. TOML takes ten times as long to read. Lines of JSON are
#: results, each within the limits of JSON; 1e5 rows take 310 MB and half of these values.
MOST_BYTES = {".json": 40 * 2**20, ".toml": 16 * 2**20, ".jsonl": 512 * 2**20}
MOST_VALUES = {".json": 2**21, ".toml": 2**19, ".jsonl": 2**25}
#: Parts of a dotted key of TOML, which is read in a time that grows with the square of their number; a scene needs one.
MOST_KEY_PARTS = 4

#: Limits of options: twenty times what the largest machines can use, and what ends in an hour at worst.
MOST_JOBS = 1024
MOST_PHASES = 1024
MOST_ROUNDS = 1024
#: Steps of a series. More steps would be too close together for their errors to differ.
MOST_SERIES = 256
#: Default time limit of an engine, seconds, after which it is terminated.
DEFAULT_TIME_LIMIT_S = 60.0
#: Seconds that a limit or a budget can be: four months. No system waits for 1e10.
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
    """Refuse an argument that is not finite, or not between two limits in magnitude, everywhere.

    Raises:
        InputError: The message names the argument, the first such value, and the limits.
    """
    size = abs(array)
    wrong = ~((size <= most) & (size >= least))
    if wrong.any():
        value = array[wrong].flat[0]
        raise InputError(f"{name} {beyond(least, most) if math.isfinite(value) else 'must be finite'}, got {value}")


def require_megabytes(name: str, value: float) -> None:
    """Refuse what is no limit of memory: a number of megabytes above 0, and not above `MOST_MB`.

    Raises:
        InputError: The message names the option or argument, and the value.
    """
    if not (isinstance(value, int | float) and 0.0 < value <= MOST_MB):
        raise InputError(f"{name} must be a positive number of megabytes, {MOST_MB:g} at most, got {value!r}")


def values_in(data: bytes) -> int:
    """Return how many values a text of JSON can hold at most, without reading it."""
    return 1 + data.count(b",") + data.count(b"[") + data.count(b"{")
