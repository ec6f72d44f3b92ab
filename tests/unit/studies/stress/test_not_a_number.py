"""What is no number holds no relation, keeps no energy and is no error to be drawn, at whatever place it stands."""

from __future__ import annotations

import dataclasses
import math

from tests.lengths import each

from carom import Scene, Trace, solve_pic
from carom.comparator import Errors
from carom.runs.scoring import Measures
from carom.scenes import catalogue
from carom.studies.bench.axes import ErrorKind, error_of
from carom.studies.bench.result import Point
from carom.studies.stress.relations import base_scene, relations, rough_scene


@each(("field", "disc"), [("final_position_m", 0), ("final_velocity_m_s", 2), ("final_spin_rad_s", 2)])
def test_a_relation_does_not_hold_for_what_is_no_number(field: str, disc: int) -> None:
    """A run whose places, velocities or spins are NaN, of one disc or another, is infinitely far off."""
    spins = field == "final_spin_rad_s"
    base = rough_scene() if spins else base_scene()

    def run(scene: Scene) -> Trace:
        trace = solve_pic(scene)
        if scene is base:
            return trace
        values = getattr(trace, field).copy()
        values[disc if spins else (disc, 1)] = math.nan
        return dataclasses.replace(trace, **{field: values})

    # From what is no number no second run can start; and where nothing spins no spin is compared.
    held = [one for one in relations() if not one.of_runs and (not spins or one.base is rough_scene)]
    assert held
    for relation in held:
        assert relation.deviation(base, run) == math.inf, relation.name


def test_an_infinite_error_is_no_sound_point() -> None:
    """The larger of a time and an infinite velocity error is infinite, and no diagram takes it for a point."""
    scene = catalogue()["paper/late"].scene
    total = Errors(**{field.name: math.inf for field in dataclasses.fields(Errors)} | {"time_s": 0.5})
    measures = Measures(total, 1, 1, 0, 0, 0, duration_s=scene.duration_s, outcome="completed")
    assert error_of(measures, ErrorKind.IMPACT) == math.inf
    point = Point("x", "tuned", 0.1, math.inf, math.inf, math.inf, phases=1, expected=1, missed=0, spurious=0)
    assert not point.sound
    assert dataclasses.replace(point, error=0.1).sound
