"""Scores of runs with driven bodies: correct runs are graded well, and a paddle treated as fixed is found wrong."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.planted.faults import drop_impact
from tests.scene_builders import alter_impact, disc_at, drive_on_legs, run_cross_check, staged, wall_at

from carom import Chain, Disc, Scene, Wall, compare, solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator.grades import Grade
from carom.comparator.stepwise import window_runs
from carom.comparator.stepwise.step_watch import StepWatch
from carom.comparator.verdict import Verdict
from carom.model.step_windows import LocalTruth, States
from carom.model.trace import Vector


def build_paddle_scene() -> Scene:
    """A disc that comes at 2 m/s to a wall that comes at 1 m/s: they meet after 1 s."""
    return staged(
        "paddle", disc_at(3.5, 0.0, -2.0), wall_at(0.0, 0.0, 1.0, 0.0, velocity_m_s=(1.0, 0.0)), duration_s=2.0
    )


def build_state(time_s: float, places: list[Vector], velocities: list[Vector]) -> States:
    """Return one state without spins."""
    return States(np.array([time_s]), np.array([places]), np.array([velocities]))


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
    )
    score = compare(truth, wrong)
    assert math.isclose(score.total.velocity, 0.5)  # 2 of 4 m/s
    # Of 1/2 m (16 - 4): what the paddle gives, 1 m/s times 6 kg m/s.
    assert math.isclose(score.total.energy, -6.0 / 6.0)
    # If the disc rests at the start, the scale is the work of the wall: 2 kg m/s at 1 m/s.
    truth = solve_pic(staged("still", disc_at(3.5, 0.0), *truth.scene.walls, duration_s=4.0))
    assert truth.final_velocity_m_s.tolist() == [[2.0, 0.0]]
    slower = replace(truth, final_velocity_m_s=np.array([(1.0, 0.0)]))
    assert math.isclose(compare(truth, slower).total.energy, -1.5 / 2.0)


def test_impact_with_a_driven_wall_before_the_start_is_reported() -> None:
    """An impact with a moving wall at a negative time has a wrong time stamp."""
    truth = solve_pic(build_paddle_scene())
    assert Verdict.WRONG_STAMP in compare(truth, alter_impact(truth, 0, time_s=-1.0)).verdicts


def watch_disc(scene: Scene, dt_s: float, path: Callable[[float], tuple[float, float]]) -> LocalTruth:
    """Return the stepwise comparison of a run with one disc on the x axis; `path` returns its position and velocity."""
    watch = StepWatch(scene, dt_s, 64)
    for step in range(1, scene.step_count(dt_s) + 1):
        place, speed = path(step * dt_s)
        watch.add(build_state(step * dt_s, [(place, 0.0)], [(speed, 0.0)]))
    return watch.finish()


@each("begins, late", [(1.0, 0.0), (0.5, -0.5 / 0.25)])
@each("edge", [False, True])
def test_steps_use_the_leg_of_a_wall_at_their_time(begins: float, late: float, edge: bool) -> None:
    """A wall that starts at 1 s strikes a touching disc at that time; a disc that is turned at 0.5 s is early."""
    legs = drive_on_legs((0.0, (0.0, 0.0)), (1.0, (1.5, 0.0)))
    wall = Chain(points_m=((0.0, -1.0), (0.0, 1.0)), **legs) if edge else wall_at(0.0, 0.0, 1.0, 0.0, **legs)
    scene = staged("starts", disc_at(0.5, 0.0), wall, duration_s=2.0)
    found = watch_disc(scene, 0.25, lambda t: (0.5 + 3.0 * (t - begins), 3.0) if t > begins else (0.5, 0.0))
    (window,) = found.windows
    assert (window["due"], window["missed"], window["velocity"]) == (1, 0, 0.0)
    assert math.isclose(float(window["late_steps"]), late, abs_tol=1e-12)


@each("speed, off", [(4.0, 0.0), (2.0, 2.0)])
def test_steps_are_compared_with_the_moving_wall(speed: float, off: float) -> None:
    """Steps through an impact with a moving wall have no error; steps that treat it as fixed are 2 m/s off."""
    found = watch_disc(
        build_paddle_scene(), 0.25, lambda t: (3.5 - 2.0 * t, -2.0) if t <= 1.0 else (1.5 + speed * (t - 1.0), speed)
    )
    (window,) = found.windows
    assert (window["due"], window["missed"]) == (1, 0)
    assert math.isclose(float(window["velocity"]), off, abs_tol=1e-12)


def test_moving_edge_that_passes_through_a_disc_is_a_miss() -> None:
    """A moving edge that passes through a resting disc is one missed impact, due at contact."""
    swatter = Chain(points_m=((-4.0, -1.0), (-4.0, 1.0)), velocity_m_s=(16.0, 0.0))
    scene = staged("swatter", disc_at(0.0, 0.0, r=0.125), swatter, duration_s=0.5)
    found = watch_disc(scene, 1 / 16, lambda _: (0.0, 0.0))
    assert [int(window["missed"]) for window in found.windows] == [1]
    assert math.isclose(float(found.meetings[0]["due_s"]), (4.0 - 0.125) / 16.0)


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
    """In a crush PIC is EXACT, PIT SAMPLED, and a missed impact WRONG, until steps can't resolve impacts."""
    results = run_cross_check([build_crush_scene()], ["pic", "pit"], dts=[1 / steps_per_s], profiles=["tuned"])
    assert [row.grade for row in results.rows] == [Grade.EXACT, Grade.SAMPLED]
    scores = [row.score for row in results.rows if row.score is not None]
    assert {score.expected for score in scores} == {expected}  # of impacts at 1.25, 1.625, 1.75, 1.8125, 1.85, ... s
    assert all(score.findings[-1].reason.endswith("after that nothing is compared") for score in scores)
    truth = solve_pic(build_crush_scene())
    assert compare(truth, replace(drop_impact(truth, 0), dt_s=1 / steps_per_s)).grade is Grade.WRONG


_PRESSES = [
    wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0)),
    Chain(points_m=((2.5, -1.1), (2.5, 1.2)), velocity_m_s=(-1.0, 0.0)),
    disc_at(3.0, 0.0, -1.0, m=math.inf, driven=True),
]


@each("press", _PRESSES)
def test_no_impact_is_due_after_a_crush(press: Wall | Chain | Disc, monkeypatch: pytest.MonkeyPatch) -> None:
    """After a crush at 2 s, between steps, no impact is due or missed, although the disc goes to and fro."""
    monkeypatch.setattr(window_runs, "MOST_IMPACTS", 50)  # of the window in which it is crushed
    scene = staged("crush", disc_at(1.25, 0.0, -0.5, r=0.25), build_crush_scene().walls[0], press, duration_s=3.0)
    watch = StepWatch(scene, 0.01, 64)
    for step in range(1, 221):
        time_s = (step + 0.5) * 0.01
        place, speed = (1.25 - 0.5 * time_s, -0.5) if time_s < 2.0 else (0.25 + 0.02 * (step % 2), (-1.0) ** step)
        places, speeds = [(place, 0.0), (3.0 - time_s, 0.0)], [(speed, 0.0), (-1.0, 0.0)]
        discs = len(scene.discs)
        watch.add(build_state(time_s, places[:discs], speeds[:discs]))
    windows = watch.finish().windows
    after = windows[windows["begin_s"] > 2.0]
    assert len(after) >= 2
    assert not np.any(after["due"])
    assert not np.any(after["missed"])


def test_normals_after_a_crush_are_not_compared() -> None:
    """Reversed normals give WRONG_NORMAL before a crush at 2 s, and no verdict after it."""
    edges = [Chain(points_m=((0.0, -1.0), (0.0, 1.0))), _PRESSES[1]]
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
    path = drive_on_legs(*((begin_s, (-0.5, 0.0)) for begin_s in legs))
    mallet = disc_at(2.5, 0.0, m=math.inf, driven=True, **path)
    disc = disc_at(0.0, 0.0, 1.0)
    truth = solve_pic(staged("mallet", disc, mallet, duration_s=2.0))
    assert len(truth.impacts) == 1
    assert compare(truth, truth).local.scored == scored
