"""Stress tests, at walls, in contact and with friction, too: PIC passes them, and a check finds what is wrong."""

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
from carom.studies.stress import stress_test as stress_test_module
from carom.studies.stress.contact import CONTACT_TESTS
from carom.studies.stress.finite_walls import WALL_TESTS
from carom.studies.stress.friction import FRICTION_TESTS
from carom.studies.stress.run import STRESS_TESTS
from carom.studies.stress.stress_test import StressTest

each_stress_test = each("stress_test", STRESS_TESTS)

#: Stress tests that no float64 method can pass to the end: an error doubles faster than once a bounce.
HORIZON = "unstable-orbit"


def test_ladder_is_monotone_from_harmless_to_extreme_value() -> None:
    """Each ladder is monotone from the harmless to the extreme value, with at least four different values."""
    for stress_test, quick in itertools.product(STRESS_TESTS, (False, True)):
        ladder = stress_test.build_ladder(quick)
        end = stress_test.quick_extreme if quick and stress_test.quick_extreme is not None else stress_test.extreme
        ends = (stress_test.harmless, end if stress_test.final_value is None else stress_test.final_value)
        assert (ladder[0], ladder[-1]) == ends, stress_test.name
        assert ladder == sorted(ladder, reverse=ladder[-1] < ladder[0]), stress_test.name
        assert len(set(ladder)) == len(ladder) >= 4, stress_test.name


def test_every_entry_of_stress_tests_file_is_used() -> None:
    """Each entry of stress_tests.json is a stress test, and each shared sentence is part of an entry."""
    held = json.loads(Path(stress_test_module.__file__).with_name("stress_tests.json").read_text(encoding="utf-8"))
    assert sorted(stress_test.name for stress_test in STRESS_TESTS) == sorted(held["stress_tests"])
    quoted = "".join(entry["truth"] + entry["failure_rule"] for entry in held["stress_tests"].values())
    assert {name for _, name, _, _ in string.Formatter().parse(quoted) if name} == set(held["sentences"])


@each_stress_test
@pytest.mark.parametrize("stride", release_after(1, [6, 1]))
def test_pic_passes_every_stress_test(stress_test: StressTest, stride: int, tmp_path: Path) -> None:
    """PIC passes the quick ladder of every stress test, unstable-orbit up to 20, and its scene survives a file."""
    ladder = stress_test.build_ladder(quick=True)
    if stress_test.name == HORIZON:
        ladder = [value for value in ladder if value <= 20]
    trials_of_value = {
        value: stress_test.trials(value) for value in (ladder[::-stride] if not stress_test.full_only else ladder[:1])
    }
    for trial in trials_of_value[min(trials_of_value, key=ladder.index)][:1]:
        save_scene(trial.scene, tmp_path / "scene.toml")
        assert load_scene(tmp_path / "scene.toml") == trial.scene
    for value, trials in trials_of_value.items():
        for trial in trials:
            result = trial.check(solve_pic(trial.scene))
            assert not result.failure, (value, result)


@each("name", ["grazing", "tunnelling", "galperin"])
def test_pit_fails_stress_tests_on_sampling(name: str) -> None:
    """PIT passes grazing, tunnelling and galperin at the harmless value and fails at the extreme one."""
    stress_test = next(stress_test for stress_test in STRESS_TESTS if stress_test.name == name)

    def stands(value: float) -> bool:
        return all(not trial.check(solve_pit(trial.scene)).failure for trial in stress_test.trials(value))

    ladder = stress_test.build_ladder(quick=True)
    assert stands(ladder[0])
    assert not stands(ladder[-1])


def test_bisection_value_is_geometric_mean() -> None:
    """The value between two others is their geometric mean, whole on whole axes, or none within the resolution."""
    pair, crowd = (next(a for a in STRESS_TESTS if a.name == name) for name in ("mass-ratio", "at-once"))
    assert pair.find_middle_value(1.0, 100.0, 1.1) == 10.0
    assert pair.find_middle_value(1.0, 1.05, 1.1) is None
    assert crowd.find_middle_value(2.0, 8.0, 1.1) == 4.0
    assert crowd.find_middle_value(2.0, 3.0, 1.1) is None
    assert pair.find_middle_value(1e-15, 0.0, 1.1) is None


WALLS = {stress_test.name: stress_test for stress_test in WALL_TESTS}


@each("name", ["thin-wall", "paddle"])
def test_pit_misses_thin_wall_only_with_large_steps(name: str) -> None:
    """PIT passes all phases at a thin wall or paddle at 0.99 radii per step, and fails at least one at 8."""
    assert not any(trial.check(solve_pit(trial.scene)).failure for trial in WALLS[name].trials(0.99))
    assert any(trial.check(solve_pit(trial.scene)).failure for trial in WALLS[name].trials(8.0))


def test_seam_test_hits_a_joint_of_the_floor() -> None:
    """In the seam stress test, the disc hits the floor exactly above a joint, for any number of pieces."""
    for pieces in WALLS["seam"].build_ladder(quick=False):
        for trial in WALLS["seam"].trials(pieces):
            (chain,), (impact,) = trial.scene.walls, solve_pic(trial.scene).impacts
            assert isinstance(chain, Chain)
            joints = np.linspace(chain.points_m[0][0], chain.points_m[1][0], int(pieces) + 1)[1:-1]
            disc = trial.scene.discs[0]
            struck = disc.position_m[0] + disc.velocity_m_s[0] * impact["time_s"]
            assert np.abs(joints - struck).min() < 1e-12
            assert math.isclose(cmath.phase(complex(*disc.velocity_m_s)), -math.atan(0.25))


IN_CONTACT = {stress_test.name: stress_test for stress_test in CONTACT_TESTS}


@each(
    "name, whole",
    [*((name, False) for name in list(IN_CONTACT)[::2]), *release_after(0, [(name, True) for name in IN_CONTACT])],
)
def test_contact_truth_and_pic_agree_with_60_digits(name: str, whole: bool) -> None:
    """The truth of contact stress tests and PIC agree to 1e-14 with an integration in 60 digits."""
    stress_test = IN_CONTACT[name]
    for value in stress_test.build_ladder(quick=False) if whole else (stress_test.harmless,):
        for trial in stress_test.trials(value):
            trace = solve_pic(trial.scene)
            with mp.workdps(contact_runs.DIGITS):
                end = contact_runs.run_contact_scene(trial.scene)
                velocity, spin = [float(part) for part in end.velocity], float(end.spin)
            spins = None if trace.final_spin_rad_s is None else np.array([spin])
            told = dataclasses.replace(trace, final_velocity_m_s=np.array([velocity]), final_spin_rad_s=spins)
            for checked in (trial.check(told), trial.check(trace)):
                assert checked.failure == ""
                assert checked.error < 1e-14


@each("stress_test", [*WALLS.values(), *IN_CONTACT.values()])
def test_trace_that_ignores_walls_fails_every_stress_test(stress_test: StressTest) -> None:
    """A trace in which the disc ignores the walls fails each wall and contact stress test at the harmless value."""
    bare = {"walls": (), "wall_friction": 0.0, "wall_rolling_resistance": 0.0, "wall_restitution": 1.0}
    for trial in stress_test.trials(stress_test.harmless):
        failure = trial.check(solve_pic(trial.scene.model_copy(update=bare))).failure
        assert "no impact is found" in failure or (
            stress_test.name in IN_CONTACT and "a velocity is wrong by" in failure
        )


def test_unchanged_spin_of_rolling_disc_fails() -> None:
    """A disc that rolls with the right velocity and its initial spin fails, and the reason is the rim speed."""
    for name in ("slipping-slope", "bouncing-slope", "slide-friction"):
        trial = IN_CONTACT[name].trials(IN_CONTACT[name].harmless)[-1]
        trace = solve_pic(trial.scene)
        unturned = dataclasses.replace(trace, final_spin_rad_s=np.array([trial.scene.discs[0].spin_rad_s]))
        assert "a rim speed is wrong by" in trial.check(unturned).failure
        assert trial.check(unturned).failure.endswith("times the change that contact causes")


def test_slope_tests_end_at_threshold_and_one_rounding_beside() -> None:
    """The last two values of slope stress tests are one rounding (2^-52) next to the threshold, and the threshold."""
    for name in ("sliding-slope", "slipping-slope", "rolling-slope", "bouncing-slope"):
        *_, least, none = IN_CONTACT[name].build_ladder(quick=False)
        assert (least, none) == (2.0**-52, 0.0)
        above, below = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(least)))
        (at, _) = ((-gx / gy) for gx, gy in (trial.scene.gravity_m_s2 for trial in IN_CONTACT[name].trials(none)))
        assert below <= at <= above
        assert above - below <= 8.0 * 2.0**-52 * at


ROUGH = {stress_test.name: stress_test for stress_test in FRICTION_TESTS}


@each(
    "name, solve, quick",
    [
        *((name, solve_pic, False) for name in ROUGH if name != "rolling"),
        *((name, solve_pit, True) for name in ("friction", "spin", "inertia")),
    ],
)
def test_friction_tests_are_passed_to_rounding(name: str, solve: Callable[[Scene], Trace], quick: bool) -> None:
    """PIC passes all friction stress tests but rolling with errors below 1e-11, PIT those in which no normal turns."""
    for value in ROUGH[name].build_ladder(quick=quick):
        for trial in ROUGH[name].trials(value):
            result = trial.check(solve(trial.scene))
            assert result.failure == ""
            assert result.error < 1e-11, value


@each("value", [0.9, 0.5, 0.1, 1e-3])
def test_disc_bouncing_on_rough_floor_ends_rolling(value: float) -> None:
    """After infinitely many bounces on a rough floor the disc rolls; PIC errs below 1e-12, and PIT passes."""
    (trial,) = ROUGH["rolling"].trials(value)
    trace = solve_pic(trial.scene)
    assert require_value(trace.modes)["after"].tolist() == [Mode.ROLL]
    assert trial.check(trace).error < 1e-12
    assert trial.check(solve_pit(trial.scene)).failure == ""


@each("name", list(ROUGH))
def test_wrong_or_missing_spin_fails_friction_tests(name: str) -> None:
    """In each friction stress test, a run with a reversed, missing or NaN spin fails with the reason."""
    trial = ROUGH[name].trials(ROUGH[name].harmless * (10.0 if name == "friction" else 1.0))[0]
    trace = solve_pic(trial.scene)
    assert trial.check(trace).failure == ""
    turned = dataclasses.replace(trace, final_spin_rad_s=-10.0 * require_value(trace.final_spin_rad_s))
    assert "a rim speed is wrong by" in trial.check(turned).failure
    none = dataclasses.replace(trace, final_spin_rad_s=None, spins=None)
    assert trial.check(none).failure == "no spin is reported"
    no_number = dataclasses.replace(trace, final_spin_rad_s=np.full(len(trial.scene.discs), np.nan))
    assert trial.check(no_number).failure
