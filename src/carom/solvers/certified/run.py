"""A certified run: impact after impact at one precision, and again at a higher one where that does not decide.

What was certified at one precision is not selected again at the next: the order of impacts is known, and only the
dynamics is computed anew. As the balls grow, the working precision is lowered after them, so that no bits are computed
that mean nothing.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from flint import ctx

from carom.solvers.certified.bodies import BallBodies
from carom.solvers.certified.contact_at_start import contact_at_start
from carom.solvers.certified.prediction import meet_pair, meet_wall
from carom.solvers.certified.recording import LOG2_10, Recording
from carom.solvers.certified.result import Degeneracy, Degenerate, Ending
from carom.solvers.certified.selection import Selection, Undecided
from carom.trace import wall_body

if TYPE_CHECKING:
    from collections.abc import Callable

    from carom.scene import Scene
    from carom.solvers.certified.prediction import Meeting

__all__ = ["Budget", "Event", "Stage", "climb", "replayed"]

#: Impacts between two looks at accuracy, clock and progress.
_CHUNK = 32
#: Bits of the first attempt beyond the digits asked for: some hundreds of impacts for most scenes.
_FIRST_BITS = 160
#: Bits by which the working precision exceeds the best known disc's accuracy.
_GUARD_BITS = 24
#: The precision is raised to what the bits lost so far let expect, and an eighth more; but never more than eightfold,
#: since the first impacts say little about all, and never less than to half as much again.
_MARGIN, _MOST_RISE, _LEAST_RISE = 1.125, 8.0, 1.5
#: Impacts, times the square of the number of bodies in them, in one unit in the last place of the time, after which
#: impacts that lose energy are called a collapse. Where they end, three equal discs make at most some 600 in all.
_COLLAPSE = 20
#: The working precision is lowered where a tenth of it has come to mean nothing.
_LOWER_AT = 0.9


class Event(NamedTuple):
    """An impact as it is needed to carry it out again: its bodies, and a lower bound of its time."""

    first: int
    second: int
    at: float


@dataclass(frozen=True)
class Budget:
    """How far a run may go.

    Attributes:
        max_impacts: Number of impacts; None for no limit.
        time_budget_s: Seconds of clock time; None for no limit.
        max_precision_bits: Bits of working precision.
        tie_bits: An event that is not decided although its bodies are known to so many bits is called degenerate.
    """

    max_impacts: int | None
    time_budget_s: float | None
    max_precision_bits: int
    tie_bits: int


@dataclass
class Stage:
    """One attempt, at one precision.

    Attributes:
        bits: Precision that it began with.
        bodies: Their state after the last of its impacts.
        events: Its impacts, as they can be carried out again.
        commuted: Pairs of neighbouring impacts whose order is not known and makes no difference.
        ending: How it ended; None where the balls have become too wide or an event was not decided.
        degeneracy: The event that was not decided.
    """

    bits: int
    bodies: BallBodies
    events: list[Event] = field(default_factory=list)
    commuted: list[tuple[int, int]] = field(default_factory=list)
    ending: Ending | None = None
    degeneracy: Degeneracy | None = None


def climb(
    recording: Recording, scene: Scene, budget: Budget, progress: Callable[[int, float, int], None] | None
) -> tuple[Stage, int]:
    """Run at rising precision until the scene, a budget or an event without an answer ends the run.

    Args:
        recording: Takes up the impacts that are known to the digits asked for.
        scene: The scene.
        budget: How far to go.
        progress: Called with impacts, seconds and bits.

    Returns:
        The last attempt, which holds the events of all before, and how often it was begun again.
    """
    deadline = math.inf if budget.time_budget_s is None else time.perf_counter() + budget.time_budget_s
    base = math.ceil(recording.digits * LOG2_10) + 16
    bits = min(base + _FIRST_BITS, budget.max_precision_bits)
    known = Stage(bits, BallBodies(scene))
    replays = 0
    while True:
        ctx.prec = bits
        recording.begin_again()
        stage = Stage(bits, BallBodies(scene), commuted=list(known.commuted))
        attempt = _Attempt(stage, recording, known.events, budget, deadline, progress)
        try:
            attempt.run()
        except KeyboardInterrupt:
            stage.ending = Ending.INTERRUPTED
        if stage.degeneracy is not None and stage.ending is None and stage.degeneracy.bits >= budget.tie_bits:
            stage.ending = Ending.DEGENERATE
        if stage.ending is None and bits >= budget.max_precision_bits:
            undecided = stage.degeneracy is not None and stage.degeneracy.bits >= base
            stage.ending = Ending.DEGENERATE if undecided else Ending.PRECISION_CAP
        if len(stage.events) < len(known.events):  # ended amidst the replay
            known.ending, known.degeneracy = stage.ending, stage.degeneracy
            stage = known
        if stage.ending is not None:
            recording.convert()
            return stage, replays
        known = stage
        bits = min(_next_bits(stage, scene, budget, base), budget.max_precision_bits)
        replays += 1


def _next_bits(stage: Stage, scene: Scene, budget: Budget, base: int) -> int:
    """Return the precision that the bits lost so far let expect to be enough."""
    done = max(len(stage.events), 1)
    reached = max(stage.bodies.time)
    expected = done * (scene.duration_s / reached) if reached > 0 else math.inf
    target = min(expected * _MARGIN, math.inf if budget.max_impacts is None else budget.max_impacts)
    lost = max(stage.bits - stage.bodies.worst_accuracy_bits(), 0) / done
    wanted = min(base + (lost * target * _MARGIN if lost else 0) + _FIRST_BITS, stage.bits * _MOST_RISE)
    if stage.degeneracy is not None:  # as much as it takes to look at this event closely
        wanted = max(wanted, stage.bits + budget.tie_bits - stage.degeneracy.bits + _FIRST_BITS)
    return math.ceil(max(wanted, stage.bits * _LEAST_RISE))


class _Attempt:
    """Replays what is known at a new precision, and goes on from there."""

    def __init__(
        self,
        stage: Stage,
        recording: Recording,
        known: list[Event],
        budget: Budget,
        deadline: float,
        progress: Callable[[int, float, int], None] | None,
    ) -> None:
        self.stage, self.recording, self.known = stage, recording, known
        self.bodies, self.scene = stage.bodies, stage.bodies.scene
        self.last = math.inf if budget.max_impacts is None else budget.max_impacts
        self.deadline, self.progress = deadline, progress

    def run(self) -> None:
        """Take the stage as far as this precision and the budget let it go."""
        start = contact_at_start(self.scene)
        if start is not None:
            self.stage.ending, self.stage.degeneracy = Ending.DEGENERATE, start
            return
        for event in self.known:
            self._carry_out(_again(self.bodies, event))
            if not self._may_go_on():
                return
        with np.errstate(all="ignore"):  # what overflows is left to the balls
            selection = Selection(self.bodies, self.scene.duration_s)
            while (meeting := self._next(selection)) is not None:
                self._carry_out(meeting)
                selection.changed(meeting)
                if not self._may_go_on():
                    return

    def _next(self, selection: Selection) -> Meeting | None:
        stage = self.stage
        at_limit = len(stage.events) >= self.last
        try:
            choice = selection.next_impact()
        except Undecided as undecided:
            if at_limit:
                self._end(Ending.MAX_IMPACTS)
            elif self.recording.convert():
                stage.degeneracy = undecided.degeneracy
            return None
        if choice is None or at_limit:
            self._end(Ending.COMPLETED if choice is None else Ending.MAX_IMPACTS)
            return None
        if choice.commutes:
            stage.commuted.append((len(stage.events), len(stage.events) + 1))
        return choice.meeting

    def _end(self, ending: Ending) -> None:
        if self.recording.convert() and self.recording.state_is_good(self.bodies):
            self.stage.ending = ending

    def _carry_out(self, meeting: Meeting) -> None:
        impact = meeting.carry_out(self.bodies)
        self.stage.events.append(Event(meeting.first, meeting.second, meeting.at))
        self.recording.add(impact)

    def _may_go_on(self) -> bool:
        """Now and then: convert, lower the precision, report; return whether to go on."""
        stage = self.stage
        if len(stage.events) % _CHUNK:
            return True
        if not self.recording.convert():
            return False
        if self.progress is not None:
            self.progress(len(stage.events), max(self.bodies.time), stage.bits)
        if time.perf_counter() > self.deadline:
            stage.ending = Ending.TIME_BUDGET
            return False
        _follow(self.bodies)
        loses_energy = self.scene.restitution < 1 or (bool(self.scene.walls) and self.scene.wall_restitution < 1)
        if loses_energy and (collapse := _collapse(self.recording, self.bodies)) is not None:
            stage.ending, stage.degeneracy = Ending.DEGENERATE, collapse
            return False
        return True


def _follow(bodies: BallBodies) -> None:
    """Lower the working precision where the balls have grown."""
    enough = bodies.best_accuracy_bits() + _GUARD_BITS
    if enough < _LOWER_AT * ctx.prec:
        bodies.lower_precision(max(enough, 64))


def _again(bodies: BallBodies, event: Event) -> Meeting:
    """Solve an impact again that was certified at a lower precision."""
    first, second, at = event
    meeting = meet_wall(bodies, first, wall_body(second), at) if second < 0 else meet_pair(bodies, first, second, at)
    if meeting is None or (second >= 0 and meeting.pair is None) or (bodies.falls and not meeting.decided):
        raise AssertionError(f"impact of {first} and {second} after {at} s was certified before, but is not now")
    return meeting


def _collapse(recording: Recording, bodies: BallBodies) -> Degeneracy | None:
    """Return the collapse that the last impacts are, if they are."""
    rows = recording.rows
    if not rows:
        return None
    latest: float = rows[-1][0]
    earliest = math.nextafter(math.nextafter(latest, 0.0), 0.0)
    involved: set[int] = set()
    count = 0
    for row in reversed(rows):
        if row[0] < earliest:
            break
        involved |= {row[1], row[2]}
        count += 1
    if count < _COLLAPSE * len(involved) ** 2:
        return None
    known = min(bodies.state_bits(body) for body in involved if body >= 0)
    first: float = rows[-count][0]
    return Degeneracy(Degenerate.COLLAPSE, tuple(sorted(involved)), first, latest, proven=False, bits=known)


def replayed(scene: Scene, stage: Stage, count: int) -> BallBodies:
    """Return the state after the first impacts of an attempt."""
    if count == len(stage.events) and stage.ending is not Ending.INTERRUPTED:  # that may have cut an impact in two
        return stage.bodies
    ctx.prec = stage.bits
    bodies = BallBodies(scene)
    for n, event in enumerate(stage.events[:count]):
        _again(bodies, event).carry_out(bodies)
        if n % _CHUNK == 0:
            _follow(bodies)
    return bodies
