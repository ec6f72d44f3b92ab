"""Settings that are tried without a profile: read as their kind, used, and never taken for a profile's own."""

import json
from pathlib import Path

import pytest
from tests.cases import each
from tests.scene_builders import disc_at

import carom
from carom import Scene
from carom.engines.api import Knob
from carom.errors import InputError
from carom.execution.cache_key import build_job_key
from carom.execution.describe_engines import find_engine
from carom.execution.job import Job, Method
from carom.execution.plan import build_plan
from carom.execution.pool import InProcessPool
from carom.execution.run_options import Options
from carom.execution.settings_override import resolve_settings
from carom.model.trace import Setting
from carom.report.junit import render_junit
from carom.report.render.markdown import render_markdown
from carom.report.results_file.records import format_records
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.run import DRAWN, execute, observed_journal
from carom.studies.diff.compare_records import compare_records


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet off their centres after about half a second."""
    discs = [disc_at(0, 0, 2, 0), disc_at(2, 0.6, 0, 0)]
    return Scene(name="aside", discs=discs, duration_s=1.5)


def checked(scene: Scene, **settings: Setting) -> carom.Results:
    with InProcessPool() as pool:
        return execute(
            build_plan([scene], Options(["mujoco"], [1 / 60], ["tuned"], settings, timing=False), pool), pool
        )


@pytest.mark.long
def test_the_engine_runs_with_what_is_tried_and_every_word_says_so(scene: Scene) -> None:
    """The settings read back hold the one tried, the trace differs from the profile's, and its profile is shown so."""
    own = carom.run(scene, "mujoco", dt=1 / 60)
    found = carom.run(scene, "mujoco", dt=1 / 60, settings={"integrator": "RK4"})
    assert (own.settings["integrator"], found.settings["integrator"]) == ("Euler", "RK4")
    assert own.final_velocity_m_s.tolist() != found.final_velocity_m_s.tolist()
    assert (own.tried, found.tried) == ({}, {"integrator": "RK4"})
    assert found.profile_shown == "tuned with integrator=RK4"
    assert "mujoco (tuned with integrator=RK4)" in repr(found)


def test_no_word_of_a_report_takes_it_for_the_profiles_own(scene: Scene) -> None:
    """Wherever a report, its JSON lines, its JUnit or its tables name the profile, they name its changed settings."""
    results = checked(scene, integrator="RK4")
    row = json.loads(format_records(results).splitlines()[1])
    assert (row["profile"], row["tried"]) == ("tuned", {"integrator": "RK4"})
    text = render_markdown(cross_check_document(results))
    told = [line for line in text.splitlines() if "mujoco" in line and "tuned" in line]
    assert told
    assert all("integrator" in line for line in told)
    assert 'name="mujoco tuned with integrator=RK4"' in render_junit(results)
    assert "settings={'integrator': 'RK4'}" in text


def test_a_diff_holds_it_against_the_profile_and_names_it(scene: Scene, tmp_path: Path) -> None:
    """Run with and without, two reports are compared cell by cell; method and cause name what was tried."""
    for name, settings in (("own", {}), ("tried", {"integrator": "RK4"})):
        (tmp_path / name).write_text(format_records(checked(scene, **settings)))
    (change,) = compare_records(tmp_path / "own", tmp_path / "tried").changes
    assert change.method == "mujoco tuned → mujoco tuned with integrator=RK4"
    assert any(cause.startswith("settings: integrator Euler → RK4") for cause in change.causes)


def test_a_value_is_read_as_the_kind_that_the_setting_is(scene: Scene) -> None:
    """A text is read as the bool, whole number, float or text that the profile's setting of that name is."""
    asked = {"in_turn": "false", "tolerance": "1e-3", "integrator": "RK4"}
    with InProcessPool() as pool:
        (job,) = build_plan([scene], Options(["mujoco"], [1 / 60], ["tuned"], settings=asked), pool).jobs
        (other,) = build_plan(
            [scene], Options(["pymunk"], [1 / 60], ["default"], settings={"iterations": "7"}), pool
        ).jobs
    assert job.method.tried == (("in_turn", False), ("integrator", "RK4"), ("tolerance", 1e-3))
    assert other.method.tried == (("iterations", 7),)  # in no setting of `default`, but in one of `tuned`


@each(
    "settings, words",
    [
        ({"iterations": "2.5"}, "'iterations' of pymunk must be a whole number, got '2.5'"),
        ({"iterations": 2.0}, "'iterations' of pymunk must be a whole number, got '2.0'"),
        ({"iterations": True}, "'iterations' of pymunk must be a whole number, got 'true'"),
        ({"collision_bias": "nan"}, "'collision_bias' of pymunk must be a finite number, got 'nan'"),
        ({"collision_bias": "half"}, "'collision_bias' of pymunk must be a finite number, got 'half'"),
        ({"dt_s": "0.1"}, "dt_s is the time step"),
    ],
)
def test_a_value_of_another_kind_is_refused(settings: dict[str, Setting], words: str) -> None:
    """What a setting can't be is refused before anything is run, with the name, the kind and the value."""
    with InProcessPool() as pool, pytest.raises(InputError, match=words):
        resolve_settings(find_engine("pymunk"), settings, ["tuned"], 1 / 60, pool)


def test_what_a_profile_declares_of_its_own_settings_holds_for_no_others() -> None:
    """PyBullet's shipped settings lose slow bounces, and are skipped there; with the threshold lifted they are run."""
    discs = [disc_at(0, 0, 0.1, 0), disc_at(1.05, 0, 0, 0)]
    scene = Scene(name="slow", discs=discs, duration_s=2.0)
    with InProcessPool() as pool:
        own, tried = (
            build_plan([scene], Options(["pybullet"], [1 / 60], ["default"], settings=settings), pool)
            for settings in ({}, {"restitutionVelocityThreshold": 0.0})
        )
    assert own.methods.find_job_refusal(own.jobs[0]) is not None
    assert tried.methods.find_job_refusal(tried.jobs[0]) is None


def test_a_journal_tells_runs_with_other_settings_apart(scene: Scene, tmp_path: Path) -> None:
    """One job with and without what is tried has two keys, and a journal is not gone on with under other settings."""
    job = Job(scene, Method("pymunk", "tuned"), 1 / 60)
    other = Job(scene, Method("pymunk", "tuned", (("iterations", 5),)), 1 / 60)
    assert build_job_key(job) != build_job_key(other)
    path = tmp_path / "journal.jsonl"
    asked = [Options(["pymunk"], [1 / 60], ["tuned"], settings={"iterations": n}, timing=False) for n in (5, 6)]
    with observed_journal(path, asked[0].stamp) as journal, InProcessPool() as pool:
        execute(build_plan([scene], asked[0], pool), pool, notes=journal)
    with pytest.raises(
        InputError, match=r"its settings is \{'iterations': 5\}, but this study's is \{'iterations': 6\}"
    ):
        observed_journal(path, asked[1].stamp, resume=True)
    with observed_journal(path, asked[0].stamp, resume=True) as journal:
        assert build_job_key(other, DRAWN) in {entry.key for entry in journal.entries.values()}


@each(
    "knob",
    [
        {},
        {"low": 1},
        {"low": 2, "high": 1},
        {"low": 1, "high": 2.0},
        {"low": 0.0, "high": 1.0, "log": True},
        {"low": 0.0, "high": float("nan")},
        {"low": 0.0, "high": 1.0, "choices": (0.0,)},
    ],
)
def test_a_knob_that_can_not_be_turned_is_refused(knob: dict[str, object]) -> None:
    """A knob without a range or choices, with both, or with an empty or endless range is refused when it is made."""
    with pytest.raises(InputError, match="knob"):
        Knob(**knob)  # type: ignore[arg-type] # that is the point
