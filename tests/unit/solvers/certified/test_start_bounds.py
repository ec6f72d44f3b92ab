"""Balls alone: what a certified run is without float64 bounds."""

from __future__ import annotations

import math

import pytest
from tests.forms import plain_form

from carom import Disc, Scene, certify
from carom.errors import MissingExtraError
from carom.scenes import catalogue
from carom.solvers.certified import bounds
from carom.solvers.certified.ball_bodies import BallBodies
from carom.solvers.certified.result import CertifiedTrace
from carom.studies.bench.gas import gas_scene

from .start_bounds import StartBounds

SCENES = [
    gas_scene(9, 0.4),
    gas_scene(6, 0.2, duration_s=3.0).model_copy(update={"gravity_m_s2": (0.5, -2.0)}),
    *(catalogue()[name].scene for name in ("classics/sorting", "classics/galperin-100", "classics/cradle-touching")),
]


def told(certified: CertifiedTrace) -> tuple[object, ...]:
    """Return the digits of a run, and how it ended."""
    trace, degeneracy = certified.trace, certified.degeneracy
    kind = degeneracy and (degeneracy.kind, degeneracy.bodies, degeneracy.proven)
    return certified.ending, certified.decimals, trace.impacts[["first", "second"]].tolist(), kind, certified.commuted


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_the_digits_are_the_same_without_bounds(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Balls alone certify the same impacts, with the same digits, and stop at the same event."""
    bounded = certify(scene, max_impacts=40, digits=20)
    monkeypatch.setattr(bounds, "LowerBounds", StartBounds)
    assert told(certify(scene, max_impacts=40, digits=20)) == told(bounded)


def test_without_the_extension_nothing_is_certified() -> None:
    """Where the bounds are not compiled, it is said what is missing."""
    with plain_form(), pytest.raises(MissingExtraError, match="certify is compiled only"):
        certify(SCENES[0])


def test_a_bound_says_nothing_until_it_is_raised() -> None:
    """Each pair that may meet is bounded by the start of both paths; a raised bound takes its place in the order."""
    bounds = StartBounds(BallBodies(gas_scene(4, 0.1)))
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    expected = sorted([*pairs, *((i, -1 - k) for i in range(4) for k in range(4))], key=lambda p: (p[0], p[1] < 0))
    found = bounds.up_to(0.0)
    assert sorted(found) == sorted((0.0, *place) for place in expected)
    for k, (_, row, body) in enumerate(found):
        bounds.raise_to(row, body, 1.0 + k)
    assert bounds.up_to(1.0) == [(1.0, *found[0][1:])]
    assert bounds.earliest() == (1.0, *found[0][1:])
    for _, row, body in found:
        bounds.raise_to(row, body, math.inf)
    assert bounds.earliest()[0] == math.inf


def test_what_has_changed_is_bounded_anew() -> None:
    """After an impact the two that met have bounds with all others, none with each other; other bounds stay."""
    bodies = BallBodies(
        Scene(name="row", discs=[Disc(position_m=(3.0 * k, 0.0), radius_m=1.0) for k in range(4)], duration_s=1.0)
    )
    bounds = StartBounds(bodies)
    for _, row, body in bounds.up_to(0.0):
        bounds.raise_to(row, body, 5.0)
    bodies.time[1] = bodies.time[2] = 0.5
    bodies.partner[1], bodies.partner[2] = 2, 1
    bounds.changed(1, 2)
    assert [entry[1:] for entry in bounds.up_to(0.5)] == [(1, 0), (1, 3), (2, 0), (2, 3)]
    assert [entry[1:] for entry in bounds.up_to(5.0)] == [(0, 3), (1, 0), (1, 3), (2, 0), (2, 3)]
