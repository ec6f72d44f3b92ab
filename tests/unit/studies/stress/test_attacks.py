"""Attacks, at walls, in contact and with friction, too: PIC passes them, and a judge finds what is wrong."""

import cmath
import dataclasses
import itertools
import json
import math
import string
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp
from tests.cases import each, release_after
from tests.scene_builders import sure
from tests.validation import contact_runs

from carom import load_scene, save_scene, solve_pic, solve_pit
from carom.model.scene import Chain, Scene
from carom.model.trace import Mode
from carom.studies.stress import attack as stress_attack
from carom.studies.stress.attack import Attack, Trial
from carom.studies.stress.contact import CONTACT_ATTACKS
from carom.studies.stress.finite_walls import WALL_ATTACKS
from carom.studies.stress.friction import FRICTION_ATTACKS
from carom.studies.stress.run import list_attacks

ATTACKS = [attack for _, attack in list_attacks()]
each_attack = each("attack", ATTACKS)

#: Attacks that no float64 method can pass to the end: an error doubles faster than once a bounce.
HORIZON = "unstable-orbit"


def test_a_ladder_runs_from_harmless_to_absurd() -> None:
    """Both ladders begin at the harmless end, end at the absurd one, and never turn back."""
    for attack, quick in itertools.product(ATTACKS, (False, True)):
        ladder = attack.build_ladder(quick)
        end = attack.quick_absurd if quick and attack.quick_absurd is not None else attack.absurd
        ends = (attack.harmless, end if attack.last is None else attack.last)
        assert (ladder[0], ladder[-1]) == ends, attack.name
        assert ladder == sorted(ladder, reverse=ladder[-1] < ladder[0]), attack.name
        assert len(set(ladder)) == len(ladder) >= 4, attack.name


def test_every_entry_of_the_file_of_attacks_is_used() -> None:
    """Each entry is an attack of the table, and each common sentence is part of one."""
    held = json.loads(Path(stress_attack.__file__).with_name("attacks.json").read_text(encoding="utf-8"))
    assert sorted(attack.name for attack in ATTACKS) == sorted(held["attacks"])
    quoted = "".join(entry["truth"] + entry["gives_way"] for entry in held["attacks"].values())
    assert {name for _, name, _, _ in string.Formatter().parse(quoted) if name} == set(held["sentences"])


@each_attack
@pytest.mark.parametrize("stride", release_after(1, [3, 1]))
def test_pic_stands_every_attack(attack: Attack, stride: int, tmp_path: Path) -> None:
    """PIC passes the rungs of the quick ladder to the end; a failure is a bug of Carom."""
    ladder = attack.build_ladder(quick=True)
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


@each("name", ["grazing", "tunnelling", "galperin"])
def test_pit_gives_way_where_sampling_must(name: str) -> None:
    """Checking once per frame passes at the harmless end, and fails at a graze, a bullet, a crowd of impacts."""
    attack = next(attack for attack in ATTACKS if attack.name == name)

    def stands(value: float) -> bool:
        return all(not trial.judge(solve_pit(trial.scene)).broken for trial in attack.trials(value))

    ladder = attack.build_ladder(quick=True)
    assert stands(ladder[0])
    assert not stands(ladder[-1])


def test_bisection_stops_when_two_values_are_near() -> None:
    """The value between two is their geometric mean, whole where the axis is; near ones have none between."""
    pair, crowd = (next(a for a in ATTACKS if a.name == name) for name in ("mass-ratio", "at-once"))
    assert pair.find_middle_value(1.0, 100.0, 1.1) == 10.0
    assert pair.find_middle_value(1.0, 1.05, 1.1) is None
    assert crowd.find_middle_value(2.0, 8.0, 1.1) == 4.0
    assert crowd.find_middle_value(2.0, 3.0, 1.1) is None
    assert pair.find_middle_value(1e-15, 0.0, 1.1) is None


WALLS = {attack.name: attack for attack in WALL_ATTACKS}


def _velocity(scene: Scene) -> complex:
    return complex(*scene.discs[0].velocity_m_s)


@each("name", ["thin-wall", "paddle"])
def test_looking_once_a_step_passes_a_thin_wall_as_often_as_the_closed_form_says(name: str) -> None:
    """PIT sees an approach within the radius, in any frame: of n phases at q radii a step about n / q find it."""
    assert not any(trial.judge(solve_pit(trial.scene)).broken for trial in WALLS[name].trials(0.99))
    assert any(trial.judge(solve_pit(trial.scene)).broken for trial in WALLS[name].trials(8.0))


def test_a_floor_of_pieces_is_struck_at_a_joint_of_two() -> None:
    """The centre is straight above a joint at the impact, whatever the number of pieces."""
    for pieces in WALLS["seam"].build_ladder(quick=False):
        for trial in WALLS["seam"].trials(pieces):
            (chain,), (impact,) = trial.scene.walls, solve_pic(trial.scene).impacts
            assert isinstance(chain, Chain)
            joints = np.linspace(chain.points_m[0][0], chain.points_m[1][0], int(pieces) + 1)[1:-1]
            disc = trial.scene.discs[0]
            struck = disc.position_m[0] + disc.velocity_m_s[0] * impact["time_s"]
            assert np.abs(joints - struck).min() < 1e-12
            assert math.isclose(cmath.phase(_velocity(trial.scene)), -math.atan(0.25))


IN_CONTACT = {attack.name: attack for attack in CONTACT_ATTACKS}


def _by_hand(trial: Trial) -> tuple[list[float], float]:
    with mp.workdps(contact_runs.DIGITS):
        end = contact_runs.run(trial.scene)
        return [float(part) for part in end.velocity], float(end.spin)


@each("name, whole", [(name, False) for name in IN_CONTACT] + release_after(0, [(n, True) for n in IN_CONTACT]))
def test_the_truth_is_that_of_60_digits_and_pic_meets_it(name: str, whole: bool) -> None:
    """The truth of scenes as stored, on both sides of each threshold and on it, to 1e-14; long, at all rungs."""
    attack = IN_CONTACT[name]
    for value in attack.build_ladder(quick=False) if whole else (attack.harmless,):
        for trial in attack.trials(value):
            trace = solve_pic(trial.scene)
            velocity, spin = _by_hand(trial)
            spins = None if trace.final_spin_rad_s is None else np.array([spin])
            told = dataclasses.replace(trace, final_velocity_m_s=np.array([velocity]), final_spin_rad_s=spins)
            for judged in (trial.judge(told), trial.judge(trace)):
                assert judged.broken == ""
                assert judged.error < 1e-14


@each("attack", [*WALLS.values(), *IN_CONTACT.values()])
def test_a_disc_that_goes_on_as_without_walls_is_broken(attack: Attack) -> None:
    """A trace in which the disc flies or falls past is broken at the harmless end: no judge takes what it is given."""
    bare = {"walls": (), "wall_friction": 0.0, "wall_rolling_resistance": 0.0, "wall_restitution": 1.0}
    for trial in attack.trials(attack.harmless):
        broken = trial.judge(solve_pic(trial.scene.model_copy(update=bare))).broken
        assert "no impact is found" in broken or (attack.name in IN_CONTACT and "a velocity is wrong by" in broken)


def test_a_rim_that_friction_has_not_turned_is_broken() -> None:
    """With its velocity right and its spin as at the start, a disc that rolls by the law is broken, and why is said."""
    for name in ("slipping-slope", "bouncing-slope", "slide-friction"):
        trial = IN_CONTACT[name].trials(IN_CONTACT[name].harmless)[-1]
        trace = solve_pic(trial.scene)
        unturned = dataclasses.replace(trace, final_spin_rad_s=np.array([trial.scene.discs[0].spin_rad_s]))
        assert "a rim speed is wrong by" in trial.judge(unturned).broken
        assert trial.judge(unturned).broken.endswith("of the change by contact")


def test_both_sides_of_a_threshold_are_tried_to_a_rounding() -> None:
    """The last rungs are one rounding of 1 off on either side, and the threshold itself."""
    for name in ("sliding-slope", "slipping-slope", "rolling-slope", "bouncing-slope"):
        *_, least, none = IN_CONTACT[name].build_ladder(quick=False)
        assert (least, none) == (2.0**-52, 0.0)
        above, below = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(least)))
        (at, _) = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(none)))
        assert below <= at <= above
        assert above - below <= 8.0 * 2.0**-52 * at


ROUGH = {attack.name: attack for attack in FRICTION_ATTACKS}


@each("name", [name for name in ROUGH if name != "rolling"])
def test_pic_stands_every_rung(name: str) -> None:
    """From the harmless to the absurd end PIC is the closed form's to rounding, chains of grips included."""
    for value in ROUGH[name].build_ladder(quick=False):
        for trial in ROUGH[name].trials(value):
            judgement = trial.judge(solve_pic(trial.scene))
            assert judgement.broken == ""
            assert judgement.error < 1e-11, value


@each("value", [0.9, 0.5, 0.1, 1e-3])
def test_what_bounces_on_a_rough_floor_ends_rolling(value: float) -> None:
    """Bounces without end, sliding at first: the disc rolls as angular momentum about the floor says."""
    (trial,) = ROUGH["rolling"].trials(value)
    trace = solve_pic(trial.scene)
    assert sure(trace.modes)["after"].tolist() == [Mode.ROLL]
    assert trial.judge(trace).error < 1e-12
    assert trial.judge(solve_pit(trial.scene)).broken == ""


@each("name", ["friction", "spin", "inertia"])
def test_pit_stands_what_turns_no_normal(name: str) -> None:
    """Head-on and on walls checking once per step costs no velocity and no spin."""
    for value in ROUGH[name].build_ladder(quick=True):
        for trial in ROUGH[name].trials(value):
            assert trial.judge(solve_pit(trial.scene)).error < 1e-11, value


@each("name", list(ROUGH))
def test_a_wrong_spin_breaks_every_attack(name: str) -> None:
    """With its velocities right, and its spins left out or turned round, a run is broken by name."""
    trial = ROUGH[name].trials(ROUGH[name].harmless * (10.0 if name == "friction" else 1.0))[0]
    trace = solve_pic(trial.scene)
    assert trial.judge(trace).broken == ""
    turned = dataclasses.replace(trace, final_spin_rad_s=-10.0 * sure(trace.final_spin_rad_s))
    assert "a rim speed is wrong by" in trial.judge(turned).broken
    none = dataclasses.replace(trace, final_spin_rad_s=None, spins=None)
    assert trial.judge(none).broken == "no spin is reported"
    no_number = dataclasses.replace(trace, final_spin_rad_s=np.full(len(trial.scene.discs), np.nan))
    assert trial.judge(no_number).broken
