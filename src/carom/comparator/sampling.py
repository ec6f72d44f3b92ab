"""The price of sampling: what checking once per step costs at worst over the phases of that step.

Where in a step an impact falls is luck: PIT may find it at once, or a step late, or not at all. So a run is compared
with PIT at `THRESHOLDS.phases` phases of the same step, the scene shifted along its own motion for each, and at the
phases at which PIT is as late as the run itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
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
from carom.model.scene import Scene
from carom.model.trace import Trace, rim_speeds, velocities
from carom.solvers.pic import solve_pic
from carom.solvers.pit.solve import solve_pit

Array = NDArray[np.float64]

#: Prices of this many scenes and steps are kept: every engine is compared with the same ones, all scenes of the
#: catalogue at three steps each, and prices at phases of its own, which hardly come again, push none of them out.
KEPT = 1024
OWN_KEPT = 256


class Paid(NamedTuple):
    """Errors at each believed impact of a reference, shape ``(m,)`` each.

    Attributes:
        velocity: Of the velocity after, over the scene's speed.
        spin: Of the spin times the radius, over the scene's speed of rims; 0 if no disc spins.
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
        spin: The same of spins times radii, over the scene's speed of rims; 0 if no disc spins.
        found: Both at worst over the phases at which that impact and all before it are found; 0 where none finds them.
        found_off_s: How far the impact's time is off at these phases, seconds.
        energy: Error of the final kinetic energy, over that at the start. This and what follows, at worst over the
            phases, is of the scene's own and of those at which nothing is missed or invented.
        final_position: Largest distance of a disc from its final one, over the scene's length; 0 where not measured.
        final_velocity: Largest error of a final velocity, over the scene's speed; 0 where not measured.
        final_spin: Largest error of a final spin times its radius, over the scene's speed of rims; 0 as well.
        late_s: Largest error of a time, seconds, over all phases; infinite where an impact is missed or invented.
        phases: At how many phases PIT was run.
        as_close: At how many of these each of its impacts was right to what is called close.
    """

    dt_s: float
    velocity: Array
    spin: Array
    found: Paid
    found_off_s: Array
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
        worst, alignment = measured.largest, measured.alignment
        errors = (worst.final_position, worst.final_velocity, worst.final_spin)
        position, velocity, spin = (0.0 if math.isnan(error) else error for error in errors)
        whole = not (alignment.missed or alignment.spurious or alignment.undecided)
        late_s = largest((abs(error.time_s) for error in measured.errors), default=0.0) if whole else math.inf
        first_missed = min(alignment.missed, default=len(paid.velocity))
        off_s = np.zeros(len(paid.velocity))
        for error in measured.errors:
            off_s[error.reference] = abs(error.time_s)
        *found, off_s = (np.where(np.arange(len(off_s)) < first_missed, errors, 0.0) for errors in (*paid, off_s))
        return cls(dt_s, *paid, Paid(*found), off_s, abs(worst.energy), position, velocity, spin, late_s)

    def is_close(self, velocity: Array, spin: Array) -> bool:
        """Whether what one phase pays is a small part of a step, and of the prices up to each impact, at most."""
        close, rounding = THRESHOLDS.close, THRESHOLDS.rounding
        return (
            self.late_s <= close * self.dt_s
            and bool(np.all(self.velocity <= close * velocity + rounding))
            and bool(np.all(self.spin <= close * spin + rounding))
        )


def price_of_sampling(
    reference: Trace, sampling: Trace, measured: Measured, scales: Scales, reach: Reach, own: Measured, float_bits: int
) -> Price:
    """Return the price of sampling at the step of a run of PIT.

    Args:
        reference: The truth.
        sampling: PIT's run.
        measured: What was measured of it: one phase.
        scales: What errors are divided by.
        reach: What of the reference is reliable.
        own: What was measured of the run that is compared with PIT: at its own lateness PIT is asked as well, where
            the even phases pay less.
        float_bits: Width of that run's floats.
    """
    dt_s, cut = sampling.dt_s, not reach.whole
    prices = [Price.of(dt_s, paid_of(reference, measured, scales, reach.impacts), measured)]
    if not (dt_s and reach.impacts):
        return _worst_of(prices)
    prices += _at_even_phases(reference.scene, dt_s, reach.impacts, cut)
    price = _worst_of(prices)
    if phases := _own_phases(reference, own, price, THRESHOLDS.ratio_known_of(float_bits)):
        at_own = _worst_of([*prices, *_at_phases(reference.scene, dt_s, reach.impacts, cut, phases)])
        # Its share of phases is of even ones.
        price = replace(at_own, phases=price.phases, as_close=price.as_close)
    return price


def _worst_of(prices: Sequence[Price]) -> Price:
    """Return what PIT pays at worst over some phases, the first of them the scene's own."""
    velocity, spin = (_up_to_each([getattr(price, name) for price in prices]) for name in Paid._fields)
    ends = [prices[0], *(price for price in prices[1:] if math.isfinite(price.late_s))]
    return Price(
        dt_s=prices[0].dt_s,
        velocity=velocity,
        spin=spin,
        found=Paid(*(_up_to_each([getattr(price.found, name) for price in prices]) for name in Paid._fields)),
        found_off_s=_up_to_each([price.found_off_s for price in prices]),
        energy=max(price.energy for price in ends),
        final_position=max(price.final_position for price in ends),
        final_velocity=max(price.final_velocity for price in ends),
        final_spin=max(price.final_spin for price in ends),
        late_s=largest(price.late_s for price in prices),
        phases=len(prices),
        as_close=sum(price.is_close(velocity, spin) for price in prices),
    )


def _up_to_each(errors: Sequence[Array]) -> Array:
    """Return the largest error of several runs up to each impact."""
    return np.maximum.accumulate(np.max(errors, axis=0))


def _own_phases(reference: Trace, own: Measured, price: Price, known: float) -> tuple[float, ...]:
    """Return the phases, 0 to 1, at which PIT is as late as a run where that is off by more than a price.

    They are one phase in the end where a run checks for overlap once per step.
    """
    found, phases = price.found, dict[float, None]()
    for error in own.errors:
        at = error.reference
        worse = (
            error.velocity > found.velocity[at]
            or error.spin > found.spin[at]
            or abs(error.time_s) > price.found_off_s[at]
        )
        if worse and error.time_s > 0.0:
            steps = (float(reference.impacts["time_s"][at]) + error.time_s) / price.dt_s
            # A look a whole step late comes after one that finds the impact at once; one just before it does not.
            just_before = (steps - 0.1 * known) % 1.0
            # What differs by as little is one phase.
            phases[round(just_before, 11)] = None
    return tuple(phases)[: THRESHOLDS.phases]


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
def _at_even_phases(scene: Scene, dt_s: float, believed: int, cut: bool) -> tuple[Price, ...]:
    """Return the price at each even phase after the first, which is the scene's own; as `_at_phases` does."""
    return _at_phases.__wrapped__(scene, dt_s, believed, cut, even_phases(THRESHOLDS.phases)[1:])


@lru_cache(maxsize=OWN_KEPT)
def _at_phases(scene: Scene, dt_s: float, believed: int, cut: bool, phases: tuple[float, ...]) -> tuple[Price, ...]:
    """Return the price at each of some phases, as far as the same impacts happen there.

    `cut` says that there are more than the `believed` impacts, beyond a horizon: then nothing is known of the end.
    """
    reference = solve_pic(scene, max_impacts=believed if cut else None)
    return tuple(_prices(reference, dt_s, believed, cut, phases))


def _prices(reference: Trace, dt_s: float, believed: int, cut: bool, phases: tuple[float, ...]) -> Iterator[Price]:
    scales, bodies = scales_of(reference.scene, reference), reference.impacts[["first", "second"]][:believed]
    for moved in shifted_scenes(reference, dt_s, phases):
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
