import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.fake_clock import Clock
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, run_cross_check, staged, wall_at

import carom
from carom import Scene
from carom.comparator import Grade, Verdict
from carom.errors import AdapterError, InputError, UnknownNameError
from carom.execution.job import Answer, Status, Task
from carom.execution.timing import TIMING_RUNS, TimeTask
from carom.model.trace import Outcome
from carom.studies.cross_check import run as execute
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import observed_journal

pytestmark = pytest.mark.usefixtures("hostile")


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet head-on after one second."""
    return staged("meeting", disc_at(0, 0, 1, 0), disc_at(3, 0, -1, 0), duration_s=2.0)


def run_tuned(scenes: list[Scene], *engines: str) -> carom.Results:
    """Each engine's tuned profile in steps of 0.1 s, in this process and untimed."""
    return run_cross_check(scenes, engines, dts=[0.1], profiles=["tuned"])


class HangsWhenTimed(InProcessPool):
    """A pool in which no engine but PIT answers when it is timed."""

    def run_each(self, tasks: Sequence[Task[Any]]) -> Iterator[Answer[Any]]:
        if any(isinstance(task, TimeTask) and task.engine != "pit" for task in tasks):
            return iter([Answer(Status.TIMED_OUT, "no answer within 3 s")] * len(tasks))
        return super().run_each(tasks)


def test_hang_during_timing_keeps_the_run_and_other_times(scene: Scene) -> None:
    """An engine that hangs while it is timed keeps its scored run, with a reason; the others keep their times."""
    results = carom.cross_check([scene], ["pit", "pic"], dts=[0.1], profiles=["tuned"], pool=HangsWhenTimed())
    rows = {row.job.engine: row for row in results.rows}
    hung, pit = rows["pic"], rows["pit"]
    assert (hung.status, hung.timing, hung.reason) == (Status.RAN, None, "")
    assert hung.untimed == "timed out: no answer within 3 s"
    assert hung.trace is not None
    assert pit.status is Status.RAN
    assert pit.timing is not None


def test_non_finite_state_ends_the_run_as_wrong(scene: Scene) -> None:
    """A run whose state becomes NaN ends at the last finite state and is graded wrong."""
    row = run_tuned([scene], "goes-nan").rows[0]
    trace = require_value(row.trace)
    assert (trace.outcome, row.grade) == (Outcome.NON_FINITE, Grade.WRONG)
    assert np.isfinite(trace.final_position_m).all()


def test_engine_warning_ends_the_run(scene: Scene) -> None:
    """An engine that reports a warning is cut short; the steps before are kept and the finding quotes the warning."""
    row = run_tuned([scene], "warns").rows[0]
    trace, score = require_value(row.trace), require_value(row.score)
    assert (trace.outcome, trace.counts["steps"]) == (Outcome.WARNED, 2)
    assert score.verdicts[0] is Verdict.CUT_SHORT
    assert "BADQACC" in score.findings[0].reason


def test_engine_output_and_log_files_are_contained(
    scene: Scene, capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An engine's output reaches neither stdout nor stderr, and its log file is not in the working folder."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    carom.run(scene, "litters", dt=0.5)
    assert capfd.readouterr() == ("", "")
    assert list(here.iterdir()) == []


def test_unavailable_and_unsupported_rows_have_reasons(scene: Scene) -> None:
    """A missing engine, a broken adapter and scenes beyond declared capabilities get rows with the reason."""
    discs = scene.discs
    walled = staged("walled", *discs, wall_at(-9, 0, 1, 0), duration_s=1)
    fast = staged("fast", disc_at(0, 0, 11, 0, r=1), duration_s=1)
    soft = staged("soft", *discs, restitution=0.25, duration_s=1)
    falling = staged("falling", *discs, gravity_m_s2=(0, -9.81), duration_s=1)
    results = run_tuned([walled, fast, soft, falling], "missing", "only-discs", "broken")
    told = {(row.job.engine, row.job.scene.name): (row.status, row.reason) for row in results.rows}
    for engine, name, found, words in (
        ("missing", "walled", Status.UNAVAILABLE, "pip install surely-not-installed"),
        ("broken", "walled", Status.UNAVAILABLE, "has no attribute 'broken'"),
        ("only-discs", "walled", Status.UNSUPPORTED, "walls"),
        ("only-discs", "fast", Status.UNSUPPORTED, "11 m/s, and this method's limit is 10 m/s"),
        ("only-discs", "soft", Status.UNSUPPORTED, "restitution is 0.25"),
        ("only-discs", "falling", Status.UNSUPPORTED, "gravity"),
    ):
        status, reason = told[engine, name]
        assert status is found
        assert words in reason


@pytest.mark.long
def test_run_error_names_engine_profile_step_and_scene(scene: Scene) -> None:
    """The error of `carom.run` contains engine, profile, step, scene and reason."""
    with pytest.raises(AdapterError, match=r"aborts \(tuned, dt = 0.1 s\) on 'meeting': crashed: .*SIGABRT"):
        carom.run(scene, "aborts", dt=0.1)
    with pytest.raises(AdapterError, match="unavailable: surely_not_installed is not installed"):
        carom.run(scene, "missing", dt=0.1)


@each("process", release_after(1, ["in_process", "another"]))
def test_run_returns_the_trace_of_the_solver(scene: Scene, process: str, request: pytest.FixtureRequest) -> None:
    """`carom.run` returns the impacts of `solve_pic` and `solve_pit` bit for bit, also from another process."""
    if process == "in_process":
        request.getfixturevalue(process)
    direct, through = carom.solve_pic(scene), carom.run(scene, "pic", dt=1 / 60)
    assert (direct.impacts == through.impacts).all()
    assert (direct.final_velocity_m_s == through.final_velocity_m_s).all()
    assert through.settings["form"] == "event-driven"
    assert require_value(through.samples).position_m.shape == (121, 2, 2)
    direct, through = carom.solve_pit(scene, frame_rate_hz=60), carom.run(scene, "pit", dt=1 / 60)
    assert (direct.impacts == through.impacts).all()


@pytest.mark.long
def test_number_of_stored_states_is_limited() -> None:
    """With 10000 steps, a trace stores 2049 to 4097 evenly spaced states, the first at time 0."""
    scene = staged("long", disc_at(0, 0, 1, 0, r=1), duration_s=1)
    samples = require_value(carom.run(scene, "pic", dt=1e-4).samples)
    assert 2048 < len(samples.time_s) <= 4097
    assert np.allclose(samples.position_m[:, 0, 0], samples.time_s, rtol=0, atol=1e-12)


@each(
    "given, said",
    [
        ({"engine_names": "pit"}, "engines must be a list, even for a single item, got 'pit'"),
        ({"scenes": [7]}, "scenes[0] must be a Scene, a catalogue scene or its name, got 7"),
        ({"scenes": []}, "no scene"),
        ({"scenes": ["paper/late", "paper/late"]}, "two scenes have the name 'paper/late'"),
        ({"engine_names": ["pimunk"]}, "no engine is named 'pimunk'; did you mean 'pymunk'? there are: "),
    ],
)
def test_invalid_cross_check_option_is_refused_with_its_value(scene: Scene, given: dict[str, Any], said: str) -> None:
    """An invalid option is refused; the message states its name, the allowed and the given value."""
    with pytest.raises((InputError, UnknownNameError), match=re.escape(said)):
        carom.cross_check(**{"scenes": [scene], "engine_names": ["pit"], **given})


@each(
    "profiles, found",
    [
        (None, ["pic frame-by-frame", "pic event-driven", "pit"]),
        (["all"], ["pic frame-by-frame", "pic event-driven", "pit"]),
        (["default"], ["pic frame-by-frame", "pit"]),
        (["tuned"], ["pic event-driven", "pit"]),
        (["event-driven"], ["pic event-driven"]),
    ],
)
def test_own_methods_are_selected_by_common_profile_names(
    scene: Scene, profiles: list[str] | None, found: list[str]
) -> None:
    """By default PIC runs in two forms and PIT once; `default` and `tuned` select one form, shown with its name."""
    results = run_cross_check([scene], ["pic", "pit"], dts=[0.1], profiles=profiles)
    assert [row.job.method.label for row in results.rows] == found
    assert {row.trace.profile for row in results.rows if row.trace} == {row.job.profile for row in results.rows}


def test_time_ratio_is_relative_to_pit(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run times are relative to PIT's on the same scene and step; preparation is timed separately."""
    # Each interval is twice the one before, so no two runs agree and every job is timed TIMING_RUNS times.
    monkeypatch.setattr("carom.execution.timing.time", Clock(1.0, factor=2.0))
    calls: list[tuple[int, int, str]] = []
    asked: dict[str, Any] = {"dts": [0.1], "profiles": ["tuned"], "pool": InProcessPool()}
    results = carom.cross_check([scene], ["pic", "pit"], progress=lambda *call: calls.append(call), **asked)
    ratios = {row.job.engine: row.time_ratio for row in results.rows}
    times = {row.job.engine: require_value(row.timing) for row in results.rows}
    assert ratios == {"pit": 1.0, "pic": times["pic"].advance_s / times["pit"].advance_s}
    assert ratios["pic"] != 1.0
    for timing in times.values():
        assert 0.0 < timing.prepare_s < timing.advance_s
        assert timing.runs == TIMING_RUNS
    assert [call[:2] for call in calls] == [(done, 4) for done in (1, 2, 3, 4)]


def test_interrupted_cross_check_resumes_from_journal(scene: Scene, tmp_path: Path) -> None:
    """A cross-check that is interrupted after three jobs and resumed has the rows of an uninterrupted one."""
    options = Options(["pic", "pit"], [0.1], phases=2, timing=False)
    plan, path = build_plan([scene], options, InProcessPool()), tmp_path / "journal.jsonl"
    whole = execute.execute(plan, InProcessPool())

    def end(done: int, _total: int, _what: str) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), observed_journal(path, options.stamp) as journal:
        execute.execute(plan, InProcessPool(), notes=journal, progress=end)
    assert len(path.read_bytes().splitlines()) == 1 + 3
    with observed_journal(path, options.stamp, resume=True) as journal:
        again = execute.execute(plan, InProcessPool(), notes=journal)
    for one, other in zip(whole.rows, again.rows, strict=True):
        assert one.trace == other.trace
        assert repr((one.score, one.spread)) == repr((other.score, other.spread))
