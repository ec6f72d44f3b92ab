"""Scenes of reported bugs, and those that have a name, with their known answers."""

import cmath
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from carom import load_scene, save_scene, solve_pic
from carom.catalogue import BugReport, all_scenes, catalogue, deviation, find_scenes
from carom.catalogue.closed_forms import (
    compute_after_impact,
    compute_after_wall,
    compute_normal,
    compute_wedge_impacts,
    dot,
)
from carom.errors import UnknownNameError

EVERY_IMPACT_KNOWN = [entry for entry in catalogue().values() if entry.known.count is not None]

coordinate = st.floats(-10, 10)
velocities = st.builds(complex, coordinate, coordinate)
masses = st.floats(1e-2, 1e2)
directions = st.floats(0, math.tau).map(lambda angle: cmath.rect(1.0, angle))


@given(masses, velocities, masses, velocities, directions, st.floats(0, 1))
def test_impact_law_conserves_momentum_and_applies_restitution(
    m1: float, v1: complex, m2: float, v2: complex, normal: complex, e: float
) -> None:
    """An impact conserves momentum and tangential velocity, and multiplies the normal velocity by -e."""
    after1, after2 = compute_after_impact(m1, v1, m2, v2, normal, e)
    assert m1 * after1 + m2 * after2 == pytest.approx(m1 * v1 + m2 * v2, abs=1e-11)
    assert dot(after2 - after1, normal) == pytest.approx(-e * dot(v2 - v1, normal), abs=1e-12)
    assert dot(after1 - v1, 1j * normal) == pytest.approx(0, abs=1e-12)


@given(velocities, directions, st.floats(0, 1))
def test_wall_impact_equals_impact_with_immovable_disc(velocity: complex, normal: complex, e: float) -> None:
    """An impact with a wall gives the same velocity as an impact with a resting disc of infinite mass."""
    limit, _ = compute_after_impact(1.0, velocity, math.inf, 0j, normal, e)
    assert compute_after_wall(velocity, normal, e) == pytest.approx(limit, abs=1e-13)


@given(velocities, st.floats(-1, 1))
def test_compute_normal_places_second_centre_at_offset(approach: complex, offset: float) -> None:
    """The normal has the given offset to the left of the approach, and never points against it."""
    assume(abs(approach) > 1e-3)
    normal = compute_normal(approach, offset)
    assert abs(normal) == pytest.approx(1)
    assert dot(normal, 1j * approach / abs(approach)) == pytest.approx(offset, abs=1e-14)
    assert dot(normal, approach) >= -1e-14


@given(st.floats(0.05, 3), st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(0.1, 5))
def test_wedge_unfolding_agrees_with_successive_reflection(
    angle: float, where: float, direction: float, speed: float
) -> None:
    """Unfolding a wedge gives the impacts of reflecting at each side in turn, until the path leaves."""
    start = cmath.rect(1.0, where * angle)
    velocity = cmath.rect(speed, where * angle + direction * math.pi)
    position, now = start, 0.0
    for bounce in compute_wedge_impacts(start, velocity, angle):
        position += velocity * (bounce.time_s - now)
        now = bounce.time_s
        side = cmath.rect(1.0, angle if bounce.upper else 0.0)
        # Far out on a side the rounding of the direction is multiplied by the distance from the apex.
        assert (position / side).imag == pytest.approx(0, abs=1e-12 * (1 + abs(position)))
        velocity = side * (velocity / side).conjugate()
        assert bounce.velocity == pytest.approx(velocity, abs=1e-12 * speed)
    # Nothing is left to hit: the point leaves within the wedge.
    assert -1e-9 <= cmath.phase(velocity) <= angle + 1e-9


def test_known_impacts_are_simultaneous_only_by_convention() -> None:
    """Known impacts of a scene are more than 1 ms apart, or all simultaneous if a convention orders them."""
    for entry in EVERY_IMPACT_KNOWN:
        gaps = np.diff([impact.time_s for impact in entry.known.impacts])
        assert np.all(gaps == 0 if entry.known.convention else gaps > 1e-3), entry.name


BUG_REPORTS = [entry for entry in all_scenes().values() if isinstance(entry, BugReport)]


def test_catalogue_has_at_least_twenty_bug_reports_with_threads() -> None:
    """At least 20 scenes come from bug reports, with full texts and the address of the thread that they name."""
    assert len(BUG_REPORTS) >= 20
    for entry in BUG_REPORTS:
        assert re.fullmatch(r"https://github\.com/[\w.-]+/[\w.-]+/(issues|pull)/\d+", entry.thread)
        assert entry.thread.rpartition("/")[2] in entry.name
        assert all(text.endswith(".") for text in (entry.summary, entry.number_sources))
        assert entry.about


@pytest.mark.long
def test_pic_matches_known_answers_of_bug_reports_after_reload(tmp_path: Path) -> None:
    """PIC matches the known answer of each bug report to 1e-12 after its scene was saved and loaded."""
    for entry in BUG_REPORTS:
        save_scene(entry.scene, tmp_path / "scene.toml")
        scene = load_scene(tmp_path / "scene.toml")
        assert scene == entry.scene
        assert deviation(solve_pic(scene), entry.known, scene) <= 1e-12, entry.name


def test_bug_reports_are_found_only_by_their_group() -> None:
    """Only their group, its pattern or a full name finds bug reports; a misspelt name gets a suggestion."""
    assert not any(name.startswith("issues/") for name in catalogue())
    assert len(find_scenes(["issues"])) == len(BUG_REPORTS) == len(find_scenes(["issues/*"]))
    assert [entry.name for entry in find_scenes(["issues/jolt-1403"])] == ["issues/jolt-1403"]
    assert not any(entry.name.startswith("issues/") for entry in find_scenes(["*", "tag:walls"]))
    with pytest.raises(UnknownNameError, match="issues/jolt-1403"):
        find_scenes(["issues/jolt-1404"])
