import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.fake_clock import Clock
from tests.scene_builders import cross_checked, disc_at, staged, sure, wall_at

import carom
from carom import Disc, Scene, Wall
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict
from carom.errors import AdapterError, InputError, UnknownNameError
from carom.execution import scene_reference
from carom.execution.engine_run import ObserveTask
from carom.execution.job import Answer, Job, Method, Status, Task
from carom.execution.plan import build_plan
from carom.execution.pool import InProcessPool
from carom.execution.run_options import Options, compute_default_dts
from carom.execution.timing import TIMING_RUNS, TimeTask
from carom.model.trace import Outcome, Trace
from carom.studies.cross_check import run as execute
from carom.studies.cross_check.run import observed_journal

pytestmark = pytest.mark.usefixtures("hostile")


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet head-on after one second."""
    return staged("meeting", disc_at(0, 0, 1, 0), disc_at(3, 0, -1, 0), duration_s=2.0)


def statuses(results: carom.Results) -> dict[str, Status]:
    return {row.job.engine: row.status for row in results.rows}


def tried(scenes: list[Scene], *engines: str) -> carom.Results:
    """Each engine's tuned profile in steps of 0.1 s, in this process and untimed."""
    return cross_checked(scenes, engines, dts=[0.1], profiles=["tuned"])


class HangsWhenTimed(InProcessPool):
    """A pool in which no engine but PIT answers when it is timed."""

    def run_each(self, tasks: Sequence[Task[Any]]) -> Iterator[Answer[Any]]:
        if any(isinstance(task, TimeTask) and task.engine != "pit" for task in tasks):
            return iter([Answer(Status.TIMED_OUT, "no answer within 3 s")] * len(tasks))
        return super().run_each(tasks)


def test_a_hang_in_the_timed_path_is_told_and_harms_no_other(scene: Scene) -> None:
    """An engine that hangs when its steps are timed keeps the run that was observed, and the others their times."""
    results = carom.cross_check([scene], ["pit", "pic"], dts=[0.1], profiles=["tuned"], pool=HangsWhenTimed())
    rows = {row.job.engine: row for row in results.rows}
    hung = rows["pic"]
    assert hung.untimed == "timed out: no answer within 3 s"
    assert hung.reason == ""
    assert (hung.status, hung.timing) == (Status.RAN, None)
    assert hung.trace is not None
    assert rows["pit"].status is Status.RAN
    assert rows["pit"].timing is not None


def test_a_state_that_is_not_finite_ends_the_run(scene: Scene) -> None:
    """An engine whose state becomes NaN is cut short there and graded wrong, not compared with NaN."""
    row = tried([scene], "goes-nan").rows[0]
    assert sure(row.trace).outcome is Outcome.NON_FINITE
    assert row.grade is Grade.WRONG
    assert np.isfinite(sure(row.trace).final_position_m).all()


def test_an_engines_own_warning_ends_the_run(scene: Scene) -> None:
    """An engine that warns of its state is cut short with its own words, and what came before is kept."""
    row = tried([scene], "warns").rows[0]
    assert sure(row.trace).outcome is Outcome.WARNED
    assert sure(row.trace).counts["steps"] == 2
    assert sure(row.score).verdicts[0] is Verdict.CUT_SHORT
    assert "BADQACC" in sure(row.score).findings[0].reason


def test_chatter_and_litter_stay_with_the_engine(
    scene: Scene, capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What an engine prints reaches neither standard output nor error, and its log file not the working folder."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    carom.run(scene, "litters", dt=0.5)
    assert capfd.readouterr() == ("", "")
    assert list(here.iterdir()) == []


def test_what_is_unavailable_or_unsupported_says_why(scene: Scene) -> None:
    """A missing engine, a broken adapter and a scene beyond the declared capabilities each give their reason."""
    walled = Scene(name="walled", discs=scene.discs, walls=[Wall(point_m=(-9, 0), normal=(1, 0))], duration_s=1)
    fast = Scene(name="fast", discs=[Disc(position_m=(0, 0), velocity_m_s=(11, 0), radius_m=1)], duration_s=1)
    soft = Scene(name="soft", discs=scene.discs, restitution=0.25, duration_s=1)
    falling = Scene(name="falling", discs=scene.discs, gravity_m_s2=(0, -9.81), duration_s=1)
    results = tried([walled, fast, soft, falling], "missing", "only-discs", "broken")
    reasons = {(row.job.scene.name, row.job.engine): (row.status, row.reason) for row in results.rows}
    assert reasons["walled", "missing"][0] is Status.UNAVAILABLE
    assert "pip install surely-not-installed" in reasons["walled", "missing"][1]
    assert reasons["walled", "broken"][0] is Status.UNAVAILABLE
    assert "has no attribute 'broken'" in reasons["walled", "broken"][1]
    for name, words in (
        ("walled", "walls"),
        ("fast", "11 m/s, and this method's limit is 10 m/s"),
        ("soft", "restitution is 0.25"),
        ("falling", "gravity"),
    ):
        status, reason = reasons[name, "only-discs"]
        assert status is Status.UNSUPPORTED
        assert words in reason


@pytest.mark.long
def test_what_comes_after_rest_is_not_scored() -> None:
    """Where PIC ends because a ball has come to rest, the comparison ends as well, and the score has that time."""
    ball = Disc(position_m=(0, 2), radius_m=1)
    floor = Wall(point_m=(0, 0), normal=(0, 1))
    scene = Scene(name="rests", discs=[ball], walls=[floor], wall_restitution=0.25, gravity_m_s2=(0, -8), duration_s=2)
    results = cross_checked([scene], ["pic", "pit"], dts=[1 / 60])
    # It closes at 4, 1 and 1/4 m/s. The second impact is at t0 + 2 e v0 / g, with t0 = v0 / g = 1/2, and is seen a
    # frame later. The third is slower than 2.5 g / 60: a step can't distinguish it from rest, and PIT doesn't have it.
    second_s = 0.5 * (1 + 2 * 0.25)
    seen_s = (math.floor(second_s * 60) + 1) / 60
    for row in results.rows:
        assert sure(row.score).horizon_s == pytest.approx(seen_s, rel=1e-12)
        assert (sure(row.score).grade is Grade.EXACT) == (row.job.engine == "pic")


@pytest.mark.long
def test_run_raises_what_a_table_would_show(scene: Scene) -> None:
    """`carom.run` raises one error whose message holds engine, profile, step, scene and reason."""
    with pytest.raises(AdapterError, match=r"aborts \(tuned, dt = 0.1 s\) on 'meeting': crashed: .*SIGABRT"):
        carom.run(scene, "aborts", dt=0.1)
    with pytest.raises(AdapterError, match="unavailable: surely_not_installed is not installed"):
        carom.run(scene, "missing", dt=0.1)


@each("process", release_after(1, ["in_process", "another"]))
def test_run_gives_the_trace_of_the_method_itself(scene: Scene, process: str, request: pytest.FixtureRequest) -> None:
    """PIC and PIT through the seam, in this process and in another, give their own impacts to the bit."""
    if process == "in_process":
        request.getfixturevalue(process)
    direct, through = carom.solve_pic(scene), carom.run(scene, "pic", dt=1 / 60)
    assert (direct.impacts == through.impacts).all()
    assert (direct.final_velocity_m_s == through.final_velocity_m_s).all()
    assert through.settings["form"] == "event-driven"
    assert sure(through.samples).position_m.shape == (121, 2, 2)
    direct, through = carom.solve_pit(scene, frame_rate_hz=60), carom.run(scene, "pit", dt=1 / 60)
    assert (direct.impacts == through.impacts).all()


@pytest.mark.long
def test_states_for_drawing_are_no_more_than_a_picture_can_show() -> None:
    """However small the step, a trace holds a few thousand states, evenly spaced, the first at time 0."""
    scene = Scene(name="long", discs=[Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=1)], duration_s=1)
    samples = sure(carom.run(scene, "pic", dt=1e-4).samples)
    assert 2048 < len(samples.time_s) <= 4097
    assert np.allclose(samples.position_m[:, 0, 0], samples.time_s, rtol=0, atol=1e-12)


@each(
    "given, said",
    [
        ({"engine_names": "pit"}, "engines must be a list, even of one item, got 'pit'"),
        ({"engine_names": [3]}, "engines[0] must be a name, got 3"),
        ({"dts": 0.1}, "dts must be a list, even of one item, got 0.1"),
        ({"profiles": 3}, "profiles must be a list, even of one item, got 3"),
        ({"jobs": 0}, "jobs must be a whole number from 1 to 1024, got 0"),
        ({"scenes": 3}, "scenes must be a list, even of one item, got int"),
        ({"scenes": [7]}, "scenes[0] must be a Scene, a catalogue scene or its name, got 7"),
        ({"scenes": []}, "no scene"),
        ({"scenes": ["paper/late", "paper/late"]}, "two scenes have the name 'paper/late'"),
        ({"dts": [0.1, math.nan]}, "dts[1]"),
        ({"engine_names": ["pimunk"]}, "no engine is named 'pimunk'; did you mean 'pymunk'? there are: "),
        ({"profiles": ["fast"]}, "profile 'fast'; there are: tuned"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name_and_value(scene: Scene, given: dict[str, Any], said: str) -> None:
    """Each option says what it must be and what it got, before any engine starts."""
    with pytest.raises((InputError, UnknownNameError), match=re.escape(said)):
        carom.cross_check(**{"scenes": [scene], "engine_names": ["pit"], **given})


def test_each_scene_has_its_own_steps_unless_told_otherwise(scene: Scene) -> None:
    """By default a scene is run at its own frame, a quarter and a sixteenth of it."""
    assert compute_default_dts(scene) == (1 / 60, 1 / 240, 1 / 960)
    results = cross_checked([scene], ["pit"])
    assert [(row.job.dt_s, row.job.refinement) for row in results.rows] == [(1 / 60, 0), (1 / 240, 1), (1 / 960, 2)]


def test_pit_is_run_once_and_each_form_of_pic(scene: Scene) -> None:
    """By the profiles that every engine has, PIT is one method, and PIC's two forms have their names."""
    results = cross_checked([scene], ["pic", "pit"], dts=[0.1])
    assert [(row.job.engine, row.job.profile) for row in results.rows] == [
        ("pic", "frame-by-frame"),
        ("pic", "event-driven"),
        ("pit", "tuned"),
    ]


@each(
    "asked, found",
    [
        ("default", {"pic frame-by-frame", "pit"}),
        ("tuned", {"pic event-driven", "pit"}),
        ("event-driven", {"pic event-driven"}),
        ("all", {"pic frame-by-frame", "pic event-driven", "pit"}),
    ],
)
def test_a_profile_has_the_name_that_every_engine_has_and_its_own(scene: Scene, asked: str, found: set[str]) -> None:
    """PIC's forms and PIT are asked for by `default` and `tuned`, too, and are shown under their own names."""
    results = cross_checked([scene], ["pic", "pit"], dts=[0.1], profiles=[asked])
    assert {row.job.method.label for row in results.rows} == found
    assert {row.trace.profile for row in results.rows if row.trace} == {row.job.profile for row in results.rows}


def test_timing_is_a_ratio_to_pit_of_the_same_round(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every timed row has two clocks and its ratio to PIT on the same scene and step, PIT's own being 1."""
    # Each interval is twice the one before, so no two runs agree and every job is timed TIMING_RUNS times.
    monkeypatch.setattr("carom.execution.timing.time", Clock(1.0, factor=2.0))
    calls: list[tuple[int, int, str]] = []
    results = carom.cross_check(
        [scene],
        ["pic", "pit"],
        dts=[0.1],
        profiles=["tuned"],
        progress=lambda *call: calls.append(call),
        pool=InProcessPool(),
    )
    ratios = {row.job.engine: row.time_ratio for row in results.rows}
    times = {row.job.engine: sure(row.timing) for row in results.rows}
    assert ratios == {"pit": 1.0, "pic": times["pic"].advance_s / times["pit"].advance_s}
    assert ratios["pic"] != 1.0
    for timing in times.values():
        assert 0.0 < timing.prepare_s < timing.advance_s
        assert timing.runs == TIMING_RUNS
    assert [done for done, _, _ in calls] == [1, 2, 3, 4]
    assert {total for _, total, _ in calls} == {4}


@pytest.mark.long
def test_without_an_answer_from_pit_nobody_is_called_worse_than_it(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where PIT crashes, a sampled method is not graded, and its row says that there was nothing to compare it with."""
    monkeypatch.setattr(execute, "PIT_METHOD", Method("aborts", "tuned"))
    row = carom.cross_check([scene], ["pit"], dts=[0.3], profiles=["tuned"], timing=False).rows[0]
    assert row.grade is Grade.UNGRADED
    assert Verdict.UNCOMPARED in sure(row.score).verdicts


def test_a_reference_without_end_is_a_reason_and_not_a_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene of more impacts than a cross-check follows is unsupported everywhere, with how far it got."""
    monkeypatch.setattr(scene_reference, "MOST_IMPACTS", 100)
    endless = staged(
        "endless", disc_at(0, 0, 1000, 0, r=0.25), wall_at(-0.5, 0, 1, 0), wall_at(0.5, 0, -1, 0), duration_s=1e9
    )
    row = cross_checked([endless], ["pit"]).rows[0]
    assert row.status is Status.UNSUPPORTED
    assert "100 impacts come before" in row.reason


def test_a_profile_that_fails_is_a_row(scene: Scene) -> None:
    """An adapter whose settings fail, or are invalid, has a row with the reason; the rows of other engines run."""
    results = cross_checked([scene], ["pit", "bad-profile"], dts=[0.1], profiles=["default", "tuned"])
    failed = {row.job.profile: row.reason for row in results.rows if row.job.engine == "bad-profile"}
    assert "KeyError: 'no such'" in failed["default"]
    assert "setting 'list' of profile 'tuned'" in failed["tuned"]
    assert statuses(results)["pit"] is Status.RAN


def contents(trace: Trace) -> dict[str, object]:
    """Return what a trace holds, arrays with their types as bytes."""
    parts = {"samples": trace.samples, "local_truth": trace.local_truth}
    values: dict[str, object] = {**vars(trace), **dict.fromkeys(parts)}
    for part, held in parts.items():
        values |= {f"{part}.{name}": value for name, value in (vars(held).items() if held else ())}
    return {
        # By what it is shown as: NaN is the same in both.
        name: (value.dtype, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)
        for name, value in values.items()
    }


def test_a_run_that_was_ended_is_gone_on_with(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was observed before a cross-check was ended is not run again, and its rows are the same to the bit."""
    options = Options(["pic", "pit"], [0.1], phases=2, timing=False)
    plan, path = build_plan([scene], options, InProcessPool()), tmp_path / "journal.jsonl"
    whole = execute.execute(plan, InProcessPool())

    def end(done: int, _total: int, _what: str) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), observed_journal(path, options.stamp) as journal:
        execute.execute(plan, InProcessPool(), notes=journal, progress=end)
    before = len(path.read_bytes().splitlines()) - 1
    ran: list[Job] = []
    carry_out = ObserveTask.carry_out

    def noted(task: ObserveTask) -> Trace:
        ran.append(task.job)
        return carry_out(task)

    monkeypatch.setattr(ObserveTask, "carry_out", noted)
    with observed_journal(path, options.stamp, resume=True) as journal:
        again = execute.execute(plan, InProcessPool(), notes=journal)
    assert before == 3
    assert len(ran) == 9 - before  # two methods and PIC's default, each at the scene's own phase and two more
    for one, other in zip(whole.rows, again.rows, strict=True):
        assert contents(sure(one.trace)) == contents(sure(other.trace))
        assert repr(one.score) == repr(other.score)
        assert one.spread == other.spread


def test_a_run_of_other_options_is_not_gone_on_with(tmp_path: Path) -> None:
    """A journal of other steps is refused, and the message says which; how many jobs run at a time does not matter."""
    path = tmp_path / "journal.jsonl"
    options = Options(["pit"], [0.1], jobs=1, timing=False)
    with observed_journal(path, options.stamp) as journal:
        execute.execute(
            build_plan([catalogue()["paper/late"]], options, InProcessPool()), InProcessPool(), notes=journal
        )
    observed_journal(path, replace(options, jobs=2).stamp, resume=True).close()
    with pytest.raises(InputError, match=r"its dts is \[0.1\], but this study's is \[0.2\]"):
        observed_journal(path, replace(options, dts=[0.2]).stamp, resume=True)
