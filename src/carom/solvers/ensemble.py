"""Ensembles: a million independent scenes of two discs and no wall through PIC and PIT, as arrays.

Scene by scene the result is that of `carom.solve_pic` and `carom.solve_pit`, to the bit.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.cores import available_cores
from carom.disc_arrays import DiscArrays
from carom.errors import InputError
from carom.extension import extension_available
from carom.trace import IMPACT_DTYPE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["TwoDiscEnsemble", "pic_ensemble", "pit_ensemble"]

#: Scenes that a thread takes at a time: a millisecond of work, many times what handing them over costs.
_PART = 16_384


@dataclass(frozen=True)
class TwoDiscEnsemble:
    """Independent scenes of two discs: row k of both sets of discs is scene k. Both have the same restitution."""

    first: DiscArrays
    second: DiscArrays

    @classmethod
    def of(
        cls,
        position_first: ArrayLike,
        velocity_first: ArrayLike,
        radius_first: ArrayLike,
        position_second: ArrayLike,
        velocity_second: ArrayLike,
        radius_second: ArrayLike,
        mass_first: ArrayLike = 1.0,
        mass_second: ArrayLike = 1.0,
        restitution: float = 1.0,
    ) -> TwoDiscEnsemble:
        """Return an ensemble of whatever broadcasts to it; units and shapes as in `DiscArrays`.

        Raises:
            InputError: The shapes do not fit, or a value is outside its range.
        """
        vectors = [
            np.asarray(v, np.float64) for v in (position_first, velocity_first, position_second, velocity_second)
        ]
        scalars = [np.asarray(s, np.float64) for s in (radius_first, mass_first, radius_second, mass_second)]
        if any(v.ndim == 0 or v.shape[-1] != 2 for v in vectors):
            raise InputError("positions and velocities must have x and y along their last axis")
        try:
            shape = np.broadcast_shapes(*(v.shape[:-1] for v in vectors), *(s.shape for s in scalars))
        except ValueError as error:
            raise InputError(f"the shapes of the ensemble do not broadcast: {error}") from None
        if len(shape) != 1:
            raise InputError(f"an ensemble is a list of scenes: its shape must be (n,), got {shape}")
        discs = []
        for k, name in ((0, "first"), (2, "second")):
            place, velocity = (np.broadcast_to(v, (*shape, 2)) for v in vectors[k : k + 2])
            radius, mass = (np.broadcast_to(s, shape) for s in scalars[k : k + 2])
            try:
                discs.append(DiscArrays(place, velocity, radius, mass, restitution=restitution))
            except InputError as error:
                raise InputError(f"the {name} discs: {error}") from None
        if np.any(~discs[0].movable & ~discs[1].movable):
            raise InputError("mass_first and mass_second must not both be infinite: two immovable discs never collide")
        return cls(*discs)

    def __post_init__(self) -> None:
        """Refuse friction and spin.

        Raises:
            InputError: Discs have either.
        """
        if self.first.turns or self.second.turns or self.first.friction or self.second.friction:
            raise InputError(
                "an ensemble has neither friction nor spin, since its rows hold no spins: "
                "solve its scenes with carom.solve_pic"
            )

    def __len__(self) -> int:
        return len(self.first)


def pic_ensemble(
    ensemble: TwoDiscEnsemble, duration_s: float = math.inf, *, threads: int | None = None
) -> NDArray[np.void]:
    """Return the first impact of each scene by PIC.

    Args:
        ensemble: The scenes.
        duration_s: Impacts after it do not count, seconds.
        threads: How many cores to use; all that this process may use by default. Without the compiled extension, one.

    Returns:
        Rows of `carom.trace.IMPACT_DTYPE`, one a scene. Where there is no impact the time is infinity, the normal NaN.

    Raises:
        InputError: There are fewer than 1 thread.
    """
    return _first_impacts(ensemble, duration_s, None, threads)


def pit_ensemble(
    ensemble: TwoDiscEnsemble, frame_rate_hz: float, frames: int, *, threads: int | None = None
) -> NDArray[np.void]:
    """Return the first impact of each scene by PIT.

    Args:
        ensemble: The scenes.
        frame_rate_hz: Frames a second.
        frames: How many frames are looked at, at ``k / frame_rate_hz`` from k = 0 on.
        threads: As in `pic_ensemble`.

    Returns:
        As `pic_ensemble`.

    Raises:
        InputError: The rate is not positive, the number of frames negative, or there are fewer than 1 thread.
    """
    if not 0 < frame_rate_hz < math.inf:
        raise InputError(f"frame_rate_hz must be a positive number, got {frame_rate_hz}")
    if frames < 0:
        raise InputError(f"frames must be 0 or more, got {frames}")
    return _first_impacts(ensemble, math.inf, np.arange(frames) / frame_rate_hz, threads)


def _first_impacts(
    ensemble: TwoDiscEnsemble, until_s: float, frames_s: Array | None, threads: int | None
) -> NDArray[np.void]:
    """Return the first impact of each scene: by PIT where there are frames."""
    if threads is not None and threads < 1:
        raise InputError(f"threads must be 1 or more, got {threads}")
    if extension_available():
        from carom.solvers import two_discs

        fill_first_impacts = two_discs.fill_first_impacts
    else:
        from carom.solvers.plain.first_impacts import fill_first_impacts
    impacts = np.empty(len(ensemble), IMPACT_DTYPE)
    rows = impacts.view(np.float64).reshape(len(ensemble), -1)

    def fill(part: slice) -> None:
        first, second = (
            [array[part] for array in (discs.position_m, discs.velocity_m_s, discs.radius_m, discs.mass_kg)]
            for discs in (ensemble.first, ensemble.second)
        )
        fill_first_impacts(first, second, ensemble.first.restitution, until_s, frames_s, rows[part])

    parts = [slice(start, start + _PART) for start in range(0, len(ensemble), _PART)]
    with ThreadPoolExecutor(threads or available_cores()) as pool:  # the compiled loop releases the GIL
        list(pool.map(fill, parts))
    return impacts
