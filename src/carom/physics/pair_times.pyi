import numpy as np
from numpy.typing import NDArray

def fill_pair_times(columns: NDArray[np.float64], times: NDArray[np.float64]) -> None: ...
