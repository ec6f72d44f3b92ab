"""Runs with damping: comparison with runs without it, and refusals."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.random_scenes import draw_scene
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import EventDrivenRun, Outcome, Scene, SceneError, solve_pic, solve_pit
from carom.engines.api import Capabilities, unsupported_reason
from carom.errors import InputError
from carom.solvers.pic import start_pic_run

RATES = st.sampled_from([0.01, 0.4, 1.0])
SCENES = st.integers(0, 9_999).map(
    lambda number: draw_scene("anywhere", number, rough=number % 2 == 1).model_copy(update={"duration_s": 3.0})
)


def build_box(**more: float) -> Scene:
    """Return two discs that spin, in a box with friction, which meet each other and the walls some times."""
    given = {"duration_s": 3.0, "restitution": 0.9, "wall_restitution": 0.8, "friction": 0.3, "wall_friction": 0.2}
    one, two = disc_at(-1.0, 0.1, 3.0, 1.0, spin_rad_s=2.0), disc_at(1.0, -0.2, -1.0, 2.0, m=2.0)
    walls = [wall_at(-3, 0, 1, 0), wall_at(3, 0, -1, 0), wall_at(0, -3, 0, 1), wall_at(0, 3, 0, -1)]
    return staged("box", one, two, *walls, **(given | more))


@given(SCENES, RATES)
def test_damped_run_is_the_undamped_run_at_later_times(scene: Scene, rate: float) -> None:
    """A damped PIC run has the undamped run's impacts, at later times and with smaller velocities, to 1e-14."""
    damped = scene.model_copy(update={"damping_per_s": rate})
    end = -math.expm1(-rate * scene.duration_s) / rate
    plain, trace = solve_pic(scene, until_s=end), solve_pic(damped)
    count = len(trace.impacts)
    assert abs(count - len(plain.impacts)) <= np.sum(plain.impacts["time_s"] > end * (1 - 1e-12))
    plain_times = plain.impacts["time_s"][:count]
    assert trace.impacts["time_s"] == pytest.approx(-np.log1p(-rate * plain_times) / rate, rel=1e-14)
    kept = (1.0 - rate * plain_times)[:, None]
    for name in ("velocity_first_before", "velocity_second_before", "velocity_first_after", "velocity_second_after"):
        assert trace.impacts[name] == pytest.approx(plain.impacts[name][:count] * kept, rel=1e-14)
    assert trace.impacts["normal"].tobytes() == plain.impacts["normal"][:count].tobytes()


def test_spin_decays_like_velocity() -> None:
    """A free disc ends with exp(-c T) of its velocity and spin, in PIC and in PIT."""
    scene = staged("alone", disc_at(0, 0, 2, r=1, spin_rad_s=3), duration_s=2.0, damping_per_s=0.7)
    for trace in (solve_pic(scene), solve_pit(scene)):
        assert require_value(trace.final_spin_rad_s)[0] == pytest.approx(3 * math.exp(-1.4), rel=1e-15)
        assert trace.final_velocity_m_s[0].tolist() == pytest.approx([2 * math.exp(-1.4), 0.0], rel=1e-15)
        assert trace.final_position_m[0].tolist() == pytest.approx([2 * (1 - math.exp(-1.4)) / 0.7, 0.0], rel=1e-15)


def test_damped_pit_reports_exact_frame_times() -> None:
    """Every impact of PIT with damping is exactly at a frame; the first is less than one frame late."""
    scene = build_box(damping_per_s=0.4)
    first, found = solve_pic(scene).impacts[0], solve_pit(scene, frame_rate_hz=60.0).impacts
    assert set(found["time_s"].tolist()) <= {k / 60.0 for k in range(181)}
    assert 0.0 <= found["time_s"][0] - first["time_s"] < 1 / 60


def test_zero_damping_changes_neither_bits_nor_scene_file() -> None:
    """A damping of 0 is not saved, makes an equal scene, and changes no bit of a run."""
    scene, named = build_box(), build_box(damping_per_s=0.0)
    assert scene == named
    assert "damping_per_s" not in named.model_dump()
    assert "damping_per_s" in build_box(damping_per_s=0.1).model_dump()
    assert solve_pic(scene).impacts.tobytes() == solve_pic(named).impacts.tobytes()
    assert scene.undamped is scene
    assert build_box(damping_per_s=0.1).undamped == scene
    assert solve_pit(scene).counts["frames_looked_at"] < 181  # so it is the compiled form


def test_samples_windows_and_limits_use_scene_time() -> None:
    """Samples, windows and end times of a damped run are at the requested scene times, to the bit."""
    scene = build_box(damping_per_s=0.4)
    whole = solve_pic(scene, sample_times_s=[0.5, 1.5])
    times = whole.impacts["time_s"].tolist()
    for k, time_s in enumerate((0.5, 1.5)):
        until = solve_pic(scene, until_s=time_s)
        assert until.end_time_s == time_s
        assert require_value(whole.samples).position_m[k].tobytes() == until.final_position_m.tobytes()
    window = solve_pic(scene, window_s=(times[1], times[-2]))
    assert window.impacts.tobytes() == whole.impacts[1:-1].tobytes()
    assert require_value(window.impacts_per_disc).tolist() == np.asarray(whole.impacts_per_disc).tolist()
    first = solve_pic(scene, max_impacts=2)
    assert first.outcome is Outcome.MAX_IMPACTS
    assert first.end_time_s == times[1]
    assert solve_pic(scene, until_s=times[2]).impacts.tobytes() == whole.impacts[:3].tobytes()


def test_progress_of_a_damped_run_is_within_the_scene() -> None:
    """A damped run reports progress, at times no later than the scene's end."""
    heard = list[float]()
    solve_pic(build_box(damping_per_s=2.0, duration_s=50.0), progress=lambda _, time_s: heard.append(time_s))
    assert heard
    assert max(heard) <= 50.0


def test_damped_run_to_infinity_ends_at_the_rest_position() -> None:
    """A disc at 3 m/s with a damping of 0.5 per second, advanced to infinity, stops after v/c = 6 m."""
    scene = staged("alone", disc_at(0, 0, 3, 0), duration_s=1.0, damping_per_s=0.5)
    run = start_pic_run(scene)
    assert run.advance_to(math.inf) is Outcome.COMPLETED
    assert run.positions()[0, 0] == pytest.approx(6.0, rel=1e-15)


def test_damping_is_refused_with_gravity_tc_model_and_bare_kernel() -> None:
    """Damping with gravity, with a contact time (TC model) or in EventDrivenRun raises an error."""
    with pytest.raises(SceneError, match=r"must be 0 in a scene with gravity, got 0\.4"):
        staged("falls", disc_at(0, 0, 0, 0), duration_s=1.0, damping_per_s=0.4, gravity_m_s2=(0.0, -9.81))
    scene = build_box(damping_per_s=0.4)
    with pytest.raises(InputError, match="contact_duration_s must be 0 in a scene with damping"):
        solve_pic(scene, contact_duration_s=0.1)
    with pytest.raises(InputError, match="EventDrivenRun does not support damping"):
        EventDrivenRun(scene)


def test_adapter_without_damping_support_is_skipped_with_a_reason() -> None:
    """The reason to skip an adapter names damping unless the adapter declares support for it."""
    able = Capabilities(restitution=(0.0, 1.0), friction=(0.0, sys.float_info.max), spin=True, damping=True)
    scene = build_box(damping_per_s=0.4)
    assert unsupported_reason(scene, able, 0.01) == ""
    reason = unsupported_reason(scene, replace(able, damping=False), 0.01)
    assert reason == "the scene has damping, which this method does not support"
