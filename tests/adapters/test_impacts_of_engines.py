"""One impact is one impact, whatever an engine makes of it: contacts of many steps, of none, and two at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.stage import Named, disc_at, staged

from carom import Scene
from carom.adapter import Adapter
from carom.runs.observe import observe_run


def _head_on() -> Scene:
    discs = [disc_at(0, 0, 2), disc_at(1.5, 0, -1)]
    return staged("head-on", *discs, duration_s=1.0)


def test_a_spring_contact_of_many_steps_is_one_impact(named: Named) -> None:
    """MuJoCo's default contact spring acts for pi / sqrt(k) seconds; its steps are one impact with outer velocities."""
    mujoco, dt_s = named("mujoco"), 1 / 1000
    scene = _head_on()
    world = mujoco.prepare(scene, mujoco.profiles["default"].settings(dt_s))
    in_contact = 0
    for _ in range(scene.step_count(dt_s)):
        world.advance(1)
        in_contact += bool(world.observe().contacts)
    world.close()
    assert in_contact > 0.9 * math.pi / math.sqrt(1000) / dt_s  # the contact's half period: 99 steps
    (impact,) = observe_run(mujoco, scene, "default", dt_s).impacts
    assert impact["velocity_first_before"].tolist() == [2, 0]
    assert impact["velocity_second_before"].tolist() == [-1, 0]
    # Equal masses exchange velocities; the spring's first-order integration loses a thousandth.
    assert impact["velocity_first_after"][0] == pytest.approx(-1, abs=3e-3)
    assert impact["velocity_second_after"][0] == pytest.approx(2, abs=3e-3)


def test_an_overlap_without_impulse_is_no_impact(engine: Adapter) -> None:
    """Discs that overlap at one boundary only, when they part already, exchange nothing: reported or not, no impact."""
    # Nearest at 0.47 s; the only boundary inside the overlap is later than that, when they separate already.
    dt_s, speed, offset = 0.1, 3.0, 0.99
    scene = staged("deep graze", disc_at(-0.47 * speed, 0, speed), disc_at(0, offset), duration_s=1.0)
    # The chord lasts 2 sqrt(1 - offset^2) / speed = 0.094 s around 0.47 s: of 0.4, 0.5 and 0.6 s it holds 0.5 s.
    half_chord_s = math.sqrt(1 - offset**2) / speed
    assert 0.47 - half_chord_s > 0.4
    assert 0.47 < 0.5 < 0.47 + half_chord_s
    profile = "no-ccd" if "no-ccd" in engine.profiles else "tuned"
    trace = observe_run(engine, scene, profile, dt_s)
    assert len(trace.impacts) == 0
    assert trace.final_velocity_m_s[1].tolist() == [0, 0]


def test_two_contacts_of_one_disc_in_one_step_are_two_impacts(engine: Adapter) -> None:
    """A disc that strikes two others within one step has two impacts, whose pushes add up to its change of velocity."""
    scene = staged("one into two", disc_at(-1.5, 0, 3), disc_at(0, 0.51), disc_at(0, -0.51), duration_s=1.0)
    trace = observe_run(engine, scene, "tuned", 1 / 60)
    first, second = trace.impacts[:2]  # in whichever order the engine takes them
    assert {int(first["second"]), int(second["second"])} == {1, 2}
    assert first["first"] == second["first"] == 0
    assert first["time_s"] == second["time_s"]
    # Both struck discs are pushed along their own normals, up and to the right, and down and to the right.
    for impact in (first, second):
        assert abs(impact["velocity_second_after"][1]) > 0.5
        assert (impact["velocity_second_after"][1] > 0) == (impact["second"] == 1)
    # Between the two, the striker has the velocity that the first has left it.
    assert first["velocity_first_before"].tolist() == [3, 0]
    np.testing.assert_allclose(first["velocity_first_after"], second["velocity_first_before"], rtol=0, atol=1e-6)


def test_velocities_are_those_outside_the_contact(engine: Adapter) -> None:
    """Before and after an impact stand the velocities of free flight: the scene's own, and the final ones."""
    for profile in ("default", "tuned", "located"):
        trace = observe_run(engine, _head_on(), profile, 1 / 240)
        (impact,) = trace.impacts
        assert [impact["velocity_first_before"].tolist(), impact["velocity_second_before"].tolist()] == [
            [2, 0],
            [-1, 0],
        ]
        assert impact["velocity_first_after"].tolist() == trace.final_velocity_m_s[0].tolist()
        assert impact["velocity_second_after"].tolist() == trace.final_velocity_m_s[1].tolist()
