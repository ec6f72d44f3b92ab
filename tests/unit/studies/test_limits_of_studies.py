"""Every study passes its limits to its workers, and does not repeat tasks whose results are in its journal."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import pytest
from tests.installed_adapters import clear_entry_point_caches
from tests.unit.studies.history.toy_engine import install_toys

import carom
from carom import Scene, studies
from carom.catalogue import all_scenes
from carom.conformance.suite import make_suite
from carom.conformance.violation import Setup
from carom.execution import cache_key, describe_engines
from carom.execution.job import Answer, Task
from carom.execution.pool import LocalPool
from carom.execution.score_jobs import score_journal
from carom.execution.shared_options import LimitOptions
from carom.execution.workers.worker_main import carry_out
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import advise
from carom.studies.bench.growth import growth_journal, measure_growth
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.run import measure_work_precision
from carom.studies.bench.timing_pass import timing_journal
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import execute, observed_journal
from carom.studies.history.compare_cells import history_journal
from carom.studies.history.options import HistoryOptions
from carom.studies.history.release_cache import ReleaseCache
from carom.studies.history.run import run_history
from carom.studies.stress.options import StressOptions
from carom.studies.stress.run import run_stress_campaign
from carom.studies.tune.evaluate import tune_journal
from carom.studies.tune.options import TuneOptions
from carom.studies.tune.run import tune

#: What nobody has by default. The time is above that which an adapter has to declare what it can.
MEMORY_MB, TIME_S = 1234.0, 43.0

#: Tasks that ask an adapter what it declares, and those of `carom tune` that no journal holds: they time or describe.
DECLARED = {"DescribeTask", "SettingsTask", "TimeTask", "OriginTask", "ServedManifestTask"}

Asked = list[tuple[int, float, str]]


@pytest.fixture
def recorded_tasks(monkeypatch: pytest.MonkeyPatch) -> Iterator[Asked]:
    """Record the limits that workers get with each task. Tasks run in this process."""
    found: Asked = []

    class Worker:
        def __init__(self, memory_bytes: int, *_how: object) -> None:
            self._memory_bytes = memory_bytes

        def run_each(self, tasks: Sequence[Task[Any]], time_limit_s: float) -> Iterator[Answer[Any]]:
            found.extend((self._memory_bytes, time_limit_s, type(task).__name__) for task in tasks)
            return map(carry_out, tasks)

        def stop(self) -> None:
            pass

        def close(self) -> None:
            pass

    monkeypatch.setattr("carom.execution.pool.Worker", Worker)
    monkeypatch.setattr(describe_engines, "_KNOWN", {})
    cache_key.find_versions.cache_clear()
    yield found
    cache_key.find_versions.cache_clear()


def scene() -> Scene:
    return all_scenes()["paper/missed"].scene


LIMITS: dict[str, Any] = {"time_limit_s": TIME_S, "memory_limit_mb": MEMORY_MB}

#: What a study is given to open its journals with, ``resume`` say.
How = dict[str, Any]


def cross_check(folder: Path, how: How) -> None:
    options = Options(["pic"], [1 / 60], ["tuned"], phases=1, timing=False, jobs=1, **LIMITS)
    with LocalPool(1, TIME_S, MEMORY_MB) as pool, observed_journal(folder / "a", options.stamp, **how) as journal:
        execute(build_plan([scene()], options, pool), pool, notes=journal)


def bench(folder: Path, how: How) -> None:
    plan = BenchPlan(engines=("pic",), dts=(1 / 60,), profiles=("tuned",), phases=1, rounds=3, **LIMITS)
    with score_journal(folder / "a", **how) as notes, timing_journal(folder / "b", **how) as timings:
        measure_work_precision([scene()], plan, LocalPool(1, TIME_S, MEMORY_MB), notes=notes, timings=timings)


def run_growth(folder: Path, how: How) -> None:
    with growth_journal(folder / "a", **how) as journal:
        measure_growth(BenchPlan(["pic"], sizes=[2], **LIMITS), notes=journal)


def run_stress(folder: Path, how: How) -> None:
    asked = StressOptions(["pit"], profiles=["tuned"], quick=True, jobs=1, **LIMITS)
    run_stress_campaign(["tunnelling"], asked, out=folder / "out", **how)


def run_tune(folder: Path, how: How) -> None:
    pytest.importorskip("optuna", reason="optuna, extra tune, is missing")
    with tune_journal(folder / "a", **how) as journal:
        tune("pymunk", [scene()], TuneOptions(trials=1, jobs=1, **LIMITS), notes=journal)


def run_release_history(folder: Path, how: How) -> None:
    with pytest.MonkeyPatch.context() as patch:
        install_toys(folder / ("again" if how else "first"), patch)
        asked = HistoryOptions(versions=["1.0", "1.1"], profiles=["default"], jobs=1, **LIMITS)
        with history_journal(folder / "a", **how) as journal:
            run_history("toy", [scene()], ReleaseCache(folder / "kept"), asked, notes=journal)
    clear_entry_point_caches()


def run_timed_cross_check(_folder: Path, _how: How) -> None:
    carom.cross_check([scene()], ["pic"], dts=[1 / 60], profiles=["tuned"], jobs=1, **LIMITS)


def run_advise(_folder: Path, _how: How) -> None:
    asked = AdviceOptions(["pymunk"], direction_error_rad=0.1, profiles=["tuned"], phases=1, budget_steps=1000)
    with LocalPool(1, TIME_S, MEMORY_MB) as pool:
        advise(scene(), asked, pool)


def run_conformance_case(_folder: Path, _how: How) -> None:
    (plan,) = make_suite(["pit"], ["tuned"], None, [], LimitOptions(**LIMITS)).engines
    assert plan.subject is not None
    with plan.subject as subject:
        subject.watch(Setup(scene()))


#: Each study, and what starts workers for it: a comparison reads two files, and starts none.
ALL: dict[str, list[Any]] = {
    "advise": [pytest.param(run_advise, marks=pytest.mark.long)],
    "bench": [bench, pytest.param(run_growth, marks=pytest.mark.long)],
    "cross_check": [cross_check, pytest.param(run_timed_cross_check, marks=pytest.mark.long)],
    "diff": [],
    "history": [pytest.param(run_release_history, marks=pytest.mark.long)],
    "stress": [run_stress],
    "tune": [pytest.param(run_tune, marks=pytest.mark.long)],
}
#: Studies with a journal, which get `how` to open it.
KEPT = {cross_check, bench, run_growth, run_stress, run_tune, run_release_history}


def test_every_study_has_a_row_in_this_test() -> None:
    """The table of this file has a row for each package of `carom.studies`."""
    assert {one.name for one in iter_modules(studies.__path__)} == set(ALL), "each study needs a row in ALL"


@pytest.mark.parametrize("study", [*(one for own in ALL.values() for one in own), run_conformance_case])
def test_workers_have_study_limits_and_journal_is_reused(
    study: Callable[[Path, How], None], recorded_tasks: Asked, tmp_path: Path
) -> None:
    """Every worker of a study has the requested limits, and a resumed study does not repeat its tasks."""
    study(tmp_path, {})
    assert {name for _, _, name in recorded_tasks} - {"DescribeTask"}
    others = [one for one in recorded_tasks if one[:2] != (round(1e6 * MEMORY_MB), TIME_S)]
    assert not others, "asked in a pool with limits of its own: see CONTRIBUTING.md, a new study"
    if study in KEPT:
        assert {name for _, _, name in recorded_tasks} - DECLARED
        recorded_tasks.clear()
        study(tmp_path, {"resume": True})
        assert {name for _, _, name in recorded_tasks} <= DECLARED
