"""Attacks with friction and spin: PIC stands them all, and a method without the law gives way at once."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from carom import solve_pic, solve_pit
from carom.studies.stress.rough import rough_attacks
from carom.trace import Mode

ATTACKS = {attack.name: attack for attack in rough_attacks()}


@pytest.mark.parametrize("name", [name for name in ATTACKS if name != "rolling"])
def test_pic_stands_every_rung(name: str) -> None:
    """From the harmless to the absurd end PIC is the closed form's to rounding, chains of grips included."""
    for value in ATTACKS[name].ladder(quick=False):
        for trial in ATTACKS[name].trials(value):
            judgement = trial.judge(solve_pic(trial.scene))
            assert judgement.broken == ""
            assert judgement.error < 1e-11, value


@pytest.mark.parametrize("value", [0.9, 0.5, 0.1, 1e-3])
def test_what_bounces_on_a_rough_floor_ends_rolling(value: float) -> None:
    """Bounces without end, sliding at first: the disc rolls as angular momentum about the floor says."""
    (trial,) = ATTACKS["rolling"].trials(value)
    trace = solve_pic(trial.scene)
    assert trace.modes is not None
    assert trace.modes["after"].tolist() == [Mode.ROLL]
    assert trial.judge(trace).error < 1e-12
    assert trial.judge(solve_pit(trial.scene)).broken == ""


@pytest.mark.parametrize("name", ["friction", "spin", "inertia"])
def test_pit_stands_what_turns_no_normal(name: str) -> None:
    """Head-on and on walls checking once per step costs no velocity and no spin."""
    for value in ATTACKS[name].ladder(quick=True):
        for trial in ATTACKS[name].trials(value):
            assert trial.judge(solve_pit(trial.scene)).error < 1e-11, value


@pytest.mark.parametrize("name", list(ATTACKS))
def test_a_wrong_spin_breaks_every_attack(name: str) -> None:
    """With its velocities right, and its spins left out or turned round, a run is broken by name."""
    trial = ATTACKS[name].trials(ATTACKS[name].harmless * (10.0 if name == "friction" else 1.0))[0]
    trace = solve_pic(trial.scene)
    assert trace.final_spin_rad_s is not None
    assert trial.judge(trace).broken == ""
    turned = dataclasses.replace(trace, final_spin_rad_s=-10.0 * trace.final_spin_rad_s)
    assert "a rim's speed wrong by" in trial.judge(turned).broken
    none = dataclasses.replace(trace, final_spin_rad_s=None, spins=None)
    assert trial.judge(none).broken == "no spin is told"
    no_number = dataclasses.replace(trace, final_spin_rad_s=np.full(len(trial.scene.discs), np.nan))
    assert trial.judge(no_number).broken
