"""The adviser: the largest step at which PIT, and each engine measured, meets a demand; and the hardest impact.

For two smooth discs PIT's answer is a closed form (`carom.bench.sampling_limit`). For everything else steps are tried:
each at starts spread over a step, and at the unlucky ones that look just before the hardest impacts.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from enum import Enum

from carom.bench.sampling_limit import PairLimit, Window, pair_limit
from carom.comparator.shift import even_phases
from carom.errors import InputError
from carom.runs.engines import engines, methods_of, to_run
from carom.runs.job import Answer, Job, Method, Progress, Status
from carom.runs.pool import Pool
from carom.runs.reference import reference_trace
from carom.runs.scoring import Measures, job_key, sweep
from carom.scene import Scene
from carom.trace import Trace

__all__ = ["RESOLUTION", "Advice", "Advised", "Cause", "Demand", "HardImpact", "StepTrial", "advise", "hardest_impacts"]

#: A search ends when the step that passes and the one that fails are so close, relative.
RESOLUTION = 1.02

#: A search begins this far above what the hardest impact allows on its own, and goes this far below it.
ABOVE, BELOW = 4.0, 64.0

#: An answer must hold at these parts of it, too: a larger step that passes by luck is no answer.
ALSO = (0.75, 0.5)

#: The unlucky starts of so many of the hardest impacts are tried.
AIMED = 3

#: An aimed start looks so large a part of a step before the impact: late by all but this part.
JUST_BEFORE = 1e-3

#: The chord of a graze is less than half of what it would be head-on, at an impact parameter above cos 30 degrees.
GRAZE = math.cos(math.pi / 6)


class Cause(Enum):
    """Why an impact is hard to find; the value is the phrase shown."""

    GRAZE = "a graze"
    FAST = "a fast small disc"
    TURN = "the line of centres turns fast"
    WALL = "a wall, which nothing passes unseen"


@dataclass(frozen=True)
class Demand:
    """What is asked for.

    Attributes:
        direction_error_rad: No disc's direction after any impact may be wrong by more.
        miss_probability: Share of starts at which an impact may be missed or invented.

    Raises:
        InputError: A number is out of range.
    """

    direction_error_rad: float
    miss_probability: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.direction_error_rad < math.pi:
            degrees = math.degrees(self.direction_error_rad)
            raise InputError(f"the direction error must be above 0 and below 180 degrees, got {degrees:g} degrees")
        if not 0 <= self.miss_probability < 1:
            raise InputError(f"the miss probability must be 0 or more and below 1, got {self.miss_probability:g}")


@dataclass(frozen=True)
class HardImpact:
    """What one impact of the reference allows a method that looks once a step.

    Attributes:
        time_s: When it is.
        first: The disc.
        second: The other disc, or a wall.
        limit: What it allows; were the discs smooth, where they rub: that is near enough to begin a search.
        cause: Why it allows no more.
    """

    time_s: float
    first: int
    second: int
    limit: PairLimit
    cause: Cause


@dataclass(frozen=True)
class StepTrial:
    """One step, run at all its starts.

    Attributes:
        dt_s: The step.
        meets: Whether the demand was met.
        lost_share: Share of evenly spread starts at which an impact was missed or invented.
        lost_anywhere: Whether any start, aimed ones among them, missed or invented one.
        direction_error_rad: Largest direction error at any start.
        reason: Why a start gave no numbers, empty where all did.
        unsupported: Whether that is what the method declares of so large a step, or of the scene.
    """

    dt_s: float
    meets: bool
    lost_share: float
    lost_anywhere: bool
    direction_error_rad: float
    reason: str = ""
    unsupported: bool = False


@dataclass(frozen=True)
class Advised:
    """The largest step at which a method was found to meet the demand.

    Attributes:
        method: Engine and profile.
        passes: The largest step that meets it; None where none does.
        fails: The next larger one that was tried and does not; None where every step meets it.
        closed_form_s: The step by closed form; None where there is none.
        reason: Why there is no answer, empty where there is one.
    """

    method: Method
    passes: StepTrial | None
    fails: StepTrial | None
    closed_form_s: float | None
    reason: str = ""


@dataclass(frozen=True)
class Advice:
    """What the adviser says.

    Attributes:
        scene: The scene.
        demand: What was asked for.
        impacts: Impacts of the reference.
        hardest: Its hardest impacts, the hardest first.
        closed_form_s: PIT's largest step by closed form; None but for two discs without a wall and friction.
        answers: One entry an engine's profile.
        phases: Starts that each step was tried at, aimed ones not counted.
    """

    scene: Scene
    demand: Demand
    impacts: int
    hardest: tuple[HardImpact, ...]
    closed_form_s: float | None
    answers: tuple[Advised, ...]
    phases: int


def hardest_impacts(reference: Trace, demand: Demand) -> tuple[HardImpact, ...]:
    """Return what each impact of a reference allows on its own, the hardest first."""
    found = [_hard(reference, k, demand) for k in range(len(reference.impacts))]
    return tuple(sorted(found, key=lambda impact: (impact.limit.dt_s, impact.time_s)))


def _hard(reference: Trace, number: int, demand: Demand) -> HardImpact:
    impact, scene = reference.impacts[number], reference.scene
    first, second, at = int(impact["first"]), int(impact["second"]), float(impact["time_s"])
    if second < 0:
        return HardImpact(at, first, second, PairLimit(None, math.inf, math.inf), Cause.WALL)
    fields = ("normal", "velocity_first_before", "velocity_second_before")
    normal, (ux, uy), (vx, vy) = ((float(impact[name][0]), float(impact[name][1])) for name in fields)
    one, other = scene.discs[first], scene.discs[second]
    window = Window.of(one.radius_m + other.radius_m, normal, (vx - ux, vy - uy))
    limit = pair_limit(
        window,
        ((ux, uy), (vx, vy)),
        (1.0 / one.mass_kg, 1.0 / other.mass_kg),
        scene.restitution,
        demand.direction_error_rad,
        demand.miss_probability,
    )
    soft = Cause.TURN if limit.direction_dt_s < limit.miss_dt_s else Cause.FAST
    return HardImpact(at, first, second, limit, Cause.GRAZE if window.share >= GRAZE else soft)


def advise(
    scene: Scene,
    demand: Demand,
    pool: Pool,
    engine_names: Sequence[str] | None = None,
    *,
    profiles: Sequence[str] = ("default", "tuned"),
    phases: int = 8,
    budget_s: float = 90.0,
    progress: Progress | None = None,
) -> Advice:
    """Return the largest step at which PIT and each engine meets a demand on a scene.

    Args:
        scene: The scene.
        demand: What is asked for.
        pool: Where steps are tried; it stays open.
        engine_names: Names of adapters; all by default.
        profiles: Names of profiles.
        phases: How many starts, evenly spread over a step, each step is tried at.
        budget_s: Seconds after which no further step is tried; what was found until then is the answer.
        progress: Called with (done, all, what).

    Raises:
        InputError: A number of the demand is out of range, or the scene has no reference or no impact.
        UnknownNameError: There is no such engine.
    """
    started = time.perf_counter()
    reference = reference_trace(scene)
    if not isinstance(reference, Trace):
        raise InputError(f"there is nothing to hold a step against: {reference}")
    if not len(reference.impacts):
        raise InputError(f"{scene.name!r} has no impact in its {scene.duration_s:g} s: any step will do")
    hardest = hardest_impacts(reference, demand)
    alone = len(scene.discs) == 2 and not scene.walls and not scene.arrays.rubs_discs
    closed_form = hardest[0].limit.dt_s if alone else None
    guess = min(hardest[0].limit.dt_s, scene.duration_s / 4)
    searches = {}
    infos = to_run(engines(engine_names, pool=pool), engine_names)
    methods = methods_of(infos, profiles, [guess], pool)
    for info in infos:
        for method in methods.at[info.name, guess]:
            if method != Method("pic", "tuned") or engine_names is not None:
                searches[method] = _Search(scene, method, closed_form, guess)
    tried = 0
    while open_searches := [search for search in searches.values() if search.wanted is not None]:
        if time.perf_counter() - started > budget_s:
            for search in open_searches:
                search.give_up(f"the {budget_s:.0f} s for trying steps were used up; raise --budget")
            break
        jobs = {
            method: [Job(scene, method, search.wanted, 0, phase) for phase in _starts(search.wanted, phases, hardest)]
            for method, search in searches.items()
            if search.wanted is not None
        }
        todo = [job for own in jobs.values() for job in own]
        results = sweep(todo, pool, refusal=lambda job: methods.dead(job.method, guess))
        for method, own in jobs.items():
            answers = [results[job_key(job)].answer for job in own]
            searches[method].take(_trial(own[0].dt_s, answers, phases, demand))
        tried += len(open_searches)
        if progress is not None:
            closed = sum(search.wanted is None for search in searches.values())
            progress(closed, len(searches), f"{tried} steps tried")
    return Advice(
        scene,
        demand,
        len(reference.impacts),
        hardest[:AIMED],
        closed_form,
        tuple(search.answer() for search in searches.values()),
        phases,
    )


def _starts(dt_s: float, phases: int, hardest: Sequence[HardImpact]) -> list[float]:
    """Return phases spread evenly, then those at which a look falls just before each of the hardest impacts."""
    found = list(even_phases(phases))
    for impact in hardest[:AIMED]:
        aimed = (JUST_BEFORE - impact.time_s / dt_s) % 1.0
        if aimed not in found:
            found.append(aimed)
    return found


def _trial(dt_s: float, answers: Sequence[Answer[Measures]], phases: int, demand: Demand) -> StepTrial:
    if silent := [answer for answer in answers if answer.value is None]:
        unsupported = all(answer.status is Status.UNSUPPORTED for answer in silent)
        return StepTrial(dt_s, False, math.nan, False, math.nan, silent[0].said, unsupported)
    measured = [answer.value for answer in answers if answer.value is not None]
    lost = [measures.missed + measures.spurious > 0 or measures.outcome != "completed" for measures in measured]
    direction = max((m.total.direction_rad for m in measured if not math.isnan(m.total.direction_rad)), default=0.0)
    share = sum(lost[:phases]) / phases
    few_enough = share <= demand.miss_probability if demand.miss_probability > 0 else not any(lost)
    return StepTrial(dt_s, few_enough and direction <= demand.direction_error_rad, share, any(lost), direction)


class _Search:
    """The search of one method: it says which step it wants tried next, and takes what came of it."""

    def __init__(self, scene: Scene, method: Method, closed_form: float | None, guess: float) -> None:
        self._method = method
        self._closed_form = closed_form if method.engine == "pit" else None
        self._passes: StepTrial | None = None
        self._fails: StepTrial | None = None
        self._reason = ""
        known = self._closed_form is not None and math.isfinite(self._closed_form)
        self._steps = self._confirm(self._closed_form or 0.0) if known else self._search(scene, guess)
        self.wanted: float | None = next(self._steps)

    def take(self, trial: StepTrial) -> None:
        """Take what came of the step that was wanted."""
        if trial.reason and not trial.unsupported:  # what can't take a large step may well take a smaller one
            self.give_up(trial.reason)
            return
        try:
            self.wanted = self._steps.send(trial)
        except StopIteration:
            self.wanted = None

    def give_up(self, reason: str) -> None:
        """End the search where it stands."""
        self._reason, self.wanted = reason, None

    def answer(self) -> Advised:
        """Return what was found."""
        return Advised(self._method, self._passes, self._fails, self._closed_form, self._reason)

    def _try(self, step: float) -> Generator[float, StepTrial, None]:
        trial = yield step
        if trial.meets:
            self._passes = trial
        else:
            self._fails = trial

    def _search(self, scene: Scene, guess: float) -> Generator[float, StepTrial, None]:
        step, finest = min(ABOVE * guess, scene.duration_s / 2), guess / BELOW
        while True:
            while self._passes is None and step >= finest:
                yield from self._try(step)
                step /= 2
            if self._passes is None:
                lowest = self._fails
                self._reason = "not met" + (f" down to a step of {lowest.dt_s:.3g} s" if lowest else "")
                if lowest is not None and lowest.reason:
                    self._reason = lowest.reason
                return
            while self._fails is not None and self._fails.dt_s > self._passes.dt_s * RESOLUTION:
                yield from self._try(math.sqrt(self._passes.dt_s * self._fails.dt_s))
            found = self._passes
            for part in ALSO:
                trial = yield part * found.dt_s
                if not trial.meets:
                    self._passes, self._fails, step = None, trial, part * found.dt_s / 2
                    break
            else:
                return

    def _confirm(self, step: float) -> Generator[float, StepTrial, None]:
        """Run the closed form's step, and one a search's resolution above it."""
        # The step itself is the limit, which rounding may put on either side.
        trial = yield step * (1.0 - 1e-9)
        self._passes = trial if trial.meets else None
        above = yield step * RESOLUTION
        self._fails = None if above.meets else above
        if self._passes is None or self._fails is None:
            self._reason = "running it does not confirm the closed form"
