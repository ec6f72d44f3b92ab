"""Thin walls and floors in pieces, as adapters build them of capsules, lines, boxes and rectangles."""

from __future__ import annotations

import numpy as np
import pytest
from tests.adapters.staged import along_a_floor, at_a_thin_wall
from tests.engines.staged import PHASES, Finish, Named

#: Of planar engines what velocities of 32-bit floats are off by, of the speed.
SINGLE = {"box2d3": 1e-5, "rapier2d": 1e-5}

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
        ("rapier2d", "tuned"),
        ("rapier2d", "ccd"),
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
    [
        *(("jolt", "swept"), ("p2", "swept"), ("physx", "swept"), ("rapier", "default"), ("rapier", "tuned")),
        # Of contacts ahead: from segments and capsules.
        *(("rapier2d", "default"), ("rapier2d", "swept")),
        *(("box2d3", "default"), ("box2d3", "tuned"), ("box2d3", "swept")),
    ],
)
def test_what_is_swept_passes_no_thin_wall(
    name: str, profile: str, q: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """With a sweep of its own a disc comes back at each of 16 starts, its velocity reversed to 32 bits."""
    for phase in PHASES:
        scene = at_a_thin_wall(q, phase, half_width_m=half_width_m)
        speed = scene.discs[0].velocity_m_s[0]
        seen = finish(named(name), scene, 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-speed, 0.0), atol=SINGLE.get(name, 1e-6) * speed)


@each_width
@pytest.mark.parametrize(
    ("name", "profile", "least", "most", "by_m_s"),
    [
        ("jolt", "default", 1, 4, 1e-3),  # without `mEnhancedInternalEdgeRemoval`, which tuned has
        ("jolt", "tuned", 0, 0, 1e-3),
        ("physx", "default", 16, 16, 1e-3),  # inelastic below 2 m/s: it slides, and catches on each joint
        ("physx", "tuned", 0, 0, 1e-3),
        ("havok", "default", 1, 6, 1e-3),
        ("p2", "tuned", 0, 0, 1e-3),
        ("cannon", "tuned", 0, 3, 1e-3),
        ("matter", "tuned", 1, 5, 1e-3),
        ("box2d3", "default", 1, 4, 1e-3),
        ("box2d3", "tuned", 0, 0, 1e-3),
        ("box2d3", "swept", 0, 0, 1e-3),
        ("rapier2d", "default", 1, 7, 1.0),
        ("rapier2d", "tuned", 1, 7, 1.0),
    ],
)
def test_a_disc_catches_on_joints_of_some(
    name: str, profile: str, least: int, most: int, by_m_s: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """Of 16 starts, 2 m/s down, a floor in ten pieces turns as many discs; planar ones one in one piece mirrors."""

    def end(pieces: int, phase: float) -> np.ndarray:
        scene = along_a_floor(pieces, phase, half_width_m=half_width_m)
        velocity: np.ndarray = finish(named(name), scene, 1 / 60, profile).velocity_m_s[0]
        return velocity

    caught = 0
    for phase in PHASES:
        whole = end(1, phase)
        if name in SINGLE:
            np.testing.assert_allclose(whole, (5.0, 2.0), atol=5 * SINGLE[name])
        caught += bool(np.abs(end(10, phase) - whole).max() > by_m_s)
    assert least <= caught <= most
