"""Limits of numbers, files and options. The limits are the same in files, on the command line and in Python.

- A physical quantity is at most `LARGEST` in magnitude, so that its square does not overflow. A radius, edge, mass,
  duration or rate is at least `SMALLEST`.
- If all quantities are between ``1 / ORDINARY`` and `ORDINARY`, solvers compute in SI units. Each term of the
  solvers' formulas multiplies at most four quantities. So neither the terms nor their rounding errors overflow or
  underflow.
- PIC raises an error if an impact is so far from the origin that floats can't represent the distance of the centres;
  see `carom.core.resolution`.
- The ratio of a scene's largest quantity to its smallest is at most `SPAN` (`carom.model.sizes`). So a change of units
  can bring all quantities between ``1 / ORDINARY`` and `ORDINARY`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.support.formatting import format_number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST = 2.0**511
SMALLEST = 1.0 / LARGEST
ORDINARY = 2.0**200
#: Largest allowed ratio of two quantities of a scene. The ratio is a little below ``ORDINARY**2``: units are powers of
#: two, so a change of units can't bring the quantities exactly into the middle of the range.
SPAN = 2.0**396

#: Largest number of steps or frames of a run. A larger number is most likely due to a wrong unit.
MOST_STEPS = 2**32

#: Default limit on the number of engine steps that `carom advise` takes to find a step size. For an error of 1
#: degree, an engine that checks for overlap once per step needs 240,000 steps in `paper/missed`, and 430,000 steps in
#: the scene of docs/how-to/which-step.md.
ADVICE_STEPS = 600_000

#: Largest numbers of discs and walls in a scene file. A file with 100,000 discs loads in seconds and takes less than
#: 500 MB of memory.
MOST_DISCS = 100_000
MOST_WALLS = 1_000

#: Largest number of legs of a driven body. A leg is a part of the body's motion with constant velocity. To predict an
#: impact, PIC examines every leg that begins before the impact.
MOST_LEGS = 10_000
#: Largest number of discs in one picture. A picture with more discs would be unreadable and take megabytes.
MOST_DISCS_DRAWN = 64
#: Largest numbers of bytes and of values in a file, by the ending of the file's name. `count_values` counts the values,
#: and each value takes up to 100 bytes of memory. In TOML, each line also counts as a value. Even the largest scene is
#: within the limits of JSON. TOML has lower limits, because TOML takes ten times as long to read. A .jsonl file
#: contains results, and each of its lines must also meet the limits of JSON. A .jsonl file of 1e5 lines has 310 MB and
#: half as many values as allowed.
MOST_BYTES = {".json": 40 * 2**20, ".toml": 16 * 2**20, ".jsonl": 512 * 2**20}
MOST_VALUES = {".json": 2**21, ".toml": 2**19, ".jsonl": 2**25}
#: Largest number of parts of a dotted key in TOML. The time to read a key grows with the square of this number. Keys of
#: scenes have only one part.
MOST_KEY_PARTS = 4

#: Limits of options. Each limit is twenty times what the largest machines can use, or causes at most an hour of work.
MOST_JOBS = 1024
MOST_PHASES = 1024
MOST_ROUNDS = 1024
#: Largest number of step sizes in a series. In a longer series, neighbouring step sizes would have nearly equal errors.
MOST_SERIES = 256
#: Default time limit of an engine, in seconds. An engine that exceeds the limit is terminated.
DEFAULT_TIME_LIMIT_S = 60.0
#: Time limit of a certified run (a run with proven error bounds), in seconds. In this time, a run computes a few
#: thousand impacts of dozens of discs.
CERTIFY_SECONDS = 10.0
#: Longest time limit or time budget, in seconds: four months. No system can wait for 1e10 seconds.
LONGEST_S = 1e7
#: Largest memory limit of a worker, in megabytes. No machine has so much memory, and every system accepts this number.
MOST_MB = 1e9


def format_limits(lower: float, upper: float) -> str:
    """Return the part of a message that states the limits of a number."""
    if lower > 0.0:
        span = f"between {format_number(lower, 3)} and {format_number(upper, 3)}"
    else:
        span = f"at most {format_number(upper, 3)} in magnitude"
    return f"must be {span} (measure in other units)"


def require_within(name: str, array: NDArray[np.float64], lower: float, upper: float) -> None:
    """Raise an error if an array contains a value that is not finite, or whose magnitude is not between two limits.

    Raises:
        InputError: The message names the argument, the first such value, and the limits.
    """
    size = abs(array)
    wrong = ~((size <= upper) & (size >= lower))
    if wrong.any():
        value = array[wrong].flat[0]
        requirement = format_limits(lower, upper) if math.isfinite(value) else "must be finite"
        raise InputError(f"{name} {requirement}, got {value}")


def count_values(data: bytes) -> int:
    """Return an upper bound of the number of values in a JSON text, without parsing it."""
    return 1 + data.count(b",") + data.count(b"[") + data.count(b"{")
