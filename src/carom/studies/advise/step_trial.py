"""Trial of one step of one method, at evenly spread starts and at aimed ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from carom.comparator.comparison_range import comparison_range
from carom.comparator.impact_matching import LATEST_STAMP_STEPS, match_impacts
from carom.comparator.measure.errors import measure
from carom.comparator.scales import compute_scales
from carom.comparator.shift import even_phases
from carom.execution.cache_key import JobKey, job_key
from carom.execution.engine_run import load_supported_adapter, observe_run
from carom.execution.job import Answer, Job, JobTask, Method, Status
from carom.execution.journal import MemoryJournal
from carom.execution.pool import Pool
from carom.execution.reference import require_reference, scene_at_phase, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.scoring import sort_by_start, steps_of
from carom.model.scene import Scene
from carom.model.trace import Outcome
from carom.studies.advise.hardest import Demand

#: An aimed start has a check this fraction of a step before the impact, so the impact is found late by the rest of a
#: step.
JUST_BEFORE = 1e-3

#: A run continues for this many steps after the scene's end, so that all impacts before it are reported.
BEYOND_STEPS = LATEST_STAMP_STEPS + 1

#: Number of references that a worker keeps: those of the starts of one step, for the next method.
REFERENCES_KEPT = 128


@dataclass(frozen=True)
class Started:
    """Result of one start.

    Attributes:
        lost: Impacts missed or invented.
        completed: Whether the run reached its end.
        direction_error_rad: Largest direction error of the impacts found; NaN where none was.
        steps: Engine steps taken.
    """

    lost: int
    completed: bool
    direction_error_rad: float
    steps: int


@dataclass(frozen=True)
class StartTask(JobTask):
    """Run a job in a worker process, and compare its impacts up to the scene's end with PIC's."""

    def carry_out(self) -> Started:
        """Return its result.

        Raises:
            UnsupportedError: There is no such start, or no reference of it.
        """
        job = self.job
        adapter = load_supported_adapter(job)
        begun = scene_at_phase(job)
        # Without further steps, an impact in the last steps of the scene could not be distinguished from a missed one.
        scene = Scene(**{**dict(begun), "duration_s": begun.duration_s + BEYOND_STEPS * job.dt_s})
        reference = require_reference(_reference(scene))
        observed = observe_run(adapter, scene, job.profile, job.dt_s, tried=job.method.tried, watched=False)
        aligned = match_impacts(reference, observed, comparison_range(reference, begun.duration_s))
        measured = measure(reference, observed, aligned, compute_scales(scene, reference))
        return Started(
            # After the extra steps nothing is undecided unless the run broke off; then the impact was not found.
            lost=len(aligned.missed) + len(aligned.spurious) + len(aligned.undecided),
            completed=observed.outcome is Outcome.COMPLETED,
            direction_error_rad=measured.largest.direction_rad,
            steps=int(observed.counts.get("steps", 0)),
        )


_reference = lru_cache(maxsize=REFERENCES_KEPT)(solve_reference)


@dataclass(frozen=True)
class StepTrial:
    """One step, run at all its starts.

    Attributes:
        dt_s: The step, seconds.
        even: Number of starts that are evenly spread over the step, without those that failed.
        starts: Number of all starts, with aimed ones.
        lost_even: Number of even starts that missed or invented an impact, or did not reach their end.
        lost: The same of all starts.
        direction_error_rad: Largest direction error at any start; NaN where no impact was found.
        steps: Engine steps taken.
        reason: Error of the engine or its adapter, with which the step fails; empty if there is none.
    """

    dt_s: float
    even: int
    starts: int
    lost_even: int
    lost: int
    direction_error_rad: float
    steps: int
    reason: str = ""

    @property
    def never_misses(self) -> bool:
        """Whether no start missed or invented an impact."""
        return not self.reason and self.lost == 0

    def meets(self, demand: Demand) -> bool:
        """Whether a demand is met; not if the direction is unknown."""
        allowed = demand.miss_probability
        few = self.never_misses if allowed == 0.0 else not self.reason and self.lost_even <= allowed * self.even
        return few and self.direction_error_rad <= demand.direction_error_rad

    @classmethod
    def of(cls, dt_s: float, even: Sequence[Answer[Started]], aimed: Sequence[Answer[Started]]) -> StepTrial | str:
        """Return the combined result of the starts; a reason if none could run."""
        answers = [*even, *aimed]
        broken = [answer for answer in answers if answer.status.is_failure or answer.status is Status.UNAVAILABLE]
        ran = [answer.value for answer in answers if answer.value is not None]
        if not ran and not broken:
            return answers[0].reason
        of_even = [answer.value for answer in even if answer.value is not None]
        known = [one.direction_error_rad for one in ran if not math.isnan(one.direction_error_rad)]
        return cls(
            dt_s,
            even=len(of_even),
            starts=len(ran) + len(broken),
            lost_even=sum(one.lost > 0 or not one.completed for one in of_even),
            lost=sum(one.lost > 0 or not one.completed for one in ran),
            direction_error_rad=max(known, default=math.nan),
            steps=sum(one.steps for one in ran),
            reason=broken[0].said if broken else "",
        )


def starts_of(dt_s: float, even: int, aimed_s: Iterable[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return evenly spread phases, and those with a check just before each of some instants."""
    spread = even_phases(even)
    aimed = dict.fromkeys((JUST_BEFORE - time_s / dt_s) % 1.0 for time_s in aimed_s)
    return spread, tuple(phase for phase in aimed if phase not in spread)


def most_steps(duration_s: float, dt_s: float, starts: int) -> int:
    """Return the number of engine steps of a step's starts; fewer where runs end early."""
    # A start may be a step earlier.
    return starts * (math.ceil(duration_s / dt_s) + 1 + BEYOND_STEPS)


def try_starts(jobs: Iterable[Job], pool: Pool) -> Mapping[tuple[Method, float], Answer[Started]]:
    """Run jobs, one step of each method at a time, and return the results by method and phase."""
    asks = [
        TaskRequest((job.method, job.phase), job_key(job), StartTask(job), steps=steps_of(job))
        for job in sort_by_start(jobs)
    ]
    return dict(run_tasks(asks, pool, MemoryJournal[JobKey, Started]()))
