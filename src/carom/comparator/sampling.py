"""The price of sampling: what looking once a step costs at worst over the phases of that step.

Where in a step an impact falls is luck: PIT may find it at once, or a step late, or not at all. So a method that beats
PIT is held against PIT at `THRESHOLDS.phases` phases of the same step, the scene shifted along its own motion for each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.align import Reach
from carom.comparator.finite import not_finite
from carom.comparator.measure import Measured, measure, worse
from carom.comparator.scales import Scales, largest, scales_of
from carom.comparator.shift import even_phases, shifted_scenes
from carom.comparator.thresholds import THRESHOLDS
from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit
from carom.trace import Trace, rim_speeds, velocities

__all__ = ["Paid", "Price", "changes", "paid_of", "price_of_sampling"]

Array = NDArray[np.float64]

#: Prices of so many scenes and steps are kept: a cross-check holds every engine against the same few.
KEPT = 256


class Paid(NamedTuple):
    """Errors at each believed impact of a reference, shape ``(m,)`` each.

    Attributes:
        velocity: Of the velocity after, over the scene's speed.
        spin: Of the spin times the radius, over the scene's speed of rims; 0 where nothing turns.
    """

    velocity: Array
    spin: Array


@dataclass(frozen=True)
class Price:
    """What PIT pays at a step: at one phase of it, or at worst over its phases.

    Attributes:
        dt_s: The step, seconds.
        velocity: Velocity error at each believed impact of the reference, over the scene's speed; an impact that is
            missed is off by all that it changes. At worst over the phases it is the largest up to each impact: errors
            hand themselves on from impact to impact.
        spin: The same of spins times radii, over the scene's speed of rims; 0 where nothing turns.
        energy: Error of the final kinetic energy, over that at the start.
        final_position: Largest distance of a disc from its final place, over the scene's length; 0 where not measured.
        final_velocity: Largest error of a final velocity, over the scene's speed; 0 where not measured.
        final_spin: Largest error of a final spin times its radius, over the scene's speed of rims; 0 as well.
        late_s: Largest error of a time, seconds; infinite where an impact is missed or invented.
        phases: At how many phases PIT was run.
        as_close: At how many of these each of its impacts was right to what is called close.
    """

    dt_s: float
    velocity: Array
    spin: Array
    energy: float
    final_position: float
    final_velocity: float
    final_spin: float
    late_s: float
    phases: int = 1
    as_close: int = 0

    @classmethod
    def of(cls, dt_s: float, paid: Paid, measured: Measured) -> Price:
        """Return the price of one phase, from what was measured of PIT at it."""
        found = measured.largest
        errors = (found.final_position, found.final_velocity, found.final_spin)
        position, velocity, spin = (0.0 if math.isnan(error) else error for error in errors)
        whole = not (measured.alignment.missed or measured.alignment.spurious or measured.alignment.undecided)
        late_s = largest((abs(error.time_s) for error in measured.errors), default=0.0) if whole else math.inf
        return cls(dt_s, *paid, abs(found.energy), position, velocity, spin, late_s)

    def is_close(self, velocity: Array, spin: Array) -> bool:
        """Whether what one phase pays is a small part of a step, and of the prices up to each impact, at most."""
        close, rounding = THRESHOLDS.close, THRESHOLDS.rounding
        return (
            self.late_s <= close * self.dt_s
            and bool(np.all(self.velocity <= close * velocity + rounding))
            and bool(np.all(self.spin <= close * spin + rounding))
        )


def price_of_sampling(reference: Trace, sampling: Trace, measured: Measured, scales: Scales, reach: Reach) -> Price:
    """Return the price of sampling at the step of a run of PIT, given what was measured of that run: one phase."""
    found = [Price.of(sampling.dt_s, paid_of(reference, measured, scales, reach.impacts), measured)]
    if sampling.dt_s and reach.impacts:
        found += _at_other_phases(reference.scene, sampling.dt_s, reach.impacts, not reach.whole)
    velocity = np.maximum.accumulate(np.max([price.velocity for price in found], axis=0))
    spin = np.maximum.accumulate(np.max([price.spin for price in found], axis=0))
    return Price(
        dt_s=sampling.dt_s,
        velocity=velocity,
        spin=spin,
        energy=max(price.energy for price in found),
        final_position=max(price.final_position for price in found),
        final_velocity=max(price.final_velocity for price in found),
        final_spin=max(price.final_spin for price in found),
        late_s=largest(price.late_s for price in found),
        phases=len(found),
        as_close=sum(price.is_close(velocity, spin) for price in found),
    )


def paid_of(reference: Trace, measured: Measured, scales: Scales, believed: int) -> Paid:
    """Return the errors at each believed impact: all that it changes where it is missed, 0 where undecided."""
    paid = Paid(np.zeros(believed), np.zeros(believed))
    for error in measured.errors:
        paid.velocity[error.reference] = error.velocity
        paid.spin[error.reference] = 0.0 if math.isnan(error.spin) else error.spin
    missed = list(measured.alignment.missed)
    for errors, changed in zip(paid, changes(reference, scales), strict=True):
        errors[missed] = changed[missed]
    return paid


def changes(reference: Trace, scales: Scales) -> Paid:
    """Return what each impact of a reference changes, of the more changed body."""
    velocity = worse(velocities(reference.impacts, "after") - velocities(reference.impacts, "before"))
    spin = np.max(np.abs(rim_speeds(reference, "after") - rim_speeds(reference, "before")), axis=0)
    return Paid(velocity / scales.speed_m_s, spin / scales.rim_m_s)


@lru_cache(maxsize=KEPT)
def _at_other_phases(scene: Scene, dt_s: float, believed: int, cut: bool) -> tuple[Price, ...]:
    """Return the price at each phase but that of the scene itself, as far as the same impacts happen there.

    `cut` says that there are more than the `believed` impacts, beyond a horizon: then nothing is known of the end.
    """
    reference = solve_pic(scene, max_impacts=believed if cut else None)
    return tuple(_prices(reference, dt_s, believed, cut))


def _prices(reference: Trace, dt_s: float, believed: int, cut: bool) -> Iterator[Price]:
    scales, bodies = scales_of(reference.scene, reference), reference.impacts[["first", "second"]][:believed]
    for moved in shifted_scenes(reference, dt_s, even_phases(THRESHOLDS.phases)[1:]):
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
        until_s = math.inf if whole else float(truth.impacts["time_s"][agreed - 1])
        found = measure(truth, pit, scales, Reach(agreed, until_s))
        yield Price.of(
            dt_s, Paid(*(np.pad(paid, (0, believed - agreed)) for paid in paid_of(truth, found, scales, agreed))), found
        )
