"""Runs a scene on an engine, reads the engine's state after each step, and builds a trace from the states."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from carom.comparator.slowing import Slowing
from carom.comparator.stepwise.step_watch import StepWatch
from carom.engines.api import Adapter, Contact, Observation, QuietWorld, World
from carom.engines.registry import has_part, load_adapter
from carom.execution.adapter_profile import load_supported_adapter, prepare_settings
from carom.execution.codec import CarriedTrace
from carom.execution.job import PIT_METHOD, Answer, Job, JobTask, SettingOverrides, Status
from carom.execution.observation.final_state import LastStep, compute_gravity
from carom.execution.observation.free_flight import QUIET_STEPS, FreeFlight
from carom.execution.observation.impact_collector import ImpactCollector
from carom.execution.observation.state_rows import StateRows
from carom.execution.observation.step_cutter import Cutter
from carom.execution.observation.validate_observation import Validator
from carom.execution.phases import generate_phases
from carom.execution.pool import TaskRunner
from carom.execution.validate_adapter import (
    build_adapter_error,
    to_plain_counts,
    to_plain_settings,
    to_plain_text,
    to_whole_number,
)
from carom.model.scene import Scene
from carom.model.trace import Outcome, Samples, Trace, resolve_profile
from carom.support.limits import LARGEST

#: A trace stores states of the run if discs may come to rest. Largest number of discs in scenes whose states are
#: stored, and largest number of stored states.
MOST_STORED_DISCS = 10
MOST_STORED_STATES = 256

#: States are stored in blocks of about 3 MB. Number of states in a block, multiplied by the number of discs.
_ROWS = 2**16

#: Largest rounding error of an instant divided by the step size. The error is the sum of two roundings, each at most
#: 2^-21 for at most 2^32 steps (`MOST_STEPS`). The value only affects how many steps one call takes.
_ROUNDED = 2.0**-20

#: Largest number of samples, which are positions for drawing. No picture is wider than this number of pixels.
MOST_SAMPLES = 4096


@dataclass(frozen=True)
class ObserveTask(JobTask):
    """Run a job in a worker process and return its trace."""

    samples: bool = False

    def carry_out(self) -> CarriedTrace:
        """Return the trace of the run."""
        job = self.job
        adapter, overrides = load_supported_adapter(job), job.method.overrides
        return observe_run(adapter, job.scene, job.profile, job.dt_s, overrides=overrides, samples=self.samples)


def observe_job(job: Job, runner: TaskRunner, *, samples: bool = False) -> Answer[Trace]:
    """Run a job and return its trace, or the reason why there is no trace."""
    return check_own_scene(job, runner.run(ObserveTask(job, samples)))


def check_own_scene(job: Job, answer: Answer[Trace]) -> Answer[Trace]:
    """Replace the trace's scene by the equal scene object of the job. If the scenes differ, return a failed answer."""
    if answer.value is None:
        return answer
    if answer.value.scene != job.scene:
        return Answer(Status.FAILED, "invalid answer: a trace of another scene")
    return replace(answer, value=replace(answer.value, scene=job.scene))


def observe_run(
    adapter: Adapter,
    scene: Scene,
    profile: str,
    dt_s: float,
    *,
    overrides: SettingOverrides = (),
    samples: bool = False,
    stepwise: bool = True,
) -> Trace:
    """Run a scene, observe it after each step, and return the trace.

    The run stops early when no further impact is possible. The final state is computed from the state after the last
    step: the discs move on without impacts until the end of the scene.

    Args:
        adapter: Adapter of the engine.
        scene: The scene.
        profile: Name of the profile.
        dt_s: Step size, in seconds.
        overrides: Settings that are used instead of the profile's settings.
        samples: Whether to keep positions for drawing.
        stepwise: Whether to compare each step with a step of PIC from the same state. The trace contains the comparison
            as `local_truth`.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The adapter refuses the scene, or fails.
    """
    settings = prepare_settings(adapter, profile, dt_s, overrides)
    run = _Run(scene, dt_s, adapter.capabilities.float_bits, samples=samples, stepwise=stepwise)
    world = adapter.prepare(scene, settings)
    missing = [part for part in ("settings", "advance", "observe", "close") if not has_part(world, part)]
    if missing:
        lacks = f"a {type(world).__name__} has no {', '.join(missing)}"
        raise build_adapter_error(f"prepare() must return a world; {lacks}")
    try:
        used = to_plain_settings(world.settings, "of a world")
        world.observe()  # some engines record contacts only after the first observation
        cutter = Cutter(world) if adapter.profiles[profile].located else None
        run.take_steps(world, cutter, FreeFlight(scene, dt_s, adapter.capabilities.float_bits))
        counting: Any = world  # `counts` is optional
        own_counts = to_plain_counts(counting.counts if has_part(counting, "counts") else {})
    finally:
        world.close()
    counts = {"steps": run.steps_taken, "steps_skipped": run.steps - run.steps_taken, **own_counts}
    if cutter is not None:
        counts |= {"pieces": cutter.pieces, "probes": cutter.probes}
    return replace(
        run.build_trace(to_plain_text(adapter.name, "the name of an adapter")),
        profile=resolve_profile(adapter.name, profile),
        overrides=dict(overrides),
        settings=used,
        float_bits=adapter.capabilities.float_bits,
        counts=counts,
    )


def run_pit(scene: Scene, dt_s: float) -> Trace:
    """Run a scene with PIT, whose only errors come from checking once per step."""
    return observe_run(load_adapter(PIT_METHOD.engine), scene, PIT_METHOD.profile, dt_s)


def choose_stored_steps(steps: int) -> frozenset[int]:
    """Return the numbers of the steps after which the state is stored: at most `MOST_STORED_STATES` of all steps.

    A run with more steps is divided into equal intervals, and the state after one quasi-random step of each interval is
    stored. If stored steps were equally spaced, a disc that hops every two steps could seem to rest.
    """
    stretch = -(-steps // MOST_STORED_STATES)
    begins = range(0, steps, stretch)
    phases = generate_phases(len(begins))
    return frozenset(min(begin + 1 + int(stretch * phase), steps) for begin, phase in zip(begins, phases, strict=True))


class _Run:
    """State of a run so far. Positions are stored every `stride` steps."""

    def __init__(self, scene: Scene, dt_s: float, float_bits: int, *, samples: bool, stepwise: bool) -> None:
        self.scene, self.dt_s, self.samples = scene, dt_s, samples
        self.steps, self.steps_taken = scene.step_count(dt_s), 0
        arrays, discs = scene.arrays, len(scene.discs)
        #: The latest states, and the number of the row with the present state. The first row is the initial state of
        #: the scene, or a copy of the last row of the previous block.
        self.rows, self.row = StateRows(1 + min(self.steps, max(_ROWS // discs, 2)), discs), 0
        self.rows.position_m[0], self.rows.velocity_m_s[0] = arrays.position_m, arrays.velocity_m_s
        self.rows.spin_rad_s[0], self.rows.has_spins = arrays.spins, arrays.turns
        self.contacts = tuple[Contact, ...]()
        #: Time and state after the last step before this block; never after the scene's end.
        self.before_block = (0.0, self.state)
        self.collector, self.collected = ImpactCollector(scene, self.state, float_bits), 0
        self.watch = StepWatch(scene, dt_s, float_bits) if stepwise else None
        self.validator = Validator(scene, dt_s, float_bits)
        self.outcome, self.notes = Outcome.COMPLETED, tuple[str, ...]()
        self.positions = [arrays.position_m]
        self.stride = -(-self.steps // MOST_SAMPLES)
        may_rest = scene.gravity_m_s2 != (0.0, 0.0) and bool(scene.walls) and len(scene.discs) <= MOST_STORED_DISCS
        self.stored_steps = choose_stored_steps(self.steps) if stepwise and may_rest else frozenset[int]()
        self.stored, self.stored_count = StateRows(len(self.stored_steps), discs), 0

    @property
    def state(self) -> Observation:
        """The current state, with the contacts of the last step."""
        return self.rows.observation(self.row, self.contacts)

    def find_last_state(self, before_row: int) -> tuple[float, Observation]:
        """Return time and state of the last row that is before `before_row` and not after the scene's end."""
        rows_within = np.flatnonzero(self.rows.time_s[:before_row] <= self.scene.duration_s)
        if not len(rows_within):
            return self.before_block
        return float(self.rows.time_s[rows_within[-1]]), self.rows.observation(int(rows_within[-1]))

    def take_steps(self, world: World, cutter: Cutter | None, flight: FreeFlight) -> None:
        """Take steps until the end of the scene, or until no further impact is possible."""
        bends = compute_gravity(self.scene).any() or Slowing.of(self.scene)
        straight = not (bends or self.scene.arrays.driven)
        takes_quiet_steps = cutter is None and hasattr(type(world), "take_quiet_steps")
        while self.steps_taken < self.steps:
            observed = None
            if takes_quiet_steps and not self.collector.open:
                observed = self._take_quiet_steps(cast("QuietWorld", world), flight if straight else None)
            step = self.steps_taken + 1
            pieces: Iterable[float] = (step * self.dt_s,)
            if observed is None and cutter is not None:
                pieces = cutter.take_step((step - 1) * self.dt_s, step * self.dt_s)
            elif observed is None:
                world.advance(1)
            for time_s in pieces:
                if not self._add_state(world.observe() if observed is None else observed, time_s):
                    return
                if self.outcome is Outcome.STANDSTILL:
                    self.steps_taken = step
                    return
            if cutter is not None and cutter.has_too_many_pieces:
                self.outcome = Outcome.STANDSTILL
                return
            self.steps_taken = step
            self._keep_states(range(step, step + 1), self.row)
            if straight and flight.has_begun(step * self.dt_s, self.state):
                return

    def _take_quiet_steps(self, world: QuietWorld, flight: FreeFlight | None) -> Observation | None:
        """Take many steps in one call. Stop after a step with contacts or a warning, or when free flight is possible.

        Return the observation after the last step. Store the states after all earlier steps. If only one step may be
        taken, take no step and return None. Call this method only while no contact continues from the last step.
        """
        if self.row + 1 == len(self.rows.time_s):
            self._begin_rows()
        rows, begin, first = self.rows, self.row + 1, self.steps_taken + 1
        count = min(self.steps - self.steps_taken, len(rows.time_s) - begin)
        if flight is not None and flight.next_check_s < self.steps * self.dt_s:
            count = min(count, math.ceil(flight.next_check_s / self.dt_s - _ROUNDED) - self.steps_taken)
        if count <= 1:
            return None
        part = slice(begin, begin + count)
        found = world.take_quiet_steps(rows.position_m[part], rows.velocity_m_s[part], rows.spin_rad_s[part])
        steps_taken = to_whole_number(found, "the result of take_quiet_steps()", smallest=1)
        if steps_taken > count:
            raise build_adapter_error(f"the result of take_quiet_steps() must be at most {count}, got {steps_taken}")
        if steps_taken == 1:
            return world.observe()
        sizes = np.abs(rows.numbers[begin : begin + steps_taken - 1])
        are_reliable = bool(np.maximum.reduce(sizes, axis=None) <= LARGEST)  # false if a number is NaN
        if not are_reliable:
            steps_taken = 1 + int(np.argmin(np.maximum.reduce(sizes, axis=1) <= LARGEST))
        steps = range(first, first + steps_taken - 1)
        rows.time_s[begin : begin + len(steps)] = np.arange(first, first + len(steps)) * self.dt_s
        self._keep_states(steps, begin)
        if flight is not None:
            for row in range(begin, begin + len(steps))[-QUIET_STEPS:]:
                flight.add_state(float(rows.time_s[row]), rows.observation(row))
        self.row += len(steps)
        self.steps_taken += len(steps)
        return world.observe() if are_reliable else rows.observation(begin + steps_taken - 1)

    def _keep_states(self, steps: range, row: int) -> None:
        """Store some of the states after `steps` for the trace. Row number `row` contains the first of these states."""
        rows, shift = self.rows, row - steps.start
        for step in sorted(self.stored_steps.intersection(steps)):
            self.stored.numbers[self.stored_count] = rows.numbers[step + shift]
            self.stored.time_s[self.stored_count] = step * self.dt_s
            self.stored_count += 1
        if self.samples:
            self.positions += [rows.position_m[step + shift].copy() for step in steps if step % self.stride == 0]

    def _add_state(self, found: Observation, time_s: float) -> bool:
        """Add a state and its contacts. If the state is not finite, add nothing and return False."""
        if self.row + 1 == len(self.rows.time_s):
            self._begin_rows()
        rows, row = self.rows, self.row + 1
        is_finite = self.validator.read(found, rows, row)
        if found.warning != "" or not is_finite:
            self.outcome, self.notes = _classify_end(str.__str__(found.warning))
            if self.outcome is not Outcome.STANDSTILL:
                return False
        contacts: Any = found.contacts
        if contacts != ():  # most steps have no contacts
            contacts = self.validator.check_contacts(contacts, float(rows.time_s[self.row]), time_s)
        self.contacts = contacts
        rows.time_s[row] = time_s
        self.row = row
        if self.contacts or self.collector.open:
            if self.collected != row - 1:
                self.collector.skip_to(float(rows.time_s[row - 1]), rows.observation(row - 1))
            self.collector.add(time_s, self.state)
            self.collected = row
        return True

    def _begin_rows(self) -> None:
        """Begin a new block of rows, whose first row is the present state."""
        self._pass_on_states()
        self.before_block = self.find_last_state(self.row + 1)
        last, self.rows = self.rows, StateRows(len(self.rows.time_s), len(self.scene.discs))
        self.rows.numbers[0], self.rows.time_s[0] = last.numbers[self.row], last.time_s[self.row]
        self.rows.has_spins = last.has_spins
        self.collected -= self.row
        self.row = 0

    def _pass_on_states(self) -> None:
        """Pass the block's states to the step-by-step comparison. Omit the first state, which was already passed."""
        if self.watch is not None:
            self.watch.add(self.rows.states(slice(1, self.row + 1)))

    def build_trace(self, method: str) -> Trace:
        """Return the trace, with the final state advanced to the end of the scene."""
        self._pass_on_states()
        self.stored.has_spins = self.rows.has_spins
        completed, duration_s = self.outcome is Outcome.COMPLETED, self.scene.duration_s
        impacts, effective, states, spins = self.collector.finish()
        last = LastStep(self.scene, *self.find_last_state(self.row), self.steps_taken * self.dt_s, self.state)
        missing_s = duration_s - last.end_s if completed else 0.0
        end_s = last.end_s + missing_s
        if missing_s < 0.0:  # the last step ends after the scene's end
            later = (impacts["time_s"] > duration_s) | (effective > duration_s)
            after = impacts[later]
            impacts, effective, states = impacts[~later], effective[~later], states[~later]
            spins = None if spins is None else spins[~later]
            turned_s = np.where(np.isfinite(effective), effective, impacts["time_s"])
            bodies = np.concatenate([after["first"], after["second"]])
            discs, until_s = sorted({*bodies[bodies >= 0].tolist()}), last.end_s
            if self.scene.table_deceleration_m_s2:  # the earlier path of a disc that has stopped is unknown
                discs, until_s = [*range(len(self.scene.discs))], duration_s
            last = last.undo_later_impacts(discs, until_s, impacts, turned_s, spins)
        if self.samples and completed:
            for step in range(len(self.positions) * self.stride, self.steps + 1, self.stride):
                seconds = (step - self.steps_taken) * self.dt_s
                self.positions.append(last.state.position_m + last.state.velocity_m_s * seconds)
        final = last.move_to(duration_s if completed else last.end_s)
        instants_s = np.arange(len(self.positions), dtype=np.float64) * (self.stride * self.dt_s)
        return Trace(
            method=method,
            scene=self.scene,
            impacts=impacts,
            final_position_m=final.position_m,
            final_velocity_m_s=final.velocity_m_s,
            end_time_s=end_s,
            outcome=self.outcome,
            dt_s=self.dt_s,
            effective_time_s=effective,
            state_before=states,
            samples=Samples(instants_s, np.array(self.positions)) if self.samples else None,
            notes=self.notes,
            spins=spins,
            final_spin_rad_s=final.spin_rad_s,
            local_truth=None if self.watch is None else self.watch.finish(),
            observed_states=self.stored.states(slice(self.stored_count)) if self.stored_count else None,
        )


def _classify_end(warning: str) -> tuple[Outcome, tuple[str, ...]]:
    """Return outcome and notes of a run that ended early, because of a warning or a state that is not finite."""
    if not warning:
        return Outcome.NON_FINITE, ()
    if warning == Outcome.STANDSTILL.value:  # a standstill is not a fault: the state is valid
        return Outcome.STANDSTILL, ()
    return Outcome.WARNED, (warning,)
