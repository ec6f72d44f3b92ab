"""Scenes of reported bugs, and those that have a name, with their known answers."""

from __future__ import annotations

import cmath
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.stage import sure

from carom import load_scene, save_scene, solve_pic
from carom.catalogue import CatalogueScene, Complaint, all_scenes, catalogue, deviation, find_scenes
from carom.catalogue.closed_forms import after_impact, after_wall, dot, normal_of_offset, wedge_impacts
from carom.errors import UnknownNameError

EVERY_IMPACT_KNOWN = [entry for entry in catalogue().values() if entry.known.count is not None]
each_entry = pytest.mark.parametrize("entry", EVERY_IMPACT_KNOWN, ids=lambda entry: entry.name)

coordinate = st.floats(-10, 10)
velocities = st.builds(complex, coordinate, coordinate)
masses = st.floats(1e-2, 1e2)
directions = st.floats(0, math.tau).map(lambda angle: cmath.rect(1.0, angle))


@given(masses, velocities, masses, velocities, directions, st.floats(0, 1))
def test_the_impact_law_keeps_momentum_and_restitution(
    m1: float, v1: complex, m2: float, v2: complex, normal: complex, e: float
) -> None:
    """Momentum is kept, the normal relative velocity turns into -e times itself, the tangential parts stay."""
    after1, after2 = after_impact(m1, v1, m2, v2, normal, e)
    assert m1 * after1 + m2 * after2 == pytest.approx(m1 * v1 + m2 * v2, abs=1e-11)
    assert dot(after2 - after1, normal) == pytest.approx(-e * dot(v2 - v1, normal), abs=1e-12)
    assert dot(after1 - v1, 1j * normal) == pytest.approx(0, abs=1e-12)


@given(velocities, directions, st.floats(0, 1))
def test_a_wall_is_an_immovable_disc(velocity: complex, normal: complex, e: float) -> None:
    """The wall's law is the limit of the pair's for an infinite second mass at rest."""
    limit, _ = after_impact(1.0, velocity, math.inf, 0j, normal, e)
    assert after_wall(velocity, normal, e) == pytest.approx(limit, abs=1e-13)


@given(velocities, st.floats(-1, 1))
def test_the_normal_of_an_offset_has_that_offset(approach: complex, offset: float) -> None:
    """The second centre is `offset` to the left of the approach, and ahead."""
    assume(abs(approach) > 1e-3)
    normal = normal_of_offset(approach, offset)
    assert abs(normal) == pytest.approx(1)
    assert dot(normal, 1j * approach / abs(approach)) == pytest.approx(offset, abs=1e-14)
    assert dot(normal, approach) >= -1e-14


@given(st.floats(0.05, 3), st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(0.1, 5))
def test_unfolding_agrees_with_reflecting_step_by_step(
    angle: float, where: float, direction: float, speed: float
) -> None:
    """Unfolding gives the impacts that reflecting the path at each side in turn gives."""
    start = cmath.rect(1.0, where * angle)
    velocity = cmath.rect(speed, where * angle + direction * math.pi)
    position, now = start, 0.0
    for bounce in wedge_impacts(start, velocity, angle):
        position += velocity * (bounce.time_s - now)
        now = bounce.time_s
        side = cmath.rect(1.0, angle if bounce.upper else 0.0)
        # Far out on a side the rounding of the direction is multiplied by the distance from the apex.
        assert (position / side).imag == pytest.approx(0, abs=1e-12 * (1 + abs(position)))
        velocity = side * (velocity / side).conjugate()
        assert bounce.velocity == pytest.approx(velocity, abs=1e-12 * speed)
    # Nothing is left to hit: the point leaves within the wedge.
    assert -1e-9 <= cmath.phase(velocity) <= angle + 1e-9


def least_gap(p: complex, v: complex, radius: float, until: float) -> float:
    """Least gap of a disc at relative position `p`, with relative velocity `v`, during `until`."""
    nearest = 0.0 if v == 0 else min(max(-dot(p, v) / abs(v) ** 2, 0.0), until)
    return abs(p + v * nearest) - radius


@each_entry
def test_known_impacts_are_a_history(entry: CatalogueScene) -> None:
    """Replayed without any solver, the bodies touch at each known instant, approach before, and never overlap."""
    scene, known = entry.scene, entry.known
    rounding = 1e-12
    position = np.array([complex(*disc.position_m) for disc in scene.discs])
    velocity = np.array([complex(*disc.velocity_m_s) for disc in scene.discs])
    radius = [disc.radius_m for disc in scene.discs]
    fall = np.array([0j if disc.immovable else complex(*scene.gravity_m_s2) for disc in scene.discs])
    now = 0.0
    for impact in (*known.impacts, None):
        until = (scene.duration_s if impact is None else impact.time_s) - now
        assert until >= 0
        for i in range(len(radius)):
            for j in range(i + 1, len(radius)):
                apart = position[j] - position[i], velocity[j] - velocity[i], radius[i] + radius[j]
                assert least_gap(*apart, until) >= -rounding
            for wall in scene.half_planes():
                normal = complex(*wall.normal)
                pull = dot(fall[i], normal)
                turning = 0.0 if pull == 0.0 else -dot(velocity[i], normal) / pull
                for t in (0.0, until, min(max(turning, 0.0), until)):
                    there = position[i] + velocity[i] * t + fall[i] * t**2 / 2
                    assert dot(there - complex(*wall.point_m), normal) - radius[i] >= -rounding
        position, velocity = position + velocity * until + fall * until**2 / 2, velocity + fall * until
        now += until
        if impact is None:
            break
        i, j = impact.first, impact.second
        after_first = complex(*sure(impact.velocity_first_after))
        if j < 0:
            wall = scene.half_planes()[-1 - j]
            normal = -complex(*wall.normal)
            gap = dot(complex(*wall.point_m) - position[i], normal) - radius[i]
            before, after, e = velocity[i], after_first, scene.wall_restitution
        else:
            after_second = complex(*sure(impact.velocity_second_after))
            between = position[j] - position[i]
            normal = between / abs(between)
            gap = abs(between) - radius[i] - radius[j]
            before, after, e = velocity[i] - velocity[j], after_first - after_second, scene.restitution
            m1, m2 = scene.discs[i].mass_kg, scene.discs[j].mass_kg
            if math.isfinite(m1) and math.isfinite(m2):
                change = m1 * (after_first - velocity[i]) + m2 * (after_second - velocity[j])
                assert abs(change) <= rounding * (m1 + m2) * max(map(abs, velocity))
            velocity[j] = after_second
        assert abs(gap) <= rounding
        assert dot(before, normal) > 0
        assert dot(after, normal) == pytest.approx(-e * dot(before, normal), abs=rounding * abs(before))
        velocity[i] = after_first
    assert np.allclose(position, [complex(*p) for p in sure(known.final_position_m)], rtol=0, atol=rounding)


def test_no_two_impacts_are_simultaneous_but_by_convention() -> None:
    """Where a scene has a unique answer its impacts are apart by more than a millisecond, so their order is sure."""
    for entry in EVERY_IMPACT_KNOWN:
        gaps = np.diff([impact.time_s for impact in entry.known.impacts])
        assert np.all(gaps == 0 if entry.known.convention else gaps > 1e-3), entry.name


COMPLAINTS = [entry for entry in all_scenes().values() if isinstance(entry, Complaint)]


def test_there_are_twenty_and_more_each_with_its_thread() -> None:
    """At least twenty complaints, each with the address of its thread and with what was reported, ours and theirs."""
    assert len(COMPLAINTS) >= 20
    for entry in COMPLAINTS:
        assert re.fullmatch(r"https://github\.com/[\w.-]+/[\w.-]+/(issues|pull)/\d+", entry.thread)
        number = entry.thread.rpartition("/")[2]
        assert number in entry.name
        assert entry.reported.endswith(".")
        assert entry.made.endswith(".")
        assert entry.about


def test_pic_reproduces_the_known_answer_of_a_complaint_that_survives_its_file(tmp_path: Path) -> None:
    """Saved and loaded again each scene is the same to the bit, and PIC meets its known answer."""
    for entry in COMPLAINTS:
        save_scene(entry.scene, tmp_path / "scene.toml")
        scene = load_scene(tmp_path / "scene.toml")
        assert scene == entry.scene
        assert deviation(solve_pic(scene), entry.known, scene) <= 1e-12, entry.name


def test_complaints_run_only_when_they_are_named() -> None:
    """The suite is without them; a name or a pattern that begins with their group finds them, and nothing else does."""
    assert not any(name.startswith("issues/") for name in catalogue())
    assert len(find_scenes(["issues"])) == len(COMPLAINTS) == len(find_scenes(["issues/*"]))
    assert [entry.name for entry in find_scenes(["issues/jolt-1403"])] == ["issues/jolt-1403"]
    assert not any(entry.name.startswith("issues/") for entry in find_scenes(["*", "tag:walls"]))
    with pytest.raises(UnknownNameError, match="issues/jolt-1403"):
        find_scenes(["issues/jolt-1404"])
