"""Certified run. Whenever a comparison is undecided, the run is repeated with a higher precision.

A repetition keeps the certified order of impacts, and only recomputes the motion. During a run, intervals become wider.
The precision is then lowered, because it is useless to compute with more bits than are known.
"""

from __future__ import annotations

import math
import time

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

from carom.core.extension import find_extension_notes
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace, build_impact_array, build_mode_array, build_spin_array
from carom.solvers.certified.attempt import Attempt, Goal, Stop
from carom.solvers.certified.ball_arithmetic import float_above, round_to_float
from carom.solvers.certified.contacts import BallContacts
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.exact import find_contact_at_start
from carom.solvers.certified.recording import BITS_A_DIGIT, Recording, to_vector
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending
from carom.solvers.certified.slowing import speed_fraction, undamped_time_of
from carom.solvers.certified.wall_meetings import find_finite_contact_at_start
from carom.solvers.options import require_goal
from carom.solvers.run import Progress

#: Precision of the first attempt, in bits, in addition to the bits of the requested digits. This precision suffices for
#: a few hundred impacts in most scenes.
_FIRST_BITS = 160
#: The next precision is predicted from the bits that were lost so far, and multiplied by the first of these factors.
#: Predictions from few impacts are inaccurate. So the next precision is limited to 1.5 to 8 times the last precision.
_MARGIN, _MOST_RISE, _LEAST_RISE = 1.125, 8.0, 1.5
#: Outcomes of runs that end with infinitely many impacts: a collapse or a crush.
_ENDLESS = {Degenerate.COLLAPSE: Outcome.STANDSTILL, Degenerate.CRUSH: Outcome.CRUSHED}
#: Outcomes of runs that can be advanced further. The keys are the endings of these runs.
_GOES_ON = {
    None: Outcome.COMPLETED,
    Ending.COMPLETED: Outcome.COMPLETED,
    Ending.MAX_IMPACTS: Outcome.MAX_IMPACTS,
}


class CertifiedRun:
    """A run of a scene with proven digits; implements `carom.solvers.run.Run`.

    If a run is advanced in several calls, its digits are the same as with one call. Error bounds can differ, because
    the precision depends on the calls. A run that ended early can't be advanced further.

    Attributes:
        ending: How the last call of `advance_to` ended; None before the first call.
        degeneracy: The event that could not be decided with any precision; None if all events were decided.
        replays: Number of restarts at a higher precision.
        precision_bits: Precision at the start of the last attempt, in bits.
    """

    def __init__(self, scene: Scene, *, digits: int, max_precision_bits: int, tie_bits: int) -> None:
        self.scene = scene
        self.log = Recording(scene, digits)
        self.time_s = 0.0
        self.ending: Ending | None = None
        self.degeneracy: Degeneracy | None = None
        self.replays = 0
        self._elapsed_s = 0.0
        self._digits_bits = math.ceil(digits * BITS_A_DIGIT) + 16
        self._most_bits, self._tie_bits = max_precision_bits, tie_bits
        self.precision_bits = min(self._digits_bits + _FIRST_BITS, max_precision_bits)
        self._attempt = Attempt(scene, self.precision_bits, self.log)

    @property
    def counts(self) -> dict[str, int]:
        """Number of impacts, and number of restarts with a higher precision."""
        return {"impacts": len(self.log), "replays": self.replays}

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user: how the run ended, and whether the compiled extension is out of date."""
        reason = self.degeneracy or (self.ending and self.ending.value)
        return (*([str(reason)] if reason else []), *find_extension_notes())

    @property
    def outcome(self) -> Outcome:
        """The outcome that a trace of this run contains."""
        if self.degeneracy is not None and self.degeneracy.kind in _ENDLESS:
            return _ENDLESS[self.degeneracy.kind]
        return _GOES_ON.get(self.ending, Outcome.STOPPED)

    def advance_to(
        self,
        time_s: float,
        max_impacts: int | None = None,
        progress: Progress | None = None,
        time_budget_s: float | None = None,
    ) -> Outcome:
        """Certify every impact up to and including `time_s`, with higher and higher precision.

        Args:
            time_s: Seconds from the start.
            max_impacts: Stop after this many impacts in all; None for no limit.
            progress: Function called at intervals with the number of impacts and the time so far, in seconds.
            time_budget_s: Limit of elapsed seconds; None for no limit.

        Raises:
            InputError: `time_s` is NaN or no number, or `max_impacts` is not a whole number of 0 or more.
        """
        require_goal(time_s, max_impacts)
        if self.ending not in _GOES_ON:
            return self.outcome
        begin_s = time.perf_counter()
        deadline_s = math.inf if time_budget_s is None else begin_s + time_budget_s
        goal = Goal(self._to_undamped(time_s), math.inf if max_impacts is None else max_impacts, deadline_s, progress)
        with ctx.workprec(self._attempt.precision):
            start = find_degenerate_start(self._attempt.bodies) if self.ending is None else None
        stop = Stop() if start is None else Stop(Ending.DEGENERATE, start)
        attempt = self._attempt
        while stop.ending is None:
            stop = self._decide_ending(attempt.advance(goal), attempt)
            if attempt.has_replayed:  # the previous attempt is no longer needed
                self._attempt = attempt
            if stop.ending is None:
                self.precision_bits = self._choose_next_bits(attempt, stop, goal)
                attempt = Attempt(self.scene, self.precision_bits, self.log, self._attempt)
                self.replays += 1
        self.log.convert()
        self.ending, self.degeneracy = stop
        reached_s = self.log.last_s()
        self.time_s = max(self.time_s, time_s if self.ending is Ending.COMPLETED else reached_s)
        self._elapsed_s += time.perf_counter() - begin_s
        return self.outcome

    def positions(self) -> NDArray[np.float64]:
        """Return the current centres, in metres, shape ``(n, 2)``."""
        return self.result().trace.final_position_m

    def velocities(self) -> NDArray[np.float64]:
        """Return the current velocities, in m/s, shape ``(n, 2)``."""
        return self.result().trace.final_velocity_m_s

    def spins(self) -> NDArray[np.float64] | None:
        """Return the current spins, in rad/s; None if no disc turns."""
        return self.result().trace.final_spin_rad_s

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of certified impacts of each disc, shape ``(n,)``."""
        bodies = [body for row in self.log.rows for body in (row.values.first, row.values.second) if body >= 0]
        return np.bincount(np.array(bodies, np.int64), minlength=len(self.scene.discs)).astype(np.int64)

    def result(self) -> CertifiedTrace:
        """Return the certified part of the run. The final state of this part is at the exact instant `time_s`."""
        attempt, impacts = self._attempt, len(self.log)
        # After an interrupt or an undecided contact, the last event may be applied only in part.
        if self.log.events < len(attempt.events) or attempt.is_cut or self.ending is Ending.INTERRUPTED:
            attempt = Attempt(self.scene, attempt.bits, self.log, attempt, self.log.events)
            if (
                attempt.advance(Goal(self._to_undamped(self.time_s), impacts, math.inf, None)).ending
                is Ending.INTERRUPTED
            ):
                raise KeyboardInterrupt
        bodies = attempt.bodies
        with ctx.workprec(attempt.precision):
            undamped_s = undamped_time_of(self.scene.damping_per_s, arb(self.time_s))
            left = speed_fraction(self.scene.damping_per_s, undamped_s)
            places = [
                bodies.centre_at(i, undamped_s) if bodies.movable[i] else bodies.centre(i, self.time_s)
                for i in range(len(bodies))
            ]
            velocities = [bodies.velocity(i, undamped_s, self.time_s) for i in range(len(bodies))]
            speeds = [(vx * left, vy * left) for vx, vy in velocities]
        with ctx.workprec(min(self.log.bits, attempt.precision)):
            position, velocity = (np.array([to_vector(+x, +y) for x, y in vectors]) for vectors in (places, speeds))
            spin = np.array([round_to_float(+(bodies.spin_at(i, undamped_s) * left)) for i in range(len(bodies))])
        trace = Trace(
            method="certified",
            scene=self.scene,
            impacts=self.log.array(),
            final_position_m=position[:, 0].copy(),
            final_velocity_m_s=velocity[:, 0].copy(),
            end_time_s=self.time_s,
            outcome=self.outcome,
            settings={"digits": self.log.digits, "precision_bits": attempt.bits},
            counts=self.counts,
            notes=self.notes,
            impacts_per_disc=self.impacts_per_disc(),
            spins=self.log.spins(),
            edges=self.log.edges(),
            modes=self.log.modes(),
            final_spin_rad_s=spin[:, 0].copy() if bodies.turns else None,
        )
        return CertifiedTrace(
            trace=trace,
            radii=build_impact_array(row.radii for row in self.log.rows),
            final_position_radius_m=position[:, 1].copy(),
            final_velocity_radius_m_s=velocity[:, 1].copy(),
            spin_radii=build_spin_array(row.radii for row in self.log.rows) if bodies.turns else None,
            mode_radii=build_mode_array(row.radii for row in self.log.mode_rows) if self.log.mode_rows else None,
            final_spin_radius_rad_s=spin[:, 1].copy() if bodies.turns else None,
            digits=self.log.digits,
            ending=self.ending or Ending.COMPLETED,
            decimals=tuple(row.decimals for row in self.log.rows if row.decimals),
            degeneracy=self.degeneracy if self.ending is Ending.DEGENERATE else None,
            commuted=tuple(pair for pair in self._attempt.commuted if pair[1] < impacts),
            precision_bits=attempt.bits,
            bits_lost=float(attempt.bits_lost()),
            replays=self.replays,
            elapsed_s=self._elapsed_s,
        )

    def _to_undamped(self, time_s: float) -> arb:
        with ctx.workprec(self._most_bits):
            return undamped_time_of(self.scene.damping_per_s, arb(time_s))

    def _decide_ending(self, stop: Stop, attempt: Attempt) -> Stop:
        """Return the end of the run after an attempt. If a higher precision may help, the ending is None."""
        trouble = stop.degeneracy
        if stop.ending is not None:
            return stop
        if trouble is not None and trouble.bits >= self._tie_bits:
            return Stop(Ending.DEGENERATE, trouble)
        if attempt.bits < self._most_bits:
            return stop
        undecided = trouble is not None and trouble.bits >= self._digits_bits
        return Stop(Ending.DEGENERATE if undecided else Ending.PRECISION_CAP, trouble)

    def _choose_next_bits(self, attempt: Attempt, stop: Stop, goal: Goal) -> int:
        """Return the next precision, in bits, predicted from the bits that were lost so far."""
        done = max(len(attempt.events), 1)
        reached_s = max(attempt.bodies.time)
        expected = done * (float_above(goal.time) / reached_s) if reached_s > 0 else math.inf
        target = min(expected * _MARGIN, goal.impacts)
        bits_per_event = attempt.bits_lost() / done
        needed_bits = self._digits_bits + (bits_per_event * target * _MARGIN if bits_per_event else 0) + _FIRST_BITS
        needed_bits = min(needed_bits, attempt.bits * _MOST_RISE)
        if stop.degeneracy is not None:  # use enough bits to decide this event
            needed_bits = max(needed_bits, attempt.bits + self._tie_bits - stop.degeneracy.bits + _FIRST_BITS)
        return min(math.ceil(max(needed_bits, attempt.bits * _LEAST_RISE)), self._most_bits)


def find_degenerate_start(bodies: BallBodies) -> Degeneracy | None:
    """Return the first pair of bodies whose contact at the start makes the motion uncertain; None if there is none.

    A disc may start in contact with a wall below it.
    """
    lying = BallContacts(bodies).find_resting() if bodies.falls else ()
    grounds = {i: bodies.trace_body(ground.body) for i, ground in lying}
    degeneracy = find_contact_at_start(bodies, grounds)
    if degeneracy or bodies.scene.arrays.has_half_planes:
        return degeneracy
    return find_finite_contact_at_start(bodies.scene, grounds)
