"""Result of a release's run, and the comparison of two releases for one scene, profile and step size (a cell)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache, partial
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from carom.comparator import Grade, Verdict, compare
from carom.comparator.thresholds import THRESHOLDS
from carom.execution.adapter_profile import load_supported_adapter
from carom.execution.cache_key import JobKey
from carom.execution.job import Answer, JobTask
from carom.execution.journal import Journal, JournalEntry
from carom.execution.observation.engine_run import observe_run, run_pit
from carom.execution.scene_reference import build_reference, require_reference, shift_to_phase, solve_reference
from carom.model.flights import free_flights
from carom.model.trace import Outcome, Trace
from carom.studies.history.options import FEWEST_PHASES
from carom.support.formatting import format_number

#: Number of PIC's and of PIT's runs that a worker process caches.
_KEPT = 64
#: Number of evenly spread instants at which positions are compared. Comparing only the end is not enough, because runs
#: with different bounces may agree again at the end.
PLACES = 8

_reference, _sampling = lru_cache(maxsize=_KEPT)(solve_reference), lru_cache(maxsize=_KEPT)(run_pit)


@dataclass(frozen=True)
class ReleaseRun:
    """Stored result of a run of one release.

    Attributes:
        digest: SHA-256 of all bits of the impacts and the final state.
        settings: The settings that were read back from the engine, as text.
        grade: Name of the grade.
        verdicts: Names of the verdicts.
        expected: Number of impacts in the reference.
        found: Number of impacts that follow from the contacts reported by the engine.
        lost: Number of missed and invented impacts.
        velocity: Largest velocity error divided by the scene's greatest speed; NaN if no impact was matched.
        late_steps: Largest time error, in steps; NaN if no impact was matched.
        position_errors_m: Errors of x and y of each disc's position at `PLACES` evenly spread instants, in metres. The
            last instant is the end. An error is infinite if the run or the reference ends before the instant.
        velocity_errors_m_s: Errors of x and y of each disc's final velocity, in metres per second.
        place_rounding_m: Largest position error that rounding can cause, in metres.
        speed_m_s: The scene's greatest speed, in metres per second.
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
    position_errors_m: tuple[float, ...]
    velocity_errors_m_s: tuple[float, ...]
    place_rounding_m: float
    speed_m_s: float
    float_bits: int

    @property
    def observes_no_contact(self) -> bool:
        """Whether velocities changed although no impact was reported, because the adapter can't observe contacts."""
        return self.expected > 0 and self.found == 0 and self.misses_contacts

    @property
    def misses_contacts(self) -> bool:
        """Whether a velocity changed without a reported impact, because the adapter does not observe every contact."""
        return Verdict.TURNS.name in self.verdicts


@dataclass(frozen=True)
class HistoryTask(JobTask):
    """Task that shifts a scene to the job's phase, runs an engine on it, and scores the run."""

    def carry_out(self) -> ReleaseRun:
        """Return the stored result.

        Raises:
            UnsupportedError: PIC can't solve the scene, or the scene can't be shifted to this phase.
        """
        job = self.job
        adapter = load_supported_adapter(job)
        scene = shift_to_phase(job)
        reference = require_reference(_reference(scene))
        horizon_s = build_reference(reference, is_requested=False).horizon_s
        trace = observe_run(adapter, scene, job.profile, job.dt_s, samples=True)
        score = compare(reference, trace, sampling=_sampling(scene, job.dt_s), horizon=horizon_s)
        errors = _compute_state_errors(reference, trace, math.inf if horizon_s is None else horizon_s)
        places, velocities = (tuple(np.where(np.isnan(one), np.inf, one).ravel().tolist()) for one in errors)
        rounding = THRESHOLDS.place_rounding_of(score.float_bits, scene.step_count(job.dt_s))
        return ReleaseRun(
            digest=_compute_digest(trace),
            settings=tuple(sorted((name, repr(value)) for name, value in trace.settings.items())),
            grade=score.grade.name,
            verdicts=tuple(sorted({verdict.name for verdict in score.verdicts})),
            expected=score.expected,
            found=len(trace.impacts),
            lost=len(score.missed) + len(score.spurious),
            velocity=score.total.velocity,
            late_steps=abs(score.total.time_s) / job.dt_s,
            position_errors_m=places,
            velocity_errors_m_s=velocities,
            place_rounding_m=rounding * score.scales.reach_m,
            speed_m_s=score.scales.speed_m_s,
            float_bits=score.float_bits,
        )


def _compute_largest_error(coordinates: Sequence[float]) -> float:
    """Return the length of the longest vector. The list contains x and y of each vector in turn."""
    return max(map(math.hypot, coordinates[::2], coordinates[1::2]))


def _compute_state_errors(
    reference: Trace, trace: Trace, until_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return errors of positions, shape ``(PLACES, n, 2)``, and of final velocities, shape ``(n, 2)``.

    An error is infinite after `until_s` or after the end of a run. An error is NaN if a coordinate of the run is NaN.
    """
    scene, flights, samples = trace.scene, list(free_flights(reference)), trace.samples
    assert samples is not None  # noqa: S101 - samples were requested
    places = np.full((PLACES, len(scene.discs), 2), np.inf)
    velocities = np.full((len(scene.discs), 2), np.inf)
    until_s = min(until_s, reference.end_time_s)
    sample_rows = np.searchsorted(samples.time_s, scene.duration_s * np.arange(1, PLACES) / PLACES)
    for place, row in zip(places, sample_rows[sample_rows < len(samples.time_s)].tolist(), strict=False):
        time_s = float(samples.time_s[row])
        for flight in flights if time_s <= until_s else ():
            if flight.begin_s <= time_s <= flight.end_s:
                place[flight.disc] = samples.position_m[row, flight.disc] - flight.position_at(time_s)
    if trace.outcome is Outcome.COMPLETED and until_s >= scene.duration_s:
        places[-1] = trace.final_position_m - reference.final_position_m
        velocities = trace.final_velocity_m_s - reference.final_velocity_m_s
    return places, velocities


def _compute_digest(trace: Trace) -> str:
    """Return a hash of all bits of a run's results."""
    arrays = (trace.impacts, trace.final_position_m, trace.final_velocity_m_s, trace.spins, trace.final_spin_rad_s)
    parts = (b"none" if array is None else array.tobytes() for array in arrays)
    return hashlib.sha256(b"".join((trace.outcome.name.encode(), *parts))).hexdigest()


#: Function that opens the journal of a history.
history_journal = partial(Journal[JobKey, ReleaseRun], "releases", JournalEntry[JobKey, ReleaseRun])


@dataclass(frozen=True)
class ReleaseCell:
    """Results of one release for a scene, profile and step size: at phase 0, and at other phases if requested."""

    at_phase_0: Answer[ReleaseRun]
    phases: tuple[Answer[ReleaseRun], ...] = ()

    @property
    def runs(self) -> tuple[ReleaseRun, ...]:
        """Results at all phases, including phase 0."""
        return tuple(answer.value for answer in (self.at_phase_0, *self.phases) if answer.value is not None)


class ChangeKind(Enum):
    """Change of a run from one release to the next. Each member's value is the phrase that the report shows."""

    SAME_BITS = "same bits"
    WORSE = "worse"
    BETTER = "better"
    OTHERWISE = "changed, but neither better nor worse"
    ROUNDING = "bits changed, but the difference is within rounding"
    PHASE_ONLY = "changed, but by no more than results at different phases differ"
    OTHER_SETTINGS = "the engine reports other settings"
    OTHER_CONTACTS = "reported contacts changed, but the motion changed by no more than it differs between phases"
    UNOBSERVED_CONTACTS = "changed, but the adapter does not observe every contact"
    NOT_RUN = "not run by both releases"

    @property
    def heading(self) -> str:
        """Heading of the column that counts changes of this kind."""
        return self.name.lower().replace("_", " ")

    @property
    def is_engine_change(self) -> bool:
        """Whether the change is attributed to the engine's motion, not to settings, contacts, phases or rounding."""
        return self in {ChangeKind.WORSE, ChangeKind.BETTER, ChangeKind.OTHERWISE}


@dataclass(frozen=True)
class CellChange:
    """Difference between two releases for one scene, profile and step size.

    Attributes:
        kind: Kind of change.
        numbers: A phrase with the numbers that show a change of the engine or of its settings, or with the reason why a
            release did not run. The phrase is empty for other kinds of change.
    """

    kind: ChangeKind
    numbers: str = ""


@dataclass(frozen=True)
class _Measure:
    """A number by which the runs of two releases are compared. A larger number is worse.

    Attributes:
        name: Name of the number.
        compute: Function that returns the number.
        rounding: Function that returns the largest change that rounding can cause.
    """

    name: str
    compute: Callable[[ReleaseRun], float]
    rounding: Callable[[ReleaseRun], float]

    def compute_rounding(self, runs: Sequence[ReleaseRun]) -> float:
        return max(map(self.rounding, runs))

    def describe(self, before: Sequence[float], after: Sequence[float]) -> str:
        return f"{self.name}: {_format_range(before)} before, {_format_range(after)} now"


def _read_rounding(release_run: ReleaseRun) -> float:
    return THRESHOLDS.rounding_of(release_run.float_bits)


def _compute_velocity_error(run: ReleaseRun) -> float:
    return _compute_largest_error(run.velocity_errors_m_s) / run.speed_m_s


def _compute_place_error(run: ReleaseRun) -> float:
    return _compute_largest_error(run.position_errors_m)


#: Numbers that describe the motion, and do not depend on reported contacts.
_MOTION = (
    _Measure(
        "largest error of a final velocity, divided by the greatest speed", _compute_velocity_error, _read_rounding
    ),
    _Measure("largest error of a position, in metres", _compute_place_error, attrgetter("place_rounding_m")),
)
#: Numbers that describe the reported contacts.
_CONTACTS = (
    _Measure("missed and invented impacts", attrgetter("lost"), lambda _: 0.0),
    _Measure("velocity error", attrgetter("velocity"), _read_rounding),
    _Measure("time error in steps", attrgetter("late_steps"), _read_rounding),
)


def _has_changed(old: ReleaseRun, new: ReleaseRun) -> bool:
    """Return whether two runs differ by more than rounding in their grades, verdicts, numbers or motion."""
    if (old.grade, old.verdicts) != (new.grade, new.verdicts) or not _has_same_motion(old, new):
        return True
    return not all(
        _are_close(one.compute(old), one.compute(new), one.compute_rounding([old, new])) for one in _CONTACTS
    )


def _are_close(old: ArrayLike, new: ArrayLike, rounding: float) -> bool:
    """Whether numbers are equal except for rounding. NaN only equals NaN, and an infinite number only equals itself."""
    return bool(np.allclose(old, new, rtol=0.0, atol=rounding, equal_nan=True))


def _has_same_motion(old: ReleaseRun, new: ReleaseRun) -> bool:
    """Whether all positions and final velocities of two runs are equal, except for rounding."""
    place_m = max(old.place_rounding_m, new.place_rounding_m)
    speed_m_s = max(_read_rounding(old), _read_rounding(new)) * old.speed_m_s
    has_same_path = _are_close(old.position_errors_m, new.position_errors_m, place_m)
    return has_same_path and _are_close(old.velocity_errors_m_s, new.velocity_errors_m_s, speed_m_s)


def classify_change(old: ReleaseCell, new: ReleaseCell) -> CellChange:
    """Compare two releases for one scene, profile and step size, and classify the change.

    A change is attributed to the engine if the settings read back from the engine are equal and the motion differs.
    Three kinds of numbers describe the motion: final velocity errors, position errors and single coordinates. Each
    release has a range of each number over at least `FEWEST_PHASES` phases. The motion differs if the two ranges of a
    number are further apart than rounding and untested phases can explain. If the motion does not differ, either only
    the reported contacts changed, or the phase explains the change. If a velocity changes without a reported impact,
    the adapter does not observe every contact, and the releases are not compared.
    """
    a, b = old.at_phase_0.value, new.at_phase_0.value
    if a is None or b is None:
        return CellChange(ChangeKind.NOT_RUN, (new.at_phase_0 if a is not None else old.at_phase_0).problem)
    if a.digest == b.digest:
        return CellChange(ChangeKind.SAME_BITS)
    if a.settings != b.settings:
        return CellChange(ChangeKind.OTHER_SETTINGS, ", ".join(_describe_changed_settings(a.settings, b.settings)))
    if a.misses_contacts or b.misses_contacts:  # contacts that the adapter misses would look like changes of the engine
        return CellChange(ChangeKind.UNOBSERVED_CONTACTS)
    if not _has_changed(a, b):
        return CellChange(ChangeKind.ROUNDING)
    if min(len(old.runs), len(new.runs)) < FEWEST_PHASES:
        return CellChange(ChangeKind.PHASE_ONLY)
    separate = list(_find_separated_measures(_MOTION, old.runs, new.runs))
    elsewhere = "" if separate else _describe_coordinate(old.runs, new.runs)
    if separate or elsewhere:
        kinds = {kind for kind, _ in separate}
        unknown = Grade.UNGRADED.name in (a.grade, b.grade)  # grades do not show which release is correct
        kind = kinds.pop() if len(kinds) == 1 and not unknown else ChangeKind.OTHERWISE
        return CellChange(kind, "; ".join(why for _, why in separate) or elsewhere)
    has_other_contacts = any(_find_separated_measures(_CONTACTS, old.runs, new.runs))
    has_other_contacts |= _has_other_verdicts(old.runs, new.runs) or all(map(_has_same_motion, old.runs, new.runs))
    return CellChange(ChangeKind.OTHER_CONTACTS if has_other_contacts else ChangeKind.PHASE_ONLY)


def _find_separated_measures(
    measures: Sequence[_Measure], old: Sequence[ReleaseRun], new: Sequence[ReleaseRun]
) -> Iterator[tuple[ChangeKind, str]]:
    for measure in measures:
        before, after = (list(map(measure.compute, runs)) for runs in (old, new))
        if any(map(math.isnan, (*before, *after))):
            continue
        gaps = _compute_range_gaps(np.array(before), np.array(after))
        is_greater, is_less = gaps > measure.compute_rounding([*old, *new])
        if is_greater or is_less:
            yield ChangeKind.WORSE if is_greater else ChangeKind.BETTER, measure.describe(before, after)


def _compute_range_gaps(before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return two gaps: from the old range up to the new range, and from the new range up to the old range.

    Each row of the arrays is a run. A gap is negative if the ranges overlap.

    Values at untested phases may be outside a range. Therefore both ends of each range are moved outwards: the upper
    end by the distance between the two largest values, the lower end by the distance between the two smallest values.
    """

    def reach(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        low, lower, *_, higher, high = np.sort(values, axis=0)[[0, 1, -2, -1]]
        return np.where(low == lower, low, 2 * low - lower), np.where(high == higher, high, 2 * high - higher)

    with np.errstate(invalid="ignore"):  # if errors are infinite in both releases, there is no gap
        (old_low, old_high), (new_low, new_high) = reach(before), reach(after)
        return np.nan_to_num(np.stack([new_low - old_high, old_low - new_high]), nan=0.0, posinf=np.inf)


def _describe_coordinate(old: Sequence[ReleaseRun], new: Sequence[ReleaseRun]) -> str:
    """Name the coordinate and the instant at which two releases differ most.

    The text is empty if no coordinate differs.
    """
    before, after = (np.array([run.position_errors_m for run in runs]) for runs in (old, new))
    gaps = _compute_range_gaps(before, after).max(axis=0)
    k = int(gaps.argmax())
    if not gaps[k] > max(run.place_rounding_m for run in (*old, *new)):
        return ""
    instant, disc = divmod(k // 2, len(gaps) // (2 * PLACES))
    ranges = f"{_format_range(before[:, k].tolist())} m before, {_format_range(after[:, k].tolist())} m now"
    return f"error of disc {disc}'s {'xy'[k % 2]} coordinate after {instant + 1}/{PLACES} of the run: {ranges}"


def _format_range(values: Sequence[float]) -> str:
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return "unknown"
    low, high = format_number(min(known), 3), format_number(max(known), 3)
    return low if low == high else f"{low} to {high}"


def _describe_changed_settings(old: Sequence[tuple[str, str]], new: Sequence[tuple[str, str]]) -> Iterator[str]:
    a, b = dict(old), dict(new)
    for name in dict.fromkeys((*a, *b)):
        if a.get(name) != b.get(name):
            yield f"{name} {a.get(name, 'none')} → {b.get(name, 'none')}"


def _has_other_verdicts(old: Sequence[ReleaseRun], new: Sequence[ReleaseRun]) -> bool:
    """Whether one release has a verdict at every phase, and the other release at none."""
    always_old, always_new = (set.intersection(*(set(run.verdicts) for run in runs)) for runs in (old, new))
    ever_old, ever_new = ({name for run in runs for name in run.verdicts} for runs in (old, new))
    return bool(always_old - ever_new or always_new - ever_old)
