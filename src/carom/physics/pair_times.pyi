import numpy as np
from numpy.typing import NDArray

def fill_pair_times(
    p1: NDArray[np.float64],
    v1: NDArray[np.float64],
    r1: NDArray[np.float64],
    p2: NDArray[np.float64],
    v2: NDArray[np.float64],
    r2: NDArray[np.float64],
    times: NDArray[np.float64],
) -> None: ...
