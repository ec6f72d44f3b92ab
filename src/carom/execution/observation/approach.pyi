import numpy as np
from numpy.typing import NDArray

def compute_pair_time(
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    reach: NDArray[np.float64],
    first: NDArray[np.intp],
    second: NDArray[np.intp],
) -> float: ...
def compute_wall_time(
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    reach: NDArray[np.float64],
    walls: NDArray[np.float64],
) -> float: ...
