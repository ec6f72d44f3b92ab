import importlib
import json
import math
import re
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from tests.cases import each
from tests.command import carom_command
from tests.fake_clock import Clock
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, staged

from carom import Scene
from carom.errors import InputError, UnknownNameError
from carom.execution.job import Answer, Method, Status
from carom.execution.score_jobs import Measures, score_journal
from carom.studies.bench.convergence import Convergence
from carom.studies.bench.growth import GrowthPoint, select_same_method
from carom.studies.bench.machine_noise import Spread
from carom.studies.bench.options import BenchPlan, compute_geometric_steps, parse_step_series
from carom.studies.bench.result import Point, find_cheapest, find_pareto_front
from carom.studies.bench.run import measure_work_precision
from carom.studies.bench.timing_pass import CellTiming, TimeScene


@pytest.fixture
def scene() -> Scene:
    return staged("oblique", disc_at(0, 0, 1, 0), disc_at(1.4, 0.3, -1, 0), duration_s=0.5)


@pytest.fixture
def scene_file(scene: Scene, tmp_path: Path) -> Path:
    """The file of a scene whose name has to be escaped in a page."""
    path = tmp_path / "my-scene.toml"
    path.write_text(tomli_w.dumps(scene.model_copy(update={"name": "mine & yours"}).model_dump()))
    return path


def build_point(engine: str, seconds: float, error: float, missed: int = 0) -> Point:
    spread = Spread(seconds, seconds, seconds)
    timing = CellTiming(100, 3, spread, spread, spread, 0.0, spread, spread, None, None)
    return Point(engine, "tuned", 0.01, error, error, error, 1, 1, missed, 0, timing=timing)


def test_step_series_is_geometric_with_whole_rates() -> None:
    """`1/60..1/10000:6` gives six geometrically spaced whole rates, and six is the default."""
    steps = parse_step_series("1/60..1/10000:6")
    assert [round(1 / step) for step in steps] == [60, 167, 464, 1292, 3594, 10000]
    assert parse_step_series("1/60..1/10000") == steps
    for given in ((0.1, 0.0125), (0.0125, 0.1)):
        assert compute_geometric_steps(*given, 4) == pytest.approx([0.1, 0.05, 0.025, 0.0125])
    assert parse_step_series("1/240") == (1 / 240,)


@each("text", ["1/60..", "1/60..1/600:1", "1/60..1/600:x", "1/60..0", "..", "1/60..1/600:-2"])
def test_malformed_step_series_is_refused(text: str) -> None:
    """A series without an end, with one step or with a wrong number is refused, and the message quotes it."""
    with pytest.raises(InputError, match=rf"^--dt must be .*, got '{re.escape(text)}'"):
        BenchPlan.parse_command_line({"dts": [text]})


def test_pareto_front_contains_only_unbeaten_points() -> None:
    """The front contains points without a miss that none beats; `find_cheapest` is the fastest within a target."""
    a, b, c = build_point("a", 1, 0.1), build_point("b", 2, 0.2), build_point("c", 3, 0.01)
    points = [a, b, c, build_point("d", 0.5, 0.0, missed=1), build_point("e", 0.5, math.inf)]
    assert find_pareto_front(points) == (a, c)
    assert find_pareto_front([a, build_point("e", 1.5, 0.1 - 1e-16)]) == (a,)
    assert [find_cheapest(points, target) for target in (0.1, 0.05, 0.001)] == [a, c, None]


@pytest.mark.long
def test_bench_measures_errors_and_times(scene: Scene) -> None:
    """PIT converges with order 1, PIC is exact, and points are timed relative to PIT, with the machine's noise."""
    # However slow the machine is, nothing is left out for want of time.
    dts = (1 / 60, 1 / 240, 1 / 960)
    plan = BenchPlan(engines=("pit", "pic"), dts=dts, profiles=("tuned",), phases=2, rounds=3, budget_s=1e6)
    (result,) = measure_work_precision([scene], plan, InProcessPool()).scenes
    noise = require_value(result.noise)
    assert (noise.probes > 1, noise.work_s > 0, noise.worst >= 1) == (True, True, True)
    found = {curve.engine: curve for curve in result.curves}
    assert found["pic"].order.verdict is Convergence.EXACT
    assert found["pit"].order.exponent == pytest.approx(1.0, abs=0.35)
    for curve in found.values():
        for timing in (require_value(entry.timing) for entry in curve.points):
            assert timing.rounds >= 3
            assert timing.ratio is not None
            assert timing.whole_s.median >= timing.advance_s.median
    assert {entry.timing and entry.timing.ratio for entry in found["pit"].points} == {Spread(1.0, 1.0, 1.0)}


def test_point_beyond_the_budget_is_untimed_with_reason(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A point that would need too much of the budget is not timed, and the reason states both times."""
    monkeypatch.setattr("carom.execution.timing.time", Clock(1.0))  # preparing takes 1 s, and so do a run's steps
    monkeypatch.setattr("carom.studies.bench.timing_pass.time", Clock(1e-3))
    coarse, fine = (Method("pit", "tuned"), 0.1), (Method("pit", "tuned"), 0.01)
    # Three rounds of ten times the coarse run's 2 s are more than the quarter of a budget that one method may take.
    found = require_value(TimeScene(scene, (coarse, fine), rounds=3, budget_s=200.0).run(InProcessPool()).value)
    assert dict(found.timings)[coarse].rounds == 3
    assert "would take about 60 s of a budget of 200 s" in dict(found.untimed)[fine]


def test_bench_adds_pic_and_pit(scene: Scene) -> None:
    """A bench includes PIC at the coarsest step and PIT at all, unless `own` is off or a profile is given."""
    plan = BenchPlan(engines=("pit",), dts=(1 / 60, 1 / 240), phases=1, timing=False)

    def found(plan: BenchPlan) -> dict[tuple[str, str], int]:
        (result,) = measure_work_precision([scene], plan, InProcessPool()).scenes
        return {(curve.engine, curve.profile): len(curve.points) for curve in result.curves}

    assert found(plan) == {("pic", "event-driven"): 1, ("pit", "tuned"): 2}
    assert found(replace(plan, own=False)) == {("pit", "tuned"): 2}
    by_frame = replace(plan, engines=("pic",), profiles=("default",))
    assert found(by_frame) == {("pit", "tuned"): 2, ("pic", "frame-by-frame"): 2}


def test_methods_beyond_the_scoring_budget_have_a_reason(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """When the budget for scoring is used up, PIT's remaining step is not scored, and the reason is the budget."""
    plan = BenchPlan(engines=("pic", "pit"), dts=(1 / 60, 1 / 120), phases=1, timing=False)
    # Each look at the clock takes a second: of the finer steps one of two fits into half of the budget.
    monkeypatch.setattr("carom.studies.bench.run.time", Clock(1.0))
    found = measure_work_precision([scene], replace(plan, budget_s=24.0), InProcessPool()).scenes[0]
    unscored = {(c.engine, c.profile, p.dt_s): p.reason for c in found.curves for p in c.points if p.reason}
    assert unscored == {("pit", "tuned", 1 / 120): "the 12 s for scoring this scene are used up; raise --budget"}


def test_invalid_bench_plan_is_refused(scene: Scene) -> None:
    """A bench without scenes, with equal scenes or an unknown profile is refused with the name."""
    plan = BenchPlan(engines=("pit",))
    for scenes, wrong, error, words in (
        ([], plan, InputError, "no scene"),
        ([scene, scene], plan, InputError, "two scenes have the name 'oblique'"),
        ([scene], replace(plan, profiles=("best",)), UnknownNameError, "profile 'best'"),
    ):
        with pytest.raises(error, match=words):
            measure_work_precision(scenes, wrong, InProcessPool())


def test_power_law_is_fitted_after_the_last_drop_in_run_time() -> None:
    """If more discs take less time, only the points from there on are fitted together."""
    times = [1.0, 3.0, 0.1, 0.4, 1.2]
    points = [GrowthPoint(10 ** (k + 2), 0.0, seconds, 1.0, 1.0) for k, seconds in enumerate(times)]
    assert select_same_method(points) == points[2:]
    assert select_same_method(points[2:]) == points[2:]


@pytest.mark.long
def test_bench_command_writes_page_diagrams_and_json(scene_file: Path, tmp_path: Path) -> None:
    """`carom bench` writes a page, PNG, SVG and JSON with escaped names, and refuses a second run."""
    pytest.importorskip("matplotlib", reason="matplotlib, extra report, is not installed")
    out = tmp_path / "out"
    options = ["-e", "pit", "-e", "pic", "--dt", "1/60..1/960:3", "--phases", "1", "--axes", "error-time"]
    arguments = ["bench", scene_file, *options, "--out", out]
    result = carom_command(*arguments, "--rounds", 3, "--budget", 1e6, "-j", 1)
    assert result.exit_code == 0, result.output
    assert ": PIC takes" in result.output
    page = (out / "index.html").read_text()
    assert page.count("<svg") == 2  # one for wide screens, one for phones
    assert "mine & yours" not in page
    assert all(words in page for words in ("mine &amp; yours", "CPython"))
    png, svg = (next(out.glob(f"mine*yours*-error-time.{kind}")) for kind in ("png", "svg"))
    assert png.read_bytes().startswith(b"\x89PNG")
    assert svg.read_text().startswith("<svg xmlns=")
    assert "<a " not in svg.read_text()  # what leads to a place of the page leads nowhere from a file
    assert json.loads((out / "bench.json").read_text())["scenes"][0]["scene"] == "mine & yours"
    again = carom_command(*arguments)
    assert again.exit_code == 2
    assert "--resume" in again.output


def load_measures(path: Path) -> list[tuple[float, Measures]]:
    with score_journal(path, resume=True) as journal:
        return [(r.key.dt_s, r.answer.value) for r in journal.entries.values() if r.answer.value is not None]


def test_documented_lines_read_the_errors_of_a_journal(
    tmp_path: Path, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lines of docs/reference/bench.md for numpy, pandas and DuckDB read the errors of a journal bit for bit."""
    plan = BenchPlan(engines=("pit",), dts=(1 / 60, 1 / 240), profiles=("tuned",), phases=1, timing=False, own=False)
    with score_journal(tmp_path / "journal.jsonl") as journal:
        measure_work_precision([scene], plan, InProcessPool(), notes=journal)
        ran = next(iter(journal.entries.values()))
        measured = require_value(ran.answer.value)
        unmeasured = replace(measured, total=replace(measured.total, velocity=math.nan))
        answers = {0.5: Answer(Status.RAN, value=unmeasured), 1.0: Answer(Status.CRASHED, "by SIGABRT")}
        journal.add([replace(ran, key=replace(ran.key, dt_s=dt), answer=answer) for dt, answer in answers.items()])
    errors = [(dt_s, measures.total.velocity) for dt_s, measures in load_measures(tmp_path / "journal.jsonl")]
    monkeypatch.chdir(tmp_path)
    lines = (Path(__file__).parents[4] / "docs" / "reference" / "bench.md").read_text().splitlines()
    code = {line.partition(".")[0]: line for line in lines if line.startswith(("np.", "pd.", "duckdb."))}
    names: dict[str, Any] = {"json": json, "np": np, "Path": Path}
    exec(next(line for line in lines if line.startswith("jobs =")), names)  # noqa: S102 - our own documentation
    assert eval(code["np"], names).tobytes() == np.array([error for _, error in errors]).tobytes()  # noqa: S307
    if find_spec("pandas"):
        frame = eval(code["pd"], {**names, "pd": importlib.import_module("pandas")})  # noqa: S307
        assert frame["answer.value.total.velocity"].to_list() == pytest.approx(
            [*(error for _, error in errors), math.nan], rel=0, abs=0, nan_ok=True
        )
    if find_spec("duckdb"):
        found = eval(code["duckdb"], {**names, "duckdb": importlib.import_module("duckdb")}).fetchall()  # noqa: S307
        assert repr(sorted(found)) == repr(sorted(("pit", dt_s, error) for dt_s, error in errors))
