"""The price of sampling: what looking once a step costs at worst over the phases of that step.

Where in a step an impact falls is luck: PIT may find it at once, or a step late, or not at all. So a method that beats
PIT is held against PIT at `THRESHOLDS.phases` phases of the same step, the scene shifted along its own motion for each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carom.comparator.finite import not_finite
from carom.comparator.measure import Errors, Measured, measure
from carom.comparator.scales import Scales, scales_of
from carom.comparator.shift import even_phases, shifted
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit
from carom.trace import Trace

__all__ = ["Price", "changes", "paid_by", "paid_of", "price_of_sampling"]

Array = NDArray[np.float64]

#: Prices of so many scenes and steps are kept: a cross-check holds every engine against the same few.
KEPT = 256


@dataclass(frozen=True)
class Price:
    """What PIT pays at a step, at worst over the phases of the step.

    Attributes:
        dt_s: The step, seconds.
        velocity: Largest velocity error up to each believed impact of the reference, over the scene's speed: errors
            hand themselves on from impact to impact. An impact that is missed is off by all that it changes.
        energy: Largest error of the final kinetic energy, over that at the start.
        final_position: Largest distance of a disc from its final place, over the scene's length; 0 where not measured.
        final_velocity: Largest error of a final velocity, over the scene's speed; 0 where not measured.
    """

    dt_s: float
    velocity: Array
    energy: float
    final_position: float
    final_velocity: float

    @property
    def worst(self) -> float:
        """The largest velocity error at any impact; NaN where there is none."""
        return float(self.velocity[-1]) if len(self.velocity) else math.nan


def price_of_sampling(
    reference: Trace, sampling: Trace, measured: Measured, scales: Scales, horizon: tuple[int, float]
) -> Price:
    """Return the price of sampling at the step of a run of PIT.

    Args:
        reference: The scene's PIC trace.
        sampling: PIT at the step; one of the phases.
        measured: What was measured of it.
        scales: What errors are divided by.
        horizon: How many of the reference's impacts may be believed, and until when.
    """
    believed, until_s = horizon
    found = [_Paid.of(paid_of(reference, measured, scales, believed), measured.largest)]
    if sampling.dt_s and believed:
        found += _at_other_phases(reference.scene, sampling.dt_s, believed, math.isfinite(until_s))
    return Price(
        dt_s=sampling.dt_s,
        velocity=np.maximum.accumulate(np.max([paid.velocity for paid in found], axis=0)),
        energy=max(paid.energy for paid in found),
        final_position=max(paid.final_position for paid in found),
        final_velocity=max(paid.final_velocity for paid in found),
    )


def paid_of(reference: Trace, measured: Measured, scales: Scales, believed: int) -> Array:
    """Return the velocity error of each believed impact: all that it changes where it is missed, 0 where undecided."""
    paid = np.zeros(believed)
    for error in measured.errors:
        paid[error.reference] = error.velocity
    missed = list(measured.alignment.missed)
    paid[missed] = changes(reference, scales)[missed]
    return paid


def paid_by(paid: Array, price: Price, rounding: float) -> float:
    """Return the largest velocity error of a run over PIT's at worst over the phases of the step; NaN without impacts.

    Args:
        paid: The run's, impact by impact.
        price: PIT's.
        rounding: What counts as no error: 0 over 0 is 0, and an error where sampling costs none is infinitely worse.
    """
    if not len(paid):
        return math.nan
    most = float(np.max(paid))
    if most <= rounding:
        return 0.0
    return most / price.worst if price.worst > THRESHOLDS.rounding else math.inf


def changes(reference: Trace, scales: Scales) -> Array:
    """Return what each impact of a reference changes of a velocity, the more changed one, over the scene's speed."""
    impacts = reference.impacts
    sizes = [
        np.hypot(*(impacts[f"velocity_{b}_after"] - impacts[f"velocity_{b}_before"]).T) for b in ("first", "second")
    ]
    changed: Array = np.maximum(*sizes) / scales.speed_m_s
    return changed


@dataclass(frozen=True)
class _Paid:
    """What PIT pays at one phase, as in `Price`, but impact by impact."""

    velocity: Array
    energy: float
    final_position: float
    final_velocity: float

    @classmethod
    def of(cls, velocity: Array, largest: Errors) -> _Paid:
        ends = (0.0 if math.isnan(error) else error for error in (largest.final_position, largest.final_velocity))
        return cls(velocity, abs(largest.energy), *ends)


@lru_cache(maxsize=KEPT)
def _at_other_phases(scene: Scene, dt_s: float, believed: int, cut: bool) -> tuple[_Paid, ...]:
    """Return what PIT pays at each phase but that of the scene itself, as far as the same impacts happen there.

    Args:
        scene: The scene.
        dt_s: The step, seconds.
        believed: How many impacts are asked for.
        cut: Whether there are more, beyond a horizon; then nothing is known of the end.
    """
    reference = solve_pic(scene, max_impacts=believed if cut else None)
    return tuple(_paid_at(reference, dt_s, even_phases(THRESHOLDS.phases)[1:], believed, cut))


def _paid_at(reference: Trace, dt_s: float, phases: Sequence[float], believed: int, cut: bool) -> Iterator[_Paid]:
    scales, bodies = scales_of(reference.scene, reference), reference.impacts[["first", "second"]][:believed]
    for phase in phases:
        moved = shifted(reference, dt_s, phase)
        if moved is None:
            continue
        try:
            truth = solve_pic(moved, max_impacts=believed + 1)
            pit = solve_pit(moved, frame_rate_hz=1.0 / dt_s)
        except InputError:
            continue
        count = min(len(truth.impacts), believed)
        same = truth.impacts[["first", "second"]][:count] == bodies[:count]
        agreed = count if same.all() else int(np.argmin(same))
        if not agreed or not_finite(truth) or not_finite(pit):
            continue
        whole = not cut and agreed == believed == len(truth.impacts)
        found = measure(truth, pit, scales, (agreed, math.inf if whole else float(truth.impacts["time_s"][agreed - 1])))
        paid = np.zeros(believed)
        paid[:agreed] = paid_of(truth, found, scales, agreed)
        yield _Paid.of(paid, found.largest)
