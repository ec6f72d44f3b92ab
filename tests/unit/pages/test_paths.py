"""The lines that a picture draws are where the discs were."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import long_after

from carom.pages.paths import exact_paths
from carom.scene import Wall
from carom.scenes import all_scenes
from carom.solvers.pic import solve_pic
from carom.trace import wall_body
from carom.walls import drive_of

#: What a thousand impacts' roundings add up to in a picture, as part of the scene's length: far below a line's width.
DRAWN_EXACTLY = 1e-9

NAMES = sorted(name for name, entry in all_scenes().items() if len(entry.scene.discs) <= 16)


@pytest.mark.parametrize("name", long_after(len(NAMES) // 3, [*NAMES[::3], *NAMES[1::3], *NAMES[2::3]]))
def test_the_drawn_bodies_touch_at_every_impact_of_the_reference(name: str) -> None:
    """At each of its impacts a drawn disc touches the body that it hits, with gravity and without."""
    scene = all_scenes()[name].scene
    trace = solve_pic(scene, max_impacts=100)
    paths = exact_paths(trace)
    stands = iter(paths.stands)
    corners = np.concatenate([points for _, points in paths.lines])
    length = float(np.ptp(corners, axis=0).max()) + max(disc.radius_m for disc in scene.discs)
    for impact in trace.impacts:
        first, second = int(impact["first"]), int(impact["second"])
        here = next(stands).position_m
        if second >= 0:
            reach = scene.discs[first].radius_m + scene.discs[second].radius_m
            gap = float(np.hypot(*(next(stands).position_m - here))) - reach
        else:
            wall, radius = scene.walls[wall_body(second)], scene.discs[first].radius_m
            here = here - drive_of(wall.legs, wall.velocity_m_s).moved_at(impact["time_s"])  # as seen from the wall
            if isinstance(wall, Wall):
                gap = float(np.dot(here - np.array(wall.point_m), wall.normal)) - radius
            else:
                gap = wall.outline.gap(float(here[0]), float(here[1]), radius)
        assert abs(gap) <= DRAWN_EXACTLY * length
