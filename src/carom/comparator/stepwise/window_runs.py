"""Short runs of PIC and PIT from any state of a few bodies, for the time of a window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.waits import compute_wait, compute_wait_again

#: Largest number of impacts within a window. Bodies that are not elastic may have infinitely many impacts.
MOST_IMPACTS = 2000


class WindowImpact(NamedTuple):
    """One impact in a window: the seconds since the window's start, the pair, its separation and the state after it."""

    time_s: float
    pair: Pair
    contact: body_states.Separation
    after: body_states.BodyStates


def simulate_pic(
    start: body_states.BodyStates, pairs: Sequence[Pair], seconds: float, resting_speed: float
) -> tuple[list[WindowImpact], Pair | None]:
    """Return PIC's impacts from a state, and the pair that came to rest (or None).

    Two bodies that have just met usually do not meet again before a third body changes the path of one of them. But
    gravity may bring a disc back to an immovable body, and a disc may meet a curved wall again. A disc that gravity
    brings back at `resting_speed` (metres per second) or less rests, and the run ends.
    """
    state, now_s, impacts = start.copy(), 0.0, list[WindowImpact]()
    waits = {pair: compute_wait(state, pair) for pair in pairs}
    while waits and len(impacts) < MOST_IMPACTS:
        pair = min(waits, key=waits.__getitem__)
        at_s = waits[pair]
        if not at_s <= seconds:
            break
        state.move_freely(max(at_s - now_s, 0.0))
        now_s = max(at_s, now_s)
        feature, bodies = state.met.get(pair, body_states.NO_FEATURE), state.bodies
        contact = state.measure_separation(pair, feature)
        falls_back = bodies.is_pulled(pair[0]) != bodies.is_pulled(pair[1])
        if falls_back and contact.closing <= resting_speed:
            return impacts, pair
        state.apply_impact(pair, feature)
        impacts.append(WindowImpact(now_s, pair, contact, state.copy()))
        struck_bodies = {body for body in pair if bodies.is_movable(body)}
        bends = pair[1] >= bodies.n and not isinstance(bodies.walls[pair[1] - bodies.n], tuple)
        for other in waits:
            if other == pair and bends:
                waits[other] = now_s + compute_wait(state, other, state.met[pair])
            elif struck_bodies.intersection(other):
                has_just_met = other == pair and not falls_back
                compute = compute_wait_again if has_just_met else compute_wait
                waits[other] = now_s + compute(state, other)
    return impacts, None


def simulate_pit(
    start: body_states.BodyStates, pairs: Sequence[Pair], seconds: float, dt_s: float, first_s: float
) -> list[WindowImpact]:
    """Return PIT's impacts from a state.

    PIT first checks for overlap after `first_s` seconds, and then once per step.
    """
    state, now_s, impacts = start.copy(), 0.0, list[WindowImpact]()
    checks = math.floor((seconds - first_s) / dt_s * body_states.TOUCH) + 1 if first_s <= seconds else 0
    for check in range(checks):
        state.move_freely(first_s + check * dt_s - now_s)
        now_s = first_s + check * dt_s
        for pair in pairs:
            if state.are_overlapping(pair) and (contact := state.measure_separation(pair)).closing > 0.0:
                state.apply_impact(pair)
                impacts.append(WindowImpact(now_s, pair, contact, state.copy()))
    return impacts
