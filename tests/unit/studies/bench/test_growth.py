"""Run time against the number of discs: which runs are measured, skipped or reused."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TypeVar

import pytest
from tests.fake_clock import Clock
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom.engines.api import Capabilities, Profile
from carom.execution.job import Answer, Method, Status, Task, UnsupportedError
from carom.execution.journal import JournalEntry
from carom.studies.bench import growth
from carom.studies.bench.options import BenchPlan

T = TypeVar("T")


def test_growth_respects_capabilities_of_the_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gas in a box is refused if the profile does not support walls, even if the adapter does."""
    narrow = Profile("without walls", lambda dt_s: {"dt_s": dt_s}, capabilities=Capabilities(walls=False))
    adapter = SimpleNamespace(name="stub", capabilities=Capabilities(), profiles={"narrow": narrow})
    monkeypatch.setattr(growth, "load_adapter", lambda _name: adapter)
    with pytest.raises(UnsupportedError, match="does not support"):
        growth.GrowthTask(2, Method("stub", "narrow")).carry_out()


@pytest.fixture
def recorded_runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Engine and number of discs of each run; the runs are carried out in this process, and take a second each."""
    ran: list[tuple[str, int]] = []

    class Pool(InProcessPool):
        def __init__(self, *_limits: float | None) -> None:
            super().__init__()

        def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
            grown: list[object] = [*tasks]
            ran.extend((task.engine, task.discs) for task in grown if isinstance(task, growth.GrowthTask))
            return super().run_each(tasks)

    monkeypatch.setattr("carom.execution.pool.LocalPool", Pool)
    for module in ("carom.execution.timing", "carom.studies.bench.growth"):
        monkeypatch.setattr(f"{module}.time", Clock(1.0))
    return ran


PLAIN_AND_FALLING = [("pit", 2), ("pit", 2)]


@pytest.mark.long
def test_ratio_needs_runs_of_the_same_session(tmp_path: Path, recorded_runs: list[tuple[str, int]]) -> None:
    """A resumed growth bench runs only the rest, and has ratios only between runs of the same session."""
    path, engines = tmp_path / "growth.jsonl", ("pit", "pymunk")
    with growth.growth_journal(path) as journal:
        growth.measure_growth(BenchPlan(engines, sizes=(2, 3), own=False), notes=journal)
        earlier = "2000-01-01T00:00:00+00:00"
        for key, run in [*journal.entries.items()]:
            if key.method.engine == "pymunk" and key.discs == 3:
                value = replace(require_value(run.answer.value), bench_start=earlier)
                journal.add([JournalEntry(key, Answer(Status.RAN, value=value))])
    recorded_runs.clear()
    with growth.growth_journal(path, resume=True) as journal:
        found = growth.measure_growth(BenchPlan(engines, sizes=(2, 3, 4), own=False), notes=journal)
    assert recorded_runs == [("pit", 4), ("pymunk", 4)] * 2
    pit, pymunk = (curve.points for curve in found.curves if not curve.gravity)
    assert [pymunk[k].ratio == pymunk[k].advance_s / pit[k].advance_s for k in range(3)] == [True, False, True]
    assert math.isnan(pymunk[1].ratio)


def test_run_skipped_for_budget_is_retried_with_larger_budget(
    tmp_path: Path, recorded_runs: list[tuple[str, int]]
) -> None:
    """A run that was skipped because the budget was too short is run when the bench resumes with a larger one."""
    path = tmp_path / "growth.jsonl"
    with growth.growth_journal(path) as journal:
        first = growth.measure_growth(BenchPlan(["pit"], sizes=[2], own=False, budget_s=1e-9), notes=journal)
    assert "raise --budget" in first.curves[0].points[0].reason
    with growth.growth_journal(path, resume=True) as journal:
        second = growth.measure_growth(BenchPlan(["pit"], sizes=[2], own=False), notes=journal)
    assert second.curves[0].points[0].reason == ""
    assert recorded_runs == PLAIN_AND_FALLING


def test_later_curve_may_use_the_budget_that_others_left(recorded_runs: list[tuple[str, int]]) -> None:
    """A run that needs about 150 s is skipped if its curve has 100 s. The last curve may use what is left."""
    options = BenchPlan(["pit"], sizes=[2, 3, 225], own=False, budget_s=100.0, time_limit_s=1e3)
    plain, falling = (curve.points[-1].reason for curve in growth.measure_growth(options).curves)
    assert plain.startswith("it would take about 150 s according to the run with 3 discs, and only ")
    assert falling == ""
    assert recorded_runs[4:] == [("pit", 225)]
