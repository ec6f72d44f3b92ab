"""A window of a run's steps, PIC's run from the window's first state, and the differences between the two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.active_pairs import Activity
from carom.comparator.stepwise.near_pairs import MARGIN_STEPS
from carom.comparator.stepwise.scene_bodies import Pair
from carom.comparator.stepwise.step_block import Block
from carom.comparator.stepwise.step_chains import StepChain
from carom.comparator.stepwise.window_runs import WindowImpact, simulate_pic
from carom.model.trace import Vector

#: In a window, PIC lets a disc rest if the speed at which the disc approaches a body is at most the speed gained by
#: falling for this fraction of a step.
_RESTING = 1e-3


class Difference(NamedTuple):
    """PIC's state after some impacts, the number of these impacts, and the differences from a state of the run."""

    velocity: float
    spin: float
    place: float
    impacts: int
    truth: body_states.BodyStates


class Window:
    """A window of a run's steps, with the states of the run and of PIC that a comparison needs."""

    def __init__(self, block: Block, chain: StepChain, activity: Activity) -> None:
        self.block, self.chain, self.bodies, self.activity = block, chain, block.bodies, activity
        self.start, self.now = block.state(chain.begin, chain.discs), block.state(chain.end, chain.discs)
        times = block.states.time_s
        self.lasts = float(times[chain.end] - times[chain.begin])
        discs, steps = list(chain.discs), slice(chain.begin, chain.end)
        #: Rounding error of the distance between two discs, in metres.
        self.gap_rounding = 2.0 * float(np.maximum.reduce(block.place_rounding[steps, discs], axis=None))
        fastest = max(float(np.maximum.reduce(block.own_speed[steps, discs], axis=None)), 1e-300)
        seconds = self.lasts + (2.0 + MARGIN_STEPS) * block.dt_s
        # An impact may double a speed. The factor of 4 allows for two impacts that double a speed.
        reach = 4.0 * (fastest + self.bodies.fastest_wall) * seconds + self.bodies.pull * seconds**2
        self.pairs = [
            pair for pair in self.bodies.list_pairs(discs) if self.start.measure_separation(pair).gap <= reach
        ]
        is_due = any(activity.due[step][pair] >= 0.0 for pair, pair_steps in chain.pairs.items() for step in pair_steps)
        # Due to rounding, PIC may have an impact at the window's end slightly later than the run.
        beyond = self.gap_rounding / fastest if is_due else MARGIN_STEPS * block.dt_s
        self.truth, self.resting = simulate_pic(
            self.start, self.pairs, self.lasts + beyond, _RESTING * self.bodies.pull * block.dt_s
        )
        self.free = self.start.compute_later_state(self.lasts)
        states = [self.start, self.now, *(impact.after for impact in self.truth)]
        speeds = [state.find_greatest_speeds() for state in states]
        self.speed, self.rim = max(speed for speed, _ in speeds), max(rim for _, rim in speeds)
        self.speed_rounding = block.unit * self.speed

    def find_nearest_difference(
        self,
        state: body_states.BodyStates,
        truth: Sequence[WindowImpact],
        seconds: float,
        resting: Pair | None,
    ) -> Difference:
        """Return the smallest difference between a state of the run and PIC's state after any number of impacts.

        An impact of PIC may be left out only if the impact is still ahead in the run's state.
        """
        best: Difference | None = None
        for count in range(len(truth), -1, -1):
            if count < len(truth) and not self.is_ahead(state, truth[count]):
                break  # smaller counts would omit this impact, too
            last_state, since_s = (truth[count - 1].after, truth[count - 1].time_s) if count else (self.start, 0.0)
            end = last_state.compute_later_state(seconds - since_s, resting if count == len(truth) else None)
            velocity, spin, place = state.measure_difference(end)
            if best is None or velocity + spin < best.velocity + best.spin - self.speed_rounding:
                best = Difference(velocity, spin, place, count, end)
        assert best is not None  # noqa: S101 - the count of all impacts is always tried
        return best

    @property
    def meets_at_rest(self) -> bool:
        """Whether PIC's run ended because a disc came to rest, although other pairs are active in the window."""
        return self.resting is not None and any(pair != self.resting for pair in self.chain.pairs)

    def is_ahead(self, state: body_states.BodyStates, impact: WindowImpact) -> bool:
        """Whether the two bodies of an impact are apart and approach each other, on the same side as in PIC."""
        contact = state.measure_separation(impact.pair)
        along = contact.normal[0] * impact.contact.normal[0] + contact.normal[1] * impact.contact.normal[1]
        return contact.gap >= -self.gap_rounding and contact.closing > 0.0 and along > 0.0


def compute_relative_motion(state: body_states.BodyStates, pair: Pair) -> tuple[Vector, Vector]:
    """Return the position and the velocity of the second body relative to the first."""
    ((x, y), (ux, uy)), ((ox, oy), (vx, vy)) = (state.motion_of(body) for body in pair)
    return (ox - x, oy - y), (vx - ux, vy - uy)


def compute_relative_velocity(state: body_states.BodyStates, pair: Pair) -> Vector:
    """Return the velocity of the second body relative to the first."""
    return compute_relative_motion(state, pair)[1]
