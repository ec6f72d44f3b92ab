"""Local error: each impact against the analytic answer from the method's own state before it.

Chaos ends the meaning of any comparison with the reference's trajectory. But the state that a method itself had just
before an impact is an exact input: two discs on straight lines, whose instant, normal and velocities after have closed
forms. So each impact of a run, however long, can be scored on its own.

What sampling alone would have made of the same state is a closed form, too: PIT collides the pair at the first step
boundary at or after contact, along the line of centres there. So the local error, too, is told apart into sampling and
solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from carom.comparator.finite import finite_impacts
from carom.comparator.scales import Scales
from carom.physics.impact_law import resolve_impact
from carom.physics.time_of_impact import time_of_impact
from carom.trace import STATE_DTYPE, Trace, free_flights

__all__ = ["LocalErrors", "local_errors", "own_states"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LocalErrors:
    """One entry an observed impact; NaN where its own state before is not known.

    Attributes:
        reported_time_s: Reported time less the analytic one, seconds.
        effective_time_s: Effective time less the analytic one; NaN where that is not known.
        velocity: Length of the velocity error after, the worse of the two bodies, over the scene's speed.
        along_normal: The same along the analytic normal.
        across_normal: The same across it.
        restitution: Effective coefficient of restitution along the analytic normal, less the scene's.
        energy: Kinetic energy gained against the analytic answer, over that at the start of the scene.
        sampling_velocity: What `velocity` would be for PIT from the same state at the same step; NaN where PIT would
            find no impact, or there are no steps.
        solver_velocity: Velocity error against that PIT, over the scene's speed.
        spurious: Impacts that, from the method's own state, do not happen at all.
    """

    reported_time_s: Array
    effective_time_s: Array
    velocity: Array
    along_normal: Array
    across_normal: Array
    restitution: Array
    energy: Array
    sampling_velocity: Array
    solver_velocity: Array
    spurious: tuple[int, ...]

    @cached_property
    def scored(self) -> int:
        """How many impacts could be scored."""
        return int(np.isfinite(self.velocity).sum())

    @cached_property
    def time_s(self) -> Array:
        """Error of the effective time where it is known, else of the reported one."""
        return np.where(np.isfinite(self.effective_time_s), self.effective_time_s, self.reported_time_s)

    def median(self, name: str) -> float:
        """Return the median of the magnitudes of one of the errors, by name; NaN where there are none."""
        values = np.abs(getattr(self, name))
        known = values[~np.isnan(values)]
        return float(np.median(known)) if len(known) else math.nan

    def worst(self, name: str) -> float:
        """Return the largest magnitude of one of the errors, by name; NaN where there are none."""
        values = np.abs(getattr(self, name))
        known = values[~np.isnan(values)]
        return float(np.max(known)) if len(known) else math.nan


def own_states(trace: Trace) -> NDArray[np.void]:
    """Return the state before each impact: as recorded, or by free flight where the impacts tell the whole path."""
    if trace.state_before is not None:
        return trace.state_before
    states = np.zeros(len(trace.impacts), STATE_DTYPE)
    for k, ended in groupby(free_flights(trace), key=lambda flight: flight.impact):
        flights = list(ended)
        if k < len(states):
            begun = states["time_s"][k] = float(np.max([flight.begin_s for flight in flights]))
            for side, flight in zip(("first", "second"), flights, strict=False):  # a wall flies nowhere
                states[f"position_{side}"][k] = flight.at(begun)
    return states


def local_errors(trace: Trace, scales: Scales) -> LocalErrors:
    """Score each impact of a trace from the trace's own state before it: of straight paths, so none under gravity."""
    impacts, scene = trace.impacts, trace.scene
    count = len(impacts)
    first, second = impacts["first"], impacts["second"]
    wall = second < 0
    radius = np.array([disc.radius_m for disc in scene.discs])
    mass = np.array([disc.mass_kg for disc in scene.discs])
    state = own_states(trace)
    start = state["time_s"]
    p1, p2 = state["position_first"], state["position_second"].copy()
    v1, v2 = impacts["velocity_first_before"], impacts["velocity_second_before"]
    # Of an impact without finite numbers there is nothing to be worked out; the verdict says that by name.
    known = np.isfinite(p1).all(axis=1) & np.isfinite(p2).all(axis=1) & np.isfinite(start) & finite_impacts(trace)
    known &= not any(scene.gravity_m_s2)
    m1, m2 = mass[first], np.where(wall, math.inf, mass[np.maximum(second, 0)])
    restitution = np.where(wall, scene.wall_restitution, scene.restitution)
    wait = np.full(count, math.nan)
    pairs, walls = np.flatnonzero(known & ~wall), np.flatnonzero(known & wall)
    reach = radius[first] + np.where(wall, 0.0, radius[np.maximum(second, 0)])
    r1 = radius[first]
    r2 = radius[np.maximum(second, 0)]
    wait[pairs] = _entry(p1[pairs], v1[pairs], r1[pairs], p2[pairs], v2[pairs], r2[pairs])
    normal = np.zeros((count, 2))
    if len(walls):
        point = np.array([w.point_m for w in scene.walls])[-1 - second[walls]]
        into = np.array([w.normal for w in scene.walls])[-1 - second[walls]]
        gap = np.sum((p1[walls] - point) * into, axis=1) - r1[walls]
        speed = np.sum(v1[walls] * into, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            wait[walls] = np.where(speed < 0.0, -gap / speed, math.inf)
        normal[walls] = -into
    # Bodies that overlap already met in the past, but not before the impact that put them on these paths.
    turned = _last_turn(trace)
    wait = np.where(wait < 0.0, np.maximum(wait, np.minimum(turned - start, 0.0)), wait)
    happens = known & np.isfinite(wait)
    at = np.flatnonzero(happens & ~wall)
    normal[at] = (p2[at] + v2[at] * wait[at, None]) - (p1[at] + v1[at] * wait[at, None])
    normal[at] /= np.hypot(*normal[at].T)[:, None]
    after = np.stack([impacts["velocity_first_after"], impacts["velocity_second_after"]])
    expected = np.full((2, count, 2), math.nan)
    ok = np.flatnonzero(happens)
    if len(ok):
        expected[:, ok] = resolve_impact(v1[ok], m1[ok], v2[ok], m2[ok], normal[ok], restitution[ok])
    sampled = _sampled(trace, wait, p1, v1, p2, v2, m1, m2, reach, wall, expected)
    difference = after - expected
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    instant = np.where(happens, start + wait, math.nan)
    effective = trace.effective_time_s if trace.effective_time_s is not None else np.full(count, math.nan)
    return LocalErrors(
        reported_time_s=impacts["time_s"] - instant,
        effective_time_s=effective - instant,
        velocity=_worse(difference) / scales.speed_m_s,
        along_normal=np.max(np.abs(np.sum(difference * normal, axis=-1)), axis=0) / scales.speed_m_s,
        across_normal=np.max(np.abs(np.sum(difference * across, axis=-1)), axis=0) / scales.speed_m_s,
        restitution=np.where(happens, _restitution(v1, v2, after, normal) - restitution, math.nan),
        energy=(_energy(after, m1, m2, wall) - _energy(expected, m1, m2, wall)) / (scales.energy_j or 1.0),
        sampling_velocity=_worse(sampled - expected) / scales.speed_m_s,
        solver_velocity=_worse(after - sampled) / scales.speed_m_s,
        spurious=tuple(int(k) for k in np.flatnonzero(known & ~np.isfinite(wait))),
    )


def _last_turn(trace: Trace) -> Array:
    """Time of the last impact of either body before each impact, seconds; 0 where there is none."""
    times = trace.impacts["time_s"]
    if trace.effective_time_s is not None:
        times = np.where(np.isfinite(trace.effective_time_s), trace.effective_time_s, times)
    latest = np.zeros(len(trace.scene.discs))
    result = np.zeros(len(times))
    for k, (time, *pair) in enumerate(zip(times, trace.impacts["first"], trace.impacts["second"], strict=True)):
        bodies = [body for body in pair if body >= 0]
        result[k] = np.max(latest[bodies])
        latest[bodies] = time
    return result


def _entry(p1: Array, v1: Array, r1: Array, p2: Array, v2: Array, r2: Array) -> Array:
    """Seconds to contact on free paths: negative for what overlaps already, infinity for what never meets."""
    if not len(p1):
        return np.zeros(0)
    ahead = np.asarray(time_of_impact(p1, v1, r1, p2, v2, r2), dtype=np.float64)
    d, u, reach = p2 - p1, v2 - v1, r1 + r2
    a, b, c = np.sum(u * u, axis=1), np.sum(d * u, axis=1), np.sum(d * d, axis=1) - reach**2
    with np.errstate(divide="ignore", invalid="ignore"):
        ago = c / (np.sqrt(np.maximum(b * b - a * c, 0.0)) - b)
    return np.where((ahead == 0.0) & (c < 0.0), ago, ahead)


def _sampled(
    trace: Trace,
    wait: Array,
    p1: Array,
    v1: Array,
    p2: Array,
    v2: Array,
    m1: Array,
    m2: Array,
    reach: Array,
    wall: NDArray[np.bool_],
    expected: Array,
) -> Array:
    """Velocities after that PIT would give from the same states, at step boundaries counted from them."""
    result = np.full_like(expected, math.nan)
    if not trace.dt_s:
        return result
    result[:, wall] = expected[:, wall]  # a wall's normal is the same wherever the disc is found
    d, u = p2 - p1, v2 - v1
    with np.errstate(divide="ignore", invalid="ignore"):
        # A contact at a step boundary to rounding is found at that boundary.
        steps = np.maximum(np.ceil(wait / trace.dt_s * (1.0 - 2.0**-40)), 0.0)
    at = np.flatnonzero(np.isfinite(steps) & ~wall)
    line = d[at] + u[at] * (steps[at] * trace.dt_s)[:, None]
    found = (np.sum(line * u[at], axis=1) < 0.0) & (np.hypot(*line.T) <= reach[at] * (1.0 + 2.0**-40))
    at, line = at[found], line[found]
    if len(at):
        result[:, at] = resolve_impact(v1[at], m1[at], v2[at], m2[at], line, trace.scene.restitution)
    return result


def _worse(difference: Array) -> Array:
    """Length of the error of the worse of the two bodies; shape ``(2, m, 2)`` to ``(m,)``."""
    lengths: Array = np.max(np.hypot(difference[..., 0], difference[..., 1]), axis=0)
    return lengths


def _restitution(v1: Array, v2: Array, after: Array, normal: Array) -> Array:
    before = np.sum((v2 - v1) * normal, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(before < 0.0, -np.sum((after[1] - after[0]) * normal, axis=1) / before, math.nan)


def _energy(velocity: Array, m1: Array, m2: Array, wall: NDArray[np.bool_]) -> Array:
    mass = np.stack([np.where(np.isinf(m1), 0.0, m1), np.where(wall | np.isinf(m2), 0.0, m2)])
    total: Array = np.sum(0.5 * mass * np.sum(velocity**2, axis=-1), axis=0)
    return total
