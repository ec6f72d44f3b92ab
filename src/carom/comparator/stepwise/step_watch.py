"""Stepwise analysis of a run. The states are analysed in blocks, so that long runs need little memory."""

from __future__ import annotations

import math
from dataclasses import replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from carom.comparator.stepwise.active_pairs import Activity, find_activity
from carom.comparator.stepwise.compare_window import (
    LARGEST_UNCHANGED,
    Comparison,
    compare_window,
    find_pairs_missed_by_pit,
)
from carom.comparator.stepwise.resting_pairs import RestHistory
from carom.comparator.stepwise.scene_bodies import Pair, SceneBodies
from carom.comparator.stepwise.step_block import Block
from carom.comparator.stepwise.step_chains import LONGEST, Chains, StepChain
from carom.comparator.thresholds import THRESHOLDS
from carom.engines.api.checks import MANTISSA_BITS
from carom.model.scene import Scene
from carom.model.step_windows import MEETING_DTYPE, REST_DTYPE, SLIP_DTYPE, WINDOW_DTYPE, LocalTruth, States
from carom.model.trace import wall_body

Array = NDArray[np.float64]

#: Largest rounding error of a number in a step, in units in the last place. The value includes the rounding of
#: products, sums and times, and a shift of the origin.
ROUNDINGS = 16

#: Relative rounding error that is allowed for velocities. The limit is larger than the rounding error of one operation,
#: because an engine may use other units and solve several contacts together. But the limit is far below any error that
#: matters for a grade.
ROUNDING_OF_VELOCITIES = 1e-11

#: Largest count of numbers in the states of a block. The largest block needs about 40 MB.
_NUMBERS = 2**19

#: Cache of the last comparisons in this process. Profiles of an engine often lead to identical runs, which are then
#: compared only once. Runs with several blocks are not cached.
_FINISHED: dict[object, LocalTruth] = {}
_MOST_FINISHED = 16

_get_row = attrgetter(*(WINDOW_DTYPE.names or ()))


def compute_local_truth(scene: Scene, states: States, *, dt_s: float, float_bits: int = 64) -> LocalTruth:
    """Compare the steps of a run with PIC, which starts from the run's own states.

    Args:
        scene: The scene.
        states: The states at the start of the scene and at the end of every step.
        dt_s: The step size, in seconds.
        float_bits: Width of the method's floats: 32 or 64 bits.
    """
    watch = StepWatch(scene, dt_s, float_bits)
    watch.add(states.select_rows(slice(1, None)))
    return watch.finish()


class StepWatch:
    """Compares the steps of a run with PIC while the run's states arrive, and returns the result at the end.

    Args:
        scene: The scene, whose start is the first state of the run.
        dt_s: The step size, in seconds.
        float_bits: Width of the method's floats: 32 or 64 bits.
    """

    def __init__(self, scene: Scene, dt_s: float, float_bits: int = 64) -> None:
        self._scene, self._dt_s, self._bodies = scene, dt_s, SceneBodies(scene)
        place_unit = ROUNDINGS * 2.0 ** -MANTISSA_BITS[float_bits]
        unit = max(place_unit, ROUNDING_OF_VELOCITIES)
        # The last number of `_units` is the largest relative difference of velocities that count as equal. PIT's errors
        # are not computed for equal velocities, so the score must allow this difference as rounding.
        self._units = (unit, place_unit, 10.0 * min(unit, THRESHOLDS.rounding_of(float_bits)))
        arrays = scene.arrays
        spins = arrays.spins[None] if self._bodies.turns else None
        #: States that are not yet analysed, or that belong to windows that are not complete.
        self._states = [States(np.zeros(1), arrays.position_m[None], arrays.velocity_m_s[None], spins)]
        self._max_states = max(_NUMBERS // (5 * len(scene.discs)), 8 * LONGEST)
        self._chains = Chains(self._bodies)
        #: Number of steps whose states are deleted (`_dropped`), whose active pairs are known (`_searched`), and whose
        #: free flight is checked (`_checked`).
        self._dropped = self._searched = self._checked = 0
        self._found_by_pit: dict[Pair, bool] = {}
        self._windows: list[tuple[float | int | bool, ...]] = []
        self._meetings: list[tuple[float | int | bool, ...]] = []
        #: For each disc and kind of change (velocity, spin, position): the size of the largest unexplained change, and
        #: its row in the result.
        self._slips: dict[tuple[int, int], tuple[float, tuple[float | int, ...]]] = {}
        self._scale = np.full(len(scene.discs), self._bodies.fast)
        self._ahead = 0
        self._turned = self._moved = self._steps = self._resting = self._invented = 0
        #: Time and disc of the first change of motion without a cause.
        self._first_invention = (math.nan, -1)
        self._rest = RestHistory()
        self._polygon = False

    def add(self, states: States) -> None:
        """Add the states at the ends of the next steps."""
        has_duration = states.time_s > np.append(self._until_s, states.time_s)[:-1]
        if not has_duration.all():  # drop steps of duration 0
            states = states.select_rows(has_duration)
        if not len(states):
            return
        if self._bodies.turns is (states.spin_rad_s is None):
            spins = np.zeros(states.position_m.shape[:2]) if self._bodies.turns else None
            states = replace(states, spin_rad_s=spins)
        self._states.append(states)
        if sum(map(len, self._states)) > self._max_states:
            self._analyse_block(ends=False)

    @property
    def _until_s(self) -> float:
        return float(self._states[-1].time_s[-1])

    def finish(self) -> LocalTruth:
        """Return the comparison of all steps. Call this method after the last state was added."""
        if self._dropped:
            return self._finish()
        states = States.joined(self._states)
        arrays = (states.time_s, states.position_m, states.velocity_m_s, states.spin_rad_s)
        key = (self._scene, self._dt_s, self._units, *(None if array is None else array.tobytes() for array in arrays))
        if (known := _FINISHED.get(key)) is None:
            known = _FINISHED[key] = self._finish()
            if len(_FINISHED) > _MOST_FINISHED:
                del _FINISHED[next(iter(_FINISHED))]
        return known

    def _finish(self) -> LocalTruth:
        until_s = self._until_s
        if sum(map(len, self._states)) > 1:
            self._analyse_block(ends=True)
        rests = [
            (i, self._to_body_number(j), *span)
            for (i, j), spans in self._rest.resting_intervals_s.items()
            for span in spans
        ]
        return LocalTruth(
            until_s=until_s,
            steps=self._steps,
            windows=np.array(self._windows, WINDOW_DTYPE),
            meetings=np.array(self._meetings, MEETING_DTYPE),
            slips=np.array([self._slips[key][1] for key in sorted(self._slips)], SLIP_DTYPE),
            ahead=self._ahead,
            slip_counts=(self._turned, self._moved),
            resting_steps=self._resting,
            sunk_radii=self._rest.sunk_radii,
            sinks_s=self._rest.sinks_s,
            polygon=self._polygon,
            rests=np.array(sorted(rests), REST_DTYPE),
            invented=self._invented,
            first_invented_s=self._first_invention[0],
            first_inventor=self._first_invention[1],
        )

    def _to_body_number(self, j: int) -> int:
        """Convert the number of a pair's second body to the body number in traces."""
        return j if j < self._bodies.n else wall_body(j - self._bodies.n)

    def _analyse_block(self, *, ends: bool) -> None:
        """Compare the complete windows of a block, and keep the states of windows that are not complete."""
        states = States.joined(self._states)
        with np.errstate(over="ignore", under="ignore"):
            block = Block(self._scene, self._bodies, states, self._dt_s, *self._units)
            activity = find_activity(block, self._rest)
            for step in sorted(step for step in activity.due if step >= self._searched - self._dropped):
                self._chains.add(self._dropped + step, activity.due[step])
            self._searched = self._dropped + len(block)
            self._chains.skip_to(self._searched)
            finished = [chain.shift_steps(-self._dropped) for chain in self._chains.take_complete(ends=ends)]
            # If large speeds cancelled in a window, a slow disc still has the rounding errors of the large speeds.
            scale = np.tile(self._scale, (len(block), 1))
            for chain in finished:
                before = float(self._scale[list(chain.discs)].max()) if chain.is_cut_at_begin else 0.0
                known = self._record_found_by_pit(block, chain)
                comparison = compare_window(block, chain, activity, known, ends=ends, speed_before=before)
                self._record(block, chain, comparison)
                for disc in chain.discs:
                    scale[chain.end :, disc] = self._scale[disc] = max(before, comparison.speed)
            open_chains = [chain.shift_steps(-self._dropped) for chain in self._chains.open_chains]
            checked_until = len(block) if ends else self._chains.complete_until - self._dropped
            flight_steps = slice(self._checked - self._dropped, checked_until)
            scale = np.maximum(scale, block.own_speed)
            self._check_free_flight(block, activity, [*finished, *open_chains], flight_steps, scale)
        self._checked = self._dropped + checked_until
        done = min([checked_until, *(chain.begin for chain in open_chains)])
        self._dropped += done
        self._states = [states.select_rows(slice(done, None))]

    def _record_found_by_pit(self, block: Block, chain: StepChain) -> dict[Pair, bool]:
        """If a chain continues a cut chain, return whether PIT finds each pair's impact; else return {}.

        If the chain is cut at its end, store the result for the next part.

        PIT always starts at the beginning of the whole chain. In later states the bodies overlap, so PIT would always
        find their impact.
        """
        known = {pair: self._found_by_pit[pair] for pair in chain.pairs if pair in self._found_by_pit}
        if not chain.is_cut_at_begin:
            known.clear()
        for pair in chain.pairs:
            self._found_by_pit.pop(pair, None)
        if chain.is_cut_at_end:
            missed = find_pairs_missed_by_pit(block, chain, [pair for pair in chain.pairs if pair not in known])
            self._found_by_pit |= {pair: known.get(pair, pair not in missed) for pair in chain.pairs}
        return known

    def _record(self, block: Block, chain: StepChain, comparison: Comparison) -> None:
        times, number = block.states.time_s, len(self._windows)
        self._windows.append(_get_row(comparison))
        for (i, j), steps in chain.pairs.items():
            due_s, steps_s = comparison.due_s.get((i, j), math.nan), (times[steps[0]], times[steps[-1] + 1])
            missed_by = ((i, j) in comparison.passed_through, (i, j) in comparison.pit_passed_through)
            self._meetings.append((number, i, self._to_body_number(j), *steps_s, due_s, *missed_by))

    def _check_free_flight(
        self, block: Block, activity: Activity, chains: list[StepChain], flight_steps: slice, scale: Array
    ) -> None:
        """Check that discs outside of windows fly freely, and count the steps in which discs rest.

        Rounding errors of speeds are proportional to `scale`.
        """
        free = ~activity.resting
        for chain in chains:
            free[max(chain.begin, 0) : chain.end, list(chain.discs)] = False
        free[: flight_steps.start] = free[flight_steps.stop :] = False
        h = block.step_s[:, None]
        # Accelerations by gravity and slowing bend paths.
        bends = np.hypot(*block.pull.T) + self._bodies.slowing.compute_deceleration(block.own_speed)
        change = np.maximum(block.velocity_change, block.rim_speed_change)
        has_turned = block.velocity_changed & free & (change > block.unit * scale)
        rounding = block.place_rounding
        allowed = 0.5 * bends * h * h
        # An engine may push overlapping bodies apart without changing their velocities.
        is_checked = free & ~has_turned & ~activity.overlapping
        has_moved = is_checked & (block.path_deviation - allowed > rounding)
        self._polygon = self._polygon or bool(np.any(is_checked & (bends > 0.0) & (block.path_deviation > rounding)))
        self._turned += int(has_turned.sum())
        self._moved += int(has_moved.sum())
        self._steps += flight_steps.stop - flight_steps.start
        self._resting += int(activity.resting[flight_steps].sum())
        relative = block.velocity_change / np.maximum(block.own_speed, 1e-300)
        spinning = block.rim_speed_change / np.maximum(block.own_speed, 1e-300)
        for step, disc in np.argwhere(has_turned & (np.maximum(relative, spinning) > LARGEST_UNCHANGED)).tolist():
            if block.has_early_turn(step, disc):
                has_turned[step, disc] = False
                self._ahead += 1
                continue
            if not self._invented:
                self._first_invention = (float(block.states.time_s[step]), disc)
            self._invented += 1
        beyond = np.where(has_moved, block.path_deviation - allowed, 0.0)
        # Store the largest unexplained changes of velocity, spin and position of each disc.
        columns = (block.velocity_change, block.rim_speed_change, beyond, block.own_speed, rounding)
        turned, spun = np.where(has_turned, relative, 0.0), np.where(has_turned, spinning, 0.0)
        for column, sizes in ((2, turned), (3, spun), (4, beyond)):
            for disc in np.flatnonzero(sizes.any(axis=0)).tolist():
                step, key = int(np.argmax(sizes[:, disc])), (disc, -column)
                size = float(sizes[step, disc])
                if key not in self._slips or size > self._slips[key][0]:
                    row = (float(block.states.time_s[step]), disc, *(float(of[step, disc]) for of in columns))
                    self._slips[key] = (size, row)
