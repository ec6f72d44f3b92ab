"""Certified run, which is repeated at a higher precision whenever a comparison is undecided.

A repetition keeps the certified order of impacts and only recomputes the motion. The working precision is lowered as
the balls grow, because the lost bits are meaningless.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from flint import arb, ctx

from carom.core.extension import find_extension_notes
from carom.model.trace import Outcome, Trace, impact_array, mode_array, spin_array
from carom.solvers.certified.accumulation import without_end
from carom.solvers.certified.ball_bodies import BallBodies
from carom.solvers.certified.balls import float_above, nearest
from carom.solvers.certified.contacts import BallContacts
from carom.solvers.certified.exact import contact_at_start
from carom.solvers.certified.impacts import BallEvent, carry_out
from carom.solvers.certified.meeting import Meeting
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.recording import BITS_A_DIGIT, Recording, enclosed
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending, Undecided
from carom.solvers.certified.selection import OutOfTime, Selection
from carom.solvers.certified.slowing import kept, slow, undamped
from carom.solvers.certified.wall_meetings import finite_contact_at_start
from carom.solvers.options import require_goal

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.model.scene import Scene
    from carom.solvers.run import Progress

#: Number of events between two checks of accuracy and progress.
_CHUNK = 32
#: Bits of the first attempt in addition to the requested digits: enough for a few hundred impacts in most scenes.
_FIRST_BITS = 160
#: Bits by which the working precision exceeds the accuracy of the most accurate disc.
_GUARD_BITS = 24
#: The next precision is the prediction from the bits lost so far times 1.125. The next precision is between 1.5 and 8
#: times the last one, since the first impacts predict little.
_MARGIN, _MOST_RISE, _LEAST_RISE = 1.125, 8.0, 1.5
#: The working precision is lowered if less than this fraction is useful.
_LOWER_AT = 0.9
#: Outcomes with infinitely many impacts.
_ENDLESS = {Degenerate.COLLAPSE: Outcome.STANDSTILL, Degenerate.CRUSH: Outcome.CRUSHED}
#: Outcome of a run for each ending from which the run can be advanced further.
_GOES_ON = {
    None: Outcome.COMPLETED,
    Ending.COMPLETED: Outcome.COMPLETED,
    Ending.MAX_IMPACTS: Outcome.MAX_IMPACTS,
}


#: Key of an event at the start.
_START = (-1, -1, 0.0)


class Goal(NamedTuple):
    """Goal of a run: a time of the undamped run, a number of impacts, and a deadline as `time.perf_counter`."""

    time: arb
    impacts: float
    deadline_s: float
    progress: Progress | None


class Stop(NamedTuple):
    """Result of an attempt: its ending, or the undecided event; neither if the balls became too wide."""

    ending: Ending | None = None
    degeneracy: Degeneracy | None = None


class CertifiedRun:
    """A run of a scene with proven digits; implements `carom.solvers.run.Run`.

    Advancing a run in pieces gives the same digits as in one piece. Radii can differ, since the precision depends on
    the goal. A run that ended early can't be advanced further.

    Attributes:
        ending: How the last call of `advance_to` ended; None before the first call.
        degeneracy: The event that no precision decided; None without such an event.
        replays: Number of restarts at a higher precision.
        precision_bits: Initial bits of the last attempt.
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
        """Number of impacts and replays."""
        return {"impacts": len(self.log), "replays": self.replays}

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user: how the run ended, and whether the compiled extension is out of date."""
        what = self.degeneracy or (self.ending and self.ending.value)
        return (*([str(what)] if what else []), *find_extension_notes())

    @property
    def outcome(self) -> Outcome:
        """How the run ended, as the outcome of a trace."""
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
        """Certify every impact up to and including `time_s`, at rising precision.

        Args:
            time_s: Seconds from the start.
            max_impacts: Stop after this many impacts in all; None for no limit.
            progress: Called at intervals with the number of impacts so far and the time reached, seconds.
            time_budget_s: Limit of elapsed seconds; None for no limit.

        Raises:
            InputError: `time_s` is NaN or no number, or `max_impacts` is not a whole number of 0 or more.
        """
        require_goal(time_s, max_impacts)
        if self.ending not in _GOES_ON:
            return self.outcome
        begin_s = time.perf_counter()
        deadline_s = math.inf if time_budget_s is None else begin_s + time_budget_s
        goal = Goal(self._undamped(time_s), math.inf if max_impacts is None else max_impacts, deadline_s, progress)
        with ctx.workprec(self._attempt.precision):
            start = trouble_at_start(self._attempt.bodies) if self.ending is None else None
        stop = Stop() if start is None else Stop(Ending.DEGENERATE, start)
        attempt = self._attempt
        while stop.ending is None:
            stop = self._judge(attempt.advance(goal), attempt)
            if attempt.has_replayed:  # the previous attempt can't improve the estimate any more
                self._attempt = attempt
            if stop.ending is None:
                self.precision_bits = self._next_bits(attempt, stop, goal)
                attempt = Attempt(self.scene, self.precision_bits, self.log, self._attempt)
                self.replays += 1
        self.log.convert()
        self.ending, self.degeneracy = stop
        reached_s = self.log.last_s()
        self.time_s = max(self.time_s, time_s if self.ending is Ending.COMPLETED else reached_s)
        self._elapsed_s += time.perf_counter() - begin_s
        return self.outcome

    def positions(self) -> NDArray[np.float64]:
        """Return the centres now, metres, shape ``(n, 2)``."""
        return self.result().trace.final_position_m

    def velocities(self) -> NDArray[np.float64]:
        """Return the velocities now, metres a second, shape ``(n, 2)``."""
        return self.result().trace.final_velocity_m_s

    def spins(self) -> NDArray[np.float64] | None:
        """Return the spins now, radians a second, shape ``(n,)``; None in a scene in which nothing turns."""
        return self.result().trace.final_spin_rad_s

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of certified impacts of each disc so far, with discs and walls, shape ``(n,)``."""
        bodies = [body for row in self.log.rows for body in (row.values.first, row.values.second) if body >= 0]
        return np.bincount(np.array(bodies, np.int64), minlength=len(self.scene.discs)).astype(np.int64)

    def result(self) -> CertifiedTrace:
        """Return the certified part of the run, with the state at the exact instant `time_s`."""
        attempt, impacts = self._attempt, len(self.log)
        # An interrupt or an undecided contact may have left an event half applied.
        if self.log.events < len(attempt.events) or attempt.is_cut or self.ending is Ending.INTERRUPTED:
            attempt = Attempt(self.scene, attempt.bits, self.log, attempt, self.log.events)
            if attempt.advance(Goal(self._undamped(self.time_s), impacts, math.inf, None)).ending is Ending.INTERRUPTED:
                raise KeyboardInterrupt
        bodies = attempt.bodies
        with ctx.workprec(attempt.precision):
            now = undamped(self.scene.damping_per_s, arb(self.time_s))
            left = kept(self.scene.damping_per_s, now)
            places = [
                bodies.place_at(i, now) if bodies.movable[i] else bodies.place(i, self.time_s)
                for i in range(len(bodies))
            ]
            velocities = [bodies.velocity(i, now, self.time_s) for i in range(len(bodies))]
            speeds = [(vx * left, vy * left) for vx, vy in velocities]
        with ctx.workprec(min(self.log.bits, attempt.precision)):
            position, velocity = (np.array([enclosed(+x, +y) for x, y in vectors]) for vectors in (places, speeds))
            spin = np.array([nearest(+(bodies.spin_at(i, now) * left)) for i in range(len(bodies))])
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
            radii=impact_array(row.radii for row in self.log.rows),
            final_position_radius_m=position[:, 1].copy(),
            final_velocity_radius_m_s=velocity[:, 1].copy(),
            spin_radii=spin_array(row.radii for row in self.log.rows) if bodies.turns else None,
            mode_radii=mode_array(row.radii for row in self.log.mode_rows) if self.log.mode_rows else None,
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

    def _undamped(self, time_s: float) -> arb:
        with ctx.workprec(self._most_bits):
            return undamped(self.scene.damping_per_s, arb(time_s))

    def _judge(self, stop: Stop, attempt: Attempt) -> Stop:
        """Decide whether a higher precision may help after an attempt. The returned ending is None if so."""
        trouble = stop.degeneracy
        if stop.ending is not None:
            return stop
        if trouble is not None and trouble.bits >= self._tie_bits:
            return Stop(Ending.DEGENERATE, trouble)
        if attempt.bits < self._most_bits:
            return stop
        undecided = trouble is not None and trouble.bits >= self._digits_bits
        return Stop(Ending.DEGENERATE if undecided else Ending.PRECISION_CAP, trouble)

    def _next_bits(self, attempt: Attempt, stop: Stop, goal: Goal) -> int:
        """Return the next precision, predicted from the bits lost so far."""
        done = max(len(attempt.events), 1)
        reached_s = max(attempt.bodies.time)
        expected = done * (float_above(goal.time) / reached_s) if reached_s > 0 else math.inf
        target = min(expected * _MARGIN, goal.impacts)
        lost = attempt.bits_lost() / done
        wanted = self._digits_bits + (lost * target * _MARGIN if lost else 0) + _FIRST_BITS
        wanted = min(wanted, attempt.bits * _MOST_RISE)
        if stop.degeneracy is not None:  # enough bits to resolve this event
            wanted = max(wanted, attempt.bits + self._tie_bits - stop.degeneracy.bits + _FIRST_BITS)
        return min(math.ceil(max(wanted, attempt.bits * _LEAST_RISE)), self._most_bits)


class Attempt:
    """A run at one precision. An attempt repeats the events certified before, and then selects further impacts.

    Attributes:
        bits: Initial precision.
        precision: Working precision.
        bodies: State of the bodies after the last impact.
        events: Data with which the next attempt repeats each event: both bodies, and a lower bound of the time.
        impacts: Number of impacts among the events.
        is_cut: Whether the last event was left half applied because it was undecided.
        commuted: Pairs of consecutive impacts whose order is unknown and does not affect the result.
    """

    def __init__(
        self, scene: Scene, bits: int, log: Recording, earlier: Attempt | None = None, events: int | None = None
    ) -> None:
        self.bits = self.precision = bits
        self.impacts, self.is_cut = 0, False
        with ctx.workprec(bits):
            self.bodies = BallBodies(scene)
            for i in range(len(scene.discs)) if scene.table_deceleration_m_s2 else ():
                if self.bodies.movable[i]:
                    slow(self.bodies, i, arb(0), 0.0)
        self._tolerance = arb(10) ** -log.digits
        self.events: list[tuple[int, int, float]] = []
        self.commuted: list[tuple[int, int]] = list(earlier.commuted) if earlier else []
        self._known = earlier.events[:events] if earlier else []
        self._selection: Selection | None = None
        self._log = log
        log.begin_again()

    def _begin(self) -> None:
        """Start the contact of each disc that touches a wall below it, or apply its impact if it approaches."""
        contacts = BallContacts(self.bodies)
        for i, ground in list(contacts.lying()) if self.bodies.falls else ():
            begun = contacts.begin(i, ground)
            self._add_event(
                carry_out(self.bodies, begun) if isinstance(begun, Meeting) else BallEvent(None, (begun,)), _START
            )

    @property
    def has_replayed(self) -> bool:
        """Whether all events certified before have been repeated."""
        return len(self.events) >= len(self._known)

    def bits_lost(self) -> int:
        """Return the bits of accuracy that the least accurate disc has lost."""
        with ctx.workprec(self.precision):
            return self.bits - self.bodies.worst_accuracy_bits()

    def advance(self, goal: Goal) -> Stop:
        """Advance to the goal, or as far as this precision permits."""
        with ctx.workprec(self.precision):
            try:
                return self._replay(goal) or self._select(goal)
            except Undecided as undecided:
                self.is_cut = True
                return Stop(None, undecided.degeneracy if self._log.convert() else None)
            except OutOfTime:
                return Stop(Ending.TIME_BUDGET)
            except KeyboardInterrupt:
                return Stop(Ending.INTERRUPTED)
            finally:
                self.precision = ctx.prec

    def _replay(self, goal: Goal) -> Stop | None:
        if not self.events:
            self._begin()
        while not self.has_replayed:
            first, second, at = self._known[len(self.events)]
            if first == second:
                BallContacts(self.bodies).consider_landing(first, None)
            meeting = meet(self.bodies, first, second, at)
            stop = self._carry_out(meeting, goal) if meeting is not None and meeting.decided else Stop()
            if stop is not None:
                return stop
        return None

    def _select(self, goal: Goal) -> Stop:
        if self._selection is None:
            for i in range(len(self.bodies)):
                BallContacts(self.bodies).consider_landing(i, self._tolerance)
            self._selection = Selection(self.bodies)
        selection = self._selection
        selection.end_s, selection.deadline_s = float_above(goal.time), goal.deadline_s
        while True:
            at_limit = self.impacts >= goal.impacts
            try:
                choice = selection.next_impact()
            except Undecided as undecided:
                if at_limit:
                    return self._end(Ending.MAX_IMPACTS)
                return Stop(None, undecided.degeneracy if self._log.convert() else None)
            if choice is None or at_limit:
                return self._end(Ending.COMPLETED if choice is None else Ending.MAX_IMPACTS)
            if not choice.meeting.time <= goal.time:  # the goal is not a float64, and the impact is too close to it
                if choice.meeting.time > goal.time:
                    return self._end(Ending.COMPLETED)
                selection.is_at_the_end(choice.meeting)
            if choice.commutes:
                self.commuted.append((self.impacts, self.impacts + 1))
            stop = self._carry_out(choice.meeting, goal)
            for i in choice.meeting[:2]:
                if i >= 0:
                    BallContacts(self.bodies).consider_landing(i, self._tolerance)
            selection.changed(choice.meeting)
            if stop is not None:
                return stop

    def _end(self, ending: Ending) -> Stop:
        return Stop(ending if self._log.convert() and self._log.state_is_good(self.bodies) else None)

    def _add_event(self, event: BallEvent, how: tuple[int, int, float]) -> None:
        self._log.add(event)
        self.events.append(how)
        self.impacts += event.impact is not None

    def _carry_out(self, meeting: Meeting, goal: Goal) -> Stop | None:
        """Apply and record an event.

        Every `_CHUNK` events, convert the events, lower the precision, and check whether to stop.
        """
        self._add_event(carry_out(self.bodies, meeting), meeting[:3])
        if len(self.events) % _CHUNK:
            return None
        if not self._log.convert():
            return Stop()
        if goal.progress is not None:
            goal.progress(self.impacts, max(self.bodies.time))
        if time.perf_counter() > goal.deadline_s:
            return Stop(Ending.TIME_BUDGET)
        enough = self.bodies.best_accuracy_bits() + _GUARD_BITS
        if enough < _LOWER_AT * ctx.prec:
            self.bodies.lower_precision(max(enough, 64))
        endless = without_end(self._log, self.bodies)
        return None if endless is None else Stop(Ending.DEGENERATE, endless)


def trouble_at_start(bodies: BallBodies) -> Degeneracy | None:
    """Return the degeneracy of the start, if any. Contact is degenerate, except with a wall below the disc."""
    lying = BallContacts(bodies).lying() if bodies.falls else ()
    begun = {i: bodies.trace_body(ground.body) for i, ground in lying}
    found = contact_at_start(bodies, begun)
    return found if found or bodies.scene.arrays.has_half_planes else finite_contact_at_start(bodies.scene, begun)
