"""Self-consistency of a run: sampling, gravity and narrow floats explain some contradictions, and no others."""

import dataclasses
import math

import numpy as np
import pytest
from tests.cases import each
from tests.planted.faults import DT, ROW, SPEED, faithful
from tests.scene_builders import disc_at, staged, sure, wall_at

from carom import Scene, Trace, compare, solve_pic
from carom.catalogue import catalogue
from carom.comparator import Grade, Verdict
from carom.comparator.measure.consistency import Consistency
from carom.engines.registry import load_adapter
from carom.execution.engine_run import observe_run

REFERENCE = solve_pic(ROW)


def own(trace: Trace, reference: Trace = REFERENCE) -> Consistency:
    return sure(compare(reference, trace).consistency)


@pytest.mark.long
@each("engine", ["pic", "pit"])
def test_every_run_of_our_own_methods_agrees_with_itself(engine: str) -> None:
    """PIC and PIT through the seam, on all kinds of scenes and with gravity, contradict themselves in nothing."""
    adapter = load_adapter(engine)
    for name in ("paper/multiple", "classics/gas", "classics/box", "classics/deflection", "gravity/box"):
        scene = catalogue()[name].scene
        trace = observe_run(adapter, scene, "tuned", 1 / scene.frame_rate_hz)
        found = own(trace, solve_pic(scene))
        largest = [found.velocity.size, found.position.size, found.across, found.normal_length, found.momentum]
        assert max(largest) < 1e-12, name
        assert found.stamp_s < 1e-12
        assert found.unchecked == 0


def pushed_apart(part: float) -> Trace:
    """A run whose struck disc is put aside, once, by so large a part of what the discs close in a step."""
    trace = faithful(REFERENCE)
    place = trace.final_position_m.copy()
    place[2, 1] += part * SPEED * DT
    return dataclasses.replace(trace, final_position_m=place)


def test_what_bodies_close_in_a_step_is_explained_and_still_said() -> None:
    """Discs pushed apart by as much as they may overlap have a verdict; only a larger distance lowers the grade."""
    late = faithful(REFERENCE).impacts.copy()
    late["velocity_second_after"][1, 1] = 1.0  # a PIT that ends far away, so that the end allows anything
    pit = dataclasses.replace(
        faithful(REFERENCE),
        impacts=late,
        final_position_m=REFERENCE.final_position_m + 1.0,
        final_velocity_m_s=REFERENCE.final_velocity_m_s + 1.0,
    )
    grades = {}
    for part in (0.5, 0.99, 1.01, 3.0):
        score = compare(REFERENCE, pushed_apart(part), sampling=pit)
        assert Verdict.DRIFTS in score.verdicts
        grades[part] = score.grade
    assert grades == {0.5: Grade.SAMPLED, 0.99: Grade.SAMPLED, 1.01: Grade.INACCURATE, 3.0: Grade.INACCURATE}


def test_the_rounding_of_narrow_floats_is_no_drift() -> None:
    """Positions and velocities kept in 32 bits, a rounding a step, contradict nothing; what is more than that does."""
    scene = staged("long", disc_at(0, 0, 0.1, 0.3), duration_s=100.0)
    reference, steps = solve_pic(scene), 60 * 100
    place, velocity = np.zeros(2, np.float32), np.array([0.1, 0.3], np.float32)
    for _ in range(steps):
        place += velocity * np.float32(DT)
    narrow = dataclasses.replace(
        reference,
        final_position_m=np.array([place], np.float64),
        final_velocity_m_s=np.array([velocity], np.float64),
        dt_s=DT,
        float_bits=32,
    )
    assert own(narrow, reference).position.size > 1e-5  # six thousand roundings show
    assert not {Verdict.DRIFTS, Verdict.TURNS} & set(compare(reference, narrow).verdicts)
    # It is rounding, and further off than a hundredth of a step's travel: close, and exact no more.
    assert narrow.final_position_m[0] == pytest.approx(
        reference.final_position_m[0], abs=0.5 * math.hypot(0.1, 0.3) * DT
    )
    assert compare(reference, narrow, sampling=reference).grade is Grade.CLOSE
    wide = dataclasses.replace(narrow, float_bits=64)
    assert {Verdict.DRIFTS, Verdict.TURNS} <= set(compare(reference, wide).verdicts)
    drifted = dataclasses.replace(narrow, final_position_m=narrow.final_position_m + 0.1)
    assert compare(reference, drifted, sampling=reference).grade is Grade.INACCURATE


def falling(duration_s: float = 1.0) -> tuple[Scene, Trace, Trace]:
    """A thrown disc without impacts, its reference, and a run by semi-implicit Euler."""
    scene = staged("thrown", disc_at(0, 0, 3, 2), gravity_m_s2=(0, -10), duration_s=duration_s)
    reference, steps = solve_pic(scene), round(duration_s / DT)
    lower = np.array([[0.0, -10 * DT * duration_s / 2]])
    euler = dataclasses.replace(reference, final_position_m=reference.final_position_m + lower, dt_s=DT)
    assert steps * DT == pytest.approx(duration_s)
    return scene, reference, euler


def test_an_integrators_error_in_falling_is_an_error_of_the_end_alone() -> None:
    """Who falls along a polygon ends too low, by g dt t / 2, and contradicts himself in nothing; no PIT explains it."""
    _, reference, euler = falling()
    score = compare(reference, euler, sampling=dataclasses.replace(reference, dt_s=DT))
    assert score.verdicts == (Verdict.MISPLACED,)
    assert score.total.final_position * 0.5 == pytest.approx(10 * DT / 2, rel=1e-12)
    assert score.grade is Grade.INACCURATE


def test_turning_while_falling_is_seen_across_the_pull() -> None:
    """Gravity explains what changes along it, and nothing across; and no more along it than it can give in the time."""
    _, reference, euler = falling()
    for change, size in (((0.5, 0.0), 0.5), ((0.0, -20.0), 20.0 - 10 * DT), ((0.0, 11.0), 1.0 - 10 * DT)):
        turned = dataclasses.replace(euler, final_velocity_m_s=euler.final_velocity_m_s + np.array([change]))
        score = compare(reference, turned)
        assert Verdict.TURNS in score.verdicts
        assert own(turned, reference).velocity.size == pytest.approx(size / score.scales.speed_m_s, rel=1e-9)


def test_discs_that_rest_on_the_floor_do_not_turn() -> None:
    """What an engine does after its disc has come to rest, where gravity is answered step by step, is no turn."""
    ball = disc_at(0, 2, r=1)
    floor = wall_at(0, 0, 0, 1)
    scene = staged("rests", ball, floor, wall_restitution=0.25, gravity_m_s2=(0, -8), duration_s=2)
    reference = solve_pic(scene)
    score = compare(reference, observe_run(load_adapter("pic"), scene, "tuned", DT), horizon=reference.end_time_s)
    assert score.verdicts == (Verdict.CONFORMS, Verdict.RESTED)


def test_several_contacts_of_a_step_are_not_followed_and_counted() -> None:
    """An impact whose instant nobody knows ends one free flight and begins another that can't be followed."""
    trace = faithful(REFERENCE)
    states, effective = sure(trace.state_before).copy(), sure(trace.effective_time_s).copy()
    states["position_first"][1] = states["position_second"][1] = effective[1] = math.nan
    unknown = dataclasses.replace(trace, state_before=states, effective_time_s=effective)
    assert own(unknown).unchecked == 4  # of discs 1 and 2, before and after
    assert compare(REFERENCE, unknown, sampling=dataclasses.replace(REFERENCE, dt_s=DT)).grade is Grade.EXACT


def test_a_run_that_calls_itself_complete_and_ended_before_is_cut_short() -> None:
    """A run that ends before the scene does is cut short, even if it reports that it completed."""
    early = dataclasses.replace(solve_pic(ROW, until_s=1.9), outcome=REFERENCE.outcome, end_time_s=1.9)
    score = compare(REFERENCE, early)
    assert Verdict.CUT_SHORT in score.verdicts
    assert score.grade is Grade.WRONG
    assert math.isnan(score.total.final_position)  # the two ends are not of one time
