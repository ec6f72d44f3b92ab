"""Uniform gravity: closed forms of PIC and of PIT."""

import math

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom import Outcome, Scene, solve_pic, solve_pit
from carom.catalogue import catalogue
from carom.errors import InputError

G = 9.81


def build_ball_scene(duration_s: float = 10.0) -> Scene:
    """Return a ball that falls 1 m to a floor, and moves along it."""
    bodies = disc_at(0, 1.125, 0.3, 0, r=0.125), wall_at(0, 0, 0, 1)
    return staged("ball", *bodies, gravity_m_s2=(0, -G), duration_s=duration_s)


@pytest.mark.long
def test_elastic_ball_is_exact_over_1e5_bounces() -> None:
    """The n-th bounce is at (2 n + 1) sqrt(2 h/g) to 1e-13, and the energy is constant to 1e-12."""
    impacts = solve_pic(build_ball_scene(1e9), max_impacts=100_000).impacts
    exact = (2 * np.arange(100_000) + 1) * math.sqrt(2 / G)
    assert np.max(np.abs(impacts["time_s"] / exact - 1)) <= 1e-13
    energy = np.sum(impacts["velocity_first_after"] ** 2, axis=1)
    assert np.max(np.abs(energy / energy[0] - 1)) <= 1e-12


def test_disc_slides_down_a_vertical_wall_without_impact() -> None:
    """A disc that touches a vertical wall falls along it to the end of the scene without an impact."""
    trace = solve_pic(staged("slide", disc_at(0.5, 0), wall_at(0, 0, 1, 0), gravity_m_s2=(0, -8), duration_s=2))
    assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 0)
    assert trace.final_position_m.tolist() == [[0.5, -16.0]]


def test_inelastic_stack_ends_at_a_standstill() -> None:
    """A heavy disc that falls on a light one on the floor ends the run as STANDSTILL, with a note that says why."""
    bodies = disc_at(0, 0.5, r=0.25), disc_at(0, 1.25, r=0.25, m=100.0), wall_at(0, 0, 0, 1)
    laws = {"restitution": 0.5, "wall_restitution": 0.5, "gravity_m_s2": (0, -G)}
    trace = solve_pic(staged("stack", *bodies, duration_s=20, **laws), max_impacts=20_000)
    assert trace.outcome is Outcome.STANDSTILL
    assert "faster than floats can resolve" in trace.notes[0]
    assert np.all(np.diff(trace.impacts["time_s"]) >= 0)


@each("rate", [7.0, 60.0, 1000.0])
def test_pit_bounces_at_the_first_frame_in_the_floor(rate: float) -> None:
    """PIT finds the first bounce at the first frame at or after sqrt(2 h/g), with the speed g t of that frame."""
    impact = solve_pit(build_ball_scene(), frame_rate_hz=rate).impacts[0]
    frame = math.ceil(math.sqrt(2 / G) * rate)
    assert impact["time_s"] == frame / rate
    assert impact["velocity_first_after"][1] == pytest.approx(G * frame / rate, rel=1e-13)


def test_pit_reports_one_impact_of_discs_that_fall_on_together() -> None:
    """After a head-on impact with restitution 0, PIT counts no further impact from the rounding of the approach."""
    for angle in np.arange(1, 13) / 10:
        cos, sin = math.cos(angle), math.sin(angle)
        discs = disc_at(0.0, 0.0, 3.0 * cos, 3.0 * sin), disc_at(1.5 * cos, 1.5 * sin)
        scene = staged("pair", *discs, gravity_m_s2=(0.3, -1.0), restitution=0.0, duration_s=1.0)
        assert len(solve_pit(scene).impacts) == 1, angle


def test_pit_impact_of_a_falling_pair_is_that_without_gravity() -> None:
    """Gravity acts equally on both discs of a pair, so PIT's impact has the time of a floating pair."""
    falling = catalogue()["gravity/falling-pair"].scene
    floating = falling.model_copy(update={"gravity_m_s2": (0.0, 0.0)})
    for rate in (30.0, 60.0, 250.0):
        with_gravity, without = (solve_pit(scene, frame_rate_hz=rate).impacts for scene in (falling, floating))
        assert with_gravity["time_s"].tolist() == without["time_s"].tolist()
        gained = np.array(falling.gravity_m_s2) * with_gravity["time_s"][0]
        for name in ("velocity_first_after", "velocity_second_after"):
            assert with_gravity[name][0] == pytest.approx(without[name][0] + gained, abs=1e-13)


def test_contact_duration_is_refused_under_gravity() -> None:
    """The TC model does not support gravity, so a contact duration above 0 is refused with that reason."""
    with pytest.raises(InputError, match=r"contact_duration_s must be 0 in a scene with gravity, got 0.1"):
        solve_pic(build_ball_scene(), contact_duration_s=0.1)
