"""Runs with damping and on tables are compared by their law: correct runs are exact, and errors are found."""

import math
from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Scene, Trace, compare, solve_pic
from carom.catalogue import find_scenes
from carom.comparator import Grade, Score, Verdict
from carom.comparator.shifted_scenes import shift_start
from carom.engines.api import Adapter, Setting, World
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom_adapters.pic import PicAdapter

#: Steps of damped scenes, and of those on tables.
DT_S, TABLE_DT_S = 1 / 240, 1 / 60
DAMPED = [entry.scene for entry in find_scenes(["contact/damped-*"]) if len(entry.known.impacts)]
ON_TABLES = [entry.scene for entry in find_scenes(["contact/table-*"])]
#: Grades of runs with another law.
TOO_SLOW_OR_FAST = {Grade.INACCURATE, Grade.WRONG, Grade.DIVERGED_INACCURATE}
each_damped = each("scene", release_after(2, reversed(DAMPED)))
#: Two discs that meet aside from the line of their centres, at no step's end.
PAIR = staged(
    "pair",
    disc_at(0.0, 0.0, 2.0, 0.1, r=0.25),
    disc_at(1.7, 0.2, 0.0, -0.1, r=0.25),
    table_deceleration_m_s2=0.8,
    duration_s=2.0,
)


class Otherwise(PicAdapter):
    """PIC of a scene in which some fields are others, by these factors."""

    def __init__(self, **factors: float) -> None:
        self._factors = factors

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        """Run that scene."""
        changed = {name: factor * getattr(scene, name) for name, factor in self._factors.items()}
        return super().prepare(scene.model_copy(update=changed), settings)


@cache
def run_pic_and_pit(scene: Scene, dt_s: float) -> tuple[Trace, Trace]:
    """PIC's and PIT's traces."""
    return solve_pic(scene), observe_run(load_adapter("pit"), scene, "tuned", dt_s)


def score_adapter(scene: Scene, adapter: Adapter) -> Score:
    dt_s = DT_S if scene.damping_per_s else TABLE_DT_S
    reference, sampling = run_pic_and_pit(scene, dt_s)
    return compare(reference, observe_run(adapter, scene, "tuned", dt_s), sampling=sampling)


def compute_rim_speed_ratio(scene: Scene) -> float:
    """Return how much faster than the disc its rim is, or 1: step errors are relative to the disc's speed."""
    disc, trace = scene.discs[0], run_pic_and_pit(scene, DT_S)[0]
    ratios = [abs(disc.spin_rad_s) * disc.radius_m / math.hypot(*disc.velocity_m_s)]
    if trace.spins is not None:
        after = trace.impacts["velocity_first_after"]
        ratios += (np.abs(trace.spins["first_after"]) * disc.radius_m / np.hypot(*after.T)).tolist()
    return max(1.0, *ratios)


@each_damped
def test_pic_of_a_damped_scene_is_exact(scene: Scene) -> None:
    """PIC of a damped scene is graded EXACT, and CONFORMS is its only verdict."""
    score = score_adapter(scene, PicAdapter())
    assert score.grade is Grade.EXACT
    assert score.verdicts == (Verdict.CONFORMS,)


@each_damped
@each("factor", release_after(1, [1.01, 0.0, 0.99, 2.0]))
def test_wrong_damping_rate_is_inaccurate_or_worse(scene: Scene, factor: float) -> None:
    """A run with a wrong damping rate, or none, is inaccurate or worse, with the verdict TURNS."""
    score = score_adapter(scene, Otherwise(damping_per_s=factor))
    assert score.grade in TOO_SLOW_OR_FAST
    assert Verdict.TURNS in score.verdicts
    # A step keeps exp(-factor c dt) of a velocity instead of exp(-c dt), of the larger of its two ends.
    rate = scene.damping_per_s * DT_S
    slipped = abs(math.exp(-factor * rate) - math.exp(-rate)) * compute_rim_speed_ratio(scene)
    assert require_value(score.local_truth).slipped == pytest.approx(slipped, rel=1e-6)


@each("factor", release_after(1, [1.01, 0.0, 0.99, 2.0]))
@each("scene", ON_TABLES)
def test_wrong_table_deceleration_is_inaccurate_or_worse(scene: Scene, factor: float) -> None:
    """A run with a wrong deceleration of the table is inaccurate or worse, with or without impacts."""
    score = score_adapter(scene, Otherwise(table_deceleration_m_s2=factor))
    assert score.grade in TOO_SLOW_OR_FAST
    # At full speed a dt / v is 1.7e-3, and near the stop half of the part; what changes by over 1 % turns by itself.
    assert require_value(score.local_truth).slipped > 1e-3 or require_value(score.local_truth).invented > 0


@each("scene", [PAIR, *release_after(2, reversed(DAMPED))])
def test_wrong_restitution_of_a_slowed_run_is_measured(scene: Scene) -> None:
    """A run with 0.9 of the restitution is INACCURATE (or WRONG if damped), with an error of 0.1 e to 1e-9."""
    score = score_adapter(scene, Otherwise(restitution=0.9, wall_restitution=0.9))
    assert require_value(score.local_truth).grade in {Grade.INACCURATE} | (
        {Grade.WRONG} if scene is not PAIR else set()
    )
    if scene.name != "contact/damped-slide":  # of rubbing impacts no restitution is worked out
        e = scene.wall_restitution if scene.walls else scene.restitution
        assert require_value(score.local_truth).restitution[1] == pytest.approx(0.1 * e, rel=1e-9)


@each_damped
def test_pit_lateness_in_damped_scenes_is_the_rest_of_the_frame(scene: Scene) -> None:
    """PIT finds the first impact of a damped scene late by the rest of its frame, to 1e-7 steps."""
    reference, found = run_pic_and_pit(scene, DT_S)
    truth, first = require_value(found.local_truth), reference.impacts["time_s"][0]
    assert truth.meetings[0]["due_s"] == pytest.approx(first, rel=1e-12)
    assert truth.windows["late_steps"][0] == pytest.approx(-first / DT_S % 1.0, abs=1e-7)


def test_positions_at_a_wall_impact_on_a_table_are_consistent() -> None:
    """Positions around a nearly head-on wall impact on a table are consistent with the path, to 1e-12."""
    bodies = disc_at(0.0, 0.0, 2.0, 2.0**-10, r=0.25), wall_at(1.25, 0.0, -1.0, 0.0)
    scene = staged("table", *bodies, table_deceleration_m_s2=0.8, duration_s=1.0)
    score = compare(solve_pic(scene), observe_run(PicAdapter(), scene, "tuned", TABLE_DT_S))
    assert require_value(score.consistency).position.size < 1e-12
    assert require_value(score.consistency).unchecked == 0


def test_disc_that_stops_after_the_end_still_moves_at_the_end() -> None:
    """A disc that stops after the scene's end, but within the last step, has PIC's speed and position at the end."""
    scene = staged("stops", disc_at(0, 0, 1, r=0.25), table_deceleration_m_s2=1.0, duration_s=0.995)
    observed = observe_run(load_adapter("pic"), scene, "tuned", 0.3)
    assert observed.end_time_s == pytest.approx(0.995, abs=1e-15)
    assert observed.final_velocity_m_s[0, 0] == pytest.approx(0.005, abs=1e-15)
    assert observed.final_position_m[0, 0] == pytest.approx(0.5 - 0.005**2 / 2, abs=1e-15)


def test_start_of_a_table_scene_can_be_shifted() -> None:
    """A table scene that starts 0.1 s earlier has its impact 0.1 s later."""
    # If discs would meet on the way back, the scene starts 0.1 s later instead.
    (first,) = solve_pic(PAIR).impacts["time_s"]
    earlier = shift_start(PAIR, 0.1)
    assert earlier.duration_s == pytest.approx(2.1)
    assert solve_pic(earlier).impacts["time_s"][0] == pytest.approx(first + 0.1, abs=1e-14)
    behind = PAIR.model_copy(update={"discs": (*PAIR.discs, disc_at(-0.55, 0.0, r=0.25))})
    assert shift_start(Scene(**dict(behind)), 0.1).duration_s == pytest.approx(1.9)
