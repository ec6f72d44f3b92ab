"""Search for the largest step size with which a method is accurate enough, beginning with the whole run in one step."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count, takewhile

from carom.execution.job import Method
from carom.model.scene import Scene
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.step_trial import StepTrial, compute_step_limit

#: Number of evenly spread phases at which a result is confirmed.
CONFIRM = 64

#: Tested step sizes per octave (factor of 2): 1, 1.5, 2, 3, 4, 6 ... steps per frame. From 2 steps per frame on, the
#: numbers are whole.
IN_AN_OCTAVE = (1.0, 1.5)

#: A step size is recommended only if all tested step sizes in this number of octaves (factors of 2) below it also pass.
#: If the error is not proportional to the step size in these octaves, one more octave is tested.
OCTAVES_BELOW = 2
LONGEST = OCTAVES_BELOW + 1

#: The search always continues down to one step per frame, because this is a usual choice. If PIT needs smaller steps,
#: the search continues down to PIT's steps, but at most this number of octaves below a frame. Smaller steps are not
#: always better: an engine that uses continuous collision detection only for discs that move far in a step may find
#: impacts with large steps, and miss them with smaller steps.
OCTAVES_COVERED = 3

#: Several numbers count as equal if the largest is at most this factor times the smallest. An error counts as
#: proportional to the step size if the error divided by the step size is equal for `OCTAVES_BELOW` octaves; the error's
#: order of convergence is then between 0.84 and 1.16. An error counts as independent of the step size if the error is
#: equal for `LONGEST` octaves; the error's order of convergence is then between -0.11 and 0.11.
SAME = 1.25

#: The smallest tested step size, as a fraction of the shortest of three times: a frame, the whole run, and the step
#: size that the hardest impact allows.
FINEST = 1 / 64


class SearchEnding(Enum):
    """Reason why no further step size was tested. Each member's value is the phrase that the report shows."""

    FOUND = "both recommended step sizes were found"
    BUDGET = "the budget of engine steps was used up"
    FINEST = "the search reached its smallest step size"
    FLAT = "the error does not depend on the step size"
    BROKE = "the engine or its adapter failed"


@dataclass(frozen=True)
class StepRange:
    """Step sizes from `largest_passing` to the smallest tested one, all of which are accurate enough.

    Attributes:
        largest_passing: The largest step size that passes, confirmed at `CONFIRM` phases; None if there is none.
        frame_divisor: The largest step size that passes and divides a frame into equal steps, confirmed at `CONFIRM`
            phases; None if there is none.
        smallest_failing: The smallest tested step size that fails; None if none fails.
        coarser_passes: Step sizes that pass although a smaller one fails, the largest first.
        finer_failures: Step sizes that fail although a larger one passes, the largest first.
    """

    largest_passing: StepTrial | None
    frame_divisor: StepTrial | None
    smallest_failing: StepTrial | None
    coarser_passes: tuple[StepTrial, ...]
    finer_failures: tuple[StepTrial, ...]

    @property
    def largest_passing_s(self) -> float:
        """The largest step size that passes, in seconds; 0 if there is none."""
        return 0.0 if self.largest_passing is None else self.largest_passing.dt_s


@dataclass(frozen=True)
class StepAdvice:
    """Result of the search for one method.

    Attributes:
        method: Engine and profile.
        trials: Results of all tested step sizes, beginning with the largest.
        never_misses: Range of step sizes with which the engine misses and invents no impact at any phase.
        meets_target: Range of step sizes that meet the whole accuracy target.
        ending: Reason why no smaller step size was tested.
        refused_s: The smallest step size that the method refuses, in seconds; None if the method refuses none.
        refusal: Reason why the method refuses step sizes; empty if none is refused.
    """

    method: Method
    trials: tuple[StepTrial, ...]
    never_misses: StepRange
    meets_target: StepRange
    ending: SearchEnding
    refused_s: float | None = None
    refusal: str = ""


@dataclass(frozen=True)
class StepRequest:
    """Request of a search to test a step size at a number of evenly spread phases."""

    dt_s: float
    even_phases: int


def generate_step_grid(scene: Scene, guess_s: float) -> Iterator[float]:
    """Yield the step sizes to test: the whole run in one step, then two step sizes per factor of 2."""
    frame_s, whole_s = 1.0 / scene.frame_rate_hz, scene.duration_s
    finest = min(guess_s, frame_s, whole_s) * FINEST
    yield whole_s
    for doubled in count(math.floor(math.log2(1.0 / (scene.frame_rate_hz * whole_s)))):
        for times in IN_AN_OCTAVE:
            dt_s = 1.0 / (scene.frame_rate_hz * times * 2.0**doubled)
            if dt_s < finest:
                return
            if dt_s < whole_s:
                yield dt_s


def count_steps_per_frame(dt_s: float, frame_rate_hz: float) -> int | None:
    """Return the number of steps per frame; None if the number is not whole."""
    times = 1.0 / (dt_s * frame_rate_hz)
    # The tolerance covers four roundings: two in this formula, and up to two in the computation of `dt_s`.
    rounded = round(times)
    return rounded if rounded and abs(times - rounded) <= 8 * 2.0**-53 * rounded else None


@dataclass
class StepSearch:
    """Search for the largest step size with which one method is accurate enough.

    The search requests step sizes, which the caller tests.

    Attributes:
        scene: The scene.
        method: Engine and profile.
        options: Required accuracy, number of evenly spread phases, and budget of engine steps. A step size is tested
            only if the rest of the budget covers its estimated number of steps. The estimate assumes that runs end as
            early as with the previous step size.
        guess_s: Largest step size at which checking once per step finds the hardest impact accurately enough.
        aimed_phases: Number of additional phases, at which a step ends just before a hard impact.
        refusal: Function that returns the reason why the method refuses a step size; empty if the method accepts the
            step size.
    """

    scene: Scene
    method: Method
    options: AdviceOptions
    guess_s: float
    aimed_phases: int
    refusal: Callable[[float], str]

    def __post_init__(self) -> None:
        self._frame_s = 1.0 / self.scene.frame_rate_hz
        self._coarsest_end_s = max(min(self._frame_s, self.guess_s), self._frame_s / 2**OCTAVES_COVERED)
        self._budget_left = self.options.budget_steps
        self._grid = tuple(generate_step_grid(self.scene, self.guess_s))
        self._trials: dict[float, StepTrial] = {}
        self._confirmed: set[float] = set()
        self._refused_step: tuple[float, str] | None = None
        self._used_part = 1.0
        self._ending = SearchEnding.FINEST
        self._requests = self._generate_steps()
        self.request: StepRequest | None = next(self._requests, None)

    @property
    def is_refused(self) -> bool:
        """Whether the method refuses every step size."""
        return all(self.refusal(dt_s) for dt_s in self._grid)

    def add_result(self, trial: StepTrial | str) -> None:
        """Store the result of the requested step size, or the reason why the step size could not be tested.

        Then request the next step size.
        """
        try:
            self.request = self._requests.send(trial)
        except StopIteration:
            self.request = None

    def build_answer(self) -> StepAdvice:
        """Return the result."""
        refused_s, refusal = self._refused_step or (None, "")
        never_misses, meets_target = (self._build_range(passes) for passes in self._criteria)
        return StepAdvice(self.method, self._tested, never_misses, meets_target, self._ending, refused_s, refusal)

    @property
    def _tested(self) -> tuple[StepTrial, ...]:
        return tuple(self._trials[dt_s] for dt_s in self._grid if dt_s in self._trials)

    @property
    def _criteria(self) -> tuple[Callable[[StepTrial], bool], ...]:
        return (lambda trial: trial.never_misses, lambda trial: trial.meets_target(self.options))

    def _generate_steps(self) -> Generator[StepRequest, StepTrial | str, None]:
        for dt_s in self._grid:
            if reason := self.refusal(dt_s):
                self._refused_step = (dt_s, reason)
                continue
            if not (yield from self._test(dt_s, self.options.phases)):
                return
            while unconfirmed := self._find_unconfirmed():
                if not (yield from self._test(unconfirmed.dt_s, max(CONFIRM, self.options.phases))):
                    return
            if all(self._is_found(passes) for passes in self._criteria):
                self._ending = SearchEnding.FOUND
                return
            if self._is_flat(dt_s):
                self._ending = SearchEnding.FLAT
                return

    def _test(self, dt_s: float, even_phases: int) -> Generator[StepRequest, StepTrial | str, bool]:
        """Request a step size, and return whether the search continues."""
        max_steps = compute_step_limit(self.scene.duration_s, dt_s, even_phases + self.aimed_phases)
        if max_steps * self._used_part > self._budget_left:
            self._ending = SearchEnding.BUDGET
            return False
        trial = yield StepRequest(dt_s, even_phases)
        if isinstance(trial, str):
            self._refused_step = (dt_s, trial)
            return True
        self._trials[dt_s] = trial
        if even_phases >= CONFIRM:
            self._confirmed.add(dt_s)
        self._budget_left -= trial.steps
        self._used_part = trial.steps / max_steps
        # An engine that fails with a huge step size may still run with a smaller one.
        if trial.reason and dt_s <= self._frame_s:
            self._ending = SearchEnding.BROKE
            return False
        return True

    def _find_unconfirmed(self) -> StepTrial | None:
        """Return a step size that passed and must be confirmed at more phases; None if there is none."""
        for passes in self._criteria:
            run = _select_finest_passing(self._tested, passes)
            for trial in (*run[:1], *self._select_frame_divisor(run)) if self._is_long_enough(run) else ():
                if trial.dt_s not in self._confirmed:
                    return trial
        return None

    def _select_frame_divisor(self, run: Sequence[StepTrial]) -> Sequence[StepTrial]:
        """Return a list of the largest step size that divides a frame into equal steps; empty if no step size does."""
        return [trial for trial in run if count_steps_per_frame(trial.dt_s, self.scene.frame_rate_hz)][:1]

    def _is_long_enough(self, run: Sequence[StepTrial]) -> bool:
        """Whether the passing step sizes in `run` extend over enough octaves to recommend the largest of them."""
        falling = _is_constant([trial.direction_error_rad / trial.dt_s for trial in run])
        return _has_octaves(run, OCTAVES_BELOW if falling else LONGEST) and run[-1].dt_s <= self._coarsest_end_s

    def _is_found(self, passes: Callable[[StepTrial], bool]) -> bool:
        run = _select_finest_passing(self._tested, passes)
        return self._is_long_enough(run) and run[0].dt_s in self._confirmed

    def _is_flat(self, dt_s: float) -> bool:
        """Whether smaller step sizes can't help, because the error is too large and stays about the same.

        The result is False for step sizes above a frame, or above the step size that PIT needs.
        """
        if dt_s > min(self._frame_s, self.guess_s):
            return False
        never_misses, meets_target = self._criteria
        run = _select_finest_passing(self._tested, lambda trial: never_misses(trial) and not meets_target(trial))
        last = [trial for trial in run if trial.dt_s <= 2**LONGEST * run[-1].dt_s]
        return _has_octaves(last, LONGEST) and _is_constant([trial.direction_error_rad for trial in last])

    def _build_range(self, passes: Callable[[StepTrial], bool]) -> StepRange:
        tested = self._tested
        run = _select_finest_passing(tested, passes)
        failed = tested[len(tested) - len(run) - 1] if len(run) < len(tested) else None
        coarser = tuple(trial for trial in tested[: len(tested) - len(run)] if passes(trial))
        finer = tuple(trial for trial in tested if coarser and not passes(trial) and trial.dt_s < coarser[0].dt_s)
        answer = run[0] if self._is_found(passes) else None
        framed = next((one for one in self._select_frame_divisor(run) if answer and one.dt_s in self._confirmed), None)
        return StepRange(answer, framed, failed, coarser, finer)


def _select_finest_passing(trials: Sequence[StepTrial], passes: Callable[[StepTrial], bool]) -> list[StepTrial]:
    """Return the passing step sizes that are smaller than every failing step size, beginning with the largest."""
    return list(takewhile(passes, reversed(trials)))[::-1]


def _has_octaves(run: Sequence[StepTrial], octaves: int) -> bool:
    """Whether the step sizes cover this number of octaves (factors of 2)."""
    return bool(run) and run[0].dt_s >= 2**octaves * run[-1].dt_s


def _is_constant(values: Sequence[float]) -> bool:
    """Whether the largest number is at most 1.25 times the smallest.

    False if any number is zero, negative, infinite or NaN.
    """
    sound = all(0.0 < value < math.inf for value in values)
    return sound and max(values, default=0.0) <= SAME * min(values, default=0.0)
