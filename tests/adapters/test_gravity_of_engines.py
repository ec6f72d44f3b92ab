"""Free fall by each engine's documented integrator, and a bounce under gravity."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.adapters.widths import width

from carom import Disc, Scene, Wall
from carom.adapter import Adapter, Observation
from carom.runs.observe import observe_run

Finish = Callable[..., Observation]

G = (0.5, -9.81)

#: Positions moved before velocities within a step, as Chipmunk documents of `cpSpaceStep`; the others are
#: semi-implicit: Bullet's `btDiscreteDynamicsWorld`, MuJoCo's "Euler", Box2D's `b2Island::Solve`.
POSITION_FIRST = {"pymunk"}


def _falling(velocity: tuple[float, float] = (1.0, 3.0)) -> Scene:
    disc = Disc(position_m=(0.25, 2.0), velocity_m_s=velocity, radius_m=0.5, mass_kg=3.0)
    post = Disc(position_m=(9, 9), radius_m=0.5, mass_kg=math.inf)
    return Scene(name="fall", discs=[disc, post], gravity_m_s2=G, duration_s=1.0)


@pytest.mark.parametrize("profile", ["default", "tuned", "located"])
def test_free_fall_is_the_engines_own_integrator(engine: Adapter, finish: Finish, profile: str) -> None:
    """After n steps a disc is at x0 + n dt v0 + g dt^2 n(n -+ 1)/2, by whether positions or velocities move first."""
    assert engine.capabilities.gravity
    scene, dt_s, n = _falling(), 1 / 64, 64
    end = finish(engine, scene, dt_s, profile)
    falls = n * (n - 1) / 2 if engine.name in POSITION_FIRST else n * (n + 1) / 2
    disc = scene.discs[0]
    position = np.array(disc.position_m) + n * dt_s * np.array(disc.velocity_m_s) + np.array(G) * dt_s**2 * falls
    velocity = np.array(disc.velocity_m_s) + n * dt_s * np.array(G)
    # Sums of 64 steps, each rounded at no more than 8 m or 8 m/s.
    rounding = width(engine, n * float(np.spacing(8.0)))
    np.testing.assert_allclose(end.position_m[0], position, rtol=0, atol=rounding)
    np.testing.assert_allclose(end.velocity_m_s[0], velocity, rtol=0, atol=rounding)
    assert end.velocity_m_s[1].tolist() == [0, 0]


def test_a_drop_bounces_at_the_time_of_free_fall(engine: Adapter) -> None:
    """A disc dropped by h meets the floor after sqrt(2 h / g), to the step, and again after twice that."""
    height, g = 1.0, 9.81
    scene = Scene(
        name="drop",
        discs=[Disc(position_m=(0, 0.5 + height), radius_m=0.5)],
        walls=[Wall(point_m=(0, 0), normal=(0, 1))],
        gravity_m_s2=(0, -g),
        duration_s=2.0,
    )
    dt_s, fall_s = 1 / 1000, math.sqrt(2 * height / g)
    trace = observe_run(engine, scene, "tuned", dt_s)
    # Noticed up to a step late, stamped up to one more; an integrator of first order is another half a step off in a
    # fall, and a bounce at a depth of g t dt keeps as much of the fall's energy again.
    assert trace.impacts["time_s"][:2].tolist() == pytest.approx([fall_s, 3 * fall_s], abs=8 * dt_s)
    assert trace.effective_time_s is not None
    # Where the parabolas before and after meet, which are the engine's own.
    assert trace.effective_time_s[:2].tolist() == pytest.approx([fall_s, 3 * fall_s], abs=8 * dt_s)


def test_two_discs_that_fall_side_by_side_collide_as_if_they_did_not(engine: Adapter) -> None:
    """Gravity acts alike on two discs: they exchange velocities head-on, at the time at which they would without it."""
    discs = [
        Disc(position_m=(-1, 0), velocity_m_s=(1, 0), radius_m=0.25),
        Disc(position_m=(1, 0), velocity_m_s=(-1, 0), radius_m=0.25),
    ]
    scene = Scene(name="pair", discs=discs, gravity_m_s2=(0, -9.81), duration_s=1.0)
    dt_s = 1 / 240
    trace = observe_run(engine, scene, "tuned", dt_s)
    assert len(trace.impacts) == 1
    assert trace.impacts["time_s"][0] == pytest.approx(0.75, abs=2 * dt_s)
    np.testing.assert_allclose(
        trace.final_velocity_m_s[:, 0], (-1, 1), rtol=0, atol=width(engine, 240 * float(np.spacing(1.0)))
    )
