"""Ensembles: a million independent scenes of two discs through PIC and PIT, as arrays.

Scene by scene the result is that of `carom.solve_pic` and `carom.solve_pit`, to the bit: the same operations in the
same order.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.cores import available_cores
from carom.errors import InputError
from carom.extension import extension_available

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["FirstImpacts", "TwoDiscEnsemble", "pic_ensemble", "pit_ensemble"]

#: Scenes that a thread takes at a time: a millisecond of work, many times what handing them over costs.
_PART = 16_384


@dataclass(frozen=True)
class TwoDiscEnsemble:
    """Independent scenes of two discs and no wall. Scalars broadcast.

    Attributes:
        position_first: Centres of the first discs, metres, shape ``(n, 2)``; likewise `position_second`.
        velocity_first: Velocities of the first discs, metres a second, shape ``(n, 2)``; likewise `velocity_second`.
        radius_first: Radii of the first discs, metres, shape ``(n,)``; likewise `radius_second`.
        mass_first: Masses of the first discs, kilograms, infinity for immovable; likewise `mass_second`.
        restitution: Coefficient of restitution of all.
    """

    position_first: Array
    velocity_first: Array
    radius_first: Array
    position_second: Array
    velocity_second: Array
    radius_second: Array
    mass_first: Array
    mass_second: Array
    restitution: float = 1.0

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
        """Return an ensemble of whatever broadcasts to it; arguments as the attributes.

        Raises:
            InputError: The shapes do not fit, or a value is outside its range.
        """
        vectors = [np.asarray(v, dtype=np.float64) for v in (position_first, velocity_first)]
        vectors += [np.asarray(v, dtype=np.float64) for v in (position_second, velocity_second)]
        scalars = [np.asarray(s, dtype=np.float64) for s in (radius_first, radius_second, mass_first, mass_second)]
        if any(v.ndim == 0 or v.shape[-1] != 2 for v in vectors):
            raise InputError("positions and velocities must have x and y along their last axis")
        try:
            shape = np.broadcast_shapes(*(v.shape[:-1] for v in vectors), *(s.shape for s in scalars))
        except ValueError as error:
            raise InputError(f"the shapes of the ensemble do not broadcast: {error}") from None
        if len(shape) != 1:
            raise InputError(f"an ensemble is a list of scenes: its shape must be (n,), got {shape}")
        if not all(np.all(np.isfinite(v)) for v in (*vectors, *scalars[:2])):
            raise InputError("positions, velocities and radii must be finite everywhere")
        if not all(np.all(s > 0) for s in scalars):
            raise InputError("radii and masses must be above 0 everywhere")
        if np.any(np.isinf(scalars[2]) & np.isinf(scalars[3])):
            raise InputError("mass_first and mass_second must not both be infinite: two immovable discs never collide")
        if not 0 <= restitution <= 1:
            raise InputError(f"restitution must lie in 0 to 1, got {restitution}")
        p1, v1, p2, v2 = (np.broadcast_to(v, (*shape, 2)) for v in vectors)
        r1, r2, m1, m2 = (np.broadcast_to(s, shape) for s in scalars)
        for name, mass, velocity in (("first", m1, v1), ("second", m2, v2)):
            if np.any(velocity[np.isinf(mass)]):
                raise InputError(f"velocity_{name} must be (0, 0) for an immovable disc")
        return cls(p1, v1, r1, p2, v2, r2, m1, m2, restitution)

    def __len__(self) -> int:
        return len(self.radius_first)


@dataclass(frozen=True)
class FirstImpacts:
    """The first impact of each scene of an ensemble; NaN beside the time where there is none.

    Attributes:
        time_s: Seconds from the start, shape ``(n,)``; infinity where there is none.
        normal: Unit vectors from first to second, shape ``(n, 2)``.
        velocity_first: Velocities of the first discs after it, shape ``(n, 2)``; as at the start without impact.
        velocity_second: Velocities of the second discs after it.
    """

    time_s: Array
    normal: Array
    velocity_first: Array
    velocity_second: Array


def pic_ensemble(
    ensemble: TwoDiscEnsemble, duration_s: float = math.inf, *, threads: int | None = None
) -> FirstImpacts:
    """Return the first impact of each scene by PIC.

    Args:
        ensemble: The scenes.
        duration_s: Impacts after it do not count, seconds.
        threads: How many cores to use; all that this process may use by default. Without the compiled extension, one.

    Raises:
        InputError: There are fewer than 1 thread.
    """
    return _first_impacts(ensemble, duration_s, None, threads)


def pit_ensemble(
    ensemble: TwoDiscEnsemble, frame_rate_hz: float, frames: int, *, threads: int | None = None
) -> FirstImpacts:
    """Return the first impact of each scene by PIT.

    Args:
        ensemble: The scenes.
        frame_rate_hz: Frames a second.
        frames: How many frames are looked at, at ``k / frame_rate_hz`` from k = 0 on.
        threads: As in `pic_ensemble`.

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
) -> FirstImpacts:
    """Return the first impact of each scene: by PIT where there are frames."""
    if threads is not None and threads < 1:
        raise InputError(f"threads must be 1 or more, got {threads}")
    n, e = len(ensemble), ensemble
    found = FirstImpacts(np.empty(n), np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2)))
    if extension_available():
        from carom.solvers import first_impacts as compiled

        fill_first_impacts = compiled.fill_first_impacts
    else:
        from carom.solvers.plain.first_impacts import fill_first_impacts

    def fill(part: slice) -> None:
        fill_first_impacts(
            [a[part] for a in (e.position_first, e.velocity_first, e.radius_first, e.mass_first)],
            [a[part] for a in (e.position_second, e.velocity_second, e.radius_second, e.mass_second)],
            e.restitution,
            until_s,
            frames_s,
            [a[part] for a in (found.time_s, found.normal, found.velocity_first, found.velocity_second)],
        )

    parts = [slice(start, start + _PART) for start in range(0, n, _PART)]
    with ThreadPoolExecutor(threads or available_cores()) as pool:  # the compiled loop releases the GIL
        list(pool.map(fill, parts))
    return found
