from collections.abc import Callable, Mapping
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Buffer

DISC_DTYPE: Final[np.dtype[np.void]]
TO_AND_FRO_DTYPE: Final[np.dtype[np.void]]

@final
class Kernel:
    def __new__(
        cls,
        position: NDArray[np.float64],
        velocity: NDArray[np.float64],
        radius: NDArray[np.float64],
        inverse_mass: NDArray[np.float64],
        turning: NDArray[np.float64],
        walls: NDArray[np.float64],
        features: NDArray[np.float64],
        materials: NDArray[np.float64],
        driven: NDArray[np.float64],
        legs: NDArray[np.float64],
        decides: Callable[[int, int, bool], bool] | None,
        crushes: Callable[[int], bool] | None,
        locates: bool,
        law: tuple[float, float, float, float, float, float, float],
        standstill: int,
        cell_factor: float = 1.0,
    ) -> Kernel: ...
    def run(self, until: float, impacts: int, events: int) -> int: ...
    def record(self, begin: float, end: float) -> None: ...
    def take_impacts(self) -> tuple[Buffer, Buffer | None, Buffer | None]: ...
    def ambiguous(self) -> tuple[int, ...]: ...
    def state(self) -> dict[str, Any]: ...
    def resume(self, state: Mapping[str, Any]) -> None: ...
    @property
    def recorded(self) -> int: ...
    @property
    def spins(self) -> NDArray[np.float64] | None: ...
    @property
    def discs(self) -> NDArray[np.void]: ...
    @property
    def to_and_fro(self) -> NDArray[np.void] | None: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def clock(self) -> dict[str, float]: ...
    @property
    def gliding(self) -> tuple[int, int]: ...
    @property
    def virial(self) -> float: ...
    @property
    def nbytes(self) -> int: ...
