"""Self-consistency of a run: sampling, gravity and narrow floats explain some contradictions, and no others."""

import dataclasses

import numpy as np
import pytest
from tests.planted.faults import DT, ROW, SPEED, replay_reference
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Trace, compare, solve_pic
from carom.comparator import Grade, Verdict
from carom.comparator.measure.consistency import Consistency
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run

REFERENCE = solve_pic(ROW)


def measure_consistency(trace: Trace, reference: Trace = REFERENCE) -> Consistency:
    return require_value(compare(reference, trace).consistency)


def build_pushed_run(part: float) -> Trace:
    """A run whose struck disc is put aside, once, by so large a part of what the discs close in a step."""
    trace = replay_reference(REFERENCE)
    place = trace.final_position_m.copy()
    place[2, 1] += part * SPEED * DT
    return dataclasses.replace(trace, final_position_m=place)


def test_push_within_the_overlap_of_a_step_keeps_the_grade() -> None:
    """Discs that are pushed apart have the verdict DRIFTS; only a push beyond a step's overlap is INACCURATE."""
    late = replay_reference(REFERENCE).impacts.copy()
    late["velocity_second_after"][1, 1] = 1.0  # a PIT that ends far away, so that the end allows anything
    pit = dataclasses.replace(
        replay_reference(REFERENCE),
        impacts=late,
        final_position_m=REFERENCE.final_position_m + 1.0,
        final_velocity_m_s=REFERENCE.final_velocity_m_s + 1.0,
    )
    grades = {}
    for part in (0.5, 0.99, 1.01, 3.0):
        score = compare(REFERENCE, build_pushed_run(part), sampling=pit)
        assert Verdict.DRIFTS in score.verdicts
        grades[part] = score.grade
    assert grades == {0.5: Grade.SAMPLED, 0.99: Grade.SAMPLED, 1.01: Grade.INACCURATE, 3.0: Grade.INACCURATE}


def test_rounding_of_32_bit_floats_is_no_drift() -> None:
    """Rounding of positions to 32 bits at each step is no DRIFTS or TURNS of a 32-bit run; it is of a 64-bit run."""
    scene = staged("long", disc_at(0, 0, 0.1, 0.3), duration_s=100.0)
    reference = solve_pic(scene)
    place, velocity = np.zeros((1, 2), np.float32), np.array([[0.1, 0.3]], np.float32)
    for _ in range(60 * 100):
        place += velocity * np.float32(DT)
    narrow = dataclasses.replace(reference, final_position_m=place.astype(np.float64), dt_s=DT, float_bits=32)
    narrow = dataclasses.replace(narrow, final_velocity_m_s=velocity.astype(np.float64))
    assert measure_consistency(narrow, reference).position.size > 1e-5  # six thousand roundings show
    score = compare(reference, narrow, sampling=reference)
    assert not {Verdict.DRIFTS, Verdict.TURNS} & set(score.verdicts)
    assert score.grade is Grade.CLOSE  # further off than a hundredth of a step's travel
    wide = dataclasses.replace(narrow, float_bits=64)
    assert {Verdict.DRIFTS, Verdict.TURNS} <= set(compare(reference, wide).verdicts)
    drifted = dataclasses.replace(narrow, final_position_m=narrow.final_position_m + 0.1)
    assert compare(reference, drifted, sampling=reference).grade is Grade.INACCURATE


def build_fall() -> tuple[Trace, Trace]:
    """The reference of a disc that is thrown for a second, without impacts, and its run by semi-implicit Euler."""
    reference = solve_pic(staged("thrown", disc_at(0, 0, 3, 2), gravity_m_s2=(0, -10), duration_s=1.0))
    lower = np.array([[0.0, -10 * DT / 2]])
    return reference, dataclasses.replace(reference, final_position_m=reference.final_position_m + lower, dt_s=DT)


def test_euler_error_of_a_fall_is_only_a_wrong_end() -> None:
    """A fall by semi-implicit Euler ends too low by g dt t / 2: it is MISPLACED and INACCURATE, and consistent."""
    reference, euler = build_fall()
    score = compare(reference, euler, sampling=dataclasses.replace(reference, dt_s=DT))
    assert score.verdicts == (Verdict.MISPLACED,)
    found = require_value(score.consistency)  # without impacts
    assert (found.across, found.normal_rad, found.normal_length, found.momentum) == (0.0, 0.0, 0.0, 0.0)
    assert score.total.final_position * 0.5 == pytest.approx(10 * DT / 2, rel=1e-12)
    assert score.grade is Grade.INACCURATE


def test_velocity_change_that_gravity_cannot_explain_is_a_turn() -> None:
    """A velocity change across gravity, or along it by more than gravity gives, has the verdict TURNS."""
    reference, euler = build_fall()
    for change, size in (((0.5, 0.0), 0.5), ((0.0, -20.0), 20.0 - 10 * DT), ((0.0, 11.0), 1.0 - 10 * DT)):
        turned = dataclasses.replace(euler, final_velocity_m_s=euler.final_velocity_m_s + np.array([change]))
        score = compare(reference, turned)
        assert Verdict.TURNS in score.verdicts
        assert measure_consistency(turned, reference).velocity.size == pytest.approx(
            size / score.scales.speed_m_s, rel=1e-9
        )


def test_resting_disc_has_no_turn() -> None:
    """PIC of a disc that comes to rest on the floor has the verdicts CONFORMS and RESTED, and not TURNS."""
    ball = disc_at(0, 2, r=1)
    floor = wall_at(0, 0, 0, 1)
    scene = staged("rests", ball, floor, wall_restitution=0.25, gravity_m_s2=(0, -8), duration_s=2)
    reference = solve_pic(scene)
    score = compare(reference, observe_run(load_adapter("pic"), scene, "tuned", DT), horizon=reference.end_time_s)
    assert score.verdicts == (Verdict.CONFORMS, Verdict.RESTED)
