"""Numbers of a trace that are NaN or infinite: no comparison with them means anything, and `max` passes over them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from carom.trace import IMPACT_DTYPE, Trace

__all__ = ["finite_impacts", "not_finite"]

_NUMBERS = tuple(name for name in IMPACT_DTYPE.names or () if IMPACT_DTYPE[name].base.kind == "f")


def finite_impacts(trace: Trace) -> NDArray[np.bool_]:
    """Return for each impact whether all of its own numbers are finite, shape ``(m,)``."""
    sound = np.ones(len(trace.impacts), dtype=np.bool_)
    for name in _NUMBERS:
        sound &= _rows(trace.impacts[name])
    return sound


def not_finite(trace: Trace) -> str:
    """Return which number of a trace is NaN or infinite, the first of them, as a clause; empty where there is none.

    NaN has a meaning in two places. The state before an impact is not known where its positions are NaN, all of them.
    The effective time is not known where that state is not, or where the impact changed no velocity.
    """
    return next(_broken(trace), "")


def _broken(trace: Trace) -> Iterator[str]:
    impacts, state, effective = trace.impacts, trace.state_before, trace.effective_time_s
    for name in _NUMBERS:
        yield from _named(f"{name} of impact", impacts[name], _rows(impacts[name]))
    known = np.ones(len(impacts), dtype=np.bool_)
    if state is not None:
        places = np.concatenate([state["position_first"], state["position_second"]], axis=1)
        unknown = np.isnan(places).all(axis=1) & ~np.isinf(state["time_s"])
        known = ~unknown
        for name in state.dtype.names or ():
            yield from _named(f"{name} of the state before impact", state[name], _rows(state[name]) | unknown)
    if effective is not None:
        changed = np.zeros(len(impacts), dtype=np.bool_)
        for body in ("first", "second"):
            changed |= np.any(impacts[f"velocity_{body}_before"] != impacts[f"velocity_{body}_after"], axis=1)
        sound = np.isfinite(effective) | (np.isnan(effective) & ~(known & changed))
        yield from _named("effective_time_s of impact", effective, sound)
    for name, values in (
        ("final_position_m of disc", trace.final_position_m),
        ("final_velocity_m_s of disc", trace.final_velocity_m_s),
    ):
        yield from _named(name, values, _rows(values))
    for name, value in (("end_time_s", trace.end_time_s), ("dt_s", trace.dt_s)):
        if not np.isfinite(value):
            yield f"{name} is {value}"
    if trace.samples is not None:
        yield from _named("time_s of sample", trace.samples.time_s, _rows(trace.samples.time_s))
        yield from _named("position_m of sample", trace.samples.position_m, _rows(trace.samples.position_m))


def _rows(values: ArrayLike) -> NDArray[np.bool_]:
    """Return for each row of an array whether it is finite."""
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(np.isfinite(array).all(axis=tuple(range(1, array.ndim))), dtype=np.bool_)


def _named(what: str, values: ArrayLike, sound: NDArray[np.bool_]) -> Iterator[str]:
    for row in np.flatnonzero(~sound)[:1].tolist():
        shown = ", ".join(f"{value:g}" for value in np.ravel(np.asarray(values)[row])[:2].tolist())
        yield f"{what} {row} is {shown}"
