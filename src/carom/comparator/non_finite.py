"""Search for NaN and infinite numbers in a trace. A comparison would overlook NaN, because `max` ignores it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from carom.comparator.thresholds import THRESHOLDS
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE, Trace, velocities

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


def find_non_finite(trace: Trace) -> str:
    """Describe the first number of a trace that is NaN or infinite; return an empty string if all are finite.

    NaN is allowed in two places. If the state before an impact is unknown, all its positions are NaN. The effective
    time of an impact, at which the paths before and after it meet, is NaN if the state before it is unknown or no path
    changed.
    """
    impacts, effective, samples = trace.impacts, trace.effective_time_s, trace.samples
    unknown = np.zeros(len(impacts), dtype=np.bool_)
    numbers: dict[str, NDArray[np.float64]] = {}
    if not find_finite_impacts(trace).all():
        numbers |= {f"{name} of impact": impacts[name] for name in _NUMBERS}
        if trace.spins is not None:
            numbers |= {f"spin {name} of impact": trace.spins[name] for name in _SPINS}
    if trace.state_before is not None:
        state = trace.state_before.copy()
        places = np.concatenate([state["position_first"], state["position_second"]], axis=1)
        unknown = np.isnan(places).all(axis=1) & ~np.isinf(state["time_s"])
        state[unknown] = 0.0
        numbers |= {f"{name} of the state before impact": state[name] for name in state.dtype.names or ()}
    if effective is not None and not np.isfinite(effective).all():
        changed = find_turned_impacts(velocities(impacts, "before"), velocities(impacts, "after"), trace.float_bits)
        is_allowed = np.isnan(effective) & (unknown | ~changed)
        numbers["effective_time_s of impact"] = np.where(is_allowed, 0.0, effective)
    numbers |= {f"{name} of disc": getattr(trace, name) for name in ("final_position_m", "final_velocity_m_s")}
    if trace.final_spin_rad_s is not None:
        numbers["final_spin_rad_s of disc"] = trace.final_spin_rad_s
    if samples is not None:
        numbers |= {"time_s of sample": samples.time_s, "position_m of sample": samples.position_m}
    for name, array in numbers.items():
        if not np.isfinite(array).all():
            row = int(np.argwhere(~np.isfinite(array))[0, 0])
            return f"{name} {row} is {', '.join(f'{value:g}' for value in np.ravel(array[row])[:2].tolist())}"
    for name in ("end_time_s", "dt_s"):
        if not math.isfinite(getattr(trace, name)):
            return f"{name} is {getattr(trace, name)}"
    return ""
