"""Certified runs with friction and spin: every number is enclosed, and stick or slide undecided ends nothing."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from tests.drawn import small

from carom import Disc, Scene, Wall, horizon, solve_pic
from carom.errors import InputError

pytest.importorskip("flint")
from tests.validation.enclosed import from_enclosures

from carom.solvers.certified.as_data import enclosures
from carom.solvers.certified.certify import certify
from carom.solvers.certified.result import CertifiedTrace, Degenerate, Ending

FLOOR = Wall(point_m=(0, 0), normal=(0, 1))


def on_floor(velocity: tuple[float, float], **fields: object) -> Scene:
    disc = Disc(position_m=(0, 2), velocity_m_s=velocity, radius_m=1)
    return Scene(**{"name": "floor", "discs": [disc], "walls": [FLOOR], "duration_s": 2.0, **fields})


def apart(one: CertifiedTrace, other: CertifiedTrace) -> list[tuple[int, str]]:
    """Return where two certified runs of one scene contradict each other."""
    found = []
    assert one.trace.spins is not None
    assert other.trace.spins is not None
    for a, b, ra, rb in (
        (one.trace.impacts, other.trace.impacts, one.radii, other.radii),
        (one.trace.spins, other.trace.spins, one.spin_radii, other.spin_radii),
    ):
        assert ra is not None
        assert rb is not None
        most = min(len(a), len(b))
        for name in a.dtype.names or ():
            if name != "second":  # which of two walls that are one
                inside = np.abs(a[name][:most] - b[name][:most]) <= ra[name][:most] + rb[name][:most]
                found += [(int(k), name) for k in np.argwhere(~inside)[:, 0]]
    return found


def test_runs_of_15_and_50_digits_enclose_the_same_truth_and_pic_is_within_it() -> None:
    """Of small rough scenes, with gravity and without, no number contradicts the other run's, and PIC's is near."""
    impacts = 0
    for number in range(40):
        scene = small(number, rough=True, gravity=(0.25, -1.0) if number % 4 == 3 else (0.0, 0.0))
        if not scene.arrays.turns:
            continue
        try:
            found = certify(scene, max_impacts=10)
        except InputError:  # falling discs beside immovable ones
            continue
        assert apart(found, certify(scene, digits=50, max_impacts=10)) == [], number
        trace, truth = solve_pic(scene, max_impacts=len(found)), found.trace
        if trace.impacts[["first", "second"]].tolist() == truth.impacts[["first", "second"]].tolist():
            assert trace.spins is not None
            assert truth.spins is not None
            impacts += len(trace.impacts)
            for name in truth.spins.dtype.names or ():
                np.testing.assert_allclose(trace.spins[name], truth.spins[name], rtol=1e-8, atol=1e-8)
    assert impacts > 100


def test_exactly_between_stick_and_slide_a_run_goes_on() -> None:
    """At |s| = 3 f (1 + e) w_n both branches are one: with dyadic numbers (9/4, -1), f = 1/2, e = 1/2 that is exact.

    The disc rolls: (3/2, 1/2) with spin -3/2, since T = f (1 + e) w_n = 3/4.
    """
    scene = on_floor((2.25, -1.0), wall_friction=0.5, wall_restitution=0.5)
    found = certify(scene, digits=30)
    assert found.ending is Ending.COMPLETED
    assert found.trace.spins is not None
    assert found.spin_radii is not None
    assert found.trace.impacts["velocity_first_after"].tolist() == [[1.5, 0.5]]
    assert found.trace.spins.tolist() == [(0.0, 0.0, -1.5, 0.0)]
    assert found.spin_radii["first_after"].max() < 1e-15
    assert [len(row) for row in found.decimals] == [6]
    assert Fraction(found.decimals[0][-1]) == Fraction(-3, 2)


def test_two_walls_at_one_instant_are_degenerate_with_friction() -> None:
    """Into a corner, impacts on orthogonal walls commute without friction; with it the run says that they do not."""
    walls = [Wall(point_m=(-1, 0), normal=(1, 0)), Wall(point_m=(0, -1), normal=(0, 1))]
    disc = Disc(position_m=(3, 2), velocity_m_s=(-3, -2), radius_m=1)
    smooth = Scene(name="corner", discs=[disc], walls=walls, duration_s=2.0)
    assert certify(smooth).ending is Ending.COMPLETED
    rough = certify(Scene(**{**smooth.model_dump(), "wall_friction": 0.25}))
    assert rough.degeneracy is not None
    assert rough.degeneracy.kind is Degenerate.SHARED_INSTANT


def test_between_two_plates_the_speed_falls_to_a_third_for_ever() -> None:
    """Grip between plates: the speed along them is times 2/3 at first, then (1 - k)/(1 + k) = 1/3 a bounce, proven."""
    ceiling = Wall(point_m=(0, 4), normal=(0, -1))
    scene = on_floor((3.0, -2.0), walls=[FLOOR, ceiling], wall_friction=100.0, duration_s=20.0)
    found = certify(scene)
    assert found.ending is Ending.COMPLETED
    along = found.trace.impacts["velocity_first_after"][:, 0]
    assert len(along) > 15
    for k, (one, other) in enumerate(pairwise([4.5 * 2 / 3, *along.tolist()])):
        assert other == pytest.approx(one * (2 / 3 if k == 0 else 1 / 3), rel=1e-13)
    assert horizon(scene).covers_the_scene


def test_a_certified_run_with_spins_is_read_back_from_data() -> None:
    """Spins and their radii are part of the document, and come back as they were."""
    found = certify(on_floor((2.0, -1.0), wall_friction=0.3))
    document = json.loads(json.dumps(enclosures(found)))
    again = from_enclosures(document)
    assert again.trace.spins is not None
    assert found.trace.spins is not None
    assert again.trace.spins.tobytes() == found.trace.spins.tobytes()
    assert enclosures(again)["spin_radii"] == enclosures(found)["spin_radii"]
    assert enclosures(again)["final_spin_rad_s"] == enclosures(found)["final_spin_rad_s"]
    assert "spins" not in enclosures(certify(on_floor((2.0, -1.0))))


def test_a_bounce_under_gravity_ends_rolling() -> None:
    """Thrown along a floor, a disc slides at each bounce until it rolls at 4/3 m/s: 13/8, 23/16, 43/32, then 4/3.

    By the series of impact speeds 1, 1/2, 1/4, ... each of which takes f (1 + e) w_n = 3/8 w_n of the speed, as long as
    the slip is more than three times that; the run's digits end before the infinitely many bounces do.
    """
    disc = Disc(position_m=(0, 1.5), velocity_m_s=(2, 0), radius_m=1)
    fields = {"gravity_m_s2": (0.0, -1.0), "wall_friction": 0.25, "wall_restitution": 0.5, "discs": [disc]}
    found = certify(on_floor((2.0, 0.0), **fields, duration_s=10.0), max_impacts=12)
    along = found.trace.impacts["velocity_first_after"][:, 0]
    np.testing.assert_allclose(along, [13 / 8, 23 / 16, 43 / 32, *[4 / 3] * 9], rtol=1e-15)
    assert found.trace.spins is not None
    np.testing.assert_allclose(found.trace.spins["first_after"][3:], -4 / 3, rtol=1e-15)
    assert math.isfinite(found.bits_lost)
