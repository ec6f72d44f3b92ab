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
        recording: Its impacts.
        events: Its impacts again, as they can be carried out.
        commuted: Pairs of neighbouring impacts whose order is not known and makes no difference.
        ending: How it ended; None where the balls have become too wide or an event was not decided.
        degeneracy: The event that was not decided.
    """

    bits: int
    recording: Recording
    bodies: BallBodies
    events: list[Event] = field(default_factory=list)
    commuted: list[tuple[int, int]] = field(default_factory=list)
    ending: Ending | None = None
    degeneracy: Degeneracy | None = None

    @property
    def good(self) -> int:
        """How many impacts are known to the digits asked for."""
        return self.recording.good


def climb(
    scene: Scene, digits: int, budget: Budget, progress: Callable[[int, float, int], None] | None
) -> tuple[Stage, int]:
    """Run at rising precision until the scene, a budget or an event without an answer ends the run.

    Returns:
        The attempt that reached furthest, and how often it was begun again.
    """
    started = time.perf_counter()
    deadline = math.inf if budget.time_budget_s is None else started + budget.time_budget_s
    base = math.ceil(digits * LOG2_10) + 16
    bits = min(base + _FIRST_BITS, budget.max_precision_bits)
    best: Stage | None = None
    known: list[Event] = []
    commuted: list[tuple[int, int]] = []
    replays = 0
    while True:
        ctx.prec = bits
        bodies = BallBodies(scene)
        stage = Stage(bits, Recording(scene, digits), bodies, commuted=list(commuted))
        try:
            _attempt(stage, known, budget, deadline, progress)
        except KeyboardInterrupt:
            stage.recording.convert()
            stage.ending = Ending.INTERRUPTED
        if best is None or stage.good >= best.good:
            best = stage
        else:
            best.ending = stage.ending
        if stage.ending is not None:
            return best, replays
        if len(stage.events) >= len(known):
            known, commuted = stage.events, stage.commuted
        if stage.degeneracy is not None and stage.degeneracy.bits >= budget.tie_bits:
            stage.ending = Ending.DEGENERATE
            return stage, replays
        if bits >= budget.max_precision_bits:
            undecided = stage.degeneracy is not None and stage.degeneracy.bits >= base
            best.ending = Ending.DEGENERATE if undecided else Ending.PRECISION_CAP
            best.degeneracy = stage.degeneracy if undecided else None
            return best, replays
        bits = min(_next_bits(stage, scene, budget, base), budget.max_precision_bits)
        replays += 1


def _next_bits(stage: Stage, scene: Scene, budget: Budget, base: int) -> int:
    """Return the precision that the bits lost so far let expect to be enough."""
    done = max(len(stage.events), 1)
    reached = max(stage.bodies.time)
    expected = done * scene.duration_s / reached if reached > 0 else math.inf
    target = min(expected * _MARGIN, math.inf if budget.max_impacts is None else budget.max_impacts)
    lost = max(stage.bits - stage.bodies.worst_accuracy_bits(), 0) / done
    wanted = min(base + (lost * target * _MARGIN if lost else 0) + _FIRST_BITS, stage.bits * _MOST_RISE)
    if stage.degeneracy is not None:  # as much as it takes to look at this event closely
        wanted = max(wanted, stage.bits + budget.tie_bits - stage.degeneracy.bits + _FIRST_BITS)
    return math.ceil(max(wanted, stage.bits * _LEAST_RISE))


def _attempt(
    stage: Stage,
    known: list[Event],
    budget: Budget,
    deadline: float,
    progress: Callable[[int, float, int], None] | None,
) -> None:
    """Replay what is known, and go on from there."""
    bodies, scene = stage.bodies, stage.bodies.scene
    last = math.inf if budget.max_impacts is None else budget.max_impacts
    loses_energy = scene.restitution < 1 or (bool(scene.walls) and scene.wall_restitution < 1)
    start = contact_at_start(scene)
    if start is not None:
        stage.ending, stage.degeneracy = Ending.DEGENERATE, start
        return
    selection: Selection | None = None
    while True:
        n = len(stage.events)
        if n % _CHUNK == 0 and n:
            if not _look(stage, deadline, progress):
                return
            if loses_energy and (collapse := _collapse(stage)) is not None:
                stage.ending, stage.degeneracy = Ending.DEGENERATE, collapse
                return
        if n < len(known):
            meeting = _again(bodies, known[n])
        else:
            selection = selection or Selection(bodies, scene.duration_s)
            try:
                choice = selection.next_impact()
            except Undecided as undecided:
                good = stage.recording.convert()
                if n >= last and good and stage.recording.state_is_good(bodies):
                    stage.ending = Ending.MAX_IMPACTS
                else:
                    stage.degeneracy = undecided.degeneracy
                return
            if choice is None or n >= last:
                if stage.recording.convert() and stage.recording.state_is_good(bodies):
                    stage.ending = Ending.COMPLETED if choice is None else Ending.MAX_IMPACTS
                return
            meeting = choice.meeting
            if choice.commutes:
                stage.commuted.append((n, n + 1))
        stage.recording.add(meeting.carry_out(bodies))
        stage.events.append(Event(meeting.first, meeting.second, meeting.at))
        if selection is not None:
            selection.changed(meeting)


def _look(stage: Stage, deadline: float, progress: Callable[[int, float, int], None] | None) -> bool:
    """Convert, lower the precision, report; return whether to go on."""
    bodies = stage.bodies
    if not stage.recording.convert():
        return False
    if progress is not None:
        progress(len(stage.events), max(bodies.time), stage.bits)
    if time.perf_counter() > deadline:
        stage.ending = Ending.TIME_BUDGET
        return False
    enough = bodies.best_accuracy_bits() + _GUARD_BITS
    if enough < 0.9 * ctx.prec:
        bodies.lower_precision(max(enough, 64))
    return True


def _again(bodies: BallBodies, event: Event) -> Meeting:
    """Solve an impact again that was certified at a lower precision."""
    first, second, at = event
    meeting = meet_wall(bodies, first, wall_body(second), at) if second < 0 else meet_pair(bodies, first, second, at)
    if meeting is None or (second >= 0 and meeting.pair is None):
        raise AssertionError(f"impact of {first} and {second} after {at} s was certified before, but is not now")
    return meeting


def _collapse(stage: Stage) -> Degeneracy | None:
    """Return the collapse that the last impacts are, if they are."""
    rows = stage.recording.rows
    latest = float(rows[-1][0])  # type: ignore[arg-type] # the rows hold floats and pairs of them
    earliest = math.nextafter(math.nextafter(latest, 0.0), 0.0)
    bodies: set[int] = set()
    count = 0
    for row in reversed(rows):
        if float(row[0]) < earliest:  # type: ignore[arg-type]
            break
        bodies |= {int(row[1]), int(row[2])}  # type: ignore[call-overload]
        count += 1
    if count < _COLLAPSE * len(bodies) ** 2:
        return None
    known = min(stage.bodies.accuracy_bits(body) for body in bodies if body >= 0)
    first = float(rows[-count][0])  # type: ignore[arg-type]
    return Degeneracy(Degenerate.COLLAPSE, tuple(sorted(bodies)), first, latest, proven=False, bits=known)


def replayed(scene: Scene, stage: Stage, count: int) -> BallBodies:
    """Return the state after the first impacts of an attempt."""
    if count == len(stage.events):
        return stage.bodies
    ctx.prec = stage.bits
    bodies = BallBodies(scene)
    for n, event in enumerate(stage.events[:count]):
        _again(bodies, event).carry_out(bodies)
        if n % _CHUNK == 0:
            enough = bodies.best_accuracy_bits() + _GUARD_BITS
            if enough < 0.9 * ctx.prec:
                bodies.lower_precision(max(enough, 64))
    return bodies
