"""Attacks in contact: their truths are those of 60 digits, PIC stands them all, and a judge tells what is wrong."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from mpmath import mp
from tests.lengths import long_after
from tests.validation import contact_runs

from carom import solve_pic
from carom.studies.stress.attack import Trial
from carom.studies.stress.in_contact import contact_attacks

ATTACKS = {attack.name: attack for attack in contact_attacks()}


def _by_hand(trial: Trial) -> tuple[list[float], float]:
    with mp.workdps(contact_runs.DIGITS):
        end = contact_runs.run(trial.scene)
        return [float(part) for part in end.velocity], float(end.spin)


@pytest.mark.parametrize(
    ("name", "whole"), [(name, False) for name in ATTACKS] + long_after(0, [(n, True) for n in ATTACKS])
)
def test_the_truth_is_that_of_60_digits_and_pic_meets_it(name: str, whole: bool) -> None:
    """Of scenes as they are stored, on both sides of each threshold and on it, to 1e-14; long, at all rungs."""
    attack = ATTACKS[name]
    for value in attack.ladder(quick=False) if whole else (attack.harmless,):
        for trial in attack.trials(value):
            trace = solve_pic(trial.scene)
            velocity, spin = _by_hand(trial)
            spins = None if trace.final_spin_rad_s is None else np.array([spin])
            told = dataclasses.replace(trace, final_velocity_m_s=np.array([velocity]), final_spin_rad_s=spins)
            for judged in (trial.judge(told), trial.judge(trace)):
                assert judged.broken == ""
                assert judged.error < 1e-14


@pytest.mark.parametrize("name", ATTACKS)
def test_a_disc_that_contact_does_nothing_to_is_broken(name: str) -> None:
    """Where the wall is left out the disc falls past it: broken at every rung, by name."""
    for trial in ATTACKS[name].trials(ATTACKS[name].harmless):
        without = trial.scene.model_copy(
            update={"walls": (), "wall_friction": 0.0, "wall_rolling_resistance": 0.0, "wall_restitution": 1.0}
        )
        broken = trial.judge(solve_pic(without)).broken
        assert "a velocity wrong by" in broken or "no impact is found" in broken


def test_a_rim_that_friction_has_not_turned_is_broken() -> None:
    """With its velocity right and its spin as at the start, a disc that rolls by the law is broken, and why is said."""
    for name in ("slipping-slope", "bouncing-slope", "slide-friction"):
        trial = ATTACKS[name].trials(ATTACKS[name].harmless)[-1]
        trace = solve_pic(trial.scene)
        unturned = dataclasses.replace(trace, final_spin_rad_s=np.array([trial.scene.discs[0].spin_rad_s]))
        assert "a rim's speed wrong by" in trial.judge(unturned).broken
        assert trial.judge(unturned).broken.endswith("of what contact changes")


def test_both_sides_of_a_threshold_are_tried_to_a_rounding() -> None:
    """The last rungs are one rounding of 1 off on either side, and the threshold itself."""
    for name in ("sliding-slope", "slipping-slope", "rolling-slope", "bouncing-slope"):
        *_, least, none = ATTACKS[name].ladder(quick=False)
        assert (least, none) == (2.0**-52, 0.0)
        above, below = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in ATTACKS[name].trials(least)))
        (at, _) = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in ATTACKS[name].trials(none)))
        assert below <= at <= above
        assert above - below <= 8.0 * 2.0**-52 * at


@pytest.mark.parametrize("lost", long_after(1, [1e-9, 1e-6, 1e-3]))
def test_a_lively_ball_bounces_three_times(lost: float) -> None:
    """Its impacts are at t, t (1 + 2 e) and t (1 + 2 e + 2 e^2), whatever it loses."""
    for trial in ATTACKS["lively"].trials(lost):
        times, e = solve_pic(trial.scene).impacts["time_s"], 1.0 - lost
        assert times / times[0] == pytest.approx([1.0, 1.0 + 2.0 * e, 1.0 + 2.0 * e + 2.0 * e * e], rel=1e-13)
