"""Certified runs under gravity, damped, on a table that slows discs, and with friction: closed forms, ends by name."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from tests.cases import each
from tests.random_scenes import draw_small_scene
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.validation.mpmath_runs import find_outside_radii

from carom import CertifiedTrace, Scene, certify, solve_pic
from carom.catalogue import catalogue
from carom.comparator.horizon import Horizon
from carom.errors import InputError
from carom.execution.scene_reference import build_reference
from carom.solvers.certified.result import Degenerate, Ending

FLOOR = wall_at(0.0, 0.0, 0.0, 1.0)


def load_gravity_scene(name: str, **changes: Any) -> Scene:
    return catalogue()[f"gravity/{name}"].scene.model_copy(update=changes)


def find_outside(certified: CertifiedTrace, **truths: list[Any]) -> dict[str, list[int]]:
    """Return by field of impacts, or name of an end, the components that are not within their radii of the truth."""
    known = {name: (certified.trace.impacts[name], certified.radii[name]) for name in certified.radii.dtype.names or ()}
    known["place"] = certified.trace.final_position_m, certified.final_position_radius_m
    known["velocity"] = certified.trace.final_velocity_m_s, certified.final_velocity_radius_m_s
    found = {name: find_outside_radii(*known[name], np.ravel(truth).tolist()) for name, truth in truths.items()}
    return {name: outside for name, outside in found.items() if outside}


def compute_bounces(scene: Scene, count: int) -> tuple[list[Any], list[Any], list[Any]]:
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
        times.append(time)
        before.append(list(along - speed * n))
        speed *= e
        after.append(list(along + speed * n))
        time += 2 * speed / a
    return times, before, after


@each(
    "name, changes",
    [
        ("bouncing-ball", {"duration_s": 20.0}),
        ("ladder", {}),
        ("ladder", {"wall_restitution": 0.95, "duration_s": 8.0}),
        ("incline", {}),
        ("incline", {"wall_restitution": 1.0, "duration_s": 20.0}),
    ],
)
def test_bounces_under_gravity_match_the_closed_form(name: str, changes: dict[str, Any]) -> None:
    """Times and velocities of bounces on a floor and a slope are within their radii of the closed form."""
    scene = load_gravity_scene(name, **changes)
    certified = certify(scene)
    assert certified.ending is Ending.COMPLETED
    with mp.workdps(60):
        times, before, after = compute_bounces(scene, len(certified) + 1)
        assert times[-1] > scene.duration_s
        velocities = {"velocity_first_before": before[:-1], "velocity_first_after": after[:-1]}
        assert find_outside(certified, time_s=times[:-1], **velocities) == {}
        found = solve_pic(scene).impacts[: len(certified)]
        assert found["time_s"] == pytest.approx([float(t) for t in times[:-1]], rel=1e-14)
        assert found["velocity_first_after"].ravel() == pytest.approx(np.array(after[:-1], float).ravel(), abs=1e-13)
        off_by_two_ulps = [t + 2 * mpf(math.ulp(float(t))) for t in times[:-1]]
        assert find_outside(certified, time_s=off_by_two_ulps) == {"time_s": list(range(len(certified)))}


def test_ball_with_restitution_zero_rests_at_its_first_impact() -> None:
    """With restitution 0 there is one impact, and contact begins at its instant."""
    certified = certify(load_gravity_scene("ladder", wall_restitution=0.0))
    assert len(certified) == 1
    assert certified.ending is Ending.COMPLETED
    assert require_value(certified.trace.modes)["time_s"].tolist() == certified.trace.impacts["time_s"].tolist()


@each("speed, impacts", [(math.nextafter(2.0, 0.0), 0), (2.0, 0), (math.nextafter(2.0, 3.0), 1)])
def test_ball_that_turns_back_at_the_ceiling_has_no_impact(speed: float, impacts: int) -> None:
    """At 2 m/s a ball just touches the ceiling at speed 0 without an impact; one ulp more speed is an impact."""
    disc, ceiling = disc_at(0.0, 0.0, 0.5, speed, r=0.25), wall_at(0.0, 1.25, 0.0, -1.0)
    certified = certify(staged("up", disc, ceiling, gravity_m_s2=(0.0, -2.0), duration_s=3.0))
    assert certified.ending is Ending.COMPLETED
    assert len(certified) == impacts


def test_certified_reference_of_a_landing_ball_is_scored_up_to_contact() -> None:
    """The requested reference of a landing ball is a certified run that covers the whole scene."""
    trace = solve_pic(load_gravity_scene("ladder", duration_s=5.0))
    reference = build_reference(
        trace, is_requested=True, time_budget_s=1e6
    )  # proven to the end, however slow the machine is
    assert reference.trace.method == "certified"
    assert reference.horizon_s == reference.trace.contact_s < reference.trace.end_time_s == 5.0
    assert isinstance(reference.certified, Horizon)
    assert reference.certified.covers_the_scene


# Slowed down ----------------------------------------------------------------------------------------------------------


@each("damping", [1e-9, 0.5, 30.0])
def test_damped_bounce_matches_the_closed_form(damping: float) -> None:
    """A damped disc meets a wall after -log(1 - c s)/c; all its numbers are within their radii of 60 digits."""
    disc, wall = disc_at(0.0, 0.0, -40.0, 3.0, r=0.5), wall_at(-1.5, 0.0, 1.0, 0.0)
    certified = certify(staged("bounce", disc, wall, wall_restitution=0.7, damping_per_s=damping, duration_s=0.9))
    with mp.workdps(60):
        c, s, e = mpf(damping), mpf(1) / 40, mpf(0.7)
        end = (1 - mp.exp(-c * mpf(0.9))) / c
        met, left, kept = -mp.log1p(-c * s) / c, 1 - c * s, mp.exp(-c * mpf(0.9))
        truth = {
            "time_s": [met],
            "velocity_first_before": [-40 * left, 3 * left],
            "velocity_first_after": [40 * e * left, 3 * left],
            "place": [-1 + 40 * e * (end - s), 3 * end],
            "velocity": [40 * e * kept, 3 * kept],
        }
        assert find_outside(certified, **truth) == {}


def test_impact_at_the_end_of_a_scene_is_decided_to_the_last_bit() -> None:
    """An impact at 4 log 2 s occurs only in scenes whose end, a neighbouring float, is not earlier."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    with mp.workdps(60):
        met = 4 * mp.log(2)
        for ends_s in (math.nextafter(float(met), 0.0), float(met), math.nextafter(float(met), 9.0)):
            scene = staged("end", disc, wall, damping_per_s=0.25, duration_s=ends_s)
            certified = certify(scene)
            assert certified.ending is Ending.COMPLETED
            assert len(certified) == (mpf(ends_s) >= met)


def test_damped_disc_never_reaches_a_wall_at_its_limit() -> None:
    """A damped disc of 1 m/s moves less than 2 m in any time, so it never meets a wall exactly 2 m away."""
    disc, wall = disc_at(0.0, 0.0, 1.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    assert len(certify(staged("never", disc, wall, damping_per_s=0.5, duration_s=1000.0))) == 0


def test_bounce_and_stop_on_a_table_match_the_closed_form() -> None:
    """On a decelerating table a bounce and the stop after it are within their radii of the 60-digit closed form."""
    disc, wall = disc_at(0.0, 0.0, 1.5, -2.0, r=0.25), wall_at(0.0, -1.0, 0.0, 1.0)
    scene = staged("bank", disc, wall, wall_restitution=0.8, table_deceleration_m_s2=0.7, duration_s=9.0)
    certified = certify(scene)
    with mp.workdps(60):
        a, e = mpf(0.7), mpf(0.8)
        way = mpf(0.75) * mpf(2.5) / 2  # at 2.5 m/s, of which 2 are towards the wall
        left = mp.sqrt(mpf(2.5) ** 2 - 2 * a * way)
        met = (mpf(2.5) - left) / a
        after = [left * mpf(3) / 5, e * left * 4 / 5]
        speed = mp.sqrt(after[0] ** 2 + after[1] ** 2)
        on = speed**2 / (2 * a)
        place = [way * 3 / 5 + on * after[0] / speed, -mpf(0.75) + on * after[1] / speed]
        assert find_outside(certified, time_s=[met], place=place, velocity_first_after=after) == {}
    assert certified.trace.final_velocity_m_s.tolist() == [[0.0, 0.0]]


def test_disc_that_stops_at_a_wall_is_a_graze() -> None:
    """A disc whose stopping distance v^2/(2 a) equals the gap to a wall ends the certified run as a graze."""
    disc, wall = disc_at(0.0, 0.0, 2.0, r=0.5), wall_at(2.5, 0.0, -1.0, 0.0)
    degeneracy = certify(staged("touch", disc, wall, table_deceleration_m_s2=1.0, duration_s=5.0)).degeneracy
    assert require_value(degeneracy).kind is Degenerate.GRAZE


# With friction --------------------------------------------------------------------------------------------------------


def find_differences(one: CertifiedTrace, other: CertifiedTrace) -> list[tuple[int, str]]:
    """Return where two certified runs of one scene contradict each other."""
    found = []
    for a, b, ra, rb in (
        (one.trace.impacts, other.trace.impacts, one.radii, other.radii),
        (require_value(one.trace.spins), require_value(other.trace.spins), one.spin_radii, other.spin_radii),
    ):
        most = min(len(a), len(b))
        for name in a.dtype.names or ():
            if name != "second":  # which of two walls that are one
                inside = (
                    np.abs(a[name][:most] - b[name][:most])
                    <= require_value(ra)[name][:most] + require_value(rb)[name][:most]
                )
                found += [(int(k), name) for k in np.argwhere(~inside)[:, 0]]
    return found


def test_runs_of_15_and_50_digits_agree() -> None:
    """In small rough scenes the intervals of default runs overlap those of runs with 50 digits."""
    impacts = 0
    for number in range(8):
        scene = draw_small_scene(number, rough=True, gravity=(0.25, -1.0) if number % 4 == 3 else (0.0, 0.0))
        if not scene.arrays.turns:
            continue
        try:
            found = certify(scene, max_impacts=10)
        except InputError:  # falling discs next to immovable ones
            continue
        assert find_differences(found, certify(scene, digits=50, max_impacts=10)) == [], number
        impacts += len(found)
    assert impacts > 20


def test_exact_tie_of_stick_and_slide_is_certified() -> None:
    """At |s| = 3 f (1 + e) w_n both branches are equal, so the run completes; dyadic numbers make this exact."""
    # With velocity (9/4, -1), f = 1/2 and e = 1/2 the disc rolls: (3/2, 1/2) with spin -3/2, since T = f (1 + e) w_n =
    # 3/4.
    disc, laws = disc_at(0, 2, 2.25, -1.0, r=1), {"wall_friction": 0.5, "wall_restitution": 0.5}
    scene = staged("floor", disc, FLOOR, **laws, duration_s=2.0)
    found = certify(scene, digits=30)
    assert found.ending is Ending.COMPLETED
    assert found.trace.impacts["velocity_first_after"].tolist() == [[1.5, 0.5]]
    assert require_value(found.trace.spins).tolist() == [(0.0, 0.0, -1.5, 0.0)]
    assert require_value(found.spin_radii)["first_after"].max() < 1e-15
    assert [len(row) for row in found.decimals] == [6]
    assert Fraction(found.decimals[0][-1]) == Fraction(-3, 2)
