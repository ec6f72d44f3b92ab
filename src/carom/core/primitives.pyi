from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from typing_extensions import disjoint_base

from carom.physics.double_double import Pair

def fill_pair_times(
    p1: NDArray[np.float64],
    v1: NDArray[np.float64],
    r1: NDArray[np.float64],
    p2: NDArray[np.float64],
    v2: NDArray[np.float64],
    r2: NDArray[np.float64],
    times: NDArray[np.float64],
) -> None: ...

@disjoint_base
class Features:
    def __new__(cls, rows: Sequence[Sequence[float]]) -> Features: ...
    def first_time(self, x: Pair, y: Pair, ux: Pair, uy: Pair, radius: float, last: int) -> tuple[float, int, bool]: ...
