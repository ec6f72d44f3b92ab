from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from typing_extensions import disjoint_base

from carom.core.wall_features import Mover
from carom.model.disc_arrays import HalfPlane

_Array = NDArray[np.float64]

def fill_pair_times(p1: _Array, v1: _Array, r1: _Array, p2: _Array, v2: _Array, r2: _Array, times: _Array) -> None: ...
def pair_time(
    x1: float, y1: float, vx1: float, vy1: float, r1: float, x2: float, y2: float, vx2: float, vy2: float, r2: float
) -> float: ...
def wall_time(x: float, y: float, vx: float, vy: float, radius: float, wall: HalfPlane) -> float: ...
def wall_fall_time(
    x: float, y: float, vx: float, vy: float, radius: float, wall: HalfPlane, ax: float, ay: float
) -> float: ...
def disc_fall_time(
    x: float,
    y: float,
    vx: float,
    vy: float,
    radius: float,
    fixed_x: float,
    fixed_y: float,
    fixed_radius: float,
    ax: float,
    ay: float,
    leaving: float | None = None,
) -> float: ...

@disjoint_base
class WallFeatures:
    def __new__(cls, rows: Sequence[Sequence[float]]) -> WallFeatures: ...
    def first_touch(self, disc: Mover, last: int) -> tuple[float, int, bool]: ...
    def first_fall(self, disc: Mover, ax: float, ay: float, last: int, leaving: float) -> tuple[float, int]: ...
    def normal(self, number: int, disc: Mover) -> tuple[float, float]: ...
    def gap(self, number: int, disc: Mover) -> float: ...
    def overlap_start(self, number: int, disc: Mover) -> float: ...

def two_diff(a: float, b: float) -> tuple[float, float]: ...
def normal_impulse(dx: float, dy: float, ux: float, uy: float, inverse_masses: float, restitution: float) -> float: ...
def tangential_impulse(
    friction: float, restitution: float, slip: float, inverse_effective_mass: float, pressed: float
) -> float: ...
def pair_tangential_impulse(
    friction: float,
    restitution: float,
    dx: float,
    dy: float,
    ux: float,
    uy: float,
    surface: float,
    inverse_effective_mass: float,
    normal: float,
) -> float: ...
def frictional_impulses(
    friction: float,
    restitution: float,
    rolling_resistance: float,
    slip: float,
    rim: float,
    inverse_inertia_ratio: float,
    pressed: float,
) -> tuple[float, float, bool]: ...
