"""Comparison of runs that miss, stop, tunnel or can't be graded, and of traces that are refused.

Planted faults are in `tests/planted`.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import DT, FIRST_S, LAST_S, ROW, drop_impact, replay_impacts
from tests.scene_builders import alter_impact, disc_at, require_value, staged, wall_at

from carom import Scene, compare, solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator import Grade, Score, Verdict
from carom.errors import InputError
from carom.model.trace import Outcome, Trace

#: Three discs in line: 0 strikes 1 at 0.2 s, 1 strikes 2 at 0.6 s, on different lines, so normals differ.
SCENE = staged("three", disc_at(0, 0, 5.0, 0), disc_at(1.8, 0.6), disc_at(4.5, 2.4), duration_s=2.0)
REFERENCE = solve_pic(SCENE)


def score_with_pit(reference: Trace, observed: Trace) -> Score:
    """Compare with the reference, and with PIT at the scene's own frame rate."""
    return compare(reference, observed, sampling=solve_pit(reference.scene))


def test_impact_of_the_wrong_pair_is_missed_and_spurious() -> None:
    """An impact reported for another pair is one missed and one spurious impact, not one with a large error."""
    score = score_with_pit(REFERENCE, replace(alter_impact(REFERENCE, 0, second=2), dt_s=1 / 60))
    assert (score.missed, score.spurious) == ((0,), (0,))


@each("outcome, said", [(Outcome.WARNED, "bad state"), (Outcome.COMPLETED, "")])
def test_run_that_stopped_early_is_cut_short_and_wrong(outcome: Outcome, said: str) -> None:
    """A trace that ends before the scene is CUT_SHORT and WRONG, whatever it reports, with the engine's message."""
    cut = replace(solve_pic(SCENE, until_s=0.3), outcome=outcome, notes=(said,), end_time_s=0.3)
    score = score_with_pit(REFERENCE, cut)
    assert score.verdicts == (Verdict.CUT_SHORT, Verdict.UNDECIDED)
    assert said in score.findings[0].reason
    assert score.undecided == (1,)
    assert score.price_paid == math.inf
    assert score.grade is Grade.WRONG
    assert math.isnan(score.total.final_position)  # the two ends are not of one time


def test_pit_compared_with_itself_is_sampled() -> None:
    """PIT compared with itself is graded SAMPLED; without a PIT run to compare with, it is UNGRADED."""
    pit = solve_pit(SCENE)
    assert compare(REFERENCE, pit, sampling=pit).grade is Grade.SAMPLED
    alone = compare(REFERENCE, pit)
    assert alone.grade is Grade.UNGRADED
    assert Verdict.UNCOMPARED in alone.verdicts


def test_traces_of_two_scenes_are_refused() -> None:
    """Comparing traces of different scenes raises an InputError that names both scenes."""
    other = solve_pic(Scene(name="other", discs=SCENE.discs, duration_s=1))
    with pytest.raises(InputError, match=r"'three'.*'other'"):
        compare(REFERENCE, other)


@each("horizon", [0, 0.1])
def test_horizon_before_the_first_impact_gives_no_grade(horizon: float) -> None:
    """With a horizon before the first impact a run is UNGRADED, with a reason, or WRONG if an impact is spurious."""
    blind = replace(solve_pit(SCENE, frame_rate_hz=0.5), dt_s=1 / 60)
    silent = replace(REFERENCE, impacts=REFERENCE.impacts[:0], dt_s=1 / 60)  # and so contradicts itself
    for observed in (REFERENCE, solve_pit(SCENE), blind, silent):
        score = compare(REFERENCE, observed, sampling=solve_pit(SCENE), horizon=horizon)
        assert score.grade is Grade.UNGRADED
        assert score.verdicts[-1] is Verdict.NOTHING_COMPARED
        assert "the first impact, at 0.2 s, is beyond the horizon" in score.findings[-1].reason
        assert Verdict.CONFORMS not in score.verdicts
    spurious = drop_impact(alter_impact(REFERENCE, 0, time_s=0.05, second=2), 1)
    assert compare(REFERENCE, replace(spurious, dt_s=1e-3), horizon=0.1).grade is Grade.WRONG


def replay_at_times(reference: Trace, times: list[float]) -> Trace:
    """The run that has the reference's impacts at other instants, and goes where that leads."""
    impacts = reference.impacts.copy()
    impacts["time_s"] = times
    return replay_impacts(reference, impacts)


def test_lateness_of_pit_excuses_only_later_lateness() -> None:
    """If PIT is three steps late at the second impact only, a run may be so late there, and one step at the first."""
    reference = solve_pic(ROW)
    pit = replay_at_times(reference, [FIRST_S, LAST_S + 3 * DT])
    for times, grade in (
        ([FIRST_S, LAST_S + 2.5 * DT], Grade.SAMPLED),
        ([FIRST_S + DT, LAST_S + 2.5 * DT], Grade.SAMPLED),
        ([FIRST_S + 2 * DT, LAST_S], Grade.INACCURATE),
        ([FIRST_S, LAST_S + 3.5 * DT], Grade.INACCURATE),
        ([FIRST_S, LAST_S - 0.5 * DT], Grade.INACCURATE),
    ):
        assert compare(reference, replay_at_times(reference, times), sampling=pit).grade is grade, times


def test_impact_that_is_early_because_of_a_late_one_is_sampled() -> None:
    """An impact that is early only because an earlier one was late is graded SAMPLED."""
    # A disc strikes an immovable one off centre. PIT finds this impact late, so the disc leaves at
    # another angle and meets the wall behind early.
    bodies = disc_at(0, 0.3, 4, 0), disc_at(3, 0, m=math.inf), wall_at(0, 6, 0, -1)
    scene = staged("thrown", *bodies, duration_s=4.0, frame_rate_hz=23.0)
    reference, pit = solve_pic(scene), solve_pit(scene)
    lucky = replace(reference, dt_s=pit.dt_s)  # a PIT whose frame falls on the first impact
    for sampling in (pit, lucky):
        score = compare(reference, pit, sampling=sampling)
        assert Verdict.EARLY in score.verdicts
        assert score.grade is Grade.SAMPLED


# Traces that are refused ----------------------------------------------------------------------------------------------

#: One disc that slides along a wall, and turns.
SLIDING = solve_pic(find_scenes(["spin/slide"])[0].scene)
#: A disc and a driven wall.
PADDLE = staged("paddle", disc_at(3.5, 0, -2.0), wall_at(0, 0, 1, 0, velocity_m_s=(1.0, 0.0)), duration_s=2.0)


def alter_first_impact(**fields: Any) -> Callable[[Trace], Trace]:
    """Return what gives the first impact of a trace other bodies or velocities."""
    return lambda trace: alter_impact(trace, 0, **fields)


def add_wall_spin(trace: Trace) -> Trace:
    spins = require_value(trace.spins).copy()
    spins["second_after"][0] = 2.5
    return replace(trace, spins=spins)


@each(
    "change, words",
    [
        (alter_first_impact(second=-8), r"second of impact 0 .* is wall 7 \(-8\)"),
        (alter_first_impact(second=9), r"second of impact 0 .* is disc 9 \(9\)"),
        (alter_first_impact(first=-1), r"first of impact 0 .* is wall 0 \(-1\)"),
        (add_wall_spin, "spin second_after of impact 0 .* is 2.5, but its second body is wall 0"),
        (
            alter_first_impact(velocity_second_before=(0.0, -0.1)),
            "velocity_second_before of impact 0 .* is 0, -0.1, but its second body is wall 0",
        ),
        (
            lambda _: alter_impact(solve_pic(PADDLE), 0, velocity_second_before=(0.0, 0.0)),
            "velocity_second_before of impact 0 .* this driven wall has 1, 0",
        ),
        (lambda trace: replace(trace, end_time_s=2 * trace.end_time_s), "ends at .* a trace must end"),
        (lambda trace: replace(trace, spins=None), "has no spins"),
        (lambda trace: replace(trace, float_bits=16), r"float_bits of .* is 16, but must be one of \[32, 64\]"),
    ],
)
def test_trace_that_contradicts_its_scene_is_refused(change: Callable[[Trace], Trace], words: str) -> None:
    """A trace with unknown bodies, a moving or spinning wall, or a wrong end time raises an InputError."""
    changed = change(SLIDING)
    right = solve_pic(changed.scene)
    for pair in ((right, changed), (changed, right)):
        with pytest.raises(InputError, match=words):
            compare(*pair)


def test_sampling_run_must_have_the_same_scene_and_step() -> None:
    """A sampling run of another scene or step raises an InputError; a run without steps accepts any step."""
    scene = find_scenes(["paper/late"])[0].scene
    reference, observed = solve_pic(scene), solve_pit(scene, frame_rate_hz=60)
    with pytest.raises(InputError, match=r"observed trace is 0.0166667 s, but that of `sampling` is 0.333333 s"):
        compare(reference, observed, sampling=solve_pit(scene, frame_rate_hz=3))
    with pytest.raises(InputError, match="sampling is of scene 'spin/slide'"):
        compare(reference, observed, sampling=solve_pit(SLIDING.scene, frame_rate_hz=60))
    # A run without steps is compared with PIT at any step.
    assert np.isfinite(compare(reference, reference, sampling=solve_pit(scene, frame_rate_hz=3)).price_paid)


@each("table", (0.0, 0.1))
def test_energy_after_the_horizon_is_compared_only_if_it_is_conserved(table: float) -> None:
    """After the horizon the final energy is compared if no table slows the discs, since it then depends on no path."""
    discs = (disc_at(-2.0, 0.0, vx=2.0), disc_at(0.0, 0.0), disc_at(3.0, 0.0))
    scene = staged("row", *discs, table_deceleration_m_s2=table, duration_s=4.0)
    reference = solve_pic(scene)
    assert len(reference.impacts) == 2
    observed = replace(reference, final_velocity_m_s=0.9 * reference.final_velocity_m_s)
    assert (compare(reference, observed, horizon=1).total.energy < 0.0) is (table == 0.0)
