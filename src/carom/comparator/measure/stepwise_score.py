"""Score of a run's single steps: their errors relative to PIC, and a grade."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.grades import Grade
from carom.comparator.scales import Scales, compute_median
from carom.comparator.stepwise.compare_window import LARGEST_UNCHANGED
from carom.comparator.thresholds import THRESHOLDS
from carom.model.step_windows import LocalTruth
from carom.model.trace import pair_name
from carom.support.formatting import format_instant

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LocalScore:
    """Score of the steps of a run. Each step is compared with PIC, started from the run's own state before the step.

    A window is a group of successive steps in which bodies collide or overlap. Lateness, velocity, ratio and
    restitution are only measured in windows with one impact, because several impacts at once have no unique result.

    Attributes:
        until_s: Time of the last state, in seconds.
        windows: Number of windows with a *due* impact: an impact that PIC finds if it starts from the run's own state.
        due: Number of due impacts.
        missed: Number of pairs of bodies that passed through each other.
        missed_by_pit: Number of the missed pairs that PIT also misses from the same state.
        missed_within: Number of the missed pairs before the horizon.
        first_missed: Description of the first missed pair; empty if there is none.
        first_missed_s: Time of the first missed pair, in seconds; NaN if there is none.
        invented: Number of steps, summed over all discs, in which a disc's motion changed without a cause. A change
            counts if it exceeds 1 % of the disc's speed, and the disc's path reaches no body within two steps.
        first_invented: Description of the first step that `invented` counts; empty if there is none.
        early: Number of windows in which the impact is earlier than in PIC.
        ahead: Number of velocity changes that come more than two steps before their impact. The cause is an engine that
            pushes bodies apart before they touch (contact margin).
        entangled: Number of windows with several impacts or several pairs of bodies.
        late_steps: Median and largest lateness of an impact, in steps; NaN if no impact was compared.
        early_steps: Largest earliness of an impact, in steps; 0 if no impact is early.
        too_late: Number of windows whose impact is later than a check once per step can explain.
        velocity: Median and largest velocity error after the impact, divided by the greatest speed of the window's own
            bodies.
        spin: Largest error of a rim speed, divided by the greatest speed or rim speed of the window's own bodies; 0 if
            no disc spins.
        ratio: Median and largest ratio of the run's error to PIT's largest error from the same state. The larger of the
            ratios for velocity and for spin counts. PIT runs at several phases of the step, and at the phase at which
            PIT is as late as the run. Infinite if the run has an error and PIT has none.
        worse_than_pit: Number of windows in which the run's error is larger than PIT's.
        judged: Number of compared windows with a single impact.
        restitution: Median and largest absolute error of the coefficient of restitution; NaN if there is none.
        energy: Energy that the run gains or loses in addition to PIT's gains and losses from the same states, divided
            by the scene's energy.
        slipped: Largest change of a velocity or rim speed with no other body near, divided by the disc's own speed.
            Changes that are counted in `invented` are excluded.
        drifts: Number of steps, summed over all discs, in which the change of a disc's position did not follow from the
            disc's velocity.
        drift: Largest change of a disc's position that did not follow from its velocity, divided by the largest radius.
        resting_steps: Number of steps, summed over all discs, in which a disc rested on another body.
        sunk_radii: The largest depth to which a resting disc sank into another body, divided by the contact distance:
            from centre to centre, or from centre to wall.
        sinks: Whether a disc sank deeper into another body than it would by falling from rest in each step.
        polygon: Whether falling discs move along polygons instead of parabolas.
        agrees: Whether all windows agree with PIC except for rounding.
        agrees_alone: Whether all windows with one impact agree with PIC except for rounding, and `slipped`, `drift` and
            `sunk_radii` are at most rounding.
        float_bits: Width of the method's floats: 32 or 64 bits.
        first_invented_s: Time of the first step that `invented` counts, in seconds; None if there is none.
    """

    until_s: float
    windows: int
    due: int
    missed: int
    missed_by_pit: int
    missed_within: int
    first_missed: str
    first_missed_s: float
    invented: int
    first_invented: str
    early: int
    ahead: int
    entangled: int
    late_steps: tuple[float, float]
    early_steps: float
    too_late: int
    velocity: tuple[float, float]
    spin: float
    ratio: tuple[float, float]
    worse_than_pit: int
    judged: int
    restitution: tuple[float, float]
    energy: float
    slipped: float
    drifts: int
    drift: float
    resting_steps: int
    sunk_radii: float
    sinks: bool
    polygon: bool
    agrees: bool
    agrees_alone: bool
    float_bits: int
    first_invented_s: float | None = None

    @property
    def missed_own(self) -> int:
        """Number of missed impacts that can't be explained by checking once per step.

        Beyond the horizon, a missed impact counts only if PIT finds this impact.
        """
        return max(self.missed_within, self.missed - self.missed_by_pit)

    @property
    def rounding(self) -> float:
        """Relative rounding error of a velocity, and of the position of a resting disc."""
        return 10.0 * THRESHOLDS.rounding_of(self.float_bits)

    @property
    def energy_rounding(self) -> float:
        """Rounding error of energy, divided by the scene's energy.

        In 32-bit floats, the rounding adds up over the impacts of a run.
        """
        return THRESHOLDS.energy + (_ENERGY_32 * self.due if self.float_bits < 64 else 0.0)

    @property
    def grade(self) -> Grade:
        """Grade of the steps: EXACT, CLOSE, SAMPLED, INACCURATE or WRONG."""
        if self.missed_own or self.invented:
            return Grade.WRONG
        has_faults = self.drifts or self.sinks or self.early or self.ahead or self.too_late or self.worse_than_pit
        if has_faults or self.slipped > self.rounding or self.energy > self.energy_rounding:
            return Grade.INACCURATE
        sampled = self.polygon or self.sunk_radii > self.rounding or self.missed
        if self.agrees and not sampled:
            return Grade.EXACT
        # Without a window of one impact, the errors are unknown, so the grade is at best *sampled*.
        far = self.ratio[1] > THRESHOLDS.close or self.late_steps[1] > THRESHOLDS.close
        near = self.judged > 0 and not far  # both comparisons are false for NaN
        return Grade.CLOSE if near and not sampled else Grade.SAMPLED


#: Rounding error of energy at an impact in 32-bit floats, divided by the scene's energy.
_ENERGY_32 = 1e-7


def score_steps(truth: LocalTruth, scales: Scales, float_bits: int, until_s: float = math.inf) -> LocalScore:
    """Score the steps of a run.

    Args:
        truth: The comparison of each step with PIC.
        scales: The length and energy that errors are divided by.
        float_bits: Width of the method's floats: 32 or 64 bits.
        until_s: The horizon, in seconds. After the horizon, a missed impact is no fault if PIT also misses this impact.
    """
    rounding = 10.0 * THRESHOLDS.rounding_of(float_bits)
    rows = truth.windows
    scored = rows[~rows["turned"] & ~rows["open"] & ~np.isnan(rows["price_velocity"])]
    single = ~scored["entangled"] & (scored["missed"] == 0)
    speed, rim = (np.where(scored[name] > 0.0, scored[name], 1.0) for name in ("speed", "rim"))
    velocity, spin = scored["velocity"] / speed, scored["spin"] / rim
    ratio = np.maximum(
        _compute_cost_ratio(velocity, scored["price_velocity"] / speed, rounding),
        _compute_cost_ratio(spin, scored["price_spin"] / rim, rounding),
    )
    single_pairs = scored[single & ~np.isnan(scored["late_steps"])]
    late = single_pairs["late_steps"]
    known = single_pairs["late_known"] + _LATE_KNOWN[float_bits >= 64]
    early = late < -known
    missed = _drop_continuations(truth.meetings[truth.meetings["missed"]])
    due_s = np.where(np.isnan(missed["due_s"]), missed["begin_s"], missed["due_s"])
    first_missed = "".join(f"at {format_instant(float(one['begin_s']))} between {pair_name(one)}" for one in missed[:1])
    invented, (first_invented, first_invented_s), slipped = _find_inventions(truth)
    restitution = scored["restitution"][single]
    # Positions are rounded at the start and at the end of a window. The rounding error of a velocity also grows into a
    # position error during the window.
    lasts_m = rounding * scored["speed"] * (scored["end_s"] - scored["begin_s"])
    is_within = (
        (velocity <= rounding) & (spin <= rounding) & (scored["place_m"] <= 10.0 * scored["place_known_m"] + lasts_m)
    )
    in_time = bool(np.all(np.abs(late) <= known))
    quiet = slipped <= rounding and not truth.slip_counts[1] and truth.sunk_radii <= rounding and not truth.polygon
    return LocalScore(
        until_s=truth.until_s,
        windows=int(np.sum(rows["due"] > 0)),
        due=int(rows["due"].sum()),
        missed=len(missed),
        missed_by_pit=int(missed["pit_missed"].sum()),
        # An impact at the time of the horizon, except for rounding, is beyond the horizon.
        missed_within=int(np.sum(due_s < until_s * (1.0 - THRESHOLDS.rounding))),
        first_missed=first_missed,
        first_missed_s=float(due_s[0]) if len(missed) else math.nan,
        invented=invented,
        first_invented=first_invented,
        first_invented_s=first_invented_s,
        early=int(early.sum()),
        ahead=truth.ahead,
        entangled=int(scored["entangled"].sum()),
        late_steps=_compute_median_and_worst(late),
        early_steps=float(np.max(-late[early], initial=0.0)),
        too_late=int(np.sum(late > single_pairs["late_allowed"] + known)),
        velocity=_compute_median_and_worst(velocity[single]),
        spin=float(np.max(spin[single], initial=0.0)),
        ratio=_compute_median_and_worst(ratio[single]),
        worse_than_pit=int(np.sum(ratio[single] > 1.0 + THRESHOLDS.ratio_known_of(float_bits))),
        judged=int(single.sum()),
        restitution=_compute_median_and_worst(np.abs(restitution[~np.isnan(restitution)])),
        energy=_compute_unexplained_energy(scored) / scales.energy_j if scales.energy_j else 0.0,
        slipped=slipped,
        drifts=truth.slip_counts[1],
        drift=float(np.max(truth.slips["moved_m"], initial=0.0)) / scales.length_m,
        resting_steps=truth.resting_steps,
        sunk_radii=truth.sunk_radii,
        sinks=not math.isnan(truth.sinks_s),
        polygon=truth.polygon,
        agrees=bool(np.all(is_within)) and in_time,
        agrees_alone=bool(np.all(is_within[single])) and in_time and quiet,
        float_bits=float_bits,
    )


#: Rounding error of the lateness, in steps. The key is True for 64-bit floats, and False for 32-bit floats.
_LATE_KNOWN = {True: 1e-8, False: 0.01}


def _compute_cost_ratio(error: Array, price: Array, rounding: float) -> Array:
    """Return errors divided by PIT's errors: 0 for rounding errors, infinite if PIT has no error."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(error <= rounding, 0.0, np.where(price <= rounding, math.inf, error / price))


def _compute_median_and_worst(values: Array) -> tuple[float, float]:
    if not len(values):
        return (math.nan, math.nan)
    return (compute_median(values), float(np.max(values)))


def _drop_continuations(meetings: NDArray[np.void]) -> NDArray[np.void]:
    """Sort meetings of bodies by time, and remove those that continue an earlier meeting of the same pair."""
    ended: dict[tuple[int, int], float] = {}
    kept_rows = []
    for row in np.argsort(meetings["begin_s"], kind="stable").tolist():
        pair = (int(meetings["first"][row]), int(meetings["second"][row]))
        if not meetings["begin_s"][row] <= ended.get(pair, -math.inf):
            kept_rows.append(row)
        ended[pair] = float(meetings["end_s"][row])
    return meetings[kept_rows]


def _find_inventions(truth: LocalTruth) -> tuple[int, tuple[str, float | None], float]:
    """Find the steps in which the motion of a disc changes without a cause.

    Return the number of these steps, the first one, and the largest change that is too small to count.
    """
    turned, slips = truth.windows[truth.windows["turned"]], truth.slips
    changes = [np.maximum(turned["velocity"], turned["spin"]), np.maximum(slips["velocity"], slips["rim"])]
    speeds = [turned["rim"], slips["speed"]]
    in_windows, alone = (size / np.where(speed > 0.0, speed, 1.0) for size, speed in zip(changes, speeds, strict=True))
    is_invented = in_windows > LARGEST_UNCHANGED
    found = [(float(time_s), "") for time_s in turned["begin_s"][is_invented]]
    if truth.invented:
        found.append((truth.first_invented_s, f", of disc {truth.first_inventor}"))
    first_s, disc = min(found, default=(math.nan, ""))
    first = (f"at {format_instant(first_s)}{disc}", first_s) if found else ("", None)
    slipped = max(float(np.max(sizes[sizes <= LARGEST_UNCHANGED], initial=0.0)) for sizes in (in_windows, alone))
    return truth.invented + int(is_invented.sum()), first, slipped


def _compute_unexplained_energy(scored: NDArray[np.void]) -> float:
    """Return the energy gained or lost in addition to PIT's gains and losses from the same states, in joules."""
    gained_j = np.abs(scored["energy_j"])
    passed = scored["missed"] > 0
    unexplained_j = np.maximum(gained_j - scored["energy_price_j"], 0.0)
    return float(np.sum(np.where(passed, 0.0, np.where(scored["entangled"], gained_j, unexplained_j))))
