"""What ODE does that a user would not expect, asked of it; the right answers are laws of mechanics and its manual."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from tests.hazards.measures import DT_S, head_on, parted
from tests.hazards.spread import starts_of

from carom import Disc, Scene, Wall
from carom.adapter import Adapter

#: Starts of each scene.
STARTS = 8


@pytest.fixture
def ode(named: Callable[[str], Adapter]) -> Adapter:
    """Return the adapter, or skip."""
    return named("ode")


def heap() -> Scene:
    """Thirty discs stacked edge to edge fall on a floor: contacts that share discs."""
    return Scene(
        name="heap",
        discs=[Disc(position_m=(x, y), radius_m=0.5) for x in range(6) for y in range(2, 7)],
        walls=[Wall(point_m=(0, 0), normal=(0, 1))],
        gravity_m_s2=(0.0, -9.81),
        restitution=0.5,
        wall_restitution=0.5,
        duration_s=1.0,
    )


@pytest.mark.parametrize("mass_kg", [1.0, 10.0, 100.0])
def test_softness_is_that_of_the_manual(ode: Adapter, mass_kg: float) -> None:
    """ODE solves J v + CFM / h λ = c for J v = c: each impulse is the right one over 1 + CFM / (h Σ 1/m)."""
    softness = 1e-5 / DT_S / (2 / mass_kg)
    expected = 2 / (1 + softness) - 1
    for scene in starts_of(head_on(5.0, mass_kg=mass_kg), STARTS):
        assert parted(ode, scene, "default") == pytest.approx(expected, rel=1e-5)  # some roundings of 32 bits


def test_a_fifth_of_an_overlap_stays_as_speed(ode: Adapter) -> None:
    """Discs without restitution stay together; ODE as shipped parts them at some starts, by at most its ERP of 0.2."""
    plastic = head_on(5.0).model_copy(update={"restitution": 0.0})
    found = [parted(ode, scene, "default") for scene in starts_of(plastic, STARTS)]
    assert 0.1 < max(found) <= 0.2
    assert max(abs(parted(ode, scene, "tuned")) for scene in starts_of(plastic, STARTS)) < 1e-6


def test_nothing_leaves_the_plane(ode: Adapter) -> None:
    """Contacts of spheres whose third coordinate is 0 push in the plane alone: after any number it is 0, to the bit."""
    world: Any = ode.prepare(heap(), ode.profiles["default"].settings(DT_S))
    world.advance(60)
    assert all(body.getPosition()[2] == 0.0 == body.getLinearVel()[2] for body in world._bodies)  # noqa: SLF001 - ODE's own
    world.close()


def test_a_step_below_32_bits_is_taken_and_moves_nothing(ode: Adapter) -> None:
    """A step of 1e-300 s, to which a bisection may come, ends no process, and no disc is moved by it."""
    scene = head_on(5.0)
    world: Any = ode.prepare(scene, ode.profiles["located"].settings(DT_S))
    before = world.observe().position_m
    world.cut(1e-300)
    world.advance(1)
    assert (world.observe().position_m == before).all()
    world.close()
