"""What is kept of one run of one release, and what two releases have to do with each other in one cell."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache, partial

import numpy as np

from carom.comparator import Grade, Verdict, compare
from carom.comparator.thresholds import THRESHOLDS
from carom.number_text import number
from carom.runs.job import Answer, JobTask
from carom.runs.journal import Entry, Journal
from carom.runs.keys import JobKey
from carom.runs.observe import able_adapter, observe_run, sampling_of
from carom.runs.reference import begun_scene, reference_of, reference_trace, require_reference
from carom.studies.history.options import FEWEST_PHASES
from carom.trace import Trace

#: References, and runs of PIT, that a worker keeps.
_KEPT = 64
#: Instants at which a run's discs are compared with another's, besides the end: two runs that bounce otherwise part for
#: longer than an eighth of a run, or come together again at the end, which the first alone would not show.
PLACES = 8

_reference, _sampling = lru_cache(maxsize=_KEPT)(reference_trace), lru_cache(maxsize=_KEPT)(sampling_of)


@dataclass(frozen=True)
class Ran:
    """What is kept of a run.

    Attributes:
        digest: SHA-256 of its impacts and its final state, to the bit.
        settings: The settings read back, each value as text.
        grade: Its grade, by name.
        verdicts: Its verdicts, by name.
        expected: Impacts of the reference.
        found: Impacts that the engine's contacts came to.
        lost: Impacts missed and impacts invented.
        velocity: Largest velocity error over the scene's speed; NaN where no impact was matched.
        late_steps: Largest error of a time, in steps; NaN likewise.
        path_m: Where each disc is at this many instants of the run, evenly spread, and at its end: coordinates, metres.
        velocity_m_s: The velocities at the end: coordinates, metres a second.
        float_bits: Width of the floats that the adapter declares.
    """

    digest: str
    settings: tuple[tuple[str, str], ...]
    grade: str
    verdicts: tuple[str, ...]
    expected: int
    found: int
    lost: int
    velocity: float
    late_steps: float
    path_m: tuple[float, ...]
    velocity_m_s: tuple[float, ...]
    float_bits: int

    @property
    def unseen(self) -> bool:
        """Whether velocities changed, and not one impact was told: the adapter sees no contact."""
        return self.expected > 0 and self.found == 0 and self.half_seen

    @property
    def half_seen(self) -> bool:
        """Whether velocities changed where no impact was told: the adapter does not see every contact."""
        return Verdict.TURNS.name in self.verdicts


@dataclass(frozen=True)
class HistoryTask(JobTask):
    """Run a job at its phase and score it, in a worker process."""

    def carry_out(self) -> Ran:
        """Return what is kept of it.

        Raises:
            UnsupportedError: There is no reference, or no such start.
        """
        job = self.job
        adapter = able_adapter(job)
        scene = begun_scene(job)
        reference = require_reference(_reference(scene))
        horizon_s = reference_of(reference, asked=False).horizon_s
        trace = observe_run(adapter, scene, job.profile, job.dt_s, samples=True)
        score = compare(reference, trace, sampling=_sampling(scene, job.dt_s), horizon=horizon_s)
        return Ran(
            digest=_digest(trace),
            settings=tuple(sorted((name, repr(value)) for name, value in trace.settings.items())),
            grade=score.grade.name,
            verdicts=tuple(sorted({verdict.name for verdict in score.verdicts})),
            expected=score.expected,
            found=len(trace.impacts),
            lost=len(score.missed) + len(score.spurious),
            velocity=score.total.velocity,
            late_steps=abs(score.total.time_s) / job.dt_s,
            path_m=_path(trace),
            velocity_m_s=tuple(trace.final_velocity_m_s.ravel().tolist()),
            float_bits=score.float_bits,
        )


def _path(trace: Trace) -> tuple[float, ...]:
    places = [] if trace.samples is None else [*trace.samples.position_m[:: len(trace.samples.time_s) // PLACES + 1]]
    return tuple(np.array([*places, trace.final_position_m]).ravel().tolist())


def _digest(trace: Trace) -> str:
    """Return a digest of all that a run came to; one bit of one number makes another."""
    found = hashlib.sha256(trace.outcome.name.encode())
    arrays = (trace.impacts, trace.final_position_m, trace.final_velocity_m_s, trace.spins, trace.final_spin_rad_s)
    for array in arrays:
        found.update(b"none" if array is None else array.tobytes())
    return found.hexdigest()


#: Opens the journal of a history.
history_journal = partial(Journal[JobKey, Ran], "releases", Entry[JobKey, Ran])


@dataclass(frozen=True)
class SeenCell:
    """One release in one cell: what came of the scene's own phase, and of the others where they were asked for."""

    own: Answer[Ran]
    phases: tuple[Answer[Ran], ...] = ()

    @property
    def ran(self) -> tuple[Ran, ...]:
        """What ran at its phases, the scene's own among them."""
        return tuple(answer.value for answer in (self.own, *self.phases) if answer.value is not None)


class Moved(Enum):
    """What became of a cell from one release to the next; the value is the phrase shown."""

    NOTHING = "same bits"
    ROUNDING = "other bits, same to rounding at this phase"
    OVERLAP = "changed, and ranges over phases overlap"
    WORSE = "worse"
    BETTER = "better"
    OTHERWISE = "changed, neither better nor worse"
    ASKED = "asked otherwise: the settings read back differ"
    TOLD = "the same motion, and contacts are told otherwise"
    UNSEEN = "changed, and the adapter does not see every contact"
    NOT_RUN = "not run by both"

    @property
    def real(self) -> bool:
        """Whether it is a change of the engine's motion: none of phase, settings, adapter or what contacts are told."""
        return self in {Moved.WORSE, Moved.BETTER, Moved.OTHERWISE}


@dataclass(frozen=True)
class CellChange:
    """What became of a cell.

    Attributes:
        moved: What.
        why: The numbers that say so, as a phrase; empty where there is nothing to say.
    """

    moved: Moved
    why: str = ""


@dataclass(frozen=True)
class _Measure:
    """A number of a run in which two releases can part: what is larger is worse."""

    name: str
    of: str
    relative: bool


_MEASURES = (
    _Measure("impacts missed and invented", "lost", relative=False),
    _Measure("velocity error", "velocity", relative=True),
    _Measure("error of time in steps", "late_steps", relative=True),
)


def differs(old: Ran, new: Ran) -> bool:
    """Whether two runs differ by more than rounding in a grade, a verdict or a number: then phases are asked for."""
    if (old.grade, old.verdicts, old.lost) != (new.grade, new.verdicts, new.lost):
        return True
    pairs = ((getattr(old, one.of), getattr(new, one.of)) for one in _MEASURES)
    return any(_apart(a, b, _rounding(old, new)) for a, b in pairs)


def _rounding(old: Ran, new: Ran) -> float:
    return THRESHOLDS.rounding_of(min(old.float_bits, new.float_bits))


def _apart(a: float, b: float, rounding: float) -> bool:
    return math.isnan(a) is not math.isnan(b) or abs(a - b) > rounding


def _move_alike(old: Ran, new: Ran, rounding: float) -> bool:
    """Whether two runs take one path and end with one velocity, to rounding, in parts of the largest number of each."""
    pairs = ((old.path_m, new.path_m), (old.velocity_m_s, new.velocity_m_s))
    return all(
        len(ours) == len(theirs)
        and all(abs(x - y) <= rounding * max(map(abs, ours)) for x, y in zip(ours, theirs, strict=True))
        for ours, theirs in pairs
    )


def change_of(old: SeenCell, new: SeenCell) -> CellChange:
    """Return what became of a cell between two releases.

    A change is one of the engine's where the settings read back are equal and, over `FEWEST_PHASES` at least, the
    ranges of a number part by more than rounding, or a verdict holds at every phase of the one and at none of the
    other. Where velocities change and no impact is told, the adapter does not see every contact, and nothing is said.
    Where discs move alike at every phase, to rounding, what changed is what the engine tells of contacts.
    """
    a, b = old.own.value, new.own.value
    if a is None or b is None:
        return CellChange(Moved.NOT_RUN, (new.own if a is not None else old.own).said)
    if a.digest == b.digest:
        return CellChange(Moved.NOTHING)
    if a.settings != b.settings:
        return CellChange(Moved.ASKED, ", ".join(_differing(a.settings, b.settings)))
    if a.half_seen or b.half_seen:  # what it does not see it would be charged as the engine's
        return CellChange(Moved.UNSEEN)
    if not differs(a, b):
        return CellChange(Moved.ROUNDING)
    if min(len(old.ran), len(new.ran)) < FEWEST_PHASES:
        fewest = min(len(old.ran), len(new.ran))
        return CellChange(Moved.OVERLAP, f"{fewest} phases ran, of {FEWEST_PHASES} that it takes")
    if all(_move_alike(*pair, _rounding(a, b)) for pair in zip(old.ran, new.ran, strict=False)):
        return CellChange(Moved.TOLD, "; ".join(_ranges(old.ran, new.ran)))
    # What counts impacts comes first: an error of those that both have found says less.
    for moved, why in _parted(old.ran, new.ran, _rounding(a, b)):
        if Grade.UNGRADED.name in (a.grade, b.grade):  # nobody can say which of the two is right
            return CellChange(Moved.OTHERWISE, why)
        return CellChange(moved, why)
    before, after = _verdicts(old.ran, new.ran), _verdicts(new.ran, old.ran)
    if before or after:
        ranks = [[list(Grade.__members__).index(run.grade) for run in one.ran] for one in (old, new)]
        worse, better = min(ranks[1]) > max(ranks[0]), max(ranks[1]) < min(ranks[0])
        moved = Moved.WORSE if worse else Moved.BETTER if better else Moved.OTHERWISE
        said = [*(f"no longer: {verdict}" for verdict in before), *(f"now: {verdict}" for verdict in after)]
        return CellChange(moved, "at every phase " + "; ".join(said))
    return CellChange(Moved.OVERLAP, "; ".join(_ranges(old.ran, new.ran)))


def _parted(old: Sequence[Ran], new: Sequence[Ran], rounding: float) -> Iterator[tuple[Moved, str]]:
    for measure in _MEASURES:
        before, after = ([float(getattr(run, measure.of)) for run in runs] for runs in (old, new))
        if any(map(math.isnan, (*before, *after))):
            continue
        gap = rounding if measure.relative else 0.0
        why = f"{measure.name} {_range(before)} before, {_range(after)} now"
        if min(after) > max(before) + gap:
            yield Moved.WORSE, why
        elif max(after) < min(before) - gap:
            yield Moved.BETTER, why


def _ranges(old: Sequence[Ran], new: Sequence[Ran]) -> Iterator[str]:
    for measure in _MEASURES:
        before, after = ([float(getattr(run, measure.of)) for run in runs] for runs in (old, new))
        if sorted(map(repr, before)) != sorted(map(repr, after)):
            yield f"{measure.name} {_range(before)} before, {_range(after)} now"


def _range(values: Sequence[float]) -> str:
    known = [value for value in values if not math.isnan(value)]
    if not known:
        return "not known"
    low, high = number(min(known), 3), number(max(known), 3)
    return low if low == high else f"{low} to {high}"


def _differing(old: Sequence[tuple[str, str]], new: Sequence[tuple[str, str]]) -> Iterator[str]:
    a, b = dict(old), dict(new)
    for name in dict.fromkeys((*a, *b)):
        if a.get(name) != b.get(name):
            yield f"{name} {a.get(name, 'none')} → {b.get(name, 'none')}"


def _verdicts(ones: Sequence[Ran], others: Sequence[Ran]) -> list[str]:
    """Return the verdicts that all of some runs have, and none of others."""
    shared = set.intersection(*(set(run.verdicts) for run in ones))
    return [Verdict[name].value for name in sorted(shared - {name for run in others for name in run.verdicts})]
