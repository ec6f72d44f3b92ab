"""Certified runs under uniform gravity: closed forms, runs of 400 digits, rest, grazes, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.lengths import each
from tests.validation import mpmath_runs

import carom
from carom import CertifiedTrace, Disc, Scene, Wall
from carom.comparator.horizon import Horizon
from carom.runs.reference import reference_of
from carom.scenes import catalogue
from carom.solvers.certified.result import Ending

FLOOR = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0))


def of_catalogue(name: str, **changes: Any) -> Scene:
    return catalogue()[f"gravity/{name}"].scene.model_copy(update=changes)


def outside(certified: CertifiedTrace, field: str, truths: list[Any]) -> list[int]:
    """Return the impacts of which a component of a field is not within its radius of the truth."""
    flat = [component for truth in truths for component in truth]
    off = mpmath_runs.outside(certified.trace.impacts[field], certified.radii[field], flat)
    return sorted({k * len(truths) // len(flat) for k in off})


def bounces(scene: Scene, count: int) -> tuple[list[Any], list[Any], list[Any]]:
    """Return times, velocities before and after of a disc that starts at rest along the normal of the one wall.

    Across the wall each hop lasts 2 u / a, u = e^n v; along it the motion is that without a wall.
    """
    disc, wall = scene.discs[0], scene.half_planes()[0]
    n = mp.matrix([mpf(c) for c in wall.normal])
    n /= mp.norm(n)
    start, velocity, gravity = (
        mp.matrix([mpf(c) for c in vector]) for vector in (disc.position_m, disc.velocity_m_s, scene.gravity_m_s2)
    )
    e, a = mpf(scene.wall_restitution), -mp.fdot(gravity, n)
    height = mp.fdot(start - mp.matrix([mpf(c) for c in wall.point_m]), n) - mpf(disc.radius_m)
    down = -mp.fdot(velocity, n)
    speed = mp.sqrt(down**2 + 2 * a * height)
    time = (speed - down) / a
    times, before, after = [], [], []
    for _ in range(count):
        along = velocity + gravity * time
        along -= mp.fdot(along, n) * n
        times.append([time])
        before.append(list(along - speed * n))
        speed *= e
        after.append(list(along + speed * n))
        time += 2 * speed / a
    return times, before, after


@each(
    ("name", "changes"),
    [
        ("bouncing-ball", {"duration_s": 20.0}),
        ("ladder", {}),
        ("ladder", {"wall_restitution": 0.95, "duration_s": 8.0}),
        ("incline", {}),
        ("incline", {"wall_restitution": 1.0, "duration_s": 20.0}),
    ],
)
def test_bounces_on_a_floor_and_down_a_slope_are_within_their_radii(name: str, changes: dict[str, Any]) -> None:
    """Times and velocities of all bounces are those of the closed form, 60 digits of it, of the very float64 scene.

    PIC's are within some roundings of them.
    """
    scene = of_catalogue(name, **changes)
    certified = carom.certify(scene)
    assert certified.ending is Ending.COMPLETED
    with mp.workdps(60):
        times, before, after = bounces(scene, len(certified) + 1)
        assert times[-1][0] > scene.duration_s
        assert outside(certified, "time_s", times[:-1]) == []
        assert outside(certified, "velocity_first_before", before[:-1]) == []
        assert outside(certified, "velocity_first_after", after[:-1]) == []
        found = carom.solve_pic(scene).impacts[: len(certified)]
        assert found["time_s"] == pytest.approx([float(t) for (t,) in times[:-1]], rel=1e-14)
        assert found["velocity_first_after"].ravel() == pytest.approx(np.array(after[:-1], float).ravel(), abs=1e-13)
        off_by_two_ulps = [[t + 2 * mpf(math.ulp(float(t)))] for (t,) in times[:-1]]
        assert outside(certified, "time_s", off_by_two_ulps) == list(range(len(certified)))


def test_a_ball_that_does_not_bounce_rests_in_contact() -> None:
    """Restitution 0: one impact, at whose instant contact begins."""
    certified = carom.certify(of_catalogue("ladder", wall_restitution=0.0))
    assert len(certified) == 1
    assert certified.ending is Ending.COMPLETED
    assert certified.trace.modes is not None
    assert certified.trace.modes["time_s"].tolist() == certified.trace.impacts["time_s"].tolist()


@pytest.mark.parametrize(("speed", "impacts"), [(math.nextafter(2.0, 0.0), 0), (2.0, 0), (math.nextafter(2.0, 3.0), 1)])
def test_a_ball_that_turns_back_at_the_ceiling_has_an_impact_only_if_it_gets_beyond(speed: float, impacts: int) -> None:
    """At 2 m/s against 2 m/s^2 it rises by 1 m exactly, and touches at zero depth; an ulp more is an impact."""
    ceiling = Wall(point_m=(0.0, 1.25), normal=(0.0, -1.0))
    disc = Disc(position_m=(0.0, 0.0), velocity_m_s=(0.5, speed), radius_m=0.25)
    scene = Scene(name="up", discs=[disc], walls=[ceiling], gravity_m_s2=(0.0, -2.0), duration_s=3.0)
    certified = carom.certify(scene)
    assert certified.ending is Ending.COMPLETED
    assert len(certified) == impacts


def test_the_reference_of_a_ball_that_lands_is_the_certified_run_where_that_is_asked_for() -> None:
    """It is proven to the end, and float64 agrees; impacts are scored up to where contact begins."""
    trace = carom.solve_pic(of_catalogue("ladder", duration_s=5.0))
    reference = reference_of(trace, asked=True)
    assert reference.trace.method == "certified"
    assert reference.horizon_s == reference.trace.contact_s < reference.trace.end_time_s == 5.0
    assert isinstance(reference.certified, Horizon)
    assert reference.certified.covers_the_scene
