"""Certified runs with friction and spin: every number is enclosed, and stick or slide undecided ends nothing."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from tests.drawn import small

from carom import Disc, Scene, Wall
from carom.errors import InputError

pytest.importorskip("flint")

from carom.solvers.certified.certify import certify
from carom.solvers.certified.result import CertifiedTrace, Ending

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


def test_runs_of_15_and_50_digits_enclose_the_same_truth() -> None:
    """Of small rough scenes, with gravity and without, no number contradicts the other run's."""
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
        impacts += len(found)
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
