"""First impacts of many scenes of two discs and no wall, scene by scene: what runs without the compiled extension."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.disc_arrays import DiscArrays
from carom.extension import Patience
from carom.solvers.plain.bodies import Bodies
from carom.trace import IMPACT_DTYPE, impact_array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["fill_first_impacts"]


def fill_first_impacts(
    first: Sequence[Array],
    second: Sequence[Array],
    restitution: float,
    until: float,
    frames: Array | None,
    rows: Array,
) -> None:
    """Write the first impact of each scene; arguments as in `carom.solvers.two_discs.fill_first_impacts`."""
    patience = Patience()
    impacts = rows.view(IMPACT_DTYPE)[:, 0]
    for k in range(len(impacts)):
        position, velocity, radius, mass = (np.array([a[k], b[k]]) for a, b in zip(first, second, strict=True))
        pair = {"position_m": position, "velocity_m_s": velocity, "radius_m": radius, "mass_kg": mass}
        bodies = Bodies(DiscArrays.of_valid(**pair, walls=(), restitution=restitution, wall_restitution=1.0))
        time = bodies.pair_impact_time(0, 1) if frames is None else _first_overlap(bodies, frames.tolist())
        if time <= until and time < math.inf:
            impacts[k] = impact_array([bodies.collide(0, 1, time)])[0]
        else:
            impacts[k] = (math.inf, 0, 1, math.nan, *velocity, *velocity)
        patience.look()


def _first_overlap(bodies: Bodies, frames: list[float]) -> float:
    """Return the instant of the first frame at which both discs approach and touch or overlap; infinity for none."""
    for instant in frames:
        bodies.move_to(0, instant)
        bodies.move_to(1, instant)
        if bodies.pair_approaches_and_overlaps(0, 1):
            return instant
    return math.inf
