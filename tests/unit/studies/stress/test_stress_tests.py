"""Stress tests: PIC passes them, and wrong runs fail them."""

import cmath
import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import require_value

from carom import load_scene, save_scene, solve_pic, solve_pit
from carom.model.scene import Chain
from carom.studies.stress.contact import CONTACT_TESTS, FRICTION_TESTS
from carom.studies.stress.pairs import WALL_TESTS
from carom.studies.stress.run import STRESS_TESTS
from carom.studies.stress.stress_test import StressTest


def test_ladder_is_monotone_from_harmless_to_extreme_value() -> None:
    """Each ladder is monotone from the harmless to the extreme value, with at least four different values."""
    for stress_test, quick in itertools.product(STRESS_TESTS, (False, True)):
        ladder = stress_test.build_ladder(quick)
        end = stress_test.quick_extreme if quick and stress_test.quick_extreme is not None else stress_test.extreme
        ends = (stress_test.harmless, end if stress_test.final_value is None else stress_test.final_value)
        assert (ladder[0], ladder[-1]) == ends, stress_test.name
        assert ladder == sorted(ladder, reverse=ladder[-1] < ladder[0]), stress_test.name
        assert len(set(ladder)) == len(ladder) >= 4, stress_test.name


@each("stress_test", STRESS_TESTS)
@pytest.mark.parametrize("stride", release_after(1, [6, 1]))
def test_pic_passes_every_stress_test(stress_test: StressTest, stride: int, tmp_path: Path) -> None:
    """PIC passes the quick ladder of every stress test to rounding, and the scene survives a file.

    In unstable-orbit an error doubles faster than once a bounce, and the pressure of a gas is a mean over a run.
    """
    ladder = stress_test.build_ladder(quick=True)
    if stress_test.name == "unstable-orbit":
        ladder = [value for value in ladder if value <= 20]
    for value in ladder[:1] if stress_test.full_only else ladder[::-stride]:
        for trial in stress_test.trials(value):
            result = trial.check(solve_pic(trial.scene))
            assert not result.failure, (value, result)
            assert result.error < 1e-11 or stress_test.name in {"unstable-orbit", "gas-pressure"}, (value, result)
    scene = stress_test.trials(ladder[0])[0].scene
    save_scene(scene, tmp_path / "scene.toml")
    assert load_scene(tmp_path / "scene.toml") == scene


@each(
    "name, passes, fails",
    [
        ("grazing", None, None),
        ("tunnelling", None, None),
        ("galperin", None, None),
        ("thin-wall", 0.99, 8.0),
        ("paddle", 0.99, 8.0),
    ],
)
def test_pit_fails_stress_tests_on_sampling(name: str, passes: float | None, fails: float | None) -> None:
    """PIT passes at the first value, such as 0.99 radii per step, and fails at the last, such as 8."""
    stress_test = next(stress_test for stress_test in STRESS_TESTS if stress_test.name == name)
    first, *_, last = stress_test.build_ladder(quick=True)
    for value, is_passed in ((passes or first, True), (fails or last, False)):
        failures = [trial.check(solve_pit(trial.scene)).failure for trial in stress_test.trials(value)]
        assert any(failures) is not is_passed


def test_bisection_value_is_geometric_mean() -> None:
    """The value between two others is their geometric mean, whole on whole axes, or none within the resolution."""
    pair, crowd = (next(a for a in STRESS_TESTS if a.name == name) for name in ("mass-ratio", "at-once"))
    assert pair.find_middle_value(1.0, 100.0, 1.1) == 10.0
    assert pair.find_middle_value(1.0, 1.05, 1.1) is None
    assert crowd.find_middle_value(2.0, 8.0, 1.1) == 4.0
    assert crowd.find_middle_value(2.0, 3.0, 1.1) is None
    assert pair.find_middle_value(1e-15, 0.0, 1.1) is None


WALLS = {stress_test.name: stress_test for stress_test in WALL_TESTS}


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


@each("stress_test", [*WALLS.values(), *IN_CONTACT.values()])
def test_trace_that_ignores_walls_fails_every_stress_test(stress_test: StressTest) -> None:
    """A trace in which the disc ignores the walls fails each wall and contact stress test at the harmless value."""
    bare = {"walls": (), "wall_friction": 0.0, "wall_rolling_resistance": 0.0, "wall_restitution": 1.0}
    for trial in stress_test.trials(stress_test.harmless):
        failure = trial.check(solve_pic(trial.scene.model_copy(update=bare))).failure
        assert "no impact is found" in failure or (
            stress_test.name in IN_CONTACT and "a velocity is wrong by" in failure
        )


ROUGH = {stress_test.name: stress_test for stress_test in FRICTION_TESTS}


@each("name", [*ROUGH, "slipping-slope", "bouncing-slope", "slide-friction"])
def test_wrong_or_missing_spin_fails_friction_tests(name: str) -> None:
    """In stress tests with friction or contact, a run with a wrong, missing or NaN spin fails with the reason."""
    stress_test = {**ROUGH, **IN_CONTACT}[name]
    trial = stress_test.trials(stress_test.harmless * (10.0 if name == "friction" else 1.0))[-1]
    trace = solve_pic(trial.scene)
    turned = dataclasses.replace(trace, final_spin_rad_s=-10.0 * require_value(trace.final_spin_rad_s))
    assert "a rim speed is wrong by" in trial.check(turned).failure
    none = dataclasses.replace(trace, final_spin_rad_s=None, spins=None)
    assert trial.check(none).failure == "no spin is reported"
    no_number = dataclasses.replace(trace, final_spin_rad_s=np.full(len(trial.scene.discs), np.nan))
    assert trial.check(no_number).failure
