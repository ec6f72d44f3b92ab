"""The adapter under test: its declarations, and a worker process that runs its engine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache, cached_property
from types import MappingProxyType
from typing import NamedTuple, TypeVar

from carom.catalogue import all_scenes
from carom.comparator import Score, compare
from carom.comparator.thresholds import THRESHOLDS
from carom.conformance.contact_margin import solve_thickened
from carom.conformance.probes import AdapterFailure, Make, ObservedRun, Watch
from carom.conformance.violation import Setup, Violation
from carom.engines.api import Adapter, Capabilities, unsupported_reason
from carom.engines.registry import load_adapter
from carom.execution.adapter_profile import capabilities_of, prepare_settings
from carom.execution.job import Job, Method, Status, Task
from carom.execution.observation.engine_run import ObserveTask, observe_run
from carom.execution.pool import Closeable, LocalPool
from carom.execution.scheduler import TaskRequest, run_tasks
from carom.execution.shared_options import LimitOptions
from carom.execution.workers.worker_process import Worker
from carom.model.scene import Scene
from carom.model.trace import Setting, Trace
from carom.solvers.pic import solve_pic

T = TypeVar("T")


class CatalogueRun(NamedTuple):
    """A run of a catalogue scene.

    Attributes:
        setup: Scene, profile and step size of the run.
        reference: PIC's trace.
        trace: Trace of the run.
        score: Comparison of the run with PIC.
        pit: Comparison of a run of PIT with PIC. PIT runs with the step size of `setup`.
        margin: Comparison with PIC of an exact run in which bodies collide at the profile's contact margin, before they
            touch. The engine may have errors of the same size. None if the profile declares no margin.
    """

    setup: Setup
    reference: Trace
    trace: Trace
    score: Score
    pit: Score
    margin: Score | None

    @property
    def misses_impacts(self) -> bool:
        """Whether the run or PIT's run misses an impact. After a missed impact, paths can't be compared."""
        return any(score.missed or score.undecided for score in (self.score, self.pit))


class Subject(Closeable):
    """The adapter under test. At the end of a `with` block, the worker process ends.

    If the worker process crashes or hangs, methods that run the engine raise `Violation`. If the adapter raises an
    error, `try_to_watch` returns it as `AdapterFailure`, and the other methods raise `Violation`.

    Attributes:
        name: Name of the adapter.
        adapter: The loaded adapter. The engine is not imported in this process.
    """

    def __init__(self, name: str, limits: LimitOptions) -> None:
        self.name = name
        self.adapter: Adapter = load_adapter(name)
        self._limits = limits
        self._scores: dict[tuple[str, str], CatalogueRun] = {}
        self._seen: dict[tuple[str, str, float], ObservedRun] = {}

    def close(self) -> None:
        """End the worker process."""
        self._pool.close()

    @cached_property
    def _pool(self) -> LocalPool:
        return self._limits.open_local_pool(1)

    def create_fresh_copy(self) -> Subject:
        """Return a `Subject` of the same adapter with a new worker process."""
        return Subject(self.name, self._limits)

    @property
    def rounding(self) -> float:
        """Rounding error that the suite allows, as a fraction of a value. The fraction is larger for 32-bit floats."""
        return THRESHOLDS.rounding_of(self.adapter.capabilities.float_bits)

    def capabilities(self, profile: str = "tuned") -> Capabilities:
        """Return the capabilities of a profile. If the profile declares none, return the adapter's."""
        return capabilities_of(self.adapter, profile)

    def find_unsupported_reason(self, setup: Setup) -> str:
        """Return the reason why the declared capabilities exclude a run; an empty text if they allow the run."""
        located = self.adapter.profiles[setup.profile].located
        return unsupported_reason(setup.scene, self.capabilities(setup.profile), setup.dt_s, located=located)

    def settings(self, profile: str, dt_s: float) -> Mapping[str, Setting]:
        """Return the settings of a profile."""
        return prepare_settings(self.adapter, profile, dt_s)

    def watch(self, setup: Setup, *, observations: int = 1) -> ObservedRun:
        """Run a scene and return every observation."""
        answer = self.try_to_watch(setup, observations=observations)
        if isinstance(answer, AdapterFailure):
            problem = f"{answer.where}() raises an error for a scene that the declared capabilities allow"
            raise Violation(problem, "a run to the end of the scene", answer.cause, setup)
        return answer

    def watch_cached(self, setup: Setup) -> ObservedRun:
        """Return the cached result of `watch` for this run."""
        key = (setup.scene.name, setup.profile, setup.dt_s)
        if key not in self._seen:
            self._seen[key] = self.watch(setup)
        return self._seen[key]

    def try_to_watch(
        self,
        setup: Setup,
        extra_settings: Mapping[str, Setting] = MappingProxyType({}),
        *,
        observations: int = 1,
        cut: bool = False,
        disturbed: bool = False,
    ) -> ObservedRun | AdapterFailure:
        """Run a scene and return every observation, or the error that the adapter raised.

        Args:
            setup: The run.
            extra_settings: Settings in addition to the settings of the profile.
            observations: Number of observations after each step. With 0, the world makes all steps in one call, and
                only the end is observed.
            cut: Whether to call the world's method `cut` before each step.
            disturbed: Whether to take and undo a longer step before each step, and to call `touching` after both steps.
        """
        settings = {**self.settings(setup.profile, setup.dt_s), **extra_settings}
        steps = setup.scene.step_count(setup.dt_s)
        cut_s = setup.dt_s if cut else None
        return self._ask(Watch(self.name, setup.scene, settings, steps, observations, cut_s, disturbed), setup)

    def measure_growth(self, setup: Setup, worlds: int, *, step: bool = True) -> float:
        """Create and close worlds one after another. Return the growth of memory in bytes; NaN if unknown."""
        settings = self.settings(setup.profile, setup.dt_s)
        answer = self._ask(Make(self.name, setup.scene, settings, worlds, step), setup)
        if isinstance(answer, AdapterFailure):
            raise Violation(f"a world can't be created and closed {worlds} times", "no error", answer, setup)
        return answer

    def score(self, profile: str, name: str) -> CatalogueRun:
        """Run a catalogue scene, and return the run with all comparisons that the checks need."""
        if (profile, name) not in self._scores:
            setup = build_catalogue_setup(name, profile)
            trace = self._ask(ObserveTask(Job(setup.scene, Method(self.name, profile), setup.dt_s)), setup)
            reference, pit, pit_score = _compute_pit_score(name)
            score, margin_m = compare(reference, trace, sampling=pit), self.adapter.profiles[profile].accuracy.margin_m
            margin = _compute_margin_score(name, margin_m) if margin_m else None
            self._scores[profile, name] = CatalogueRun(setup, reference, trace, score, pit_score, margin)
        return self._scores[profile, name]

    @property
    def worker(self) -> Worker:
        """The worker process of the engine."""
        return self._pool.worker_of(self.name)

    def _ask(self, task: Task[T], setup: Setup) -> T:
        ((_, answer),) = run_tasks([TaskRequest(None, None, task)], self._pool, one_at_a_time=True)
        if answer.value is None:
            problem = _FAILURES.get(answer.status, "the run fails")
            raise Violation(problem, "a run to the end of the scene", answer.reason, setup)
        return answer.value


_FAILURES = {Status.CRASHED: "the engine ends its process", Status.TIMED_OUT: "the engine hangs"}

#: Number of steps per frame in runs of catalogue scenes. `carom run` uses 1, 4 and 16 steps per frame.
STEPS_A_FRAME = 4


@cache
def _compute_pit_score(name: str) -> tuple[Trace, Trace, Score]:
    """Return three results for a catalogue scene: PIC's trace, PIT's trace, and PIT's score."""
    setup = build_catalogue_setup(name, "tuned")
    reference = solve_pic(setup.scene)
    pit = observe_run(load_adapter("pit"), setup.scene, setup.profile, setup.dt_s)
    return reference, pit, compare(reference, pit, sampling=pit)


@cache
def _compute_margin_score(name: str, margin_m: float) -> Score:
    scene = all_scenes()[name].scene
    return compare(_compute_pit_score(name)[0], solve_thickened(scene, margin_m))


def build_catalogue_setup(name: str, profile: str) -> Setup:
    """Return the scene, profile and step size with which the suite runs a catalogue scene."""
    scene = all_scenes()[name].scene
    return Setup(scene, profile, 1.0 / (scene.frame_rate_hz * STEPS_A_FRAME), catalogued=True)


def find_greatest_speed(scene: Scene) -> float:
    """Return the greatest initial speed of a disc, in metres per second; 1 if no disc moves."""
    return max(math.hypot(*disc.velocity_m_s) for disc in scene.discs) or 1.0


def list_masses(scene: Scene) -> list[float]:
    """Return the masses of the discs, in kilograms. Immovable discs get 0, so that they add nothing to the momentum."""
    return [0.0 if disc.immovable else disc.mass_kg for disc in scene.discs]
