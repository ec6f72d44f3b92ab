"""Comparison of a window (a few steps of a run) with PIC and PIT, started from the run's state before the window.

If a run is late, some of PIC's impacts may not have happened in the run at the end of a window. So PIC's state is also
computed without its last impacts, if these impacts are still ahead in the run's own state. The run is compared with the
most similar of PIC's states.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from carom.comparator.slowing import find_nearest_time
from carom.comparator.stepwise.active_pairs import Activity
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.step_block import Block
from carom.comparator.stepwise.step_chains import StepChain
from carom.comparator.stepwise.window import Difference, Window, compute_relative_motion, compute_relative_velocity
from carom.comparator.stepwise.window_runs import simulate_pit
from carom.comparator.thresholds import THRESHOLDS
from carom.model.step_windows import WindowRow

Array = NDArray[np.float64]

#: A relative velocity counts as unchanged if it changed by at most this fraction of the closing speed. Two bodies that
#: meet and keep their relative velocity passed through each other. A larger change is an impact with a velocity error.
LARGEST_UNCHANGED = 0.01


@dataclass(eq=False)
class Comparison(WindowRow):
    """Result of the comparison of a window: the numbers of its table row, and its pairs of bodies.

    Attributes:
        due_s: Time in seconds at which each pair should first have met. Pairs that only push are not included.
        passed_through: Pairs of bodies that passed through each other.
        pit_passed_through: Those pairs in `passed_through` that PIT also misses from the same state.
    """

    due_s: dict[Pair, float] = field(default_factory=dict)
    passed_through: Collection[Pair] = ()
    pit_passed_through: Collection[Pair] = ()


def compare_window(
    block: Block,
    chain: StepChain,
    activity: Activity,
    found_by_pit: Mapping[Pair, bool],
    *,
    ends: bool,
    speed_before: float = 0.0,
) -> Comparison:
    """Compare a window with PIC and PIT, started from the run's own state at the window's start.

    Args:
        block: The steps.
        chain: The steps and bodies of the window.
        activity: The pairs that meet, push or rest in each step.
        found_by_pit: Whether PIT, started at the beginning of the chain, finds each pair's impact. Only used if the
            window continues a chain that was cut.
        ends: Whether this block is the last block of the run.
        speed_before: Greatest speed of the discs before the window, in metres per second. Only used if the window
            continues a chain that was cut.
    """
    begin_s, end_s = block.states.time_s[[chain.begin, chain.end]].tolist()
    if not block.is_possible(chain.begin, block.bodies.list_pairs(chain.discs)):
        return Comparison(begin_s, end_s, entangled=True, price_velocity=0.0, price_spin=0.0)  # PIC has no result
    window = Window(block, chain, activity)
    comparison = Comparison(begin_s, end_s, speed=window.speed, rim=window.rim, place_known_m=window.gap_rounding)
    if not window.truth:
        return _compare_nothing_due(window, comparison)
    found = window.find_nearest_difference(window.now, window.truth, window.lasts, window.resting)
    comparison.velocity, comparison.spin, comparison.place_m = found.velocity, found.spin, found.place
    # Pairs that overlap where a long chain was cut should have met in the part before the cut.
    known = sum(impact.time_s == 0.0 for impact in window.truth[: found.impacts]) if chain.is_cut_at_begin else 0
    comparison.due = max(found.impacts, 1) - known if not chain.is_cut_at_begin else found.impacts - known
    comparison.entangled = _is_entangled(window, found)
    comparison.energy_j = _compute_energy_gain(window, found, entangled=comparison.entangled)
    rounding = block.agreement
    agrees = (
        found.velocity <= rounding * window.speed
        and found.spin <= rounding * window.rim
        and found.place <= 10.0 * window.gap_rounding
        and found.impacts == len(window.truth)
    )
    missed = [] if agrees else [pair for pair in chain.pairs if _is_missed(window, pair, speed_before)]
    is_last = ends and chain.end == len(block)
    if is_last:
        missed = [pair for pair in missed if not _is_due_at_next_frame(window, pair)]
    comparison.missed, comparison.passed_through = len(missed), missed
    if is_last and not missed and _has_contact_at_end(window):
        comparison.open = True
    if not comparison.open:
        _measure_lateness(window, comparison, found, agrees=agrees)
        comparison.price_velocity = comparison.price_spin = 0.0
        if not (agrees or comparison.entangled or comparison.missed):  # in other cases PIT's errors are not needed
            _measure_sampling_cost(window, comparison, found)
    missed_by_pit = {pair for pair in missed if not found_by_pit.get(pair, True)}
    missed_by_pit |= find_pairs_missed_by_pit(block, chain, [pair for pair in missed if pair not in found_by_pit])
    comparison.pit_missed, comparison.pit_passed_through = len(missed_by_pit), missed_by_pit
    for pair, steps in chain.pairs.items():
        for step in steps[::-1]:
            if activity.due[step][pair] >= 0.0:
                comparison.due_s[pair] = float(block.states.time_s[step]) + activity.due[step][pair]
    return comparison


def _compare_nothing_due(window: Window, comparison: Comparison) -> Comparison:
    """Compare a window in which PIC has no impact.

    If a velocity changes, either a resting body is held up by another body, or the change has no cause.
    """
    velocity, spin, place = window.now.measure_difference(window.free)
    bodies, chain = window.bodies, window.chain
    # A body counts as resting if its velocity changed by at most the speed that it gains by falling during the window.
    steps = chain.end - chain.begin + 0.5
    may_rest = velocity <= max(RESTING_STEPS, steps) * bodies.pull * window.block.dt_s and _can_be_held_up(window)
    if chain.is_cut_at_begin or (not may_rest and window.meets_at_rest):
        comparison.entangled, comparison.price_velocity, comparison.price_spin = True, 0.0, 0.0
    else:
        comparison.turned = not may_rest
    if chain.is_cut_at_begin or comparison.turned:
        comparison.velocity, comparison.spin, comparison.place_m = velocity, spin, place
    # If the window continues a longer contact, velocities already changed before the window. So only the energy is
    # compared.
    if chain.is_cut_at_begin and bodies.pull == 0.0 and not bodies.driven and not bodies.slowing.table_m_s2:
        comparison.energy_j = window.now.compute_energy() - window.free.compute_energy()
    return comparison


def _can_be_held_up(window: Window) -> bool:
    """Whether gravity can press a disc of the window against another body."""
    bodies, chain, activity = window.bodies, window.chain, window.activity
    for i, j in chain.pairs:
        falling = [body for body in (i, j) if bodies.is_pulled(body)]
        if len(falling) == 2 or any(activity.resting[chain.begin : chain.end, body].any() for body in falling):
            return True
        normal = window.start.measure_separation((i, j)).normal
        pull = normal[0] * bodies.gravity[0] + normal[1] * bodies.gravity[1]
        if falling and (pull if falling == [i] else -pull) > window.block.place_unit * bodies.pull:
            return True
    return False


def _is_entangled(window: Window, found: Difference) -> bool:
    if len(window.chain.pairs) > 1 or (len(window.truth) > 1 and found.impacts > 1) or window.meets_at_rest:
        return True
    # If two bodies overlap at the start, their impact was found late, or a third body pushed them together.
    starts = [window.start.measure_separation(pair) for pair in window.chain.pairs]
    return any(contact.gap < -window.gap_rounding and contact.closing > window.speed_rounding for contact in starts)


def _compute_energy_gain(window: Window, found: Difference, *, entangled: bool) -> float:
    """Return the energy gained relative to PIC; for a window with several impacts, relative to free flight.

    In a window with several impacts, a loss of energy counts only if all impacts are elastic.
    """
    if window.bodies.pull > 0.0:
        return 0.0
    energy_j = window.now.compute_energy()
    if not entangled:
        return energy_j - found.truth.compute_energy()
    if window.bodies.driven or window.bodies.slowing.table_m_s2:  # on a table, the loss of energy depends on the path
        return 0.0
    gain_j = energy_j - window.free.compute_energy()
    bodies = window.bodies
    lossless = all(
        bodies.restitution_of(pair) == 1.0 and bodies.contact_of(pair).friction == 0.0 for pair in window.chain.pairs
    )
    return gain_j if lossless else max(gain_j, 0.0)


def _is_missed(window: Window, pair: Pair, speed_before: float) -> bool:
    """Whether two bodies that should have met kept their motion, and so passed through each other."""
    block, bodies, activity = window.block, window.bodies, window.activity
    steps = window.chain.pairs[pair]
    own_steps = [step for step in _list_due_steps(window, pair) if (step, pair) not in activity.consequences]
    if not own_steps:
        return False
    last = own_steps[-1]
    while last + 1 in steps:  # if bodies push each other while they separate, their impact was late
        last += 1
    i, j = pair
    discs = (i, j) if j < bodies.n else (i,)
    one, other = block.state(own_steps[0], discs), block.state(last + 1, discs)
    before, after = one.measure_separation(pair), other.measure_separation(pair)
    times = block.states.time_s
    duration_s = float(times[last + 1] - times[own_steps[0]])
    velocity_before = compute_relative_velocity(one.compute_later_state(duration_s), pair)
    velocity_after = compute_relative_velocity(other, pair)
    size = math.hypot(*velocity_before)
    if size <= (RESTING_STEPS + 0.5) * bodies.pull * block.dt_s + window.speed_rounding:
        return False  # the bodies are so slow that they may rest on each other
    if before.closing <= LARGEST_UNCHANGED * speed_before:
        return False  # a slow approach that remains after an earlier impact counts as a velocity error
    closed = before.closing * bodies.slowing.damping.compute_kept_fraction(duration_s)
    unchanged = math.dist(velocity_before, velocity_after) <= LARGEST_UNCHANGED * max(closed, 1e-3 * size)
    past = after.gap > window.gap_rounding or after.closing <= 0.0
    changed_x, changed_y = velocity_after[0] - velocity_before[0], velocity_after[1] - velocity_before[1]
    repelled = changed_x * before.normal[0] + changed_y * before.normal[1] > LARGEST_UNCHANGED * closed
    if not unchanged and not repelled and past and window.chain.end - window.chain.begin <= 2:
        unchanged = _is_idle(window, pair, size)
    # If a wall still pushes the disc, the disc has not yet passed through the wall.
    pushed = bool(block.velocity_changed[last, i])
    deep = j >= bodies.n and not pushed and after.gap < -min(bodies.radius[i], 1.5 * before.closing * block.dt_s)
    through = before.normal[0] * after.normal[0] + before.normal[1] * after.normal[1] < 0.0
    return unchanged and (past or deep or through)


def _is_idle(window: Window, pair: Pair, size: float) -> bool:
    """Whether one of two bodies kept its velocity in the window, although PIC's impacts change this velocity."""
    block, chain, bodies = window.block, window.chain, window.bodies
    changed = block.velocity_changed[chain.begin : chain.end]
    idle = [body for body in pair if bodies.is_movable(body) and not changed[:, body].any()]
    meets = any(
        impact.pair == pair and impact.contact.closing > 1e-3 * size and impact.time_s < window.lasts
        for impact in window.truth
    )
    if not idle or not meets:
        return False
    end = window.truth[-1].after.compute_later_state(max(window.lasts - window.truth[-1].time_s, 0.0))
    return any(
        math.dist(end.motion_of(body)[1], window.free.motion_of(body)[1]) > LARGEST_UNCHANGED * size for body in idle
    )


def _is_due_at_next_frame(window: Window, pair: Pair) -> bool:
    """Whether two bodies should have met in the run's last step, so that no later check could find their impact."""
    return _list_due_steps(window, pair) == [window.chain.end - 1] and _is_closing(window, pair)


def _list_due_steps(window: Window, pair: Pair) -> list[int]:
    """Return the steps in which two bodies should meet."""
    return [step for step in window.chain.pairs[pair] if window.activity.due[step][pair] >= 0.0]


def _has_contact_at_end(window: Window) -> bool:
    """Whether the run ended in the middle of a contact."""
    if window.chain.end - window.chain.begin > 3:
        return False
    return any(_is_closing(window, impact.pair) for impact in window.truth)


def _is_closing(window: Window, pair: Pair) -> bool:
    """Whether the bodies of a pair overlap at the window's end and still approach each other."""
    contact = window.now.measure_separation(pair)
    return contact.gap <= 0.0 and contact.closing > window.speed_rounding


def _measure_lateness(window: Window, comparison: Comparison, found: Difference, *, agrees: bool) -> None:
    """Measure how late the impact of a window is, in steps, and the error of its coefficient of restitution."""
    first, bodies, dt_s = window.truth[0], window.bodies, window.block.dt_s
    closing = max(first.contact.closing, 1e-300)
    comparison.late_known = window.gap_rounding / closing / dt_s
    # An engine may move discs along straight steps instead of curved paths. The position error is then up to `a dt^2 /
    # 2` for an acceleration a. The position error divided by the closing speed is the largest delay of the contact.
    bends = bodies.pull + bodies.slowing.compute_deceleration(window.speed)
    comparison.late_allowed = 1.0 + comparison.late_known + 0.5 * bends * dt_s / closing
    if agrees:
        comparison.late_steps = 0.0
    elif not comparison.entangled and found.impacts <= 1 and comparison.missed == 0:
        comparison.late_steps = (_find_turn_time(window, first.pair) - first.time_s) / dt_s
    if comparison.entangled or comparison.missed or len(window.truth) != 1 or bodies.pull > 0.0:
        return
    contact = bodies.contact_of(first.pair)
    velocity_before = compute_relative_velocity(window.free, first.pair)
    velocity_after = compute_relative_velocity(window.now, first.pair)
    if bodies.slowing.table_m_s2:  # a table does not slow all discs by the same factor, so compare at the impact
        turned_s = first.time_s + comparison.late_steps * dt_s
        velocity_before = compute_relative_velocity(window.start.compute_later_state(turned_s), first.pair)
        velocity_after = compute_relative_velocity(window.now.compute_later_state(turned_s - window.lasts), first.pair)
    change = (velocity_after[0] - velocity_before[0], velocity_after[1] - velocity_before[1])
    size = math.hypot(*change)
    if contact.friction == 0.0 and size > window.speed_rounding:
        normal = (change[0] / size, change[1] / size)  # normal of the run's own impact
        closing = velocity_before[0] * normal[0] + velocity_before[1] * normal[1]
        if closing != 0.0:  # `closing` is 0 if the disc changed its velocity before a moving wall reached it
            separating = velocity_after[0] * normal[0] + velocity_after[1] * normal[1]
            comparison.restitution = -separating / closing - bodies.restitution_of(first.pair)


def _find_turn_time(window: Window, pair: Pair) -> float:
    """Return the seconds from the window's start until the free paths before and after the impact are nearest."""
    if window.bodies.slowing.table_m_s2:
        return _find_turn_time_on_table(window, pair)
    free_offset, velocity_before = compute_relative_motion(window.free, pair)
    offset_after, velocity_after = compute_relative_motion(window.now, pair)
    slope = (velocity_before[0] - velocity_after[0], velocity_before[1] - velocity_after[1])
    squared = slope[0] ** 2 + slope[1] ** 2
    if squared == 0.0:
        return math.nan
    # The paths are nearest `ago_s` seconds before the window's end: their distance at the end, divided by their
    # relative velocity. With damping, paths are straight lines in undamped time.
    ago_s = ((free_offset[0] - offset_after[0]) * slope[0] + (free_offset[1] - offset_after[1]) * slope[1]) / squared
    return window.lasts + window.bodies.slowing.damping.to_damped(-ago_s)


def _find_turn_time_on_table(window: Window, pair: Pair) -> float:
    """Return the result of `_find_turn_time` on a table, where both paths are curved."""

    def compute_offset(time_s: float) -> tuple[Array, Array]:
        (p, u), (q, v) = (
            compute_relative_motion(state.select_discs(pair).compute_later_state(seconds), pair)
            for state, seconds in ((window.start, time_s), (window.now, time_s - window.lasts))
        )
        return np.subtract(p, q), np.subtract(u, v)

    return find_nearest_time(compute_offset, window.lasts)


def _measure_sampling_cost(window: Window, comparison: Comparison, found: Difference) -> None:
    """Measure the largest errors of PIT, started from the run's own state at the window's start."""
    dt_s, truth = window.block.dt_s, window.truth
    need = max(found.impacts, 1)
    first_checks_s = [dt_s * phase / THRESHOLDS.phases for phase in range(1, THRESHOLDS.phases + 1)]
    if 0.0 < comparison.late_steps <= comparison.late_allowed:
        first_checks_s.append(truth[0].time_s + comparison.late_steps * dt_s)
    until_s = truth[need - 1].time_s + 2.0 * dt_s
    until_there = [met for met in truth if met.time_s <= until_s]
    # Like the run's errors, PIT's errors are those at the window's end. Damping multiplies all errors by a common
    # factor, but a table does not.
    slowing, measured_s = window.bodies.slowing, until_s
    kept_fraction = slowing.damping.compute_kept_fraction(window.lasts - until_s)
    if slowing.table_m_s2:
        measured_s = window.lasts
    costs_by_completeness: dict[bool, list[tuple[float, float, float]]] = {True: [], False: []}
    for first_s in first_checks_s:
        met = simulate_pit(window.start, window.pairs, until_s, dt_s, first_s)
        last_state, since_s = (met[-1].after, met[-1].time_s) if met else (window.start, 0.0)
        end = last_state.compute_later_state(measured_s - since_s)
        difference = window.find_nearest_difference(end, until_there, measured_s, None)
        gained_j = abs(end.compute_energy() - difference.truth.compute_energy())
        cost = (difference.velocity * kept_fraction, difference.spin * kept_fraction, gained_j * kept_fraction**2)
        costs_by_completeness[len(met) >= min(need, len(until_there))].append(cost)
    # If PIT finds all impacts at some phases, use only these phases.
    columns = zip(*(costs_by_completeness[True] or costs_by_completeness[False]), strict=True)
    comparison.price_velocity, comparison.price_spin, comparison.energy_price_j = map(max, columns)


def find_pairs_missed_by_pit(block: Block, chain: StepChain, pairs: Sequence[Pair]) -> set[Pair]:
    """Return the pairs that PIT misses if PIT starts from a window's first state and checks at the end of each step."""
    if not pairs:
        return set()
    dt_s, begin_s = block.dt_s, float(block.states.time_s[chain.begin])
    steps = round(begin_s / dt_s)
    # If the window starts at a step boundary, PIT checks at once. If an engine shortens steps, a window may start
    # within a regular step. PIT then first checks at the end of this regular step.
    at_boundary = abs(begin_s - steps * dt_s) <= 2.0**-50 * begin_s
    first_s = 0.0 if at_boundary else (math.floor(begin_s / dt_s) + 1.0) * dt_s - begin_s
    seconds = float(block.states.time_s[chain.end]) - begin_s + 2.0 * dt_s
    start = block.state(chain.begin, chain.discs)
    pit_impacts = simulate_pit(start, block.bodies.list_pairs(chain.discs), seconds, dt_s, first_s)
    return set(pairs) - {one.pair for one in pit_impacts}
