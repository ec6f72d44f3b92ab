"""Every worker of every study has the study's limits: of memory and of time, also those that are only asked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

import carom
from carom import Scene
from carom.bench.adviser import Demand, advise
from carom.bench.bench_plan import BenchPlan
from carom.bench.growth import growth
from carom.bench.work_precision import work_precision
from carom.runs import engines, scoring
from carom.runs.job import Answer, Task
from carom.runs.pool import LocalPool
from carom.runs.worker import answer
from carom.scenes import all_scenes
from carom.stress.campaign import stress
from carom.tune.run import TuneOptions, tune

#: What nobody has by default. The time is above that which an adapter has to declare what it can.
MEMORY_MB, TIME_S = 1234.0, 43.0

Asked = list[tuple[int, float, str]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Iterator[Asked]:
    """The limits that each worker is given with each of its tasks; tasks are carried out in this process."""
    found: Asked = []

    class Worker:
        def __init__(self, memory_bytes: int) -> None:
            self._memory_bytes = memory_bytes

        def ask_each(self, tasks: Sequence[Task[Any]], time_limit_s: float) -> Iterator[Answer[Any]]:
            found.extend((self._memory_bytes, time_limit_s, type(task).__name__) for task in tasks)
            return map(answer, tasks)

        def stop(self) -> None:
            pass

        def close(self) -> None:
            pass

    monkeypatch.setattr("carom.runs.pool.Worker", Worker)
    monkeypatch.setattr(engines, "_KNOWN", {})
    scoring.versions_of.cache_clear()
    yield found
    scoring.versions_of.cache_clear()


def scene() -> Scene:
    return all_scenes()["paper/missed"].scene


LIMITS: dict[str, Any] = {"time_limit_s": TIME_S, "memory_limit_mb": MEMORY_MB}


def cross_check(_: Path) -> None:
    carom.cross_check([scene()], ["pic"], dts=[1 / 60], profiles=["tuned"], phases=1, jobs=1, **LIMITS)


def bench(_: Path) -> None:
    plan = BenchPlan(engines=("pic",), dts=(1 / 60,), profiles=("tuned",), phases=1, rounds=3, **LIMITS)
    work_precision([scene()], plan, LocalPool(1, TIME_S, MEMORY_MB))


def grow(_: Path) -> None:
    growth(["pic"], sizes=[2], **LIMITS)


def attack(folder: Path) -> None:
    stress(["tunnelling"], ["pit"], out=folder / "out", quick=True, profiles=["tuned"], jobs=1, **LIMITS)


def advice(_: Path) -> None:
    with LocalPool(1, TIME_S, MEMORY_MB) as pool:
        advise(scene(), Demand(0.1), pool, ["pymunk"], profiles=["tuned"], phases=1, budget_steps=1000)


def search(_: Path) -> None:
    pytest.importorskip("optuna", reason="optuna, extra tune, is missing")
    tune("pymunk", [scene()], TuneOptions(trials=1, jobs=1, **LIMITS))


@pytest.mark.parametrize("study", [cross_check, bench, grow, attack, advice, search])
def test_each_worker_of_a_study_has_its_limits(study: Callable[[Path], None], asked: Asked, tmp_path: Path) -> None:
    """Whatever a study starts, to ask adapters, to run or to time, has the memory and the time that were asked for."""
    study(tmp_path)
    assert {name for _, _, name in asked} > {"Describe"}
    assert {(memory, time_s) for memory, time_s, _ in asked} == {(round(1e6 * MEMORY_MB), TIME_S)}
