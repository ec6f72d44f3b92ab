"""Certified run. Whenever a comparison is undecided, the run is repeated with a higher precision.

A repetition keeps the certified order of impacts, and only recomputes the motion. During a run, intervals become wider.
The precision is then lowered, because it is useless to compute with more bits than are known.
"""

from __future__ import annotations

import math
import time

import numpy as np
from flint import arb, ctx

from carom.core.extension import find_extension_notes
from carom.model.scene import Scene
from carom.model.trace import Outcome, Trace, build_edge_array, build_impact_array, build_mode_array, build_spin_array
from carom.solvers.certified.attempt import Attempt, Goal, Stop
from carom.solvers.certified.ball_arithmetic import float_above, round_to_float
from carom.solvers.certified.contacts import find_resting
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.exact import find_contact_at_start
from carom.solvers.certified.options import CertifyOptions
from carom.solvers.certified.recording import BITS_A_DIGIT, Recording, to_vector
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending
from carom.solvers.certified.slowing import speed_fraction, undamped_time_of
from carom.solvers.certified.wall_meetings import find_finite_contact_at_start
from carom.solvers.run import Progress

#: Precision of the first attempt, in bits, in addition to the bits of the requested digits. The first precision
#: suffices for a few hundred impacts in most scenes.
_FIRST_BITS = 160
#: The next precision is predicted from the bits that were lost so far, and multiplied by the first of these factors.
#: Predictions from few impacts are inaccurate. So the next precision is limited to 1.5 to 8 times the last precision.
_MARGIN, _MOST_RISE, _LEAST_RISE = 1.125, 8.0, 1.5
#: Outcomes of runs that end as requested, or with infinitely many impacts.
_OUTCOMES = {
    Ending.COMPLETED: Outcome.COMPLETED,
    Ending.MAX_IMPACTS: Outcome.MAX_IMPACTS,
    Degenerate.COLLAPSE: Outcome.STANDSTILL,
    Degenerate.CRUSH: Outcome.CRUSHED,
}


class CertifiedRun:
    """A run of a scene with proven digits.

    Attributes:
        ending: How the run ended; None before `advance` has returned.
        degeneracy: The event that could not be decided with any precision; None if all events were decided.
        replays: Number of restarts at a higher precision.
        precision_bits: Precision at the start of the last attempt, in bits.
    """

    def __init__(self, scene: Scene, options: CertifyOptions) -> None:
        self.scene = scene
        self.log = Recording(scene, options.digits)
        self.ending: Ending | None = None
        self.degeneracy: Degeneracy | None = None
        self.replays = 0
        self._options = options
        self._elapsed_s = 0.0
        self._digits_bits = math.ceil(options.digits * BITS_A_DIGIT) + 16
        self._most_bits = options.max_precision_bits
        self.precision_bits = min(self._digits_bits + _FIRST_BITS, self._most_bits)
        self._attempt = Attempt(scene, self.precision_bits, self.log)

    def advance(self, progress: Progress | None = None) -> None:
        """Certify the impacts of the scene, with higher and higher precision.

        Args:
            progress: Function called from time to time with the number of impacts and the time so far, in seconds.
        """
        begin_s = time.perf_counter()
        budget_s, max_impacts = self._options.time_budget_s, self._options.max_impacts
        deadline_s = math.inf if budget_s is None else begin_s + budget_s
        impacts = math.inf if max_impacts is None else max_impacts
        goal = Goal(self._to_undamped(self.scene.duration_s), impacts, deadline_s, progress)
        attempt = self._attempt
        with ctx.workprec(attempt.precision):
            start = find_degenerate_start(attempt.bodies)
        stop = Stop() if start is None else Stop(Ending.DEGENERATE, start)
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
        self._elapsed_s = time.perf_counter() - begin_s

    def result(self) -> CertifiedTrace:
        """Return the certified part of the run, with the final state at the exact instant at which this part ends."""
        attempt, log = self._attempt, self.log
        if self.ending is None:
            raise TypeError("the run has not been advanced")
        end_s = self.scene.duration_s if self.ending is Ending.COMPLETED else log.last_s()
        # After an interrupt or an undecided contact, the last event may be applied only in part.
        if log.events < len(attempt.events) or attempt.is_cut or self.ending is Ending.INTERRUPTED:
            attempt = Attempt(self.scene, attempt.bits, log, attempt, log.events)
            goal = Goal(self._to_undamped(end_s), len(log), math.inf, None)
            if attempt.advance(goal).ending is Ending.INTERRUPTED:
                raise KeyboardInterrupt
        bodies = attempt.bodies
        with ctx.workprec(attempt.precision):
            undamped_s = undamped_time_of(self.scene.damping_per_s, arb(end_s))
            left = speed_fraction(self.scene.damping_per_s, undamped_s)
            places = [
                bodies.centre_at(i, undamped_s) if bodies.movable[i] else bodies.centre(i, end_s)
                for i in range(len(bodies))
            ]
            velocities = [bodies.velocity(i, undamped_s, end_s) for i in range(len(bodies))]
            speeds = [(vx * left, vy * left) for vx, vy in velocities]
        with ctx.workprec(min(log.bits, attempt.precision)):
            position, velocity = (np.array([to_vector(+x, +y) for x, y in vectors]) for vectors in (places, speeds))
            spin = np.array([round_to_float(+(bodies.spin_at(i, undamped_s) * left)) for i in range(len(bodies))])
        impacts, has_edges = [row.values for row in log.rows], not self.scene.arrays.has_half_planes
        met = np.array([body for row in impacts for body in (row.first, row.second)], np.int64)
        trace = Trace(
            method="certified",
            scene=self.scene,
            impacts=build_impact_array(impacts),
            final_position_m=position[:, 0].copy(),
            final_velocity_m_s=velocity[:, 0].copy(),
            end_time_s=end_s,
            outcome=_OUTCOMES.get(self.degeneracy.kind if self.degeneracy else self.ending, Outcome.STOPPED),
            settings={"digits": log.digits, "precision_bits": attempt.bits},
            counts={"impacts": len(impacts), "replays": self.replays},
            notes=(str(self.degeneracy or self.ending.value), *find_extension_notes()),
            impacts_per_disc=np.bincount(met[met >= 0], minlength=len(bodies)).astype(np.int64),
            spins=build_spin_array(impacts) if bodies.turns else None,
            edges=build_edge_array(impacts) if has_edges else None,
            modes=build_mode_array(row.values for row in log.mode_rows) if log.mode_rows else None,
            final_spin_rad_s=spin[:, 0].copy() if bodies.turns else None,
        )
        return CertifiedTrace(
            trace=trace,
            radii=build_impact_array(row.radii for row in log.rows),
            final_position_radius_m=position[:, 1].copy(),
            final_velocity_radius_m_s=velocity[:, 1].copy(),
            spin_radii=build_spin_array(row.radii for row in log.rows) if bodies.turns else None,
            mode_radii=build_mode_array(row.radii for row in log.mode_rows) if log.mode_rows else None,
            final_spin_radius_rad_s=spin[:, 1].copy() if bodies.turns else None,
            digits=log.digits,
            ending=self.ending,
            decimals=tuple(row.decimals for row in log.rows if row.decimals),
            degeneracy=self.degeneracy if self.ending is Ending.DEGENERATE else None,
            commuted=tuple(pair for pair in self._attempt.commuted if pair[1] < len(impacts)),
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
        if trouble is not None and trouble.bits >= self._options.tie_bits:
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
            needed_bits = max(needed_bits, attempt.bits + self._options.tie_bits - stop.degeneracy.bits + _FIRST_BITS)
        return min(math.ceil(max(needed_bits, attempt.bits * _LEAST_RISE)), self._most_bits)


def find_degenerate_start(bodies: BallBodies) -> Degeneracy | None:
    """Return the first pair of bodies whose contact at the start makes the motion uncertain; None if there is none.

    A disc may start in contact with a wall below it.
    """
    lying = find_resting(bodies) if bodies.falls else ()
    grounds = {i: bodies.trace_body(ground.body) for i, ground in lying}
    degeneracy = find_contact_at_start(bodies, grounds)
    if degeneracy or bodies.scene.arrays.has_half_planes:
        return degeneracy
    return find_finite_contact_at_start(bodies.scene, grounds)
