"""The scenes that solvers are compared by hold what the comparisons are for, so that none of them is vacuous."""

from collections import Counter

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.random_scenes import KINDS, TABLES, draw_scene, draw_table, number_of_impacts

from carom import Outcome, Scene, Trace, solve_pic
from carom.model.trace import EdgeKind

#: Number of drawn scenes of each kind, half of them rough.
DRAWN = 40

#: In which share of the scenes of all kinds something must occur at least: two thirds of what the drawing gives,
#: rounded down. So a drawing that loses a kind of scene, or draws it seldom, is noticed.
LEAST = {
    "an impact": 0.55,
    "an impact of two discs": 0.46,
    "an impact with a wall": 0.33,
    "an impact with an immovable disc": 0.19,
    "two impacts at one instant": 0.14,
    "impacts without a unique answer": 0.13,
    "more impacts than an epoch has": 0.008,
    "no impact left": 0.36,
    "a wall": 0.56,
    "an oblique wall": 0.2,
    "a wall given twice": 0.2,
    "restitution of discs below 1": 0.32,
    "restitution of walls below 1": 0.33,
    "unequal radii": 0.46,
    "two discs in contact at the start": 0.08,
    "a disc in contact with a wall at the start": 0.08,
    "a disc on an edge of the cells": 0.005,
    "coordinates beyond ten thousand": 0.12,
    "a spin that changes": 0.2,
}


#: The same of tables, of which each number is run over 120 impacts.
LEAST_ON_TABLES = {
    "a face": 0.47,
    "a vertex": 0.19,
    "an arc": 0.65,
    "impacts without a unique answer": 0.12,
    "a note, of gliding or of a crush": 0.19,
    "spins": 0.63,
    "more impacts than an epoch has": 0.06,
    "a driven wall that strikes": 0.26,
    "a belt": 0.18,
    "a mallet that strikes": 0.08,
    "a leg that begins": 0.11,
}


def list_scene_features(scene: Scene, trace: Trace) -> set[str]:
    """Return what occurs in a scene, of `LEAST`."""
    impacts, walls, arrays = trace.impacts, scene.half_planes(), scene.arrays
    second = impacts["second"]
    pairs = impacts[second >= 0]
    still = ~np.isfinite(arrays.mass_kg)
    normals = [wall.normal for wall in walls]
    apart = np.linalg.norm(arrays.position_m[:, None] - arrays.position_m, axis=2)
    rows = np.array(arrays.half_planes()).reshape(-1, 4)
    gaps = ((arrays.position_m[:, None] - rows[:, :2]) * rows[:, 2:]).sum(axis=2) - arrays.radius_m[:, None]
    spins = trace.spins
    turned = np.zeros(0, bool) if spins is None else spins["first_after"] != spins["first_before"]
    found = {
        "an impact": len(impacts) > 0,
        "an impact of two discs": len(pairs) > 0,
        "an impact with a wall": bool((second < 0).any()),
        "an impact with an immovable disc": bool((still[pairs["first"]] | still[pairs["second"]]).any()),
        "two impacts at one instant": bool((np.diff(impacts["time_s"]) == 0.0).any()),
        "impacts without a unique answer": len(trace.ambiguous) > 0,
        "more impacts than an epoch has": trace.counts.get("epochs", 0) > 0,
        "no impact left": trace.outcome is Outcome.COMPLETED,
        "a wall": len(walls) > 0,
        "an oblique wall": any(0.0 not in normal for normal in normals),
        "a wall given twice": len(set(normals)) < len(normals),
        "restitution of discs below 1": scene.restitution < 1.0,
        "restitution of walls below 1": scene.wall_restitution < 1.0,
        "unequal radii": len(set(arrays.radius_m.tolist())) > 1,
        "two discs in contact at the start": bool(
            np.triu(apart == arrays.radius_m[:, None] + arrays.radius_m, 1).any()
        ),
        "a disc in contact with a wall at the start": bool((gaps == 0.0).any()),
        "a disc on an edge of the cells": bool((arrays.position_m == 16.0).any()),
        "coordinates beyond ten thousand": bool((np.abs(arrays.position_m) > 1e4).any()),
        "a spin that changes": bool(turned.any()),
    }
    return {what for what, occurs in found.items() if occurs}


@pytest.mark.long
def test_random_scenes_cover_every_listed_feature() -> None:
    """Each feature in `LEAST` occurs in at least its listed fraction of the random scenes, and most have an impact."""
    counted: Counter[str] = Counter()
    met: Counter[str] = Counter()
    for kind in KINDS:
        for number in range(DRAWN):
            scene = draw_scene(kind, number, rough=number % 4 > 1)
            found = list_scene_features(scene, solve_pic(scene, max_impacts=number_of_impacts(number)))
            counted.update(found)
            met[kind] += "an impact" in found
    scenes = DRAWN * len(KINDS)
    lacking = {what: counted[what] / scenes for what, least in LEAST.items() if not counted[what] >= least * scenes}
    assert not lacking
    assert min(met[kind] for kind in KINDS) >= DRAWN / 2


def list_table_features(scene: Scene, trace: Trace) -> set[str]:
    """Return what occurs on a table, of `LEAST_ON_TABLES`."""
    assert trace.edges is not None
    kinds, struck = set(trace.edges["kind"].tolist()), {int(second) for second in trace.impacts["second"]}
    met = struck | {int(first) for first in trace.impacts["first"]}
    last_leg = max((leg.begin_s for drive in scene.arrays.wall_drives or () for leg in drive.legs), default=0.0)
    found = {
        "a face": EdgeKind.FACE.value in kinds,
        "a vertex": EdgeKind.VERTEX.value in kinds,
        "an arc": EdgeKind.ARC.value in kinds,
        "impacts without a unique answer": len(trace.ambiguous) > 0,
        "a note, of gliding or of a crush": len(trace.notes) > 0,
        "spins": trace.spins is not None,
        "more impacts than an epoch has": trace.counts["epochs"] > 0,
        "a driven wall that strikes": any(wall.driven and -1 - k in struck for k, wall in enumerate(scene.walls)),
        "a belt": any(wall.surface_speed_m_s and -1 - k in struck for k, wall in enumerate(scene.walls)),
        "a mallet that strikes": any(disc.driven and i in met for i, disc in enumerate(scene.discs)),
        "a leg that begins": 0.0 < last_leg < trace.end_time_s,
    }
    return {what for what, occurs in found.items() if occurs}


@each("each_kind", release_after(1, [6, 24]))
def test_random_tables_cover_every_listed_feature(each_kind: int) -> None:
    """Each feature in `LEAST_ON_TABLES` occurs in at least its listed fraction of the random tables."""
    counted: Counter[str] = Counter()
    for kind in TABLES:
        for number in range(each_kind):
            counted.update(list_table_features(scene := draw_table(kind, number), solve_pic(scene, max_impacts=120)))
    tables = each_kind * len(TABLES)
    least = LEAST_ON_TABLES.items()
    lacking = {what: counted[what] / tables for what, share in least if not counted[what] >= share * tables}
    assert not lacking
