"""Every step of a run compared with PIC from the run's own state: what must hold of the catalogue, and of blocks."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.planted.altered_runs import record_pic
from tests.random_scenes import draw_scene, draw_table_friction_scene
from tests.scene_builders import disc_at, drive_on_legs, require_value, staged, wall_at

from carom import Chain, Scene
from carom.catalogue.find_scenes import all_scenes
from carom.comparator import Grade, compute_local_truth
from carom.comparator.measure.stepwise_score import LocalScore, score_steps
from carom.comparator.scales import compute_scales
from carom.comparator.stepwise import step_watch
from carom.comparator.stepwise.step_watch import StepWatch
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom.model.step_windows import LocalTruth, States
from carom.model.trace import Outcome
from carom.solvers.pic import solve_pic

GROUPS = [*dict.fromkeys(entry.group for entry in all_scenes().values())]


def draw_damped_scene(number: int) -> Scene:
    """Draw a scene, with friction if the number is odd, that is damped by up to a tenth a step."""
    scene = draw_scene("anywhere", number, rough=number % 2 == 1)
    return Scene(**{**dict(scene), "damping_per_s": (0.1, 1.0, 6.0)[number % 3], "duration_s": 3.0})


def collect_scenes(kind: str, numbers: Iterable[int]) -> list[Scene]:
    """Return the scenes with these numbers of a group of the catalogue, or of a kind of random scenes."""
    if kind == "damped":
        return [draw_damped_scene(number) for number in numbers]
    if kind == "slowing":
        return [draw_table_friction_scene(number) for number in numbers]
    scenes = [entry.scene for entry in all_scenes().values() if entry.group == kind]
    return [scenes[number] for number in numbers if number < len(scenes)]


#: Kinds and numbers of scenes. Two of the damped ones, 24 and 38, come deep into a wall in a last step of 1.4 s, or
#: meet at what damping has left of their speed.
SCENES = [
    *(("paper", range(9)), ("classics", range(0, 99, 8)), ("damped", (0, 1, 2, 24, 38)), ("slowing", range(2))),
    *(pytest.param(group, range(99), marks=pytest.mark.long) for group in GROUPS),
    pytest.param("damped", range(40), marks=pytest.mark.long),
    pytest.param("slowing", range(150), marks=pytest.mark.long),
]


def compute_steps(scene: Scene, name: str) -> LocalTruth:
    return require_value(observe_run(load_adapter(name), scene, "tuned", 1.0 / scene.frame_rate_hz).local_truth)


def score_states(scene: Scene, states: States, dt_s: float) -> LocalScore:
    return score_steps(compute_local_truth(scene, states, dt_s=dt_s), compute_scales(scene, solve_pic(scene)), 64)


@each("kind, numbers", SCENES)
def test_steps_of_pic_are_exact_and_steps_of_pit_pay_its_price(kind: str, numbers: Iterable[int]) -> None:
    """Every step of PIC is exact; steps of PIT miss only what PIT misses there, with errors of at most PIT's."""
    for scene in collect_scenes(kind, numbers):
        reference = solve_pic(scene, max_impacts=2000)
        if reference.outcome is Outcome.GLIDES:  # of infinitely many hops
            continue
        scales, steps = compute_scales(scene, reference), compute_steps(scene, "pic")
        if reference.outcome is Outcome.CRUSHED:  # in the step in which that comes impacts have no end
            steps = replace(steps, windows=steps.windows[steps.windows["end_s"] <= reference.end_time_s])
        exact, sampled = score_steps(steps, scales, 64), score_steps(compute_steps(scene, "pit"), scales, 64)
        assert (exact.missed, exact.invented, exact.early, exact.ahead, exact.drifts) == (0, 0, 0, 0, 0), scene.name
        # At a tie PIC from a state that is an ulp away may take the other admissible order.
        tied = reference.ambiguous and (exact.grade is Grade.SAMPLED or exact.agrees_alone)
        assert tied or exact.grade is Grade.EXACT, scene.name
        assert (sampled.invented, sampled.early, sampled.drifts) == (0, 0, 0), scene.name
        assert sampled.missed == sampled.missed_by_pit, scene.name
        assert sampled.ratio[1] > 0.9 or scene.name != "paper/late"  # .9 of a frame late
        assert not sampled.ratio[1] > 1.0 + 1e-9, scene.name  # NaN where nothing stands alone


def test_stepwise_results_do_not_depend_on_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows, meetings and slips of a run are the same, whether it is processed in one block or in many."""
    scene = all_scenes()["classics/gas"].scene
    states = record_pic(scene).states
    whole = compute_local_truth(scene, states, dt_s=1 / 60)
    pieces = compute_in_small_blocks(monkeypatch, scene, states, 1 / 60)
    assert len(whole.windows) > 20
    for name in ("windows", "meetings", "slips"):
        one, other = getattr(pieces, name), getattr(whole, name)
        assert [
            field for field in one.dtype.names if not np.array_equal(one[field], other[field], equal_nan=True)
        ] == []
    assert (pieces.steps, pieces.until_s) == (whole.steps, whole.until_s)


def compute_in_small_blocks(monkeypatch: pytest.MonkeyPatch, scene: Scene, states: States, dt_s: float) -> LocalTruth:
    """Return the result of `compute_local_truth` for states that arrive one by one and are analysed in small blocks."""
    monkeypatch.setattr(step_watch, "_NUMBERS", 1)
    watch = StepWatch(scene, dt_s)
    for step in range(1, len(states)):
        watch.add(states.select_rows(slice(step, step + 1)))
    return watch.finish()


def test_sinking_depth_does_not_depend_on_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball that sinks by 0.1 m, or 0.2 radii, in 10 s has that depth in one block and in many."""
    disc = disc_at(0, 0.5, r=0.5)
    scene = staged("sinking", disc, wall_at(0, 0, 0, 1), duration_s=10.0, gravity_m_s2=(0.0, -10.0))
    times = np.arange(601, dtype=np.float64) / 60
    place = np.stack([np.zeros_like(times), 0.5 - 0.01 * times], axis=1)[:, None]
    states = States(times, place, np.zeros_like(place))
    whole = compute_local_truth(scene, states, dt_s=1 / 60)
    pieces = compute_in_small_blocks(monkeypatch, scene, states, 1 / 60)
    assert whole.sunk_radii == pytest.approx(0.1 / 0.5, rel=1e-9)
    assert (pieces.sunk_radii, pieces.resting_steps) == (whole.sunk_radii, whole.resting_steps)


def test_slow_fall_onto_a_fixed_disc_is_due_at_contact() -> None:
    """A disc that falls 1 m from rest at 0.5 m/s^2 onto a fixed disc is due after exactly 2 s."""
    # On a straight path it would never arrive.
    bodies = disc_at(0.0, 2.0), disc_at(0.0, 0.0, m=math.inf)
    scene = staged("slow", *bodies, gravity_m_s2=(0.0, -0.5), duration_s=3.0, frame_rate_hz=8.0)
    assert compute_steps(scene, "pic").meetings["due_s"].tolist() == [2.0]


def test_push_on_leaving_a_floor_is_an_invented_impact() -> None:
    """A push of 5 m/s in the step in which a disc leaves the floor is an invented impact."""
    # It is no rest: 2.5 steps of falling are 0.4 m/s.
    dt_s = 1 / 60
    bodies = disc_at(0.0, 0.5, 0.0, 2.0), wall_at(0.0, 0.0, 0.0, 1.0)
    scene = staged("pushed", *bodies, gravity_m_s2=(0.0, -10.0), duration_s=0.25)
    times = np.arange(16, dtype=np.float64) * dt_s
    heights, speeds = 0.5 + 2.0 * times - 5.0 * times**2, 2.0 - 10.0 * times
    heights[1:] += 5.0 * (times[1:] - dt_s)
    speeds[1:] += 5.0
    place, velocity = (np.stack([0.0 * times, part], axis=1)[:, None] for part in (heights, speeds))
    found = score_states(scene, States(times, place, velocity), dt_s)
    assert (found.invented, found.missed, found.early) == (1, 0, 0)


def test_state_at_an_unchanged_time_adds_no_step() -> None:
    """A state at the same time as the one before, alone or among others, adds no step."""
    scene = staged("flight", disc_at(0.0, 0.0, 1.0, 0.0), duration_s=1.0)
    times_s = np.array([0.0, 0.25, 0.25, 0.5, 0.5, 0.75])
    places = np.stack([times_s, np.zeros_like(times_s)], axis=1)[:, None]
    states = States(times_s, places, np.tile(scene.arrays.velocity_m_s, (len(times_s), 1, 1)))
    watch = StepWatch(scene, 0.25)
    for part in (slice(0, 1), slice(1, 2), slice(2, 3), slice(3, 6)):
        watch.add(states.select_rows(part))
    found = watch.finish()
    assert (found.steps, found.until_s, found.slip_counts) == (3, 0.75, (0, 0))


def test_impact_of_a_floor_that_starts_to_rise_is_not_invented() -> None:
    """A disc at rest on a floor that begins to rise within a step has one impact in PIT, and it is due."""
    rises = drive_on_legs((0.0, (0.0, 0.0)), (0.53, (0.0, 1.0)))
    floor = Chain(points_m=[(9.0, 0.0), (-9.0, 0.0)], **rises)
    scene = staged("rises", disc_at(0.0, 0.5), floor, gravity_m_s2=(0.0, -4.0), duration_s=1.0, frame_rate_hz=16.0)
    found = score_steps(compute_steps(scene, "pit"), compute_scales(scene, solve_pic(scene)), 64)
    assert (found.due, found.invented) == (1, 0)


def test_largest_change_of_a_spin_is_relative_to_the_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    r"""A disc's largest change of spin is the one largest relative to the disc's speed, in one block or in many.

    The rim speed of a falling disc changes by 0.002 m/s below 1 m/s, and by 0.004 m/s above 3 m/s.
    """
    times = np.arange(257, dtype=np.float64) / 64
    scene = staged("spins", disc_at(0.0, 0.0, spin_rad_s=1.0), gravity_m_s2=(0.0, -1.0), duration_s=4.0)
    place, velocity = (np.stack([0.0 * times, part], axis=1)[:, None] for part in (-(times**2) / 2, -times))
    spins = 1.0 + 0.004 * (times > 0.5) + 0.008 * (times > 3.5)
    states = States(times, place, velocity, spins[:, None])
    whole = compute_local_truth(scene, states, dt_s=1 / 64)
    pieces = compute_in_small_blocks(monkeypatch, scene, states, 1 / 64)
    assert whole.slips["time_s"].tolist() == pieces.slips["time_s"].tolist() == [0.5]
    assert whole.slips["rim"] == pytest.approx([0.002], rel=1e-12)


def test_every_invented_change_is_counted_once() -> None:
    """Each step in which a lone disc changes its velocity, its spin or both is one invention; the first is named."""
    scene = staged("turns", disc_at(-9.0, 0.0), disc_at(9.0, 0.0, vx=1.0, spin_rad_s=1.0), duration_s=1.0)
    times = np.arange(11) / 10
    velocity = np.zeros((11, 2, 2))
    velocity[:, 1, 0] = 1.0 + 0.1 * sum(times > turn for turn in (0.35, 0.55, 0.75))
    place = np.tile(scene.arrays.position_m, (11, 1, 1))
    place[1:, 1, 0] += np.cumsum(velocity[1:, 1, 0]) / 10
    spins = np.ones((11, 2)) * [0.0, 1.0] + [0.0, 0.5] * (times > 0.55)[:, None]
    found = compute_local_truth(scene, States(times, place, velocity, spins), dt_s=0.1)
    score = score_steps(found, compute_scales(scene, solve_pic(scene)), 64)
    assert (score.invented, score.first_invented, score.first_invented_s) == (3, "at 0.3 s, of disc 1", 0.3)
    before = found.clip_to(0.2)
    assert (before.invented, before.first_inventor) == (0, -1)


@each(
    "body",
    [
        wall_at(0.0, 0.5, 0.0, -1.0),
        Chain(points_m=[(-3.0, 0.5), (3.0, 0.5)]),
        wall_at(0.5, 0.0, -1.0, 0.0),
        disc_at(0.3, 0.98, r=0.5247856705360713, m=math.inf),
    ],
)
def test_disc_that_hangs_on_a_body_above_or_beside_it_is_wrong(body: Any) -> None:
    """A disc that stays under a ceiling or next to a wall does not rest: PIC falls, so its steps are wrong."""
    scene = staged("hangs", disc_at(0.0, 0.0), body, gravity_m_s2=(0.0, -10.0), duration_s=1.0)
    times = np.arange(101) / 100
    place, velocity = (np.tile(array, (101, 1, 1)) for array in (scene.arrays.position_m, scene.arrays.velocity_m_s))
    score = score_states(scene, States(times, place, velocity), 0.01)
    assert score.resting_steps == 0
    assert score.grade is Grade.WRONG


def test_disc_in_a_corner_rests_on_both_walls() -> None:
    """A disc between a slope and a vertical wall rests on both: gravity presses it on the slope, and so on the wall."""
    half = math.sqrt(0.5)
    walls = [wall_at(0.5, 0.0, -1.0, 0.0), wall_at(0.5 * half, -0.5 * half, -half, half)]
    scene = staged("corner", disc_at(0.0, 0.0), *walls, gravity_m_s2=(0.0, -10.0), duration_s=1.0, restitution=0.0)
    times = np.arange(101) / 100
    place, velocity = (np.tile(array, (101, 1, 1)) for array in (scene.arrays.position_m, scene.arrays.velocity_m_s))
    velocity[1::2, 0, 0] = 0.01  # the engine's contact solver moves it against the wall
    assert score_states(scene, States(times, place, velocity), 0.01).invented == 0
