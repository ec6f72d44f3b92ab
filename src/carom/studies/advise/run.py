"""The adviser: from which step on each engine never misses, and meets a demand, on a scene; and the hardest impact.

Of two smooth discs what checking once per step (PIT) needs is a closed form
(`carom.studies.advise.sampling_limit`). All else is found by trying: every step of a grid, each at starts spread over
it and at the unlucky ones that look just before the hardest impacts.
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
from carom.execution.engines import describe_engines, list_methods, select_engines
from carom.execution.environment import Environment, environment
from carom.execution.job import PIT_METHOD, Job, Method, Progress, no_progress
from carom.execution.pool import Pool
from carom.execution.reference import solve_reference
from carom.execution.settings_code import find_step_code
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.studies.advise.hardest import Cause, Demand, HardImpact, hardest_impacts
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.step_search import Advised, SearchEnding, StepRange, StepSearch
from carom.studies.advise.step_trial import StepTrial, starts_of, try_starts

__all__ = [
    "Advice",
    "Advised",
    "Cause",
    "ClosedForm",
    "Demand",
    "HardImpact",
    "ReferenceCut",
    "SearchEnding",
    "StepRange",
    "StepTrial",
    "Unable",
    "advise",
    "hardest_impacts",
]

#: The unlucky starts of this many of the hardest impacts are tried.
AIMED = 3


class ReferenceCut(Enum):
    """Why a scene is asked about up to some time only; the value is the phrase shown."""

    TIE = "a disc meets two others at once, which has no unique answer"
    CHAOS = "rounding alone decides what happens"


@dataclass(frozen=True)
class Unable:
    """A method that was not searched.

    Attributes:
        method: Engine and profile.
        reason: Why it can't run the scene at any step that would be tried.
    """

    method: Method
    reason: str


@dataclass(frozen=True)
class ClosedForm:
    """The largest steps of checking once per step (PIT) on two smooth discs alone, seconds.

    Attributes:
        never_misses_s: Up to it no start misses the impact.
        demand_s: Up to it every start meets the demand.
    """

    never_misses_s: float
    demand_s: float


@dataclass(frozen=True)
class Advice:
    """What the adviser says.

    Attributes:
        scene: The scene, ended where its reference is reliable no longer.
        demand: What was asked for.
        impacts: Impacts of the reference.
        hardest: Its hardest impacts, the hardest first.
        closed_form: What PIT needs; None where there is no closed form of it.
        sampling: PIT, searched as the engines are, where there is no closed form: a yardstick, and no engine to take.
        answers: One entry an engine's profile.
        unable: Engines' profiles that can't run the scene, and were not searched.
        phases: Even starts at which each step was tried, aimed ones not counted.
        budget_steps: Engine steps that each search was allowed.
        swept: The methods whose engine sweeps fast bodies, so that none passes through another in a step.
        located: The methods whose steps Carom cuts: no setting of the engine does that, so there is nothing to paste.
        code: The engine's own code of a frame at the step of the answer, by method; none where an adapter writes none.
        environment: Machine and versions.
        command: The command that makes this again; empty where it was called from Python.
        elapsed_s: Seconds that it took.
        cut: Why the scene was ended before its own end; None where it was not.
    """

    scene: Scene
    demand: Demand
    impacts: int
    hardest: tuple[HardImpact, ...]
    closed_form: ClosedForm | None
    sampling: Advised | None
    answers: tuple[Advised, ...]
    unable: tuple[Unable, ...]
    phases: int
    budget_steps: int
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
    """Return from which step on each engine never misses an impact of a scene, and meets a demand.

    Args:
        scene: The scene.
        options: What is asked for.
        pool: Where steps are tried; it stays open.
        progress: Called with (done, all, what).
        command: The command that makes this again, for the result.

    Raises:
        InputError: The scene has no reference or no impact.
        UnknownNameError: There is no such engine.
    """
    started = time.perf_counter()
    demand, phases = Demand(options.direction_error_rad, options.miss_probability), options.phases
    reference, cut = _reliable(scene)
    scene = reference.scene
    hardest = hardest_impacts(reference, demand)
    closed_form = _closed_form(scene, hardest)
    guess_s, frame_s = hardest[0].limit.dt_s, 1.0 / scene.frame_rate_hz
    infos = select_engines(describe_engines(options.engines, pool), options.engines)
    others = [info for info in infos if info.name not in {"pic", "pit"}]
    asked = list_methods([*others, *describe_engines([PIT_METHOD.engine], pool)], options.profiles, [frame_s], pool)
    aimed_s = tuple(impact.time_s for impact in hardest[:AIMED])

    def refusal(method: Method, dt_s: float) -> str:
        answer = asked.find_refusal(method, frame_s) or asked.find_job_refusal(Job(scene, method, dt_s))
        return "" if answer is None else answer.said

    def search_of(method: Method) -> StepSearch:
        why = partial(refusal, method)
        return StepSearch(scene, method, demand, guess_s, phases, len(aimed_s), options.budget_steps, why)

    searches = {} if closed_form else {PIT_METHOD: search_of(PIT_METHOD)}
    unable = []
    for method in (method for info in others for method in asked.at[info.name, frame_s]):
        search = search_of(method)
        if search.refused_all:
            unable.append(Unable(method, refusal(method, frame_s) or search.answer().refusal))
        else:
            searches[method] = search
    _carry_out(scene, searches, aimed_s, pool, progress)
    found = {method: search.answer() for method, search in searches.items()}
    sampling = found.pop(PIT_METHOD, None)
    located = frozenset(method for method in found if method.profile in asked.infos[method.engine].located)
    return Advice(
        scene,
        demand,
        len(reference.impacts),
        hardest[:AIMED],
        closed_form,
        sampling,
        tuple(found.values()),
        tuple(unable),
        phases,
        options.budget_steps,
        swept=frozenset(one for one in found if one not in located and _sweeps(asked.infos[one.engine], one.profile)),
        located=located,
        code={
            method: code
            for method, answer in found.items()
            if method not in located and (code := _code(scene, answer, pool))
        },
        environment=environment(infos),
        command=command,
        elapsed_s=time.perf_counter() - started,
        cut=cut,
    )


def _sweeps(info: EngineInfo, profile: str) -> bool:
    able = info.own.get(profile, info.capabilities)
    return able is not None and able.continuous_detection


def _code(scene: Scene, answer: Advised, pool: Pool) -> str:
    """Return the code of a frame at the step that meets the demand, or, where none does, that misses nothing."""
    trial = answer.demand.in_frame or answer.never_misses.in_frame
    return "" if trial is None else find_step_code(answer.method.engine, answer.method.profile, scene, trial.dt_s, pool)


def _reliable(scene: Scene) -> tuple[Trace, ReferenceCut | None]:
    """Return the reference of a scene as far as it is reliable, and why it ends before the scene does."""
    reference = solve_reference(scene)
    if not isinstance(reference, Trace):
        raise InputError(f"no reference to compare with: {reference}")
    if not len(reference.impacts):
        raise InputError(f"{scene.name!r} has no impact in its {scene.duration_s:g} s, so any step passes")
    times, cut = reference.impacts["time_s"].tolist(), None
    if reference.ambiguous:
        cut, reliable = ReferenceCut.TIE, bisect_left(times, times[reference.ambiguous[0]])
    elif (horizon_s := estimate_horizon(reference)) is not None:
        cut, reliable = ReferenceCut.CHAOS, bisect_right(times, horizon_s)
    if cut is None or reliable == len(times):
        return reference, None
    if reliable == 0:
        raise InputError(f"no step can be recommended for {scene.name!r}, because from its first impact on {cut.value}")
    # Half way to the next impact: no start's rounding moves one across.
    ended = solve_reference(Scene(**{**dict(scene), "duration_s": 0.5 * (times[reliable - 1] + times[reliable])}))
    if not isinstance(ended, Trace):
        raise InputError(f"no reference to compare with: {ended}")
    return ended, cut


def _closed_form(scene: Scene, hardest: Sequence[HardImpact]) -> ClosedForm | None:
    """Return what PIT needs; None where friction, slowing, legs, a third body or a fall onto one leave none."""
    slowed = scene.damping_per_s or scene.table_deceleration_m_s2
    apart = slowed or (any(scene.gravity_m_s2) and not all(scene.arrays.movable))
    turns = any(disc.legs for disc in scene.discs)
    if len(scene.discs) != 2 or scene.walls or scene.arrays.rubs_discs or apart or turns:
        return None
    windows = [impact.limit.window for impact in hardest]
    never = min((window.length_s for window in windows if window is not None), default=math.inf)
    return ClosedForm(never, hardest[0].limit.dt_s)


def _carry_out(
    scene: Scene,
    searches: Mapping[Method, StepSearch],
    aimed_s: Sequence[float],
    pool: Pool,
    progress: Progress,
) -> None:
    """Try what the searches want, one step of each at a time, until none wants any."""
    tried = 0
    while wanted := {method: search.wanted for method, search in searches.items() if search.wanted is not None}:
        starts = {method: starts_of(one.dt_s, one.even, aimed_s) for method, one in wanted.items()}
        jobs = [
            Job(scene, method, wanted[method].dt_s, 0, phase)
            for method, (even, aimed) in starts.items()
            for phase in (*even, *aimed)
        ]
        found = try_starts(jobs, pool)
        for method, (even, aimed) in starts.items():
            answers = ([found[method, phase] for phase in phases] for phases in (even, aimed))
            searches[method].take(StepTrial.of(wanted[method].dt_s, *answers))
        tried += len(wanted)
        ended = sum(search.wanted is None for search in searches.values())
        progress(ended, len(searches), f"{tried} steps tried")
