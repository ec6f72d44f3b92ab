from typing import final

import numpy as np
from numpy.typing import NDArray

@final
class Search:
    def __new__(
        cls, position: NDArray[np.float64], reach: NDArray[np.float64], movable: NDArray[np.bool_]
    ) -> Search: ...
    def pairs(self, begin: int) -> tuple[NDArray[np.intp], NDArray[np.intp], int]: ...
