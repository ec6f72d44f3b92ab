from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

def fill_first_impacts(
    first: Sequence[NDArray[np.float64]],
    second: Sequence[NDArray[np.float64]],
    restitution: float,
    until: float,
    frames: NDArray[np.float64] | None,
    impacts: Sequence[NDArray[np.float64]],
) -> None: ...
