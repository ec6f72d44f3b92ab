"""Explanation of a plan: what is skipped, and why."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import pytest
from tests.cases import each, release_after
from tests.in_process_pool import InProcessPool
from tests.scene_builders import require_value

from carom.catalogue import all_scenes, catalogue
from carom.execution import scene_reference
from carom.execution.job import Answer, Job, Method, Status, Task
from carom.execution.observation.engine_run import ObserveTask
from carom.execution.time_saved import measure_pic_saving, measure_pit_saving
from carom.report.document import Figures, Media, Table
from carom.solvers.pic import solve_pic
from carom.studies.cross_check.explain import explain
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import cross_check, execute
from carom.studies.cross_check.sections.skipping import build_skipping_section


@each(
    "name, options, said",
    [
        ("classics/box", {}, ["PIC: event-driven, with a grid of cells: 13 impacts in 13 predictions"]),
        (
            "classics/gas",
            {"dts": [1 / 60]},
            [r"classics/gas: .*; skipped: \d+ of 60 frames of PIT\n", "run for all 60 steps", " times as long"],
        ),
        (
            "gravity/falling-pair",
            {"dts": [1 / 60]},
            [
                r"skipped: wall tests, \d+ of \d+ frames of PIT\n",
                "PIC: event-driven along parabolas",
                " of 75 frames are tested, because no pair can touch ",
            ],
        ),
        ("paper/late", {"phases": 5}, ["phases: 5 of 5", "PIC's last impact at"]),
        ("classics/miss", {}, ["because no discs meet in PIC"]),
        ("gravity/free-fall", {}, ["engines: run for all .*: gravity changes velocities"]),
        ("spin/bounce-to-roll", {}, ["the comparison with PIC ends at 1.5 s, when a disc rolls along a wall"]),
    ],
)
def test_explanation_describes_what_runs_and_what_is_skipped(
    name: str, options: dict[str, Any], said: list[str]
) -> None:
    """The explanation lists work that a scene does not need, PIC's form, PIT's frames, steps and phases."""
    text = "\n".join(explain(build_plan([all_scenes()[name]], Options(["pit"], **options), InProcessPool())))
    assert [words for words in said if not re.search(words, text)] == []


def test_time_saved_by_skipping_is_measured() -> None:
    """The time saved by skipping is measured, unless the run without skipping is too long."""
    scene = catalogue()["classics/gas"].scene
    for saved in (measure_pic_saving(scene, solve_pic(scene)), measure_pit_saving(scene, 1 / 60)):
        assert require_value(saved).with_skipping_s > 0.0
        assert require_value(saved).ratio > 0.0
    assert measure_pit_saving(scene, 1e-7) is None


def test_report_has_section_on_skipped_work() -> None:
    """A report of timed runs with stored states has a section on skipped work, and no other report has one."""
    asked: dict[str, Any] = {"profiles": ["tuned"], "dts": [1 / 60], "pool": InProcessPool()}
    found = cross_check(["classics/gas", "paper/late"], ["pit"], **asked)
    assert list(found.skipped) == ["classics/gas", "paper/late"]
    section = build_skipping_section(build_grid(found))
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    _, ((scene, *_), _) = table.select_for(Media.MARKDOWN)
    assert scene.text == "classics/gas"
    (figures,) = [block for block in section.blocks if isinstance(block, Figures)]
    assert "classics/gas" in figures.items[0].draw(False)
    assert not build_skipping_section(build_grid(cross_check(["paper/late"], ["pit"], **asked, timing=False))).blocks
    assert not cross_check(["paper/late"], ["pit"], **asked, samples=False).skipped


def test_explanation_lists_engine_that_is_not_installed() -> None:
    """An engine that is not installed is listed with the install command, and is not planned."""
    found = build_plan([catalogue()["paper/late"]], Options(profiles=["tuned"]), InProcessPool())
    gone = replace(found.engines[0], name="gone", unavailable="gone is not installed; pip install gone")
    text = "\n".join(explain(found._replace(engines=(*found.engines, gone))))
    assert "gone is not available: gone is not installed; pip install gone" in text
    assert "gone tuned" not in text


class Noting(InProcessPool):
    """A pool that starts no engine and records the requested jobs."""

    def __init__(self) -> None:
        self.jobs: list[Job] = []

    def run_each(self, tasks: Sequence[Task[Any]]) -> Iterator[Answer[Any]]:
        for task in tasks:
            assert isinstance(task, ObserveTask)
            self.jobs.append(task.job)
            yield Answer(Status.FAILED, "noted")


@pytest.mark.usefixtures("hostile")
@each(
    "options, most_impacts, one_in",
    release_after(
        1,
        [
            ({"profiles": ["all"]}, 3, 4),
            ({"profiles": ["all"]}, 3, 1),
            ({"profiles": ["tuned", "default"], "dts": [0.5, 0.1]}, scene_reference.MOST_IMPACTS, 1),
            ({}, scene_reference.MOST_IMPACTS, 1),
            ({"profiles": ["located"]}, scene_reference.MOST_IMPACTS, 1),
        ],
    ),
)
def test_explanation_agrees_with_jobs_that_run(
    options: dict[str, Any], most_impacts: int, one_in: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For each scene, the explanation lists exactly the jobs that run, and each skipped row has the same reason."""
    monkeypatch.setattr(scene_reference, "MOST_IMPACTS", most_impacts)
    engines = ["pit", "pymunk", "box2d", "only-discs", "missing", "broken", "bad-profile"]
    chosen = Options(engines, timing=False, samples=False, certified=False, **options)
    for entry in list(catalogue().values())[::one_in]:
        planned, pool = build_plan([entry], chosen, InProcessPool()), Noting()
        rows = execute(planned, pool).rows
        lines = dict(line.strip().split(": ", maxsplit=1) for line in explain(planned))
        if "not run" in lines:
            assert {(row.status, row.reason) for row in rows} == {(Status.UNSUPPORTED, lines["not run"])}
            assert pool.jobs == []
            continue
        told = {f"pit at {line.removeprefix('PIT at ')}" for line in lines if line.startswith("PIT at ")}
        for method in {row.job.method for row in rows}:
            own = [row for row in rows if row.job.method == method]
            fate = lines[method.label]
            runs = re.match(r"run at ([\d.e, -]+) s", fate)
            told |= {f"{method.label} at {dt} s" for dt in (runs[1].split(", ") if runs else ())}
            refused = [row for row in own if row.reason != "noted"]
            assert all(
                fate == f"skipped: {row.reason}" or f"skipped at {row.job.dt_s:.6g} s: {row.reason}" in fate
                for row in refused
            )
            assert bool(refused) == ("skipped" in fate)
        assert sorted(f"{job.method.label} at {job.dt_s:.6g} s" for job in pool.jobs) == sorted(told)
        there = {row.job.method.label for row in rows}
        others = [
            lines[f"{info.name} {profile}"]
            for info in planned.engines
            for profile in info.profiles
            if profile in planned.profiles and Method(info.name, profile).label not in there
        ]
        assert set(others) <= {"skipped: another profile has the same settings"}
