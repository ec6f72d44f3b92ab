"""Settings that replace those of a profile: parsed by type, used in runs, and shown in reports."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at

import carom
from carom import Scene
from carom.engines.api import Knob
from carom.errors import InputError
from carom.execution.describe_engines import find_engine
from carom.execution.pool import Pool
from carom.model.trace import Setting
from carom.report.junit import render_junit
from carom.report.render.markdown import render_markdown
from carom.report.results_file.results_jsonl import format_records
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import Plan, build_plan, resolve_settings
from carom.studies.cross_check.run import execute
from carom.studies.diff.compare_records import compare_records


@pytest.fixture
def scene() -> Scene:
    """Two discs that meet off their centres after about half a second."""
    return Scene(name="aside", discs=[disc_at(0, 0, 2, 0), disc_at(2, 0.6, 0, 0)], duration_s=1.5)


def plan_run(scene: Scene, engine: str, profile: str, settings: Mapping[str, Any], pool: Pool) -> Plan:
    """Return the plan of one run with other settings."""
    return build_plan([scene], Options([engine], [1 / 60], [profile], settings=settings, timing=False), pool)


def run_with_settings(scene: Scene, **settings: Setting) -> carom.Results:
    with InProcessPool() as pool:
        return execute(plan_run(scene, "mujoco", "tuned", settings, pool), pool)


@pytest.mark.usefixtures("in_process")
def test_run_uses_and_shows_changed_settings(scene: Scene) -> None:
    """A run with another integrator has it in its settings, and its text shows it with the profile."""
    found = carom.run(scene, "mujoco", dt=1 / 60, settings={"integrator": "RK4"})
    assert (found.settings["integrator"], found.overrides) == ("RK4", {"integrator": "RK4"})
    assert "mujoco (tuned with integrator=RK4)" in repr(found)


def test_reports_show_changed_settings_with_the_profile(scene: Scene) -> None:
    """Markdown, JSON lines and JUnit show the changed settings wherever they name the profile."""
    results = run_with_settings(scene, integrator="RK4")
    row = json.loads(format_records(results).splitlines()[1])
    assert (row["profile"], row["tried"]) == ("tuned", {"integrator": "RK4"})
    text = render_markdown(cross_check_document(results))
    told = [line for line in text.splitlines() if "mujoco" in line and "tuned" in line]
    assert told
    assert all("integrator" in line for line in told)
    assert 'name="mujoco tuned with integrator=RK4"' in render_junit(results)


def test_diff_compares_changed_settings_with_the_profile(scene: Scene, tmp_path: Path) -> None:
    """A diff of runs with and without a changed setting compares their cells and names the setting as a cause."""
    for name, settings in (("own", {}), ("tried", {"integrator": "RK4"})):
        (tmp_path / name).write_text(format_records(run_with_settings(scene, **settings)))
    (change,) = compare_records(tmp_path / "own", tmp_path / "tried").changes
    assert change.method == "mujoco tuned → mujoco tuned with integrator=RK4"
    assert any(cause.startswith("settings: integrator Euler → RK4") for cause in change.causes)


def test_setting_values_are_parsed_by_type(scene: Scene) -> None:
    """A text is parsed as the bool, integer, float or text that the setting has in one of the engine's profiles."""
    asked = {"in_turn": "false", "tolerance": "1e-3", "integrator": "RK4"}
    with InProcessPool() as pool:
        (job,) = plan_run(scene, "mujoco", "tuned", asked, pool).jobs
        (other,) = plan_run(scene, "pymunk", "default", {"iterations": "7"}, pool).jobs
    assert job.method.overrides == (("in_turn", False), ("integrator", "RK4"), ("tolerance", 1e-3))
    assert other.method.overrides == (("iterations", 7),)  # in no setting of `default`, but in one of `tuned`


@each(
    "settings, words",
    [
        ({"iterations": "2.5"}, "'iterations' of pymunk must be a whole number, got '2.5'"),
        ({"iterations": 2.0}, "'iterations' of pymunk must be a whole number, got '2.0'"),
        ({"iterations": True}, "'iterations' of pymunk must be a whole number, got 'true'"),
        ({"collision_bias": "nan"}, "'collision_bias' of pymunk must be a finite number, got 'nan'"),
        ({"collision_bias": "half"}, "'collision_bias' of pymunk must be a finite number, got 'half'"),
        ({"dt_s": "0.1"}, "dt_s is the step size"),
    ],
)
def test_setting_value_of_another_type_is_refused(settings: dict[str, Setting], words: str) -> None:
    """A value that a setting can't have is refused with the setting's name, and `dt_s` as the time step."""
    with InProcessPool() as pool, pytest.raises(InputError, match=words):
        resolve_settings(find_engine("pymunk"), settings, ["tuned"], 1 / 60, pool)


def test_limits_of_a_profile_do_not_apply_to_changed_settings() -> None:
    """PyBullet's default settings lose slow bounces and skip the scene; without the threshold the scene is run."""
    scene = Scene(name="slow", discs=[disc_at(0, 0, 0.1, 0), disc_at(1.05, 0, 0, 0)], duration_s=2.0)
    with InProcessPool() as pool:
        changes: list[dict[str, float]] = [{}, {"restitutionVelocityThreshold": 0.0}]
        own, tried = (plan_run(scene, "pybullet", "default", settings, pool) for settings in changes)
    assert own.methods.find_job_refusal(own.jobs[0]) is not None
    assert tried.methods.find_job_refusal(tried.jobs[0]) is None


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
def test_invalid_knob_is_refused(knob: dict[str, object]) -> None:
    """A knob without a range or choices, with both, or with an invalid range is refused when it is built."""
    with pytest.raises(InputError, match="Knob"):
        Knob(**knob)  # type: ignore[arg-type] # that is the point
