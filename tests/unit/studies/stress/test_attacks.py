"""Attacks, at walls, in contact and with friction, too: PIC passes them, and a check finds what is wrong."""

import cmath
import dataclasses
import itertools
import json
import math
import string
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp
from tests.cases import each, release_after
from tests.scene_builders import require_value
from tests.validation import contact_runs

from carom import load_scene, save_scene, solve_pic, solve_pit
from carom.model.scene import Chain, Scene
from carom.model.trace import Mode, Trace
from carom.studies.stress import attack as stress_attack
from carom.studies.stress.attack import Attack
from carom.studies.stress.contact import CONTACT_ATTACKS
from carom.studies.stress.finite_walls import WALL_ATTACKS
from carom.studies.stress.friction import FRICTION_ATTACKS
from carom.studies.stress.run import list_attacks

ATTACKS = [attack for _, attack in list_attacks()]
each_attack = each("attack", ATTACKS)

#: Attacks that no float64 method can pass to the end: an error doubles faster than once a bounce.
HORIZON = "unstable-orbit"


def test_ladder_is_monotone_from_harmless_to_extreme_value() -> None:
    """Each ladder is monotone from the harmless to the extreme value, with at least four different values."""
    for attack, quick in itertools.product(ATTACKS, (False, True)):
        ladder = attack.build_ladder(quick)
        end = attack.quick_absurd if quick and attack.quick_absurd is not None else attack.absurd
        ends = (attack.harmless, end if attack.last is None else attack.last)
        assert (ladder[0], ladder[-1]) == ends, attack.name
        assert ladder == sorted(ladder, reverse=ladder[-1] < ladder[0]), attack.name
        assert len(set(ladder)) == len(ladder) >= 4, attack.name


def test_every_entry_of_attacks_file_is_used() -> None:
    """Each entry of attacks.json is an attack, and each shared sentence is part of an entry."""
    held = json.loads(Path(stress_attack.__file__).with_name("attacks.json").read_text(encoding="utf-8"))
    assert sorted(attack.name for attack in ATTACKS) == sorted(held["attacks"])
    quoted = "".join(entry["truth"] + entry["gives_way"] for entry in held["attacks"].values())
    assert {name for _, name, _, _ in string.Formatter().parse(quoted) if name} == set(held["sentences"])


@each_attack
@pytest.mark.parametrize("stride", release_after(1, [6, 1]))
def test_pic_passes_every_attack(attack: Attack, stride: int, tmp_path: Path) -> None:
    """PIC passes the quick ladder of every attack, unstable-orbit up to 20, and its scene survives a file."""
    ladder = attack.build_ladder(quick=True)
    if attack.name == HORIZON:
        ladder = [value for value in ladder if value <= 20]
    rungs = {value: attack.trials(value) for value in (ladder[::-stride] if not attack.full_only else ladder[:1])}
    for trial in rungs[min(rungs, key=ladder.index)][:1]:
        save_scene(trial.scene, tmp_path / "scene.toml")
        assert load_scene(tmp_path / "scene.toml") == trial.scene
    for value, trials in rungs.items():
        for trial in trials:
            result = trial.check(solve_pic(trial.scene))
            assert not result.broken, (value, result)


@each("name", ["grazing", "tunnelling", "galperin"])
def test_pit_fails_attacks_on_sampling(name: str) -> None:
    """PIT passes grazing, tunnelling and galperin at the harmless value and fails at the extreme one."""
    attack = next(attack for attack in ATTACKS if attack.name == name)

    def stands(value: float) -> bool:
        return all(not trial.check(solve_pit(trial.scene)).broken for trial in attack.trials(value))

    ladder = attack.build_ladder(quick=True)
    assert stands(ladder[0])
    assert not stands(ladder[-1])


def test_bisection_value_is_geometric_mean() -> None:
    """The value between two others is their geometric mean, whole on whole axes, or none within the resolution."""
    pair, crowd = (next(a for a in ATTACKS if a.name == name) for name in ("mass-ratio", "at-once"))
    assert pair.find_middle_value(1.0, 100.0, 1.1) == 10.0
    assert pair.find_middle_value(1.0, 1.05, 1.1) is None
    assert crowd.find_middle_value(2.0, 8.0, 1.1) == 4.0
    assert crowd.find_middle_value(2.0, 3.0, 1.1) is None
    assert pair.find_middle_value(1e-15, 0.0, 1.1) is None


WALLS = {attack.name: attack for attack in WALL_ATTACKS}


@each("name", ["thin-wall", "paddle"])
def test_pit_misses_thin_wall_only_with_large_steps(name: str) -> None:
    """PIT passes all phases at a thin wall or paddle at 0.99 radii per step, and fails at least one at 8."""
    assert not any(trial.check(solve_pit(trial.scene)).broken for trial in WALLS[name].trials(0.99))
    assert any(trial.check(solve_pit(trial.scene)).broken for trial in WALLS[name].trials(8.0))


def test_seam_attack_hits_a_joint_of_the_floor() -> None:
    """In the seam attack, the disc hits the floor exactly above a joint, for any number of pieces."""
    for pieces in WALLS["seam"].build_ladder(quick=False):
        for trial in WALLS["seam"].trials(pieces):
            (chain,), (impact,) = trial.scene.walls, solve_pic(trial.scene).impacts
            assert isinstance(chain, Chain)
            joints = np.linspace(chain.points_m[0][0], chain.points_m[1][0], int(pieces) + 1)[1:-1]
            disc = trial.scene.discs[0]
            struck = disc.position_m[0] + disc.velocity_m_s[0] * impact["time_s"]
            assert np.abs(joints - struck).min() < 1e-12
            assert math.isclose(cmath.phase(complex(*disc.velocity_m_s)), -math.atan(0.25))


IN_CONTACT = {attack.name: attack for attack in CONTACT_ATTACKS}


@each(
    "name, whole",
    [*((name, False) for name in list(IN_CONTACT)[::2]), *release_after(0, [(name, True) for name in IN_CONTACT])],
)
def test_contact_truth_and_pic_agree_with_60_digits(name: str, whole: bool) -> None:
    """The truth of contact attacks and PIC agree to 1e-14 with an integration in 60 digits."""
    attack = IN_CONTACT[name]
    for value in attack.build_ladder(quick=False) if whole else (attack.harmless,):
        for trial in attack.trials(value):
            trace = solve_pic(trial.scene)
            with mp.workdps(contact_runs.DIGITS):
                end = contact_runs.run_contact_scene(trial.scene)
                velocity, spin = [float(part) for part in end.velocity], float(end.spin)
            spins = None if trace.final_spin_rad_s is None else np.array([spin])
            told = dataclasses.replace(trace, final_velocity_m_s=np.array([velocity]), final_spin_rad_s=spins)
            for checked in (trial.check(told), trial.check(trace)):
                assert checked.broken == ""
                assert checked.error < 1e-14


@each("attack", [*WALLS.values(), *IN_CONTACT.values()])
def test_trace_that_ignores_walls_fails_every_attack(attack: Attack) -> None:
    """A trace in which the disc ignores the walls fails each wall and contact attack at the harmless value."""
    bare = {"walls": (), "wall_friction": 0.0, "wall_rolling_resistance": 0.0, "wall_restitution": 1.0}
    for trial in attack.trials(attack.harmless):
        broken = trial.check(solve_pic(trial.scene.model_copy(update=bare))).broken
        assert "no impact is found" in broken or (attack.name in IN_CONTACT and "a velocity is wrong by" in broken)


def test_unchanged_spin_of_rolling_disc_fails() -> None:
    """A disc that rolls with the right velocity and its initial spin fails, and the reason is the rim speed."""
    for name in ("slipping-slope", "bouncing-slope", "slide-friction"):
        trial = IN_CONTACT[name].trials(IN_CONTACT[name].harmless)[-1]
        trace = solve_pic(trial.scene)
        unturned = dataclasses.replace(trace, final_spin_rad_s=np.array([trial.scene.discs[0].spin_rad_s]))
        assert "a rim speed is wrong by" in trial.check(unturned).broken
        assert trial.check(unturned).broken.endswith("times the change by contact")


def test_slope_attacks_end_at_threshold_and_one_rounding_beside() -> None:
    """The last two values of slope attacks are one rounding (2^-52) next to the threshold, and the threshold."""
    for name in ("sliding-slope", "slipping-slope", "rolling-slope", "bouncing-slope"):
        *_, least, none = IN_CONTACT[name].build_ladder(quick=False)
        assert (least, none) == (2.0**-52, 0.0)
        above, below = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(least)))
        (at, _) = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(none)))
        assert below <= at <= above
        assert above - below <= 8.0 * 2.0**-52 * at


ROUGH = {attack.name: attack for attack in FRICTION_ATTACKS}


@each(
    "name, solve, quick",
    [
        *((name, solve_pic, False) for name in ROUGH if name != "rolling"),
        *((name, solve_pit, True) for name in ("friction", "spin", "inertia")),
    ],
)
def test_friction_attacks_are_passed_to_rounding(name: str, solve: Callable[[Scene], Trace], quick: bool) -> None:
    """PIC passes all friction attacks but rolling with errors below 1e-11, PIT those in which no normal turns."""
    for value in ROUGH[name].build_ladder(quick=quick):
        for trial in ROUGH[name].trials(value):
            result = trial.check(solve(trial.scene))
            assert result.broken == ""
            assert result.error < 1e-11, value


@each("value", [0.9, 0.5, 0.1, 1e-3])
def test_disc_bouncing_on_rough_floor_ends_rolling(value: float) -> None:
    """After infinitely many bounces on a rough floor the disc rolls; PIC errs below 1e-12, and PIT passes."""
    (trial,) = ROUGH["rolling"].trials(value)
    trace = solve_pic(trial.scene)
    assert require_value(trace.modes)["after"].tolist() == [Mode.ROLL]
    assert trial.check(trace).error < 1e-12
    assert trial.check(solve_pit(trial.scene)).broken == ""


@each("name", list(ROUGH))
def test_wrong_or_missing_spin_fails_friction_attacks(name: str) -> None:
    """In each friction attack, a run with a reversed, missing or NaN spin fails with the reason."""
    trial = ROUGH[name].trials(ROUGH[name].harmless * (10.0 if name == "friction" else 1.0))[0]
    trace = solve_pic(trial.scene)
    assert trial.check(trace).broken == ""
    turned = dataclasses.replace(trace, final_spin_rad_s=-10.0 * require_value(trace.final_spin_rad_s))
    assert "a rim speed is wrong by" in trial.check(turned).broken
    none = dataclasses.replace(trace, final_spin_rad_s=None, spins=None)
    assert trial.check(none).broken == "no spin is reported"
    no_number = dataclasses.replace(trace, final_spin_rad_s=np.full(len(trial.scene.discs), np.nan))
    assert trial.check(no_number).broken
