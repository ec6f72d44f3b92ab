"""Exact motion of a scene; NaN satisfies no invariance and is no error that can be drawn."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged

from carom import Scene, Trace, solve_pic
from carom.catalogue import CatalogueScene, catalogue
from carom.model.scene import Need
from carom.studies.stress.invariances import build_base_scene, build_rough_scene, list_invariances
from carom.studies.stress.true_motion import UndecidedError, compute_true_motion

KNOWN = [e for e in catalogue().values() if e.known.count is not None and Need.GRAVITY not in e.scene.needs]


@each("entry", KNOWN)
def test_true_motion_agrees_with_known_answers(entry: CatalogueScene) -> None:
    """`compute_true_motion` has each known answer's impacts, times to 1e-13 and final velocities to 1e-12."""
    motion, known, scene = compute_true_motion(entry.scene), entry.known, entry.scene
    assert [(i.first, i.second) for i in motion.impacts] == [(i.first, i.second) for i in known.impacts]
    times_s, known_s = ([i.time_s for i in impacts] for impacts in (motion.impacts, known.impacts))
    assert times_s == pytest.approx(known_s, abs=1e-13 * scene.duration_s)
    speed = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    assert np.allclose(motion.final_velocity_m_s, known.final_velocity_m_s or (), rtol=0, atol=1e-12 * speed)
    assert motion.convention == bool(known.convention)


@each(
    "named, field",
    [
        ("more than 50 impacts", {"restitution": 0.05}),
        ("gravity", {"gravity_m_s2": (0, -10)}),
        ("friction", {"friction": 0.3}),
        ("tangential restitution", {"friction": 0.3, "tangential_restitution": 0.5}),
    ],
)
def test_true_motion_refuses_collapse_gravity_and_friction(named: str, field: dict[str, Any]) -> None:
    """Scenes with too many impacts, gravity, friction or tangential restitution are refused with the reason."""
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-0.75, 1.0), (0.0, 0.0), (0.9, -1.0))]
    with pytest.raises(UndecidedError, match=named):
        compute_true_motion(staged("collapse", *discs, duration_s=2.0, **field), most_impacts=50)


@each("field, disc", [("final_position_m", 0), ("final_velocity_m_s", 2), ("final_spin_rad_s", 2)])
def test_invariance_deviates_infinitely_for_nan_results(field: str, disc: int) -> None:
    """If a run's final positions, velocities or spins contain a NaN, each invariance deviates infinitely."""
    spins = field == "final_spin_rad_s"
    base = build_rough_scene() if spins else build_base_scene()

    def run(scene: Scene) -> Trace:
        trace = solve_pic(scene)
        if scene is base:
            return trace
        values = getattr(trace, field).copy()
        values[disc if spins else (disc, 1)] = math.nan
        return dataclasses.replace(trace, **{field: values})

    # No second run can start from NaN, and without spins no spin is compared.
    held = [
        one for one in list_invariances() if not one.starts_from_result and (not spins or one.base is build_rough_scene)
    ]
    assert held
    for invariance in held:
        assert invariance.deviation(base, run) == math.inf, invariance.name
