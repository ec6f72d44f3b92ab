"""Search for the pairs of bodies that meet, push each other or rest on each other in each step."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.near_pairs import MARGIN_STEPS, NearPairs, find_disc_pairs, find_wall_pairs
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS, RestHistory, find_resting_pairs
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.step_block import Block
from carom.comparator.stepwise.waits import compute_wait
from carom.comparator.stepwise.window_runs import MOST_IMPACTS

Flags = NDArray[np.bool_]

#: Number of impacts at one instant after which the search checks whether all further impacts are too slow to matter.
#: The check takes as long as a few impacts.
_AT_ONCE = 64

#: Number of steps whose near pairs are found together. In so few steps, a box around a disc's path is little larger
#: than the disc.
_TOGETHER = 16

#: Number of distances that are computed together in scenes with few pairs. In scenes with few pairs, more steps are
#: searched together, because computing distances takes less time than computing boxes.
_DISTANCES = 2**12


@dataclass(eq=False)
class Activity:
    """Active pairs (bodies that meet or push each other) and resting discs in each step of a block.

    Attributes:
        due: For each step, its active pairs and the seconds from the step's start until they meet; NaN for a pair that
            only pushes.
        consequences: Pairs, each with its step, that meet only because of an earlier impact in this step.
        resting: Whether each disc rests on a body that holds it up, for each step, shape ``(k, n)``.
        overlapping: Whether each disc overlaps another body at the beginning of each step, shape ``(k, n)``.
    """

    resting: Flags
    overlapping: Flags
    due: dict[int, dict[Pair, float]] = field(default_factory=lambda: defaultdict(dict))
    consequences: set[tuple[int, Pair]] = field(default_factory=set)


def find_activity(block: Block, rest: RestHistory) -> Activity:
    """Find the pairs that meet, push or rest in each step of a block. Record in `rest` how deep resting bodies sink."""
    shape = block.velocity_changed.shape
    found = Activity(resting=np.zeros(shape, np.bool_), overlapping=np.zeros(shape, np.bool_))
    steps = _choose_steps_together(block)
    for begin in range(0, len(block), steps):
        end = min(begin + steps, len(block))
        together = [*find_disc_pairs(block, begin, end), *find_wall_pairs(block, begin, end)]
        for relative, resting in zip(together, find_resting_pairs(block, together), strict=True):
            _enter_active_pairs(block, relative, resting, found)
            rest.add(block, relative, resting)
        _enter_consequences(block, found, begin, end, together)
    for step in list(found.due):
        _drop_bystanders(block, found, step)
    return found


def _choose_steps_together(block: Block) -> int:
    """Return how many steps are searched together; this number is smaller if each pair is solved separately."""
    bodies = block.bodies
    bends = bodies.slowing.table_m_s2 > 0.0 or any(len(drive.legs) > 1 for drive in bodies.wall_drives)
    if bends or not all(isinstance(wall, tuple) for wall in bodies.walls):
        return _TOGETHER
    return max(_TOGETHER, _DISTANCES // (bodies.n * (bodies.n + len(bodies.walls))))


def _enter_active_pairs(block: Block, relative: NearPairs, resting: Flags, found: Activity) -> None:
    """Add the active pairs of each step to `found`, except pairs that rest in the step."""
    begin, steps = relative.begin, len(relative.wait)
    h = block.step_s[begin : begin + steps, None]
    gap, wait = relative.gap, relative.wait
    first, second = relative.list_discs(block.bodies.n)
    meets = (wait <= h) & ~resting
    velocity_changed = block.velocity_changed[begin : begin + steps]
    pushed = velocity_changed[:, first] | velocity_changed[:, second]
    near = (wait <= (1.0 + MARGIN_STEPS) * h) | (gap[:-1] <= relative.gap_rounding) | (gap[1:] <= relative.gap_rounding)
    for row, column in np.argwhere((meets | (pushed & near)) & ~resting).tolist():
        due_s = float(wait[row, column]) if meets[row, column] else np.nan
        found.due[begin + row][relative.pairs[column]] = due_s
    for begins, flags in ((gap[:-1] < -relative.gap_rounding, found.overlapping), (resting, found.resting)):
        rows, columns = np.nonzero(begins)
        flags[begin + rows, first[columns]] = flags[begin + rows, second[columns]] = True


def _enter_consequences(block: Block, found: Activity, begin: int, end: int, together: Sequence[NearPairs]) -> None:
    """Add pairs that meet only because of an earlier impact in the same step, for the steps from `begin` to `end`."""
    due_steps = [
        step for step in range(begin, end) if step in found.due and _has_other_pairs(found.due[step], together)
    ]
    within_reach = [near_pairs.find_within_reach(block) for near_pairs in together] if due_steps else []
    for step in due_steps:
        near: dict[int, list[Pair]] = defaultdict(list)
        for near_pairs, flags in zip(together, within_reach, strict=True):
            for column in np.flatnonzero(flags[step - begin]).tolist():
                pair = near_pairs.pairs[column]
                for body in filter(block.bodies.is_movable, pair):
                    near[body].append(pair)
        _enter_consequences_in_step(block, found, step, near)


def _has_other_pairs(active: Mapping[Pair, float], together: Sequence[NearPairs]) -> bool:
    """Whether an active pair meets, and another near pair is not active."""
    return any(due_s >= 0.0 for due_s in active.values()) and any(
        pair not in active for near_pairs in together for pair in near_pairs.pairs
    )


def _enter_consequences_in_step(block: Block, found: Activity, step: int, near: dict[int, list[Pair]]) -> None:
    """Do the work of `_enter_consequences` for one step. For each movable disc, `near` lists pairs that may meet."""
    bodies, active = block.bodies, found.due[step]
    due = [(due_s, pair) for pair, due_s in active.items() if due_s >= 0.0]
    if _are_all_active(active, due, near):
        return
    struck_bodies = (body for _, pair in due for body in pair if body in near)
    if not block.is_possible(step, {pair for body in struck_bodies for pair in near[body]}):
        return
    slow = (RESTING_STEPS + 0.5) * bodies.pull * float(block.step_s[step])
    for time_s, pair, closing in _find_impacts(block, step, due, near, slow):
        if pair not in active and closing > slow:
            active[pair] = time_s
            found.consequences.add((step, pair))
            if _are_all_active(active, due, near):
                break  # further impacts only involve pairs that are already active


def _are_all_active(
    active: Mapping[Pair, float], due: list[tuple[float, Pair]], near: Mapping[int, list[Pair]]
) -> bool:
    """Whether all pairs that can be reached from the due pairs by a chain of impacts are already active."""
    bodies = [body for _, pair in due for body in pair if body in near]
    reached = set(bodies)
    while bodies:
        for pair in near[bodies.pop()]:
            if pair not in active:
                return False
            new = [body for body in pair if body in near and body not in reached]
            reached.update(new)
            bodies += new
    return True


def _find_impacts(
    block: Block, step: int, due: list[tuple[float, Pair]], near: dict[int, list[Pair]], slow: float
) -> Iterator[tuple[float, Pair, float]]:
    """Yield PIC's impacts in a step: the seconds from the step's start, the pair and its closing speed.

    The first impacts are those of the pairs in `due`. After an impact, only the next meetings of the struck discs are
    predicted. There may be infinitely many impacts at one instant. The search ends when all further impacts must be
    slower than `slow`.
    """
    bodies, seconds, begun_s = block.bodies, float(block.step_s[step]), float(block.states.time_s[step])
    latest_states: dict[int, tuple[float, body_states.BodyStates]] = {}
    impact_counts = defaultdict[int, int](int)

    def build_state(time_s: float, pair: Pair) -> body_states.BodyStates:
        both = body_states.BodyStates(bodies, begun_s + time_s)
        for body in pair:
            if body < bodies.n:
                since_s, own_state = latest_states.get(body) or (0.0, block.state(step, (body,)))
                own_state.move_freely(time_s - since_s)
                latest_states[body] = (time_s, own_state)
                both.merge_discs(own_state)
        return both

    events = [(time_s, pair, (0, 0)) for time_s, pair in due]
    heapify(events)
    found = at_once = 0
    last_s = 0.0
    while events and found < MOST_IMPACTS:
        time_s, pair, counts = heappop(events)
        if counts != (impact_counts[pair[0]], impact_counts[pair[1]]):
            continue  # this meeting is outdated, because another impact has changed the path of one of the bodies
        state = build_state(time_s, pair)
        contact, falls_back = state.measure_separation(pair), bodies.is_pulled(pair[0]) != bodies.is_pulled(pair[1])
        if falls_back and contact.closing <= 0.0:
            continue
        state.apply_impact(pair)
        found, at_once, last_s = found + 1, at_once + 1 if time_s == last_s else 1, time_s
        yield time_s, pair, contact.closing
        changed_bodies = [body for body in pair if bodies.is_movable(body)]
        for body in changed_bodies:
            impact_counts[body] += 1
            latest_states[body] = (time_s, state.select_discs((body,)))
        if at_once > _AT_ONCE and not bodies.driven and _bound_closing_speed(block, latest_states) <= slow:
            return
        for other in {other for body in changed_bodies for other in near[body]}:
            if other != pair or falls_back:
                meets_s = time_s + compute_wait(build_state(time_s, other), other)
                if meets_s <= seconds:
                    heappush(events, (meets_s, other, (impact_counts[other[0]], impact_counts[other[1]])))


def _bound_closing_speed(block: Block, latest_states: Mapping[int, tuple[float, body_states.BodyStates]]) -> float:
    """Return an upper bound for the closing speeds of discs after any further impacts, from their kinetic energy."""
    bodies, twice, lightest = block.bodies, 0.0, math.inf
    for body, (_, state) in latest_states.items():
        if bodies.is_movable(body):
            inverse, rim = bodies.inverse_inertia_ratio[body], bodies.radius[body] * state.spin_of(body)
            rotation = rim * rim / inverse if inverse else 0.0
            twice += bodies.mass[body] * (math.hypot(*state.motion_of(body)[1]) ** 2 + rotation)
            lightest = min(lightest, bodies.mass[body])
    return 2.0 * math.sqrt(twice / lightest)


def _drop_bystanders(block: Block, found: Activity, step: int) -> None:
    """Remove each pair that does not meet and whose velocity changes are explained by meetings of other pairs."""
    active, n = found.due[step], block.bodies.n
    involved = {body for pair, due_s in active.items() if due_s >= 0.0 for body in pair if body < n}
    unexplained = set(np.flatnonzero(block.velocity_changed[step]).tolist()) - involved
    for pair in [pair for pair, due_s in active.items() if np.isnan(due_s) and not unexplained.intersection(pair)]:
        del active[pair]
    if not active:
        del found.due[step]
