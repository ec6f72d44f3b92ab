"""Scores of runs with driven bodies: correct runs are graded well, and a paddle treated as fixed is found wrong."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted.faults import drop_impact
from tests.scene_builders import alter_impact, disc_at, require_value, run_cross_check, staged, wall_at

from carom import Chain, Disc, Scene, Wall, compare, solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator.grades import Grade
from carom.comparator.stepwise import window, window_runs
from carom.comparator.stepwise.body_states import BodyStates
from carom.comparator.stepwise.step_watch import StepWatch
from carom.comparator.verdict import Verdict
from carom.errors import InputError
from carom.model.step_windows import States
from carom.model.trace import Vector
from carom.model.walls import Leg


def build_paddle_scene() -> Scene:
    """A disc that comes at 2 m/s to a wall that comes at 1 m/s: they meet after 1 s."""
    return staged(
        "paddle", disc_at(3.5, 0.0, -2.0), wall_at(0.0, 0.0, 1.0, 0.0, velocity_m_s=(1.0, 0.0)), duration_s=2.0
    )


def build_state(time_s: float, places: list[Vector], velocities: list[Vector]) -> States:
    """Return one state without spins."""
    return States(np.array([time_s]), np.array([places]), np.array([velocities]))


@pytest.mark.long
def test_pit_of_driven_scenes_is_sampled_or_exact_with_exceptions() -> None:
    """PIT is SAMPLED or EXACT in 11 of 14 driven scenes; it tunnels in two, and in driven/piston it is DIVERGED."""
    scenes = [entry.scene for entry in find_scenes(["driven"])]
    grades = {row.job.scene.name: row.grade for row in run_cross_check(scenes, ["pit"], dts=[1 / 60]).rows}
    assert grades.pop("driven/swatter") is Grade.WRONG
    assert grades.pop("driven/fast-cup") is Grade.WRONG
    assert grades.pop("driven/piston") is Grade.DIVERGED
    assert len(grades) == 11
    assert set(grades.values()) == {Grade.SAMPLED, Grade.EXACT}
    found = {name for name, grade in grades.items() if grade is Grade.EXACT}
    assert found == {"driven/start-at-a-touch", "driven/conveyor"}  # at a look, and on a flat floor


@each("dt_s", release_after(1, [1 / 11, 1 / 60]))
def test_pic_with_a_last_step_beyond_the_end_is_exact(dt_s: float) -> None:
    """PIC is EXACT in driven scenes whose last step reaches beyond the scene's end."""
    scenes = [entry.scene for entry in find_scenes(["driven/piston", "driven/paddle-to-and-fro"])]
    rows = run_cross_check(scenes, ["pic"], dts=[dt_s], profiles=["tuned"])
    assert {row.grade for row in rows.rows} == {Grade.EXACT}


def test_paddle_treated_as_fixed_has_velocity_and_energy_errors() -> None:
    """A run that treats a moving wall as fixed is off by 2 of 4 m/s, and lacks all energy that the wall gives."""
    truth = solve_pic(build_paddle_scene())
    wrong = replace(
        alter_impact(truth, 0, velocity_first_after=(2.0, 0.0)),  # -v, where 2 V - v is right
        final_velocity_m_s=np.array([(2.0, 0.0)]),
        final_position_m=np.array([(3.5, 0.0)]),
    )
    score = compare(truth, wrong)
    assert math.isclose(score.total.velocity, 0.5)  # 2 of 4 m/s
    # Of 1/2 m (16 - 4): what the paddle gives, 1 m/s times 6 kg m/s.
    assert math.isclose(score.total.energy, -6.0 / 6.0)


def test_energy_error_is_relative_to_the_work_of_a_driven_wall() -> None:
    """If the disc rests at the start, its energy error is relative to the work of the wall that strikes it."""
    truth = solve_pic(staged("still", disc_at(3.5, 0.0), *build_paddle_scene().walls, duration_s=4.0))
    slower = replace(truth, method="slower", final_velocity_m_s=np.array([(1.0, 0.0)]))
    assert truth.final_velocity_m_s.tolist() == [[2.0, 0.0]]
    assert math.isclose(compare(truth, slower).total.energy, -1.5 / 2.0)  # of 2 kg m/s at 1 m/s


@each("begins, late", [(1.0, 0.0), (0.5, -0.5 / 0.3)])
@each("edge", [False, True])
def test_steps_use_the_leg_of_a_wall_at_their_time(begins: float, late: float, edge: bool) -> None:
    """A wall that starts at 1 s, within a step, strikes a touching disc at that time."""
    # A disc that is turned at 0.5 s is early by 0.5/0.3 steps.
    legs = ({"from_s": 0.0, "velocity_m_s": (0.0, 0.0)}, {"from_s": 1.0, "velocity_m_s": (1.5, 0.0)})
    wall = Chain(points_m=((0.0, -1.0), (0.0, 1.0)), legs=legs) if edge else wall_at(0.0, 0.0, 1.0, 0.0, legs=legs)
    disc = disc_at(0.5, 0.0)
    scene = staged("starts", disc, wall, duration_s=2.0)
    watch = StepWatch(scene, 0.3, 64)
    for step in range(1, 7):
        time_s = step * 0.3
        place, speed = (0.5 + 3.0 * (time_s - begins), 3.0) if time_s > begins else (0.5, 0.0)
        watch.add(build_state(time_s, [(place, 0.0)], [(speed, 0.0)]))
    told = watch.finish()
    (window,) = told.windows
    assert (window["due"], window["missed"], window["velocity"]) == (1, 0, 0.0)
    assert math.isclose(float(window["late_steps"]), late, abs_tol=1e-12)


@each("after, off", [((4.0, 0.0), 0.0), ((2.0, 0.0), 2.0)])
@each("edge", [False, True])
def test_steps_are_compared_with_the_moving_wall(after: tuple[float, float], off: float, edge: bool) -> None:
    """Steps through an impact with a moving wall have no error; steps that treat it as fixed are 2 m/s off."""
    scene, dt_s = build_paddle_scene(), 0.25
    if edge:
        edges = (Chain(points_m=((0.0, -1.0), (0.0, 1.0)), velocity_m_s=(1.0, 0.0)),)
        scene = scene.model_copy(update={"walls": edges})
    watch = StepWatch(scene, dt_s, 64)
    for step in range(1, 9):
        time_s = step * dt_s
        velocity = (-2.0, 0.0) if time_s <= 1.0 else after
        place = 3.5 - 2.0 * time_s if time_s <= 1.0 else 1.5 + after[0] * (time_s - 1.0)
        watch.add(build_state(time_s, [(place, 0.0)], [velocity]))
    (window,) = watch.finish().windows
    assert (window["due"], window["missed"]) == (1, 0)
    assert math.isclose(float(window["velocity"]), off, abs_tol=1e-12)


def test_moving_edge_that_passes_through_a_disc_is_a_miss() -> None:
    """A moving edge that passes through a resting disc is one missed impact, due at contact."""
    scene = staged(
        "swatter",
        disc_at(0.0, 0.0, r=0.125),
        Chain(points_m=((-4.0, -1.0), (-4.0, 1.0)), velocity_m_s=(16.0, 0.0)),
        duration_s=0.5,
    )
    watch = StepWatch(scene, 1 / 16, 64)
    for step in range(1, 9):
        watch.add(build_state(step / 16, [(0.0, 0.0)], [(0.0, 0.0)]))
    told = watch.finish()
    assert [int(window["missed"]) for window in told.windows] == [1]
    assert math.isclose(float(told.meetings[0]["due_s"]), (4.0 - 0.125) / 16.0)


def test_trace_with_a_wrong_wall_velocity_is_refused() -> None:
    """A trace in which a driven wall has another velocity than in the scene raises an InputError."""
    truth = solve_pic(build_paddle_scene())
    wrong = alter_impact(truth, 0, velocity_second_before=(0.0, 0.0))
    with pytest.raises(InputError, match=r"velocity_second_before of impact 0 .* this driven wall has 1, 0"):
        compare(truth, wrong)


def test_impact_after_the_end_is_ignored() -> None:
    """An impact after the scene's end, but within the last step, is neither recorded nor in the final state."""
    scene = staged("late", disc_at(1.0, 0.0, 1.0), wall_at(3.505, 0.0, -1.0, 0.0), duration_s=2.004)
    (row,) = run_cross_check([scene], ["pit"], dts=[1 / 60]).rows
    trace = require_value(row.trace)
    assert len(trace.impacts) == 0
    assert np.allclose(trace.final_position_m, [(3.004, 0.0)], rtol=0.0, atol=1e-12)
    assert trace.final_velocity_m_s.tolist() == [[1.0, 0.0]]


def build_crush_scene() -> Scene:
    """Return a scene with a disc that a wall, approaching at 1 m/s, crushes against a wall at rest after 2 s."""
    return staged(
        "crush",
        disc_at(1.0, 0.0, r=0.25),
        wall_at(0.0, 0.0, 1.0, 0.0),
        wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0)),
        duration_s=3.0,
    )


@each("steps_per_s, expected", release_after(1, [(7.0, 1), (60.0, 4), (55.5, 4)]))
def test_crush_is_compared_while_steps_resolve_its_impacts(steps_per_s: float, expected: int) -> None:
    """In a crush PIC is EXACT and PIT SAMPLED for impacts that steps can resolve; later ones are ignored."""
    results = run_cross_check([build_crush_scene()], ["pic", "pit"], dts=[1 / steps_per_s], profiles=["tuned"])
    assert [row.grade for row in results.rows] == [Grade.EXACT, Grade.SAMPLED]
    scores = [row.score for row in results.rows if row.score is not None]
    assert {score.expected for score in scores} == {expected}  # of impacts at 1.25, 1.625, 1.75, 1.8125, 1.85, ... s
    assert all(score.findings[-1].reason.endswith("after that nothing is compared") for score in scores)


_SLANT = (0.6, 0.8)
_PRESSES = {
    "half-plane": wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0)),
    "edge": Chain(points_m=((2.5, -1.1), (2.5, 1.2)), velocity_m_s=(-1.0, 0.0)),
    "disc": disc_at(3.0, 0.0, -1.0, m=math.inf, driven=True),
}


@each("turned", [(1.0, 0.0), _SLANT])
@each("press", _PRESSES.values())
def test_stepwise_comparison_runs_no_pic_after_a_crush(
    press: Wall | Chain | Disc, turned: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a crush at 2 s PIC is not run for further steps, and no impact is due or missed in them."""
    cos, sin = turned

    def to(x: float, y: float) -> tuple[float, float]:
        return x * cos - y * sin, x * sin + y * cos

    def placed(thing: Any) -> Any:
        told = {
            name: tuple(to(*point) for point in value) if name == "points_m" else to(*value)
            for name in ("point_m", "normal", "points_m", "position_m", "velocity_m_s")
            if (value := getattr(thing, name, None)) is not None
        }
        return type(thing)(**{**thing.model_dump(exclude_unset=True), **told})

    begun, exact_run = list[float](), window_runs.simulate_pic

    def asked(start: BodyStates, *rest: Any) -> Any:
        begun.append(start.time_s)
        return exact_run(start, *rest)

    monkeypatch.setattr(window, "simulate_pic", asked)
    monkeypatch.setattr(window_runs, "MOST_IMPACTS", 50)  # of the window in which it is crushed
    things = [placed(disc_at(1.25, 0.0, -0.5, r=0.25)), placed(build_crush_scene().walls[0]), placed(press)]
    scene = staged("crush", *things, duration_s=3.0)
    dt_s = 0.01
    watch = StepWatch(scene, dt_s, 64)
    for step in range(1, 221):
        time_s = (step + 0.5) * dt_s  # so that the crush is within a step
        place, speed = (1.25 - 0.5 * time_s, -0.5) if time_s < 2.0 else (0.25 + 0.02 * (step % 2), (-1.0) ** step)
        rows, speeds = [to(place, 0.0), to(3.0 - time_s, 0.0)], [to(speed, 0.0), to(-1.0, 0.0)]
        n = len(scene.discs)
        watch.add(build_state(time_s, rows[:n], speeds[:n]))
    told = watch.finish()
    assert any(time_s < 2.0 for time_s in begun)
    assert not any(time_s > 2.0 for time_s in begun)
    after = told.windows[told.windows["begin_s"] > 2.0]
    assert len(after) >= 2
    assert not np.any(after["due"])
    assert not np.any(after["missed"])


def test_impact_missed_before_a_crush_is_wrong() -> None:
    """A run without the second of its impacts, many steps before a crush, is WRONG."""
    truth = solve_pic(build_crush_scene())
    assert compare(truth, replace(drop_impact(truth, 1), dt_s=1 / 60)).grade is Grade.WRONG


def test_normals_after_a_crush_are_not_compared() -> None:
    """Reversed normals give WRONG_NORMAL before a crush at 2 s, and no verdict after it."""
    edges = [Chain(points_m=((0.0, -1.0), (0.0, 1.0))), _PRESSES["edge"]]
    scene = build_crush_scene().model_copy(update={"walls": tuple(edges)})
    truth, seen = solve_pic(scene), solve_pit(scene)
    for reversed_late in (True, False):
        impacts = seen.impacts.copy()
        impacts["normal"][(impacts["time_s"] > 2.0) == reversed_late] *= -1.0
        verdicts = {finding.verdict for finding in compare(truth, replace(seen, impacts=impacts)).findings}
        assert (Verdict.WRONG_NORMAL in verdicts) is not reversed_late
    assert seen.impacts["time_s"][-1] > 2.0


@each("legs, scored", [((0.0,), 1), ((0.0, 0.25), 0)])
def test_impact_with_a_disc_on_several_legs_has_no_local_error(legs: tuple[float, ...], scored: int) -> None:
    """The local error of an impact with a driven disc is scored only if the disc's path has one leg."""
    path = [Leg(from_s=begin_s, velocity_m_s=(-0.5, 0.0)) for begin_s in legs]
    mallet = disc_at(2.5, 0.0, m=math.inf, driven=True, legs=path)
    disc = disc_at(0.0, 0.0, 1.0)
    truth = solve_pic(staged("mallet", disc, mallet, duration_s=2.0))
    assert len(truth.impacts) == 1
    assert compare(truth, truth).local.scored == scored
