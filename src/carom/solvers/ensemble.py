"""Ensembles: a million independent scenes of two discs through PIC and PIT, as arrays.

Scene by scene the result is that of `carom.solve_pic` and `carom.solve_pit`, to the bit: the same operations in the
same order, each on the whole array.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.physics.time_of_impact import time_of_impact

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

__all__ = ["FirstImpacts", "TwoDiscEnsemble", "pic_ensemble", "pit_ensemble"]

#: Scenes taken through all frames at a time: the arrays of one part stay in the second-level cache. Chosen, not tuned.
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


def pic_ensemble(ensemble: TwoDiscEnsemble, duration_s: float = math.inf) -> FirstImpacts:
    """Return the first impact of each scene by PIC.

    Args:
        ensemble: The scenes.
        duration_s: Impacts after it do not count, seconds.
    """
    e = ensemble
    time = np.asarray(
        time_of_impact(
            e.position_first, e.velocity_first, e.radius_first, e.position_second, e.velocity_second, e.radius_second
        )
    ).astype(np.float64)
    time[time > duration_s] = math.inf
    result = _no_impacts(ensemble)
    rows = np.flatnonzero(np.isfinite(time))
    wait = time[rows, None]
    first = np.where(np.isinf(e.mass_first[rows, None]), 0.0, wait)  # an immovable disc is not moved at all
    second = np.where(np.isinf(e.mass_second[rows, None]), 0.0, wait)
    p1 = e.position_first[rows] + e.velocity_first[rows] * first
    p2 = e.position_second[rows] + e.velocity_second[rows] * second
    _collide(ensemble, result, rows, p1, p2, e.velocity_first[rows], e.velocity_second[rows])
    result.time_s[rows] = time[rows]
    return result


def pit_ensemble(ensemble: TwoDiscEnsemble, frame_rate_hz: float, frames: int) -> FirstImpacts:
    """Return the first impact of each scene by PIT.

    Args:
        ensemble: The scenes.
        frame_rate_hz: Frames a second.
        frames: How many frames are looked at, at ``k / frame_rate_hz`` from k = 0 on.

    Raises:
        InputError: The rate is not positive, or the number of frames negative.
    """
    if not 0 < frame_rate_hz < math.inf:
        raise InputError(f"frame_rate_hz must be a positive number, got {frame_rate_hz}")
    if frames < 0:
        raise InputError(f"frames must be 0 or more, got {frames}")
    times = [k / frame_rate_hz for k in range(frames)]
    result = _no_impacts(ensemble)
    for rows in _parts(len(ensemble)):
        _frames(ensemble, result, rows, times)
    return result


def _parts(count: int) -> Iterator[NDArray[np.intp]]:
    for start in range(0, count, _PART):
        yield np.arange(start, min(start + _PART, count))


def _no_impacts(e: TwoDiscEnsemble) -> FirstImpacts:
    return FirstImpacts(
        np.full(len(e), math.inf), np.full((len(e), 2), math.nan), e.velocity_first.copy(), e.velocity_second.copy()
    )


def _frames(e: TwoDiscEnsemble, result: FirstImpacts, rows: NDArray[np.intp], times: list[float]) -> None:
    """Take some scenes from frame to frame; each leaves when it has collided, or can no more."""
    p1, p2 = e.position_first[rows], e.position_second[rows]
    v1, v2 = e.velocity_first[rows], e.velocity_second[rows]
    reach = e.radius_first[rows] + e.radius_second[rows]
    for frame, time in enumerate(times):
        d, u = p2 - p1, v2 - v1
        approaching = d[:, 0] * u[:, 0] + d[:, 1] * u[:, 1] < 0.0
        distance = np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1])
        hit = approaching & (distance <= reach)
        if hit.any():
            _collide(e, result, rows[hit], p1[hit], p2[hit], v1[hit], v2[hit])
            result.time_s[rows[hit]] = time
        # Rounding alone could turn a pair that separates at the closest point into one that approaches: it is kept
        # until it has plainly passed.
        passed = d[:, 0] * u[:, 0] + d[:, 1] * u[:, 1] > 2.0**-20 * distance * np.hypot(u[:, 0], u[:, 1])
        going = ~(hit | passed)
        if frame + 1 == len(times) or not going.any():
            return
        if not going.all():
            rows = rows[going]
            p1, p2, v1, v2, reach = (a[going] for a in (p1, p2, v1, v2, reach))
        step = times[frame + 1] - time
        p1, p2 = p1 + v1 * step, p2 + v2 * step


def _collide(
    e: TwoDiscEnsemble, result: FirstImpacts, rows: NDArray[np.intp], p1: Array, p2: Array, v1: Array, v2: Array
) -> None:
    """Give scenes their velocities after the impact: `Bodies.collide_pair` and `pair_push`, operation by operation."""
    dx, dy = p2[:, 0] - p1[:, 0], p2[:, 1] - p1[:, 1]
    ux, uy = v2[:, 0] - v1[:, 0], v2[:, 1] - v1[:, 1]
    w1, w2 = 1.0 / e.mass_first[rows], 1.0 / e.mass_second[rows]
    along = dx * ux + dy * uy
    push = np.where(along < 0.0, (1.0 + e.restitution) * along / ((dx * dx + dy * dy) * (w1 + w2)), 0.0)
    distance = np.sqrt(dx * dx + dy * dy)
    for axis, d in enumerate((dx, dy)):
        result.normal[rows, axis] = d / distance
        result.velocity_first[rows, axis] = v1[:, axis] + push * w1 * d
        result.velocity_second[rows, axis] = v2[:, axis] - push * w2 * d
