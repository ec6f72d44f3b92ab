"""Search for the largest step sizes at which an engine misses no impact and meets an accuracy target.

For two discs without friction, `carom.studies.advise.sampling_limit` computes PIT's largest step size by a formula. All
other step sizes are found by testing a series of step sizes. Each step size is tested at several phases: the scene is
shifted in time by fractions of a step. Some phases are evenly spread over a step; each other phase is chosen so that a
step ends just before one of the hardest impacts.
"""

from __future__ import annotations

import math
import time
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial

from carom.comparator.horizon import estimate_horizon
from carom.engines.registry import EngineInfo
from carom.errors import InputError
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.environment import Environment, describe_environment
from carom.execution.job import PIT_METHOD, Job, Method, Progress, no_progress
from carom.execution.methods import list_methods
from carom.execution.pool import Pool
from carom.execution.scene_reference import solve_reference
from carom.execution.settings_code import find_step_code
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.sampling_limit import HardImpact, rank_hardest_impacts
from carom.studies.advise.step_search import StepAdvice, StepSearch
from carom.studies.advise.step_trial import StepTrial, list_start_phases, try_phases

#: Number of the hardest impacts for which additional phases are tested.
AIMED = 3


class ReferenceCut(Enum):
    """Reason why only the beginning of a scene is searched. Each member's value is the phrase that the report shows."""

    TIE = "a disc meets two others at once, so the scene has no unique answer"
    CHAOS = "rounding decides what happens"


@dataclass(frozen=True)
class Advice:
    """Result of `carom advise`.

    Attributes:
        scene: The searched scene. The scene is cut off before its first impact without a reliable result, if it has
            such an impact.
        options: Options of the study.
        impacts: Number of impacts in the searched part of the scene.
        hardest: Some of the hardest impacts, beginning with the hardest one.
        pit_steps_s: Two step sizes of PIT, for comparison with the engines: the largest with which PIT misses no
            impact, and the largest with which PIT also meets the accuracy target. A value is 0 if no tested step size
            suffices.
        answers: The search result of each engine and profile.
        unable: Engines and profiles that can't run the scene with any tested step size, with the reason.
        swept: Methods whose continuous collision detection keeps a fast body from passing through another body within a
            step.
        located: Methods whose steps Carom shortens so that a step ends at each impact, which no setting of the engine
            can do.
        code: For each method, the engine's code for one frame with the recommended step size, if the adapter can write
            code.
        environment: Description of the machine, and versions of packages.
        command: The command that repeats the study; empty if it was called from Python.
        elapsed_s: Duration of the whole study, in seconds.
        cut: Reason why the scene was shortened; None for a whole scene.
    """

    scene: Scene
    options: AdviceOptions
    impacts: int
    hardest: tuple[HardImpact, ...]
    pit_steps_s: tuple[float, float]
    answers: tuple[StepAdvice, ...]
    unable: Mapping[Method, str]
    swept: frozenset[Method]
    located: frozenset[Method]
    code: Mapping[Method, str]
    environment: Environment
    command: str
    elapsed_s: float
    cut: ReferenceCut | None = None


def advise(
    scene: Scene, options: AdviceOptions, pool: Pool, *, progress: Progress = no_progress, command: str = ""
) -> Advice:
    """For each engine, find the largest step sizes at which it misses no impact of a scene and meets a target accuracy.

    Args:
        scene: The scene.
        options: Options of the study.
        pool: Pool of worker processes, which is not closed.
        progress: Function that is called with the number of finished searches, the number of all searches, and a
            description.
        command: The command that repeats the study, which is stored in the result.

    Raises:
        InputError: PIC can't solve the scene, the scene has no impact, or its first impact has no reliable result.
        UnknownNameError: An engine does not exist.
    """
    started = time.perf_counter()
    reference, cut = _cut_reference(scene)
    scene = reference.scene
    hardest = rank_hardest_impacts(reference, options)
    pit_steps_s = find_closed_form(scene, hardest)
    guess_s, frame_s = hardest[0].dt_s, 1.0 / scene.frame_rate_hz
    infos = select_engines(describe_engines(options.engines, pool), options.engines)
    other_infos = [info for info in infos if info.name not in {"pic", "pit"}]
    methods = list_methods(
        [*other_infos, *describe_engines([PIT_METHOD.engine], pool)], options.profiles, [frame_s], pool
    )
    aimed_s = tuple(impact.time_s for impact in hardest[:AIMED])

    def find_refusal(method: Method, dt_s: float) -> str:
        answer = methods.find_refusal(method, frame_s) or methods.find_job_refusal(Job(scene, method, dt_s))
        return "" if answer is None else answer.problem

    def build_search(method: Method) -> StepSearch:
        why = partial(find_refusal, method)
        return StepSearch(scene, method, options, guess_s, len(aimed_s), why)

    searches = {} if pit_steps_s else {PIT_METHOD: build_search(PIT_METHOD)}
    unable = {}
    for method in (method for info in other_infos for method in methods.by_engine_and_step[info.name, frame_s]):
        search = build_search(method)
        if search.is_refused:
            unable[method] = find_refusal(method, frame_s) or search.build_answer().refusal
        else:
            searches[method] = search
    _run_searches(scene, searches, aimed_s, pool, progress)
    answers = {method: search.build_answer() for method, search in searches.items()}
    if pit_steps_s is None:
        pit = answers.pop(PIT_METHOD)
        pit_steps_s = (pit.never_misses.largest_passing_s, pit.meets_target.largest_passing_s)
    located = frozenset(method for method in answers if method.profile in methods.infos[method.engine].located)
    own = {method: answer for method, answer in answers.items() if method not in located}
    return Advice(
        scene,
        options,
        len(reference.impacts),
        hardest[:AIMED],
        pit_steps_s,
        tuple(answers.values()),
        unable,
        swept=frozenset(one for one in own if _has_continuous_detection(methods.infos[one.engine], one.profile)),
        located=located,
        code={method: code for method, answer in own.items() if (code := _write_frame_code(scene, answer, pool))},
        environment=describe_environment(infos),
        command=command,
        elapsed_s=time.perf_counter() - started,
        cut=cut,
    )


def _has_continuous_detection(info: EngineInfo, profile: str) -> bool:
    capabilities = info.own.get(profile, info.capabilities)
    return capabilities is not None and capabilities.continuous_detection


def _write_frame_code(scene: Scene, answer: StepAdvice, pool: Pool) -> str:
    """Return the engine's code for one frame.

    If no step size meets the target, the code uses the largest step size that misses no impact.
    """
    trial = answer.meets_target.frame_divisor or answer.never_misses.frame_divisor
    return "" if trial is None else find_step_code(answer.method.engine, answer.method.profile, scene, trial.dt_s, pool)


def _cut_reference(scene: Scene) -> tuple[Trace, ReferenceCut | None]:
    """Return a scene's PIC trace up to its last reliable impact, and the reason why later impacts are unreliable."""
    reference = solve_reference(scene)
    if not isinstance(reference, Trace):
        raise InputError(f"there is no reference to compare with: {reference}")
    if not len(reference.impacts):
        raise InputError(f"{scene.name!r} has no impact within its {scene.duration_s:g} s, so any step size passes")
    times, cut = reference.impacts["time_s"].tolist(), None
    if reference.ambiguous:
        cut, reliable = ReferenceCut.TIE, bisect_left(times, times[reference.ambiguous[0]])
    elif (horizon_s := estimate_horizon(reference)) is not None:
        cut, reliable = ReferenceCut.CHAOS, bisect_right(times, horizon_s)
    if cut is None or reliable == len(times):
        return reference, None
    if reliable == 0:
        why = f"because from its first impact on, {cut.value}"
        raise InputError(f"no step size can be recommended for {scene.name!r}, {why}")
    # The shortened scene ends midway between its last impact and the next one. Therefore an engine that rounds the
    # starting state still has the same impacts before the end.
    ended = solve_reference(Scene(**{**dict(scene), "duration_s": 0.5 * (times[reliable - 1] + times[reliable])}))
    if not isinstance(ended, Trace):
        raise InputError(f"there is no reference to compare with: {ended}")
    return ended, cut


def find_closed_form(scene: Scene, hardest: Sequence[HardImpact]) -> tuple[float, float] | None:
    """Compute by formulas the largest step sizes at which PIT is accurate enough, in seconds; see `Advice.pit_steps_s`.

    Return None for three or more bodies, friction or forces.
    """
    slowed = scene.damping_per_s or scene.table_deceleration_m_s2
    is_accelerated = slowed or (any(scene.gravity_m_s2) and not all(scene.arrays.movable))
    turns = any(disc.legs for disc in scene.discs)
    if len(scene.discs) != 2 or scene.walls or scene.arrays.has_disc_friction or is_accelerated or turns:
        return None
    never = min((impact.window.length_s for impact in hardest if impact.window is not None), default=math.inf)
    return never, hardest[0].dt_s


def _run_searches(
    scene: Scene, searches: Mapping[Method, StepSearch], aimed_s: Sequence[float], pool: Pool, progress: Progress
) -> None:
    """Test the step sizes that the searches request, until all searches have ended."""
    tested_count = 0
    while requests := {method: search.request for method, search in searches.items() if search.request is not None}:
        phases_by_method = {
            method: list_start_phases(one.dt_s, one.even_phases, aimed_s) for method, one in requests.items()
        }
        phases = [(method, phase) for method, (even, aimed) in phases_by_method.items() for phase in (*even, *aimed)]
        jobs = [Job(scene, method, requests[method].dt_s, 0, phase) for method, phase in phases]
        found = try_phases(jobs, pool)
        for method, (even, aimed) in phases_by_method.items():
            answers = ([found[method, phase] for phase in some] for some in (even, aimed))
            searches[method].add_result(StepTrial.of(requests[method].dt_s, *answers))
        tested_count += len(requests)
        ended = sum(search.request is None for search in searches.values())
        progress(ended, len(searches), f"{tested_count} steps tested")
