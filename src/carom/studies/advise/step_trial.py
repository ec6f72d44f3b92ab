"""Test of one method with one step size, at evenly spread phases and at phases chosen for the hardest impacts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from carom.comparator.comparison_range import comparison_range
from carom.comparator.match_impacts import LATEST_STAMP_STEPS, match_impacts
from carom.comparator.measure.errors import MatchedRun, measure_errors
from carom.comparator.scales import compute_scales
from carom.comparator.shifted_scenes import list_even_phases
from carom.execution.adapter_profile import load_supported_adapter
from carom.execution.cache_key import build_job_key
from carom.execution.job import Answer, Job, JobTask, Method, Status
from carom.execution.observation.engine_run import observe_run
from carom.execution.pool import Pool
from carom.execution.scene_reference import require_reference, shift_to_phase, solve_reference
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.score_jobs import estimate_steps, sort_by_start
from carom.model.scene import Scene
from carom.model.trace import Outcome
from carom.studies.advise.options import AdviceOptions

#: At a phase that is chosen for a hard impact, a check comes this fraction of a step before the impact. A method that
#: checks once per step then finds the impact almost a whole step late.
JUST_BEFORE = 1e-3

#: A run continues for this number of steps after the scene's end, so that the engine also reports the scene's last
#: impacts.
BEYOND_STEPS = LATEST_STAMP_STEPS + 1

#: Number of PIC traces that a worker process caches. Methods that are tested with the same step size reuse these
#: traces.
REFERENCES_KEPT = 128


@dataclass(frozen=True)
class PhaseResult:
    """Result of a run at one phase.

    Attributes:
        is_lost: Whether an impact was missed or invented, or the run ended early.
        direction_error_rad: Largest direction error of the found impacts; NaN if none was found.
        steps: Number of engine steps.
    """

    is_lost: bool
    direction_error_rad: float
    steps: int


@dataclass(frozen=True)
class StartTask(JobTask):
    """Task that runs an engine and compares its impacts with PIC's, up to the scene's end."""

    def carry_out(self) -> PhaseResult:
        """Return the result of the run.

        Raises:
            UnsupportedError: The scene can't be shifted to this phase, or PIC can't solve the shifted scene.
        """
        job = self.job
        adapter = load_supported_adapter(job)
        shifted_scene = shift_to_phase(job)
        # Run further steps, because impacts in the last steps may be reported later.
        scene = Scene(**{**dict(shifted_scene), "duration_s": shifted_scene.duration_s + BEYOND_STEPS * job.dt_s})
        reference = require_reference(_reference(scene))
        observed = observe_run(adapter, scene, job.profile, job.dt_s, overrides=job.method.overrides, stepwise=False)
        aligned = match_impacts(reference, observed, comparison_range(reference, shifted_scene.duration_s))
        (measured,) = measure_errors([MatchedRun(reference, observed, aligned)], compute_scales(scene, reference))
        # An impact is undecided if no further step follows in which the run could report it. Because of the additional
        # steps, only a run that ends early has undecided impacts, which count as missed.
        wrong = aligned.missed or aligned.spurious or aligned.undecided
        return PhaseResult(
            is_lost=bool(wrong) or observed.outcome is not Outcome.COMPLETED,
            direction_error_rad=measured.largest.direction_rad,
            steps=int(observed.counts.get("steps", 0)),
        )


_reference = lru_cache(maxsize=REFERENCES_KEPT)(solve_reference)


@dataclass(frozen=True)
class StepTrial:
    """Result of one step size at all its phases.

    Attributes:
        dt_s: The step size, in seconds.
        even_phases: Number of evenly spread phases at which the engine did not fail.
        phases: Number of all phases at which the engine ran or failed.
        lost_even_phases: Number of evenly spread phases at which an impact was missed or invented, or the run ended
            early.
        lost_phases: Number of all phases at which an impact was missed or invented, or the run ended early.
        direction_error_rad: Largest direction error at any phase; NaN if no impact was found.
        steps: Number of engine steps.
        reason: Error message of the engine or its adapter; empty without an error. A step size with an error fails.
    """

    dt_s: float
    even_phases: int
    phases: int
    lost_even_phases: int
    lost_phases: int
    direction_error_rad: float
    steps: int
    reason: str = ""

    @property
    def never_misses(self) -> bool:
        """Whether every run reached its end without a missed or invented impact."""
        return not self.reason and self.lost_phases == 0

    def meets_target(self, options: AdviceOptions) -> bool:
        """Return whether the requested accuracy is reached; False if the direction error is unknown."""
        few_lost = self.lost_phases == 0
        if options.miss_probability > 0.0:
            few_lost = self.lost_even_phases <= options.miss_probability * self.even_phases
        return not self.reason and few_lost and self.direction_error_rad <= options.direction_error_rad

    @classmethod
    def of(
        cls, dt_s: float, even: Sequence[Answer[PhaseResult]], aimed: Sequence[Answer[PhaseResult]]
    ) -> StepTrial | str:
        """Combine the results of the phases. Return the reason as text if the method supports none of the phases."""
        answers = [*even, *aimed]
        broken = [answer for answer in answers if answer.status.is_failure or answer.status is Status.UNAVAILABLE]
        results = [answer.value for answer in answers if answer.value is not None]
        if not results and not broken:
            return answers[0].reason
        of_even = [answer.value for answer in even if answer.value is not None]
        known = [one.direction_error_rad for one in results if not math.isnan(one.direction_error_rad)]
        return cls(
            dt_s,
            even_phases=len(of_even),
            phases=len(results) + len(broken),
            lost_even_phases=sum(one.is_lost for one in of_even),
            lost_phases=sum(one.is_lost for one in results),
            direction_error_rad=max(known, default=math.nan),
            steps=sum(one.steps for one in results),
            reason=broken[0].problem if broken else "",
        )


def list_start_phases(dt_s: float, even: int, aimed_s: Iterable[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return evenly spread phases, and the phases at which a step ends just before each given instant."""
    spread = list_even_phases(even)
    aimed = dict.fromkeys((JUST_BEFORE - time_s / dt_s) % 1.0 for time_s in aimed_s)
    return spread, tuple(phase for phase in aimed if phase not in spread)


def compute_step_limit(duration_s: float, dt_s: float, phases: int) -> int:
    """Return an upper bound for the number of engine steps in runs at this number of phases."""
    # A run can begin up to a step before the scene's start.
    return phases * (math.ceil(duration_s / dt_s) + 1 + BEYOND_STEPS)


def try_phases(jobs: Iterable[Job], pool: Pool) -> Mapping[tuple[Method, float], Answer[PhaseResult]]:
    """Run jobs, and return their results by method and phase. All jobs of a method must have the same step size."""
    asks = [
        TaskRequest((job.method, job.phase), build_job_key(job), StartTask(job), steps=estimate_steps(job))
        for job in sort_by_start(jobs)
    ]
    return dict(run_tasks(asks, pool))
