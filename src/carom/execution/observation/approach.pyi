import numpy as np
from numpy.typing import NDArray

def has_moved_straight(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    velocity: NDArray[np.float64],
    step_s: float,
    end_s: float,
    roundings: float,
) -> bool: ...
def are_overlapping(
    position: NDArray[np.float64],
    radius: NDArray[np.float64],
    first: NDArray[np.intp],
    second: NDArray[np.intp],
) -> bool: ...
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
