"""Search for the best settings of an engine within a number of trials.

1. Each setting is tested at both ends of its range. All other settings keep the first profile's values.
2. An optimiser (Optuna's tree-structured Parzen estimator, Bergstra et al., NeurIPS 2011) chooses further trials. A
   trial is a combination of settings. Each setting keeps the first profile's value or has another value.
3. Starting from the best trial, one setting at a time is reset or gets another value, until nothing improves. Therefore
   every changed setting of the result has an effect.
4. Step 3 is repeated from other good trials: those that no trial *dominates*. A trial dominates another trial if it is
   better in one criterion and worse in none. This step finds some pairs of settings that only help together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from carom.comparator import Grade
from carom.errors import InputError, MissingExtraError
from carom.execution.job import Method, Progress, SettingOverrides, no_progress
from carom.model.scene import Scene
from carom.studies.tune.evaluate import Evaluator
from carom.studies.tune.objective import Merit, SceneResult, compute_merit
from carom.studies.tune.search_space import Point, Space

#: Number of parts into which the scenes are divided. The first part contains the scenes with the worst results of the
#: first profile. After each part, a trial is abandoned if its best possible result would still be worse than that of a
#: finished trial.
PARTS = 3

#: Trials other than the best are refined until the number of trials reaches this multiple of the requested number.
MOST_TRIALS = 4


def require_tune_extra() -> None:
    """Check that Optuna is installed.

    Raises:
        MissingExtraError: Optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise MissingExtraError(
            "carom tune needs Optuna, which is not installed", hints=["pip install 'carom[tune]'"]
        ) from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)


@dataclass(frozen=True)
class TriedSettings:
    """A tested combination of settings, and the results.

    Attributes:
        overrides: Settings that replace settings of the first profile.
        merit: Rank of the settings. If the settings were abandoned, this is the best rank that was still possible.
        results: Results of the scenes, in the requested order; empty for abandoned settings.
        trial: Number of the trial; 0 is the first profile itself.
    """

    overrides: SettingOverrides
    merit: Merit
    results: tuple[SceneResult, ...]
    trial: int

    @property
    def rank(self) -> tuple[Merit, int]:
        """Sort key that is smallest for the best settings: the merit, then the number of changed settings."""
        return self.merit, len(self.overrides)


@dataclass
class KnobSearch:
    """A search over the settings that an adapter declares as searchable (`knobs`).

    Attributes:
        method: The method from which the search starts.
        space: The settings and values that may be tested.
        scenes: Scenes of the search.
        evaluator: Object that evaluates methods on scenes.
        progress: Function that is called after each trial with the number of trials, the expected number of trials, and
            a description.
        on_improvement: Function that is called with the best settings so far, whenever they improve.
    """

    method: Method
    space: Space
    scenes: Sequence[Scene]
    evaluator: Evaluator
    progress: Progress = no_progress
    on_improvement: Callable[[TriedSettings], None] | None = None
    _tried: dict[SettingOverrides, TriedSettings] = field(default_factory=dict, init=False)
    _order: list[int] = field(default_factory=list, init=False)
    _requested_trials: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        if not self.space.values:
            raise InputError(f"the adapter of {self.method.engine} declares no settings to tune (`knobs`)")

    @property
    def trials(self) -> int:
        """Number of tested combinations of settings, not counting the first profile."""
        return len(self._tried) - 1

    @property
    def first(self) -> TriedSettings:
        """Results of the first profile."""
        return self._tried[()]

    @property
    def best(self) -> TriedSettings:
        """The best settings that were found so far."""
        return min(self._list_full_trials(), key=lambda one: one.rank)

    def count_abandoned(self) -> int:
        """Return the number of combinations that were abandoned before the last scene."""
        return len(self._tried) - len(self._list_full_trials())

    def _list_full_trials(self) -> list[TriedSettings]:
        return [one for one in self._tried.values() if one.results]

    def run(self, trials: int, seed: int) -> TriedSettings:
        """Run the search and return the best settings.

        Args:
            trials: Number of combinations of settings to test before the refinement, including those that change a
                single setting.
            seed: Seed of the optimiser's random numbers. Equal seeds lead to equal trials.

        Raises:
            MissingExtraError: Optuna is not installed.
        """
        require_tune_extra()
        self._requested_trials = trials
        self._evaluate_first_profile()
        self._run_optimiser(trials, seed)
        return self._refine(MOST_TRIALS * trials)

    def _evaluate_first_profile(self) -> None:
        """Evaluate the first profile, and sort the scenes so that those with the worst results are first."""
        results = self.evaluator.evaluate(self.method, self.scenes)
        self._order = sorted(range(len(results)), key=lambda k: compute_merit([results[k]]), reverse=True)
        self._tried[()] = TriedSettings((), compute_merit(results, results), tuple(results), 0)

    def _run_optimiser(self, trials: int, seed: int) -> None:
        import optuna

        ends = self.space.list_end_points()
        sampler = optuna.samplers.TPESampler(seed=seed, n_startup_trials=len(ends) + 1)
        study = optuna.create_study(sampler=sampler)
        for point in ({}, *ends):
            is_turned: dict[str, Any] = {f"{name} turned": name in point for name in self.space.values}
            study.enqueue_trial(is_turned | {f"{name} value": k for name, k in point.items()})
        request_count = 0
        # Settings that were already tested are not run again. If the optimiser only repeats settings, the search ends.
        while self.trials < trials and request_count < 10 * trials:
            request_count += 1
            trial = study.ask()
            suggested = {
                name: trial.suggest_int(f"{name} value", 0, len(values) - 1)
                for name, values in self.space.values.items()
                if trial.suggest_categorical(f"{name} turned", (False, True))
            }
            tried = self.evaluate(suggested)
            number = tried.merit.to_number(len(self.scenes))
            if not tried.results:
                trial.report(number, 0)
                study.tell(trial, state=optuna.trial.TrialState.PRUNED)
            else:
                study.tell(trial, number)

    def _refine(self, max_trials: int) -> TriedSettings:
        """Change one setting at a time, first in the best trial, then in each other trial of `_find_front`."""
        done: set[SettingOverrides] = set()
        while todo := [found for found in self._find_front() if found.overrides not in done]:
            if todo[0] is not self.best and self.trials >= max_trials:
                break
            done.add(todo[0].overrides)
            for point in self.space.neighbours(self.space.point_of(todo[0].overrides)):
                self.evaluate(point)
        return self.best

    def _find_front(self) -> list[TriedSettings]:
        """Return the trials that no other trial dominates (see the module's docstring), best first."""
        first_of: dict[tuple[int, int, int], TriedSettings] = {}
        for found in sorted(self._list_full_trials(), key=lambda one: one.rank):
            first_of.setdefault(found.merit.criteria, found)
        candidates = first_of.values()
        return [one for one in candidates if not any(one.merit.is_beaten_by(other.merit) for other in candidates)]

    def evaluate(self, point: Point) -> TriedSettings:
        """Evaluate the settings of a point, and return them with their results.

        The evaluation may be abandoned early.
        """
        overrides = self.space.settings_of(point)
        if overrides not in self._tried:
            best_before = self.best
            self._tried[overrides] = self._evaluate_settings(overrides)
            best = self.best
            if best is not best_before and self.on_improvement is not None:
                self.on_improvement(best)
            message = f"best so far: {best.merit.wrong} scenes wrong, {best.merit.imprecise} neither exact nor close"
            self.progress(self.trials, max(self._requested_trials, self.trials), message)
        return self._tried[overrides]

    def _evaluate_settings(self, overrides: SettingOverrides) -> TriedSettings:
        method = Method(self.method.engine, self.method.profile, overrides)
        trial, full_trials = len(self._tried), self._list_full_trials()
        results_by_scene: dict[int, SceneResult] = {}
        part_size = math.ceil(len(self.scenes) / PARTS)
        for start in range(0, len(self.scenes), part_size):
            part = self._order[start : start + part_size]
            results_by_scene |= zip(part, self.evaluator.evaluate(method, [self.scenes[k] for k in part]), strict=True)
            # Assume the best case, in which all remaining scenes are exact.
            left = [SceneResult(Grade.EXACT, 0.0)] * (len(self.scenes) - len(results_by_scene))
            at_best = replace(compute_merit([*results_by_scene.values(), *left]), cost=0.0)
            if left and any(at_best.is_beaten_by(full_trial.merit) for full_trial in full_trials):
                return TriedSettings(overrides, at_best, (), trial)
        results = tuple(results_by_scene[k] for k in range(len(self.scenes)))
        return TriedSettings(overrides, compute_merit(results, self.first.results), results, trial)
