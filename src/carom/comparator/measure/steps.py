"""Score of stepwise accuracy: windows, meetings and slips of a run in numbers, and the grade."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom.comparator.grades import Grade
from carom.comparator.scales import Scales, median
from carom.comparator.stepwise.judge import PASSED
from carom.comparator.thresholds import THRESHOLDS
from carom.model.step_windows import LocalTruth
from carom.model.trace import pair_name
from carom.support.formatting import instant

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LocalScore:
    """Comparison of the steps of a run with PIC, each from the run's own state at its start, to the end of the run.

    Lateness, velocity, ratio and restitution are of windows of one impact: several at once have no unique answer.

    Attributes:
        until_s: Time of the last state.
        windows: Windows in which something was due.
        due: Impacts of PIC in them.
        missed: Pairs that passed through each other.
        missed_by_pit: How many of these PIT misses, too, from the same state.
        missed_within: Number of the missed pairs within the horizon.
        first_missed: The first of them, empty where there is none.
        first_missed_s: When; NaN where there is none.
        invented: Steps in which bodies turned with nothing near, by more than a hundredth of their speed.
        first_invented: The first, empty where there is none.
        early: Windows in which the paths turned before PIC's.
        ahead: Turns outside of windows that answer a meeting by a margin of length, more than two steps ahead.
        entangled: Windows of several pairs or impacts.
        late_steps: Median and worst lateness, steps; NaN where there is none.
        early_steps: Worst earliness, steps, as a positive number; 0 where none is early.
        too_late: Windows that are later than checking once per step is.
        velocity: Median and worst error of velocities after, over the greatest speed of the window's own bodies.
        spin: Worst error of rims, over the greatest rim or speed of the window's own bodies; 0 where no disc spins.
        ratio: Median and worst of the velocity's error, or the spin's, over what PIT pays at worst from the same state,
            at the phases of the step and at the run's own lateness; infinite where PIT pays nothing.
        worse_than_pit: Windows whose ratio is above 1.
        judged: Windows of one impact that were compared.
        restitution: Median and worst error of the effective restitution, without signs; NaN where there is none.
        energy: Energy gained or lost that PIT does not gain or lose from the same states, over the scene's energy.
        slipped: Largest change of a velocity or a rim with nothing near, over the disc's own speed, of those that are
            no inventions.
        drifts: In how many steps of discs a place moved other than by its velocity.
        drift: The farthest of these moves, over the scene's length.
        resting_steps: In how many steps of discs one rested on something.
        sunk_radii: The deepest that a resting pair sank, over its contact distance.
        sinks: Whether one sank faster than by falling for a step at a time.
        polygon: Whether falling discs move on polygons.
        agrees: Whether all windows agree with PIC to rounding, entangled ones among them.
        agrees_alone: Whether those of one impact do, and nothing slips, drifts or sinks.
        float_bits: Width of the floats that the method declares.
        first_invented_s: When the first of the invented is; None where there is none.
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
        """Missed impacts that sampling does not explain: all within the horizon, and beyond it those that PIT finds."""
        return max(self.missed_within, self.missed - self.missed_by_pit)

    @property
    def rounding(self) -> float:
        """Rounding error of a velocity, over its own size, and of a position at rest."""
        return 10.0 * THRESHOLDS.rounding_of(self.float_bits)

    @property
    def energy_rounding(self) -> float:
        """Rounding error of energy, over the scene's: in narrow floats it adds up over the impacts of a run."""
        return THRESHOLDS.energy + (_ENERGY_32 * self.due if self.float_bits < 64 else 0.0)

    @property
    def grade(self) -> Grade:
        """EXACT, CLOSE, SAMPLED, INACCURATE or WRONG, by these numbers."""
        if self.missed_own or self.invented:
            return Grade.WRONG
        off_alone = self.drifts or self.slipped > self.rounding or self.sinks
        if (
            off_alone
            or self.early
            or self.ahead
            or self.too_late
            or self.worse_than_pit
            or self.energy > self.energy_rounding
        ):
            return Grade.INACCURATE
        sampled = self.polygon or self.sunk_radii > self.rounding or self.missed
        if self.agrees and not sampled:
            return Grade.EXACT
        # Without windows of one impact, closeness to PIC is not known.
        far = self.ratio[1] > THRESHOLDS.close or self.late_steps[1] > THRESHOLDS.close
        near = self.judged > 0 and not far  # either may be NaN
        return Grade.CLOSE if near and not sampled else Grade.SAMPLED


#: Rounding error of energy at an impact in 32-bit floats, over the scene's.
_ENERGY_32 = 1e-7


def score_steps(truth: LocalTruth, scales: Scales, float_bits: int, until_s: float = math.inf) -> LocalScore:
    """Compute the score of the steps of a run.

    Args:
        truth: The comparison of the steps with PIC.
        scales: The scene's own length and energy.
        float_bits: Width of the floats that the method declares.
        until_s: The horizon, seconds: beyond it a miss that PIT shares is sampling's.
    """
    rounding = 10.0 * THRESHOLDS.rounding_of(float_bits)
    rows = truth.windows
    scored = rows[~rows["turned"] & ~rows["open"] & ~np.isnan(rows["price_velocity"])]
    single = ~scored["entangled"] & (scored["missed"] == 0)
    speed, rim = (np.where(scored[name] > 0.0, scored[name], 1.0) for name in ("speed", "rim"))
    velocity, spin = scored["velocity"] / speed, scored["spin"] / rim
    ratio = np.maximum(
        _ratio(velocity, scored["price_velocity"] / speed, rounding), _ratio(spin, scored["price_spin"] / rim, rounding)
    )
    alone = scored[single & ~np.isnan(scored["late_steps"])]
    late = alone["late_steps"]
    known = alone["late_known"] + _LATE_KNOWN[float_bits >= 64]
    early = late < -known
    missed = _drop_continuations(truth.meetings[truth.meetings["missed"]])
    due_s = np.where(np.isnan(missed["due_s"]), missed["begin_s"], missed["due_s"])
    first_missed = "".join(f"at {instant(float(one['begin_s']))} between {pair_name(one)}" for one in missed[:1])
    invented, (first_invented, first_invented_s), slipped = _find_inventions(truth)
    restitution = scored["restitution"][single]
    # Places round at the start and at the end, and a velocity's rounding moves them for the length of the window.
    lasts_m = rounding * scored["speed"] * (scored["end_s"] - scored["begin_s"])
    within = (
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
        # An impact due at the horizon itself, to rounding, is beyond it.
        missed_within=int(np.sum(due_s < until_s * (1.0 - THRESHOLDS.rounding))),
        first_missed=first_missed,
        first_missed_s=float(due_s[0]) if len(missed) else math.nan,
        invented=invented,
        first_invented=first_invented,
        first_invented_s=first_invented_s,
        early=int(early.sum()),
        ahead=truth.ahead,
        entangled=int(scored["entangled"].sum()),
        late_steps=_median_and_worst(late),
        early_steps=float(np.max(-late[early], initial=0.0)),
        too_late=int(np.sum(late > alone["late_allowed"] + known)),
        velocity=_median_and_worst(velocity[single]),
        spin=float(np.max(spin[single], initial=0.0)),
        ratio=_median_and_worst(ratio[single]),
        worse_than_pit=int(np.sum(ratio[single] > 1.0 + THRESHOLDS.ratio_known_of(float_bits))),
        judged=int(single.sum()),
        restitution=_median_and_worst(np.abs(restitution[~np.isnan(restitution)])),
        energy=_unexplained_energy_j(scored) / scales.energy_j if scales.energy_j else 0.0,
        slipped=slipped,
        drifts=truth.slip_counts[1],
        drift=float(np.max(truth.slips["moved_m"], initial=0.0)) / scales.length_m,
        resting_steps=truth.resting_steps,
        sunk_radii=truth.sunk_radii,
        sinks=not math.isnan(truth.sinks_s),
        polygon=truth.polygon,
        agrees=bool(np.all(within)) and in_time,
        agrees_alone=bool(np.all(within[single])) and in_time and quiet,
        float_bits=float_bits,
    )


#: Accuracy of lateness in steps, by whether floats have 64 bits; a hundredth is called close.
_LATE_KNOWN = {True: 1e-8, False: 0.01}


def _ratio(error: Array, price: Array, rounding: float) -> Array:
    """Return errors over costs of sampling: 0 for rounding errors, infinite where sampling costs nothing."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(error <= rounding, 0.0, np.where(price <= rounding, math.inf, error / price))


def _median_and_worst(values: Array) -> tuple[float, float]:
    if not len(values):
        return (math.nan, math.nan)
    return (median(values), float(np.max(values)))


def _drop_continuations(meetings: NDArray[np.void]) -> NDArray[np.void]:
    """Return meetings in order of time, without those that continue one of the same pair."""
    ended: dict[tuple[int, int], float] = {}
    kept = []
    order = np.argsort(meetings["begin_s"], kind="stable")
    for row in order.tolist():
        pair = (int(meetings["first"][row]), int(meetings["second"][row]))
        if not meetings["begin_s"][row] <= ended.get(pair, -math.inf):
            kept.append(row)
        ended[pair] = float(meetings["end_s"][row])
    return meetings[kept]


def _find_inventions(truth: LocalTruth) -> tuple[int, tuple[str, float | None], float]:
    """Return the number of invented turns (with nothing near), the first of them, and the largest of the rest."""
    found: list[tuple[float, str]] = []
    slipped = 0.0
    turned = truth.windows[truth.windows["turned"]]
    for row in turned:
        size = max(float(row["velocity"]), float(row["spin"])) / (float(row["rim"]) or 1.0)
        if size > PASSED:
            found.append((float(row["begin_s"]), f"at {instant(float(row['begin_s']))}"))
        else:
            slipped = max(slipped, size)
    for row in truth.slips:
        size = max(float(row["velocity"]), float(row["rim"])) / (float(row["speed"]) or 1.0)
        if size > PASSED:
            found.append((float(row["time_s"]), f"at {instant(float(row['time_s']))}, of disc {int(row['disc'])}"))
        else:
            slipped = max(slipped, size)
    first_s, first = min(found, default=(None, ""))
    return len(found), (first, first_s), slipped


def _unexplained_energy_j(scored: NDArray[np.void]) -> float:
    """Return the energy gained or lost beyond PIT's from the same states, joules."""
    gained = np.abs(scored["energy_j"])
    passed = scored["missed"] > 0
    alone = np.maximum(gained - scored["energy_price_j"], 0.0)
    return float(np.sum(np.where(passed, 0.0, np.where(scored["entangled"], gained, alone))))
