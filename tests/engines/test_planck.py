"""Planck: event-driven where it is asked to be; contacts below its threshold, walls, long moves where it is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.engines.staged import Drive, Finish, Named, after_oblique, energy_part, head_on, oblique

from carom import Disc, Scene, Wall
from carom.scenes import all_scenes

#: Rounding of a velocity after an impact at speeds of some metres a second.
ROUNDING = 1e-12


@pytest.mark.parametrize("frames", [24, 30, 60])
def test_planck_can_be_made_event_driven(frames: int, named: Named, drive: Drive) -> None:
    """With bullets and a slop of 1e-14 m an oblique impact has its closed form, in time and velocities, at any rate."""
    planck = named("planck")
    seen = drive(planck, oblique(), 1 / frames, "event-driven")
    np.testing.assert_allclose(seen[-1].velocity_m_s, after_oblique(), atol=ROUNDING)
    (contact,) = [contact for look in seen for contact in look.contacts]
    assert contact.time_s == pytest.approx(0.377, abs=ROUNDING)
    assert contact.normal == pytest.approx((0.8, 0.6), abs=ROUNDING)


def test_planck_tuned_is_not(named: Named, finish: Finish) -> None:
    """Without bullets the same impact is found late, and its direction is off by percents at 60 frames a second."""
    error = finish(named("planck"), oblique(), 1 / 60, "tuned").velocity_m_s - after_oblique()
    assert np.abs(error).max() > 0.01


@pytest.mark.parametrize("profile", ["swept", "tuned"])
@pytest.mark.parametrize("speed_m_s", [10.0, 100.0, 1000.0])
def test_only_planck_swept_stops_bullets(profile: str, speed_m_s: float, named: Named, finish: Finish) -> None:
    """Discs of 5 cm at up to 1000 m/s all hit, in eight phases of a step; without bullets most pass through."""
    hits = 0
    for phase in range(8):
        scene = head_on(speed_m_s, 0.05, (phase + 0.5) / 8)
        hits += bool(finish(named("planck"), scene, 1 / 60, profile).velocity_m_s[1, 0] > 0)
    assert (hits == 8) == (profile == "swept")


@pytest.mark.parametrize(("slop_m", "hits"), [(1e-9, True), (1e-14, False)])
def test_a_slop_below_the_rounding_of_positions_loses_impacts(
    slop_m: float, hits: bool, named: Named, finish: Finish
) -> None:
    """100 m out, where numbers are 1.4e-14 m apart, its time of impact finds nothing to 1e-14 m, and says nothing."""
    near = head_on(100.0, 0.05, 0.5)
    discs = [disc.model_copy(update={"position_m": (disc.position_m[0] + 100, 0.0)}) for disc in near.discs]
    scene = near.model_copy(update={"discs": tuple(discs)})
    end = finish(named("planck"), scene, 1 / 60, "swept", linearSlop=slop_m)
    assert bool(end.velocity_m_s[1, 0] > 0) == hits
    assert end.warning == ""


@pytest.mark.parametrize(("speed_m_s", "bounces"), [(0.99, False), (1.01, True)])
def test_planck_as_shipped_makes_slow_contacts_inelastic(
    speed_m_s: float, bounces: bool, named: Named, finish: Finish
) -> None:
    """Elastic discs that close at less than 1 m/s leave together, at half the speed, without a word."""
    end = finish(named("planck"), head_on(speed_m_s), 1 / 60, "default")
    expected = [0, speed_m_s] if bounces else [speed_m_s / 2, speed_m_s / 2]
    np.testing.assert_allclose(end.velocity_m_s[:, 0], expected, atol=ROUNDING)
    tuned = finish(named("planck"), head_on(speed_m_s), 1 / 60, "tuned")
    np.testing.assert_allclose(tuned.velocity_m_s[:, 0], [0, speed_m_s], atol=ROUNDING)


def test_planck_as_shipped_keeps_a_centimetre_from_walls(named: Named, drive: Drive) -> None:
    """A slow step shows where a disc turns: 1 cm before the wall, twice the slop of 5 mm."""
    disc = Disc(position_m=(1, 0), velocity_m_s=(-2, 0), radius_m=0.5)
    scene = Scene(name="wall", discs=[disc], walls=[Wall(point_m=(0, 0), normal=(1, 0))], duration_s=0.5)
    for profile, skin_m in (("default", 0.01), ("tuned", 0.0)):
        nearest = min(look.position_m[0, 0] for look in drive(named("planck"), scene, 1e-4, profile))
        assert nearest - 0.5 == pytest.approx(skin_m, abs=2e-4)


def test_planck_slows_down_what_moves_more_than_two_metres_a_step(named: Named, finish: Finish) -> None:
    """A light disc sent off by a heavy one at nearly twice its speed moves 2 m a step, with a warning."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(100, 0), radius_m=0.5, mass_kg=1000)
    scene = Scene(name="sling", discs=[heavy, Disc(position_m=(6, 0), radius_m=0.5, mass_kg=1)], duration_s=0.2)
    law = 2 * 1000 * 100 / 1001
    end = finish(named("planck"), scene, 1 / 60, "default")
    assert end.velocity_m_s[1, 0] == pytest.approx(120, abs=1e-9)
    assert "slowed down" in end.warning
    assert finish(named("planck"), scene, 1 / 60, "tuned").velocity_m_s[1, 0] == pytest.approx(law, rel=ROUNDING)


def test_planck_as_shipped_cools_a_gas(named: Named, finish: Finish) -> None:
    """25 elastic discs lose a tenth of their energy in 20 s as shipped, and no millionth with no threshold."""
    scene = all_scenes()["engines/gas-of-25"].scene
    assert energy_part(scene, finish(named("planck"), scene, 1 / 60, "default")) < 0.9
    for profile in ("tuned", "swept", "event-driven"):
        assert math.isclose(energy_part(scene, finish(named("planck"), scene, 1 / 60, profile)), 1, rel_tol=1e-6)


def test_planck_event_driven_grips_a_wall_as_coulomb_has_it(named: Named, finish: Finish) -> None:
    """A disc of inertia 1/2 that grips keeps two thirds of its speed along the wall, and rolls: 2 of 3 m/s here."""
    end = finish(named("planck"), all_scenes()["spin/grip"].scene, 1 / 60, "event-driven")
    assert end.spin_rad_s is not None
    np.testing.assert_allclose(end.velocity_m_s, [[2, 2]], atol=ROUNDING)
    np.testing.assert_allclose(end.spin_rad_s, [-2], atol=ROUNDING)


def test_planck_as_shipped_turns_no_disc_more_than_a_quarter_turn_a_step(named: Named, finish: Finish) -> None:
    """A disc that a grip should leave with two thirds of 180 rad/s keeps pi / 2 a step, with a warning."""
    rough = all_scenes()["spin/grip"].scene
    (disc,) = rough.discs
    fast = disc.model_copy(update={"velocity_m_s": (60 * disc.velocity_m_s[0], disc.velocity_m_s[1])})
    scene = rough.model_copy(update={"discs": (fast,), "wall_friction": 100.0})
    end = finish(named("planck"), scene, 1 / 60, "default", maxTranslation=1e100)
    assert end.spin_rad_s is not None
    assert end.spin_rad_s[0] == pytest.approx(-math.pi / 2 * 60, rel=1e-9)
    assert "rad a step" in end.warning
