import numpy as np
from numpy.typing import NDArray

class Search:
    def __init__(
        self, position: NDArray[np.float64], reach: NDArray[np.float64], movable: NDArray[np.bool_]
    ) -> None: ...
    def pairs(self, begin: int) -> tuple[NDArray[np.intp], NDArray[np.intp], int]: ...
