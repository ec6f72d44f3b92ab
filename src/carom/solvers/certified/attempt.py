"""One attempt of a certified run. An attempt starts with a given precision of numbers."""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

from flint import arb, ctx

from carom.model.scene import Scene
from carom.solvers.certified.accumulation import find_accumulation
from carom.solvers.certified.ball_arithmetic import float_above
from carom.solvers.certified.contacts import begin_contact, find_resting, record_landing
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.impacts import BallEvent, apply_meeting
from carom.solvers.certified.meeting import Meeting
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.recording import Recording
from carom.solvers.certified.result import Degeneracy, Ending, Undecided
from carom.solvers.certified.selection import OutOfTime, Selection
from carom.solvers.certified.slowing import start_deceleration
from carom.solvers.run import Progress

#: Number of events after which accuracy and progress are checked again.
_CHUNK = 32
#: Bits by which the precision of computations exceeds the accuracy of the most accurate disc.
_GUARD_BITS = 24
#: The precision of computations is lowered if less than this fraction of its bits is accurate.
_LOWER_AT = 0.9
#: Entry of `Attempt.events` for an event at the start.
_START = (-1, -1, 0.0)


class Goal(NamedTuple):
    """Goal of a run: a time, a number of impacts, and a deadline as a value of `time.perf_counter`.

    In a scene with damping, the time is that of the same run without damping.
    """

    time: arb
    impacts: float
    deadline_s: float
    progress: Progress | None


class Stop(NamedTuple):
    """Result of an attempt: how it ended, or the undecided event.

    The fields `ending` and `degeneracy` are None if intervals became too wide.
    """

    ending: Ending | None = None
    degeneracy: Degeneracy | None = None


class Attempt:
    """An attempt to certify a run.

    An attempt repeats the events that earlier attempts certified, and then continues with further events.

    Attributes:
        bits: Precision at the start, in bits.
        precision: Current precision, in bits, which becomes lower during the attempt.
        bodies: State of the bodies after the last impact.
        events: For each event, its two bodies and a lower bound of its time. The next attempt repeats the events from
            these data.
        impacts: Number of impacts among the events.
        is_cut: Whether the last event was only partly applied, because its result is undecided.
        commuted: Pairs of consecutive impacts whose order is unknown and does not change the result.
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
                    start_deceleration(self.bodies, i, arb(0), 0.0)
        self._tolerance = arb(10) ** -log.digits
        self.events: list[tuple[int, int, float]] = []
        self.commuted: list[tuple[int, int]] = list(earlier.commuted) if earlier else []
        self._known = earlier.events[:events] if earlier else []
        self._log = log
        log.begin_again()

    def _begin(self) -> None:
        """Start the contact of each disc on a wall below it, or apply an impact if the disc moves towards the wall."""
        for i, ground in list(find_resting(self.bodies)) if self.bodies.falls else ():
            mode_or_meeting = begin_contact(self.bodies, i, ground)
            if isinstance(mode_or_meeting, Meeting):
                event = apply_meeting(self.bodies, mode_or_meeting)
            else:
                event = BallEvent(None, (mode_or_meeting,))
            self._add_event(event, _START)

    @property
    def has_replayed(self) -> bool:
        """Whether the attempt has repeated all events that earlier attempts certified."""
        return len(self.events) >= len(self._known)

    def bits_lost(self) -> int:
        """Return the number of accurate bits that the least accurate disc has lost."""
        with ctx.workprec(self.precision):
            return self.bits - self.bodies.worst_accuracy_bits()

    def advance(self, goal: Goal) -> Stop:
        """Advance to the goal, or to the last event that can be decided with this precision. Call this method once."""
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
        self._begin()
        while not self.has_replayed:
            first, second, instant_s = self._known[len(self.events)]
            if first == second:
                record_landing(self.bodies, first, None)
            meeting = meet(self.bodies, first, second, instant_s)
            stop = self._carry_out(meeting, goal) if meeting is not None and meeting.decided else Stop()
            if stop is not None:
                return stop
        return None

    def _select(self, goal: Goal) -> Stop:
        for i in range(len(self.bodies)):
            record_landing(self.bodies, i, self._tolerance)
        selection = Selection(self.bodies)
        selection.end_s, selection.deadline_s = min(float_above(goal.time), sys.float_info.max), goal.deadline_s
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
            if not choice.meeting.time <= goal.time:  # part of the impact's time interval may be after the goal
                if choice.meeting.time > goal.time:
                    return self._end(Ending.COMPLETED)
                selection.raise_at_the_end(choice.meeting)
            if choice.commutes:
                self.commuted.append((self.impacts, self.impacts + 1))
            stop = self._carry_out(choice.meeting, goal)
            for i in choice.meeting[:2]:
                if i >= 0:
                    record_landing(self.bodies, i, self._tolerance)
            selection.changed(choice.meeting)
            if stop is not None:
                return stop

    def _end(self, ending: Ending) -> Stop:
        return Stop(ending if self._log.convert() and self._log.is_state_accurate(self.bodies) else None)

    def _add_event(self, event: BallEvent, how: tuple[int, int, float]) -> None:
        self._log.add(event)
        self.events.append(how)
        self.impacts += event.impact is not None

    def _carry_out(self, meeting: Meeting, goal: Goal) -> Stop | None:
        """Apply and record an event.

        After every `_CHUNK` events, convert these events to floats, lower the precision, and check whether to stop.
        """
        self._add_event(apply_meeting(self.bodies, meeting), meeting[:3])
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
        endless = find_accumulation(self._log, self.bodies)
        return None if endless is None else Stop(Ending.DEGENERATE, endless)
