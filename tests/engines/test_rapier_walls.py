"""Rapier's plane build at walls of edges: thin ones, those in pieces, with and without a half width."""

from __future__ import annotations

import numpy as np
import pytest
from tests.adapters.staged import along_a_floor, at_a_thin_wall
from tests.engines.staged import Finish, Named

STARTS = 16
#: Velocities of 32-bit floats, of the speed.
SINGLE = 1e-5

each_width = pytest.mark.parametrize("half_width_m", [0.0, 0.02])


@each_width
@pytest.mark.parametrize("q", [0.9, 3.0, 20.0])
@pytest.mark.parametrize("profile", ["default", "swept"])
def test_rapier_with_contacts_ahead_passes_no_thin_wall(
    profile: str, q: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """As shipped and swept, a disc comes back from a segment or capsule at each of 16 starts, its velocity reversed."""
    for k in range(STARTS):
        scene = at_a_thin_wall(q, k / STARTS, half_width_m=half_width_m)
        seen = finish(named("rapier2d"), scene, 1 / 60, profile)
        assert seen.position_m[0, 0] < 0
        speed = scene.discs[0].velocity_m_s[0]
        np.testing.assert_allclose(seen.velocity_m_s[0], (-speed, 0.0), atol=SINGLE * speed)


@each_width
@pytest.mark.parametrize("q", [0.9, 3.0, 20.0])
@pytest.mark.parametrize("profile", ["tuned", "ccd"])
def test_rapier_with_overlaps_alone_passes_a_thin_wall_by_the_closed_form(
    profile: str, q: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """Of 16 even starts the fraction max(0, 1 - 1/q) passes, to the one start that even spreading may miss."""
    scenes = [at_a_thin_wall(q, k / STARTS, half_width_m=half_width_m) for k in range(STARTS)]
    passed = sum(finish(named("rapier2d"), scene, 1 / 60, profile).position_m[0, 0] > 0 for scene in scenes)
    assert abs(passed - STARTS * max(0.0, 1 - 1 / q)) <= 1


@each_width
@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_a_disc_catches_on_joints_of_rapiers_segments(
    profile: str, half_width_m: float, named: Named, finish: Finish
) -> None:
    """At 16 starts a floor in one piece mirrors the velocity, and at some of them one in ten pieces turns the disc."""

    def end(pieces: int, start: int) -> np.ndarray:
        scene = along_a_floor(pieces, start / STARTS, half_width_m=half_width_m)
        velocity: np.ndarray = finish(named("rapier2d"), scene, 1 / 60, profile).velocity_m_s[0]
        return velocity

    caught = 0
    for start in range(STARTS):
        np.testing.assert_allclose(end(1, start), (5.0, 2.0), atol=5 * SINGLE)
        caught += bool(np.abs(end(10, start) - end(1, start)).max() > 1)
    assert 1 <= caught < STARTS // 2
