from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carom.scene import Disc

def solve(first: Disc, second: Disc, restitution: float, end: float) -> tuple[bytes, bytes] | None: ...
def fill_first_impacts(
    first: Sequence[NDArray[np.float64]],
    second: Sequence[NDArray[np.float64]],
    restitution: float,
    until: float,
    frames: NDArray[np.float64] | None,
    rows: NDArray[np.float64],
) -> None: ...
