from collections.abc import Mapping
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from carom.trace import IMPACT_DTYPE as IMPACT_DTYPE

ENDINGS: Final[tuple[str, ...]]

@final
class Kernel:
    def __new__(
        cls,
        position: NDArray[np.float64],
        velocity: NDArray[np.float64],
        radius: NDArray[np.float64],
        inverse_mass: NDArray[np.float64],
        walls: NDArray[np.float64],
        law: tuple[float, float, float],
        standstill: int,
        cell_factor: float = 1.0,
    ) -> Kernel: ...
    def run(self, until: float, impacts: int, events: int) -> int: ...
    def record(self, begin: float, end: float) -> None: ...
    def take_impacts(self) -> NDArray[np.void]: ...
    def ambiguous(self) -> tuple[int, ...]: ...
    def positions(self, time: float) -> NDArray[np.float64]: ...
    def velocities(self) -> NDArray[np.float64]: ...
    def resume(
        self,
        discs: NDArray[np.void],
        last_impact: NDArray[np.float64],
        recent: NDArray[np.float64],
        clock: Mapping[str, float],
        counts: Mapping[str, int],
        virial: float,
    ) -> None: ...
    @property
    def recorded(self) -> int: ...
    @property
    def discs(self) -> NDArray[np.void]: ...
    @property
    def last_impact(self) -> NDArray[np.float64]: ...
    @property
    def recent(self) -> NDArray[np.float64]: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def clock(self) -> dict[str, float]: ...
    @property
    def virial(self) -> float: ...
    @property
    def nbytes(self) -> int: ...
