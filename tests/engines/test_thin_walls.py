"""Thin walls and floors in pieces, as adapters build them of capsules, lines, boxes and rectangles."""

from __future__ import annotations

import numpy as np
import pytest
from tests.adapters.staged import along_a_floor, at_a_thin_wall
from tests.engines.staged import PHASES, Finish, Named

each_width = pytest.mark.parametrize("half_width_m", [0.0, 0.02])


@each_width
@pytest.mark.parametrize("q", [0.9, 3.0, 20.0])
@pytest.mark.parametrize(
    ("name", "profile"),
    [
        ("jolt", "tuned"),
        ("physx", "tuned"),
        ("p2", "default"),
        ("p2", "tuned"),
        ("cannon", "default"),
        ("cannon", "tuned"),
        ("matter", "tuned"),
    ],
)
def test_what_looks_once_a_step_passes_a_thin_wall_by_the_closed_form(
    name: str, profile: str, q: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """Of 16 even starts the fraction max(0, 1 - 1/q) passes, to the one start that even spreading may miss."""
    scenes = [at_a_thin_wall(q, phase, half_width_m=half_width_m) for phase in PHASES]
    passed = sum(finish(named(name), scene, 1 / 60, profile).position_m[0, 0] > 0 for scene in scenes)
    assert abs(passed - len(PHASES) * max(0.0, 1 - 1 / q)) <= 1


@each_width
@pytest.mark.parametrize("q", [0.9, 3.0, 20.0])
@pytest.mark.parametrize(
    ("name", "profile"),
    [("jolt", "swept"), ("p2", "swept"), ("physx", "swept"), ("rapier", "default"), ("rapier", "tuned")],
)
def test_what_is_swept_passes_no_thin_wall(
    name: str, profile: str, q: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """With a sweep of its own a disc comes back at each of 16 starts, its velocity reversed to 32 bits."""
    for phase in PHASES:
        scene = at_a_thin_wall(q, phase, half_width_m=half_width_m)
        speed = scene.discs[0].velocity_m_s[0]
        seen = finish(named(name), scene, 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-speed, 0.0), atol=1e-6 * speed)


@each_width
@pytest.mark.parametrize(
    ("name", "profile", "least", "most"),
    [
        ("jolt", "default", 1, 4),  # without `mEnhancedInternalEdgeRemoval`, which tuned has
        ("jolt", "tuned", 0, 0),
        ("physx", "default", 16, 16),  # inelastic below 2 m/s: it slides, and catches on each joint
        ("physx", "tuned", 0, 0),
        ("havok", "default", 1, 6),
        ("p2", "tuned", 0, 0),
        ("cannon", "tuned", 0, 3),
        ("matter", "tuned", 1, 5),
    ],
)
def test_a_disc_catches_on_joints_of_some(
    name: str, profile: str, least: int, most: int, half_width_m: float, named: Named, finish: Finish
) -> None:
    """Of 16 starts, 2 m/s down, a floor in ten pieces turns as many discs by a millimetre a second or more."""

    def end(pieces: int, phase: float) -> np.ndarray:
        scene = along_a_floor(pieces, phase, half_width_m=half_width_m)
        velocity: np.ndarray = finish(named(name), scene, 1 / 60, profile).velocity_m_s[0]
        return velocity

    caught = sum(bool(np.abs(end(10, phase) - end(1, phase)).max() > 1e-3) for phase in PHASES)
    assert least <= caught <= most
