"""The scenes that solvers are compared by hold what the comparisons are for, so that none of them is vacuous."""

from __future__ import annotations

from collections import Counter

import numpy as np
from tests.validation.small_scenes import impacts_of, small_scene

from carom import Scene, Trace, solve_pic

#: So many scenes are drawn, as by the tests that compare the kernel with all pairs.
DRAWN = 400

#: In which share of the scenes drawn something must occur at least: two thirds of what the drawing gives, rounded down,
#: so that one which loses a kind of scene, or draws it seldom, is told.
LEAST = {
    "an impact": 0.62,
    "an impact of two discs": 0.55,
    "an impact with a wall": 0.52,
    "an impact with an immovable disc": 0.29,
    "two impacts at one instant": 0.13,
    "impacts without a unique answer": 0.10,
    "an oblique wall": 0.22,
    "a wall given twice": 0.23,
    "restitution of discs below 1": 0.36,
    "restitution of walls below 1": 0.35,
    "unequal radii": 0.46,
    "two bodies in contact at the start": 0.11,
    "a disc on an edge of the cells": 0.03,
}


def occurring(scene: Scene, trace: Trace) -> set[str]:
    """Return what occurs in a scene, of `LEAST`."""
    impacts, walls, arrays = trace.impacts, scene.half_planes(), scene.arrays
    second = impacts["second"]
    pairs = impacts[second >= 0]
    still = ~np.isfinite(arrays.mass_kg)
    normals = [wall.normal for wall in walls]
    apart = np.linalg.norm(arrays.position_m[:, None] - arrays.position_m, axis=2)
    touching = np.triu(apart == arrays.radius_m[:, None] + arrays.radius_m, 1)
    found = {
        "an impact": len(impacts) > 0,
        "an impact of two discs": len(pairs) > 0,
        "an impact with a wall": bool((second < 0).any()),
        "an impact with an immovable disc": bool((still[pairs["first"]] | still[pairs["second"]]).any()),
        "two impacts at one instant": bool((np.diff(impacts["time_s"]) == 0.0).any()),
        "impacts without a unique answer": len(trace.ambiguous) > 0,
        "an oblique wall": any(0.0 not in normal for normal in normals),
        "a wall given twice": len(set(normals)) < len(normals),
        "restitution of discs below 1": scene.restitution < 1.0,
        "restitution of walls below 1": scene.wall_restitution < 1.0,
        "unequal radii": len(set(arrays.radius_m.tolist())) > 1,
        "two bodies in contact at the start": bool(touching.any()),
        "a disc on an edge of the cells": bool((arrays.position_m == 16.0).any()),
    }
    return {what for what, occurs in found.items() if occurs}


def test_the_small_scenes_hold_what_they_are_drawn_for() -> None:
    """Impacts of each kind, ties, contact, oblique and repeated walls, and each law occur in no smaller share."""
    counted: Counter[str] = Counter()
    for number in range(DRAWN):
        scene = small_scene(number)
        counted.update(occurring(scene, solve_pic(scene, max_impacts=impacts_of(number))))
    lacking = {what: counted[what] / DRAWN for what, least in LEAST.items() if not counted[what] >= least * DRAWN}
    assert not lacking
