"""Search for NaN and infinite numbers in a trace. A comparison would overlook NaN, because `max` ignores it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE, Trace, Vector, velocities

_NUMBERS = tuple(name for name in IMPACT_DTYPE.names or () if IMPACT_DTYPE[name].base.kind == "f")
_SPINS = SPIN_DTYPE.names or ()

#: Memory layouts of `IMPACT_DTYPE` and `SPIN_DTYPE` in which neighbouring floats form one field. NumPy tests each
#: joined field in one call.
_JOINED_NUMBERS = np.dtype([("time_s", "f8"), ("bodies", "i8", 2), ("others", "f8", 10)])
_JOINED_SPINS = np.dtype([("spins", "f8", 4)])


def find_finite_impacts(trace: Trace) -> NDArray[np.bool_]:
    """Return whether all numbers of each impact are finite, shape ``(m,)``."""
    numbers = trace.impacts.view(_JOINED_NUMBERS)
    finite: NDArray[np.bool_] = np.isfinite(numbers["time_s"]) & np.isfinite(numbers["others"]).all(axis=1)
    if trace.spins is not None:
        finite &= np.isfinite(trace.spins.view(_JOINED_SPINS)["spins"]).all(axis=1)
    return finite


def find_turned_impacts(before: NDArray[np.float64], after: NDArray[np.float64], float_bits: int) -> NDArray[np.bool_]:
    """Return whether each impact changed a velocity by more than rounding, shape ``(m,)``.

    Args:
        before: Velocities of the two bodies before the impacts, shape ``(2, m, 2)``.
        after: Velocities of the two bodies after the impacts, shape ``(2, m, 2)``.
        float_bits: Width of the method's floats. Rounding errors of velocities are proportional to the pair's greatest
            speed.
    """
    greatest = np.max(np.linalg.norm([before, after], axis=-1), axis=(0, 1))
    change = np.max(np.linalg.norm(after - before, axis=-1), axis=0)
    found: NDArray[np.bool_] = ~(change <= THRESHOLDS.rounding_of(float_bits) * greatest)
    return found


def has_turned(before: tuple[Vector, Vector], after: tuple[Vector, Vector], float_bits: int) -> bool:
    """Whether one impact with finite velocities changed a velocity by more than rounding; see `find_turned_impacts`."""
    changes = [(ux - x, uy - y) for (x, y), (ux, uy) in zip(before, after, strict=True)]
    greatest, change = (max(math.sqrt(x * x + y * y) for x, y in one) for one in ((*before, *after), changes))
    return change > THRESHOLDS.rounding_of(float_bits) * greatest


def find_non_finite(trace: Trace) -> str:
    """Describe the first number of a trace that is NaN or infinite; return an empty string if all are finite.

    NaN is allowed in two places. If the state before an impact is unknown, all its positions are NaN. The effective
    time of an impact, at which the paths before and after it meet, is NaN if the state before it is unknown or no path
    changed.
    """
    return next(_iterate_non_finite(trace), "")


def _iterate_non_finite(trace: Trace) -> Iterator[str]:
    impacts, state, effective, samples = trace.impacts, trace.state_before, trace.effective_time_s, trace.samples
    if not find_finite_impacts(trace).all():
        for name in _NUMBERS:
            yield from _describe_first_non_finite(f"{name} of impact", impacts[name])
        if trace.spins is not None:
            for name in _SPINS:
                yield from _describe_first_non_finite(f"spin {name} of impact", trace.spins[name])
    unknown = np.zeros(len(impacts), dtype=np.bool_)
    if state is not None:
        places = np.concatenate([state["position_first"], state["position_second"]], axis=1)
        unknown = np.isnan(places).all(axis=1) & ~np.isinf(state["time_s"])
        for name in state.dtype.names or ():
            yield from _describe_first_non_finite(f"{name} of the state before impact", state[name], unknown)
    if effective is not None and not np.isfinite(effective).all():
        changed = find_turned_impacts(velocities(impacts, "before"), velocities(impacts, "after"), trace.float_bits)
        yield from _describe_first_non_finite(
            "effective_time_s of impact", effective, np.isnan(effective) & (unknown | ~changed)
        )
    yield from _describe_first_non_finite("final_position_m of disc", trace.final_position_m)
    yield from _describe_first_non_finite("final_velocity_m_s of disc", trace.final_velocity_m_s)
    if trace.final_spin_rad_s is not None:
        yield from _describe_first_non_finite("final_spin_rad_s of disc", trace.final_spin_rad_s)
    for name in ("end_time_s", "dt_s"):
        if not math.isfinite(getattr(trace, name)):
            yield f"{name} is {getattr(trace, name)}"
    if samples is not None:
        yield from _describe_first_non_finite("time_s of sample", samples.time_s)
        yield from _describe_first_non_finite("position_m of sample", samples.position_m)


def _find_finite_rows(values: ArrayLike) -> NDArray[np.bool_]:
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(np.isfinite(array).all(axis=tuple(range(1, array.ndim))), dtype=np.bool_)


def _describe_first_non_finite(
    row_name: str, values: ArrayLike, allowed: NDArray[np.bool_] | bool = False
) -> Iterator[str]:
    """Yield a description of the first row that contains NaN or an infinity. Rows that `allowed` marks are skipped."""
    if np.isfinite(values).all():
        return
    for row in np.flatnonzero(~(_find_finite_rows(values) | allowed))[:1].tolist():
        numbers_text = ", ".join(f"{value:g}" for value in np.ravel(np.asarray(values)[row])[:2].tolist())
        yield f"{row_name} {row} is {numbers_text}"
