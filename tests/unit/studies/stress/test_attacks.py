from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from tests.lengths import long_after

from carom import load_scene, save_scene, solve_pic, solve_pit
from carom.studies.stress.attack import Attack
from carom.studies.stress.run import attacks

ATTACKS = attacks()
each_attack = pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)

#: What no float64 method can stand to the end: an error doubles faster than once a bounce.
HORIZON = "unstable-orbit"


def test_a_ladder_runs_from_harmless_to_absurd() -> None:
    """Both ladders begin at the harmless end, end at the absurd one, and never turn back."""
    for attack, quick in itertools.product(ATTACKS, (False, True)):
        ladder = attack.ladder(quick)
        end = attack.quick_absurd if quick and attack.quick_absurd is not None else attack.absurd
        ends = (attack.harmless, end if attack.last is None else attack.last)
        assert (ladder[0], ladder[-1]) == ends, attack.name
        assert ladder == sorted(ladder, reverse=ladder[-1] < ladder[0]), attack.name
        assert len(set(ladder)) == len(ladder) >= 4, attack.name


@each_attack
@pytest.mark.parametrize("stride", long_after(1, [3, 1]))
def test_pic_stands_every_attack(attack: Attack, stride: int, tmp_path: Path) -> None:
    """PIC stands at the rungs of the quick ladder, to the end: what it does not stand is a bug of ours.

    The first scene of the last is read again from its file without loss: the truth is that of the scene as stored.
    One attack has a horizon that no method of 53 bits can pass; there PIC stands where twenty bounces are asked for.
    """
    ladder = attack.ladder(quick=True)
    if attack.name == HORIZON:
        ladder = [value for value in ladder if value <= 20]
    rungs = {value: attack.trials(value) for value in (ladder[::-stride] if not attack.full_only else ladder[:1])}
    for trial in next(iter(rungs.values()))[:1]:
        save_scene(trial.scene, tmp_path / "scene.toml")
        assert load_scene(tmp_path / "scene.toml") == trial.scene
    for value, trials in rungs.items():
        for trial in trials:
            judgement = trial.judge(solve_pic(trial.scene))
            assert not judgement.broken, (value, judgement)


@pytest.mark.parametrize("name", ["grazing", "tunnelling", "galperin"])
def test_pit_gives_way_where_sampling_must(name: str) -> None:
    """What checks once per frame stands at the harmless end, and gives way to a graze, a bullet, a crowd of impacts."""
    attack = next(attack for attack in ATTACKS if attack.name == name)

    def stands(value: float) -> bool:
        return all(not trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(value))

    ladder = attack.ladder(quick=True)
    assert stands(ladder[0])
    assert not stands(ladder[-1])


def test_bisection_stops_when_two_values_are_near() -> None:
    """The value between two is their geometric mean, whole where the axis is; near ones have none between."""
    pair, crowd = (next(a for a in ATTACKS if a.name == name) for name in ("mass-ratio", "at-once"))
    assert pair.between(1.0, 100.0, 1.1) == 10.0
    assert pair.between(1.0, 1.05, 1.1) is None
    assert crowd.between(2.0, 8.0, 1.1) == 4.0
    assert crowd.between(2.0, 3.0, 1.1) is None
    assert pair.between(1e-15, 0.0, 1.1) is None
