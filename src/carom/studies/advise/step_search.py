"""Search for the step of one method: every step of a grid, from the whole run in one step down."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from carom.execution.job import Method
from carom.model.scene import Scene
from carom.studies.advise.hardest import Demand
from carom.studies.advise.step_trial import StepTrial, most_steps

#: Number of even starts at which an answer is confirmed.
CONFIRM = 64

#: The grid has two steps an octave: 1, 1.5, 2, 3, 4, 6 ... steps a frame, whole numbers of them from half a frame down.
IN_AN_OCTAVE = (1.0, 1.5)

#: An answer must hold at all steps of the grid down to this many octaves below it. This is enough where the error is in
#: proportion to the step there, since it then keeps falling. Otherwise one octave more is required.
OCTAVES_BELOW = 2
LONGEST = OCTAVES_BELOW + 1

#: An answer requires that steps were tried down to a frame's, the usual step. Where a check once per step needs finer
#: ones, they are tried too, down to this many octaves below a frame. Engines that sweep only fast discs sweep none at
#: such steps, and may miss impacts that they found at larger ones.
OCTAVES_COVERED = 3

#: An error is in proportion to the step if error over step varies by at most a quarter over these octaves, and does not
#: depend on it if the error itself does. Its order is then within 0.16 of 1 (over two), or 0.11 of 0 (over three).
SAME = 1.25

#: The finest tried step, as a fraction of a frame or of the step that the hardest impact allows.
FINEST = 1 / 64


class SearchEnding(Enum):
    """Why no further step was tried; the value is the phrase shown."""

    FOUND = "both answers were found"
    BUDGET = "the engine steps that it may take were used up"
    FINEST = "it is the finest that is tried"
    FLAT = "the error does not depend on the step"
    BROKE = "the engine, or its adapter, broke off"


@dataclass(frozen=True)
class StepRange:
    """Passing steps: every tried step from the one that `passes` down to `down_to_s`.

    Attributes:
        passes: The largest of them, confirmed at `CONFIRM` starts; None where there is no answer.
        in_frame: The largest of them that divides a frame, also confirmed; None where there is no answer, or none of
            them does.
        down_to_s: The finest that was tried, seconds; NaN where no step was.
        fails: The finest that fails, which is the next larger one tried; None where none fails.
        coarser_passes: Steps that pass although a finer one fails, the largest first.
        finer_failures: Steps that fail although a larger one passes, the largest first.
    """

    passes: StepTrial | None
    in_frame: StepTrial | None
    down_to_s: float
    fails: StepTrial | None
    coarser_passes: tuple[StepTrial, ...]
    finer_failures: tuple[StepTrial, ...]

    @property
    def monotone(self) -> bool:
        """Whether no tried step fails that is finer than a passing one."""
        return not self.finer_failures


@dataclass(frozen=True)
class Advised:
    """Result of a method's search.

    Attributes:
        method: Engine and profile.
        trials: Every step that was tried, the largest first.
        never_misses: Steps at which no start misses or invents an impact.
        demand: Steps that meet the whole demand.
        ending: Why no further step was tried.
        refused_s: The finest step that the method refuses, seconds; larger ones were not run. None for none.
        refusal: Reason of the refusal; empty for none.
    """

    method: Method
    trials: tuple[StepTrial, ...]
    never_misses: StepRange
    demand: StepRange
    ending: SearchEnding
    refused_s: float | None = None
    refusal: str = ""

    @property
    def steps(self) -> int:
        """Engine steps of these trials."""
        return sum(trial.steps for trial in self.trials)

    @property
    def flat_from_s(self) -> float | None:
        """The largest step below which the direction error does not depend on the step, seconds; None for none.

        Only the finest tried steps count, up to the first that loses an impact.
        """
        run: list[StepTrial] = []
        for trial in reversed(_finest_that(self.trials, lambda trial: trial.never_misses)):
            if not _same([one.direction_error_rad for one in (trial, *run)]):
                break
            run.insert(0, trial)
        return run[0].dt_s if _reaches(run, LONGEST) else None


@dataclass(frozen=True)
class Wanted:
    """A step that a search requests, and the number of its even starts."""

    dt_s: float
    even: int


def grid_of(scene: Scene, guess_s: float) -> Iterator[float]:
    """Yield the steps of the grid: the whole run in one step, then two an octave, down to the finest."""
    frame_s, whole_s = 1.0 / scene.frame_rate_hz, scene.duration_s
    finest = min(guess_s, frame_s, whole_s) * FINEST
    yield whole_s
    doubled = math.floor(math.log2(1.0 / (scene.frame_rate_hz * whole_s)))
    while True:
        for times in IN_AN_OCTAVE:
            dt_s = 1.0 / (scene.frame_rate_hz * times * 2.0**doubled)
            if dt_s < finest:
                return
            if dt_s < whole_s:
                yield dt_s
        doubled += 1


def in_a_frame(dt_s: float, frame_rate_hz: float) -> int | None:
    """Return the number of steps a frame; None if it is not whole."""
    times = 1.0 / (dt_s * frame_rate_hz)
    # A step of the grid is one over a product, and so is this: four operations with one rounding each.
    whole = round(times)
    return whole if whole and abs(times - whole) <= 8 * 2.0**-53 * whole else None


class StepSearch:
    """Search for the step of one method: it requests the next step to try, and takes its result.

    Args:
        scene: The scene.
        method: Engine and profile.
        demand: Required accuracy.
        guess_s: Largest step that the hardest impact allows a method that checks for overlap once per step.
        phases: Even starts at which each step is tried.
        aimed: Number of aimed starts in addition.
        budget_steps: Budget of engine steps; a step is tried if the cost of the step before predicts that the budget
            suffices.
        refusal: Returns why the method does not take a step; empty where it does.
    """

    def __init__(
        self,
        scene: Scene,
        method: Method,
        demand: Demand,
        guess_s: float,
        phases: int,
        aimed: int,
        budget_steps: int,
        refusal: Callable[[float], str],
    ) -> None:
        self._method, self._demand, self._phases, self._aimed = method, demand, phases, aimed
        self._duration_s, self._left, self._refusal = scene.duration_s, budget_steps, refusal
        self._rate_hz, self._guess_s = scene.frame_rate_hz, guess_s
        self._frame_s = 1.0 / scene.frame_rate_hz
        self._covers_s = max(min(self._frame_s, guess_s), self._frame_s / 2**OCTAVES_COVERED)
        self._grid = tuple(grid_of(scene, guess_s))
        self._trials: dict[float, StepTrial] = {}
        self._confirmed: set[float] = set()
        self._untried: tuple[float, str] | None = None
        self._share = 1.0
        self._ending = SearchEnding.FINEST
        self._walk = self._steps()
        self.wanted: Wanted | None = next(self._walk, None)

    @property
    def refused_all(self) -> bool:
        """Whether the method takes no step of the grid."""
        return all(self._refusal(dt_s) for dt_s in self._grid)

    def take(self, trial: StepTrial | str) -> None:
        """Take the result of the requested step, or the reason why it could not be tried."""
        try:
            self.wanted = self._walk.send(trial)
        except StopIteration:
            self.wanted = None

    def answer(self) -> Advised:
        """Return the result."""
        refused_s, refusal = self._untried or (None, "")
        misses, whole = (self._range(passes) for passes in self._questions)
        return Advised(self._method, self._tried, misses, whole, self._ending, refused_s, refusal)

    @property
    def _tried(self) -> tuple[StepTrial, ...]:
        return tuple(self._trials[dt_s] for dt_s in self._grid if dt_s in self._trials)

    @property
    def _questions(self) -> tuple[Callable[[StepTrial], bool], ...]:
        return (lambda trial: trial.never_misses, lambda trial: trial.meets(self._demand))

    def _steps(self) -> Generator[Wanted, StepTrial | str, None]:
        for dt_s in self._grid:
            if reason := self._refusal(dt_s):
                self._untried = (dt_s, reason)
                continue
            if not (yield from self._try(dt_s, self._phases)):
                return
            while unconfirmed := self._unconfirmed():
                if not (yield from self._try(unconfirmed.dt_s, max(CONFIRM, self._phases))):
                    return
            if all(self._settled(passes) for passes in self._questions):
                self._ending = SearchEnding.FOUND
                return
            if self._hopeless(dt_s):
                self._ending = SearchEnding.FLAT
                return

    def _try(self, dt_s: float, even: int) -> Generator[Wanted, StepTrial | str, bool]:
        """Request a step, and return whether the search goes on."""
        most = most_steps(self._duration_s, dt_s, even + self._aimed)
        # A run ends early after its last impact, and so it did at the step before.
        if most * self._share > self._left:
            self._ending = SearchEnding.BUDGET
            return False
        trial = yield Wanted(dt_s, even)
        if isinstance(trial, str):
            self._untried = (dt_s, trial)
            return True
        self._trials[dt_s] = trial
        if even >= CONFIRM:
            self._confirmed.add(dt_s)
        self._left -= trial.steps
        self._share = trial.steps / most
        # An engine that fails at a huge step may run at a smaller one.
        if trial.reason and dt_s <= self._frame_s:
            self._ending = SearchEnding.BROKE
            return False
        return True

    def _unconfirmed(self) -> StepTrial | None:
        """Return a step that would be an answer if it had been run at enough starts."""
        for passes in self._questions:
            run = _finest_that(self._tried, passes)
            for trial in (*run[:1], *self._in_frame(run)) if self._long_enough(run) else ():
                if trial.dt_s not in self._confirmed:
                    return trial
        return None

    def _in_frame(self, run: Sequence[StepTrial]) -> Sequence[StepTrial]:
        """Return the largest step of a run that takes a whole number of steps a frame, if there is one."""
        return [trial for trial in run if in_a_frame(trial.dt_s, self._rate_hz)][:1]

    def _long_enough(self, run: Sequence[StepTrial]) -> bool:
        """Whether all steps were tried that an answer at the first one needs."""
        falling = _same([trial.direction_error_rad / trial.dt_s for trial in run])
        return _reaches(run, OCTAVES_BELOW if falling else LONGEST) and run[-1].dt_s <= self._covers_s

    def _settled(self, passes: Callable[[StepTrial], bool]) -> bool:
        run = _finest_that(self._tried, passes)
        return self._long_enough(run) and run[0].dt_s in self._confirmed

    def _hopeless(self, dt_s: float) -> bool:
        """Whether a finer step is hopeless: the error is too large, and constant over the last octaves.

        This applies only below a frame, and below the step that suffices for a check once per step.
        """
        if dt_s > min(self._frame_s, self._guess_s):
            return False
        run = _finest_that(self._tried, lambda trial: trial.never_misses and not trial.meets(self._demand))
        last = [trial for trial in run if trial.dt_s <= 2**LONGEST * run[-1].dt_s]
        return _reaches(last, LONGEST) and _same([trial.direction_error_rad for trial in last])

    def _range(self, passes: Callable[[StepTrial], bool]) -> StepRange:
        tried = self._tried
        run = _finest_that(tried, passes)
        failed = tried[len(tried) - len(run) - 1] if len(run) < len(tried) else None
        coarser = tuple(trial for trial in tried[: len(tried) - len(run)] if passes(trial))
        finer = tuple(trial for trial in tried if coarser and not passes(trial) and trial.dt_s < coarser[0].dt_s)
        answer = run[0] if self._settled(passes) else None
        framed = next((one for one in self._in_frame(run) if answer and one.dt_s in self._confirmed), None)
        return StepRange(answer, framed, tried[-1].dt_s if tried else math.nan, failed, coarser, finer)


def _finest_that(trials: Sequence[StepTrial], passes: Callable[[StepTrial], bool]) -> list[StepTrial]:
    """Return the passing steps, from the finest tried up to the first that fails; the largest first."""
    found: list[StepTrial] = []
    for trial in reversed(trials):
        if not passes(trial):
            break
        found.append(trial)
    return found[::-1]


def _reaches(run: Sequence[StepTrial], octaves: int) -> bool:
    """Whether the steps go down by this number of octaves."""
    return bool(run) and run[0].dt_s >= 2**octaves * run[-1].dt_s


def _same(values: Sequence[float]) -> bool:
    """Whether numbers above 0 are the same to a quarter; not if one is NaN or infinite."""
    sound = all(0.0 < value < math.inf for value in values)
    return sound and max(values, default=0.0) <= SAME * min(values, default=0.0)
