from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from tests.lengths import long_after

from carom import solve_pic, solve_pit
from carom.scene import Chain, Scene
from carom.studies.stress.finite_walls import wall_attacks

ATTACKS = {attack.name: attack for attack in wall_attacks()}


def _velocity(scene: Scene) -> complex:
    return complex(*scene.discs[0].velocity_m_s)


@pytest.mark.parametrize("degrees", [90.0, 45.0, 30.0, 1.0])
def test_a_corner_that_an_even_number_of_half_turns_fill_sends_a_disc_back(degrees: float) -> None:
    """Of a corner of 180 degrees over an even number a disc comes out the way that it went in (kaleidoscope)."""
    for trial in ATTACKS["corner"].trials(degrees):
        trace = solve_pic(trial.scene)
        assert len(trace.impacts) == round(180 / degrees)
        assert complex(*trace.final_velocity_m_s[0]) == pytest.approx(-_velocity(trial.scene), rel=1e-11)
        assert not trial.judge(trace).broken


def test_an_end_struck_three_fifths_off_turns_a_disc_as_three_four_five_says() -> None:
    """At b/R = 3/5 the velocity (1, 0) becomes (2 9/25 - 1, 2 12/25) = (-7, 24)/25."""
    for trial in ATTACKS["wall-end"].trials(0.4):
        after = complex(*solve_pic(trial.scene).final_velocity_m_s[0])
        assert after / _velocity(trial.scene) == pytest.approx(complex(-7, 24) / 25, abs=1e-13)


def test_looking_once_a_step_passes_a_thin_wall_as_often_as_the_closed_form_says() -> None:
    """PIT sees an approach within the radius before the wall: of n phases at q radii a step about n / q find it."""
    attack = ATTACKS["thin-wall"]
    assert not any(trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(0.99))
    assert any(trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(8.0))


def test_a_driven_wall_passes_a_disc_at_rest_as_often_as_a_disc_passes_a_wall() -> None:
    """PIT knows no frame: of n phases at q radii a step about n / q find the disc; PIC finds it at every speed."""
    attack = ATTACKS["paddle"]
    assert not any(trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(0.99))
    assert any(trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(8.0))
    for value in attack.ladder(quick=False):
        for trial in attack.trials(value):
            trace, (wall,) = solve_pic(trial.scene), trial.scene.walls
            assert len(trace.impacts) == 1
            assert trace.final_velocity_m_s[0, 0] == 2.0 * wall.velocity_m_s[0]


@pytest.mark.parametrize("name", ATTACKS)
def test_a_judge_tells_a_disc_that_flies_on(name: str) -> None:
    """A trace in which the disc keeps its velocity is broken at the harmless end: no judge takes what it is given."""
    for trial in ATTACKS[name].trials(ATTACKS[name].harmless):
        unhit = trial.scene.model_copy(update={"walls": ()})
        judgement = trial.judge(solve_pic(unhit))
        assert "no impact is found" in judgement.broken


def test_a_floor_of_pieces_is_struck_at_a_joint_of_two() -> None:
    """The centre is straight above a joint at the impact, whatever the number of pieces."""
    for pieces in ATTACKS["seam"].ladder(quick=False):
        for trial in ATTACKS["seam"].trials(pieces):
            (chain,), (impact,) = trial.scene.walls, solve_pic(trial.scene).impacts
            assert isinstance(chain, Chain)
            joints = np.linspace(chain.points_m[0][0], chain.points_m[1][0], int(pieces) + 1)[1:-1]
            disc = trial.scene.discs[0]
            struck = disc.position_m[0] + disc.velocity_m_s[0] * impact["time_s"]
            assert np.abs(joints - struck).min() < 1e-12
            assert math.isclose(cmath.phase(_velocity(trial.scene)), -math.atan(0.25))


@pytest.mark.parametrize("legs", long_after(4, [1, 2, 7, 64, 1000]))
def test_a_wall_of_any_number_of_legs_strikes_a_disc_once_on_its_last(legs: int) -> None:
    """PIC finds one impact, at the trial's own instant to rounding, and the disc leaves at twice the last velocity."""
    for trial in ATTACKS["legs"].trials(legs):
        (wall,), trace = trial.scene.walls, solve_pic(trial.scene)
        assert len(wall.legs) == legs
        assert len(trace.impacts) == 1
        assert wall.legs[-1].from_s < trace.impacts["time_s"][0]
        assert trace.final_velocity_m_s[0, 0] == 2.0 * wall.legs[-1].velocity_m_s[0]
        assert not trial.judge(trace).broken
