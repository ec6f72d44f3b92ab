"""Which form serves a scene, and what a trace says of it."""

from typing import Any

import pytest
from tests.cases import each
from tests.scene_builders import build_line_scene
from tests.unit.solvers.pit.run_forms import list_compiled_forms, run_to_end, start_plain_run

from carom.errors import InputError
from carom.model.scene import Scene, Wall
from carom.model.trace import Outcome
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import solve_pit, start_pit_run
from carom.solvers.rows import RecordedImpacts

CLOCK = FrameClock(rate_hz=60.0)


def build_falling_scene(**changes: Any) -> Scene:
    fields = {"gravity_m_s2": (0.0, -9.8), **changes}
    return Scene(**{**build_line_scene(0.0, 3.0, velocities=(1.0, 0.0)).model_dump(), **fields})


def test_every_kind_of_motion_runs_compiled() -> None:
    """Straight, falling, rough, damped, slowed and driven scenes run in compiled code, without notes."""
    still = {"gravity_m_s2": (0.0, 0.0)}
    for scene in (
        build_line_scene(0.0, velocities=(1.0,)),
        build_falling_scene(),
        build_falling_scene(friction=0.5, wall_rolling_resistance=0.1),
        build_falling_scene(**still, damping_per_s=0.5),
        build_falling_scene(**still, table_deceleration_m_s2=0.5),
        build_falling_scene(walls=[Wall(point_m=(0.0, -5.0), normal=(0.0, 1.0), velocity_m_s=(0.0, -1.0))]),
    ):
        for skipping in (True, False):
            run = start_pit_run(scene, CLOCK, skipping=skipping)
            assert isinstance(run.log, RecordedImpacts)
            assert run.notes == ()


def test_impact_without_a_representable_normal_raises_an_error() -> None:
    """Discs that meet at 1e18 m, where floats cannot represent their distance, raise an InputError in all forms."""
    scene = build_falling_scene(duration_s=1e9, frame_rate_hz=1e-7)
    discs = [disc.model_copy(update={"velocity_m_s": (4e-9 * (k == 0), 0.0)}) for k, disc in enumerate(scene.discs)]
    scene = scene.model_copy(update={"discs": tuple(discs)})
    for form in (start_plain_run, *list_compiled_forms().values()):
        with pytest.raises(InputError, match="cannot represent the distance"):
            run_to_end(scene, FrameClock(rate_hz=1e-7), form)


@each("rate", [None, 10.0])
def test_pit_trace_has_method_frame_length_and_counts(rate: float | None) -> None:
    """A PIT trace has the method, outcome, end time, frame length and frame counts of its run."""
    scene = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0), duration_s=4.0)
    trace = solve_pit(scene, frame_rate_hz=rate)
    assert (trace.method, trace.outcome, trace.end_time_s) == ("pit", Outcome.COMPLETED, 4.0)
    assert trace.dt_s == 1.0 / (rate or scene.frame_rate_hz)
    assert trace.counts["frames"] == 4.0 * (rate or scene.frame_rate_hz)
    assert trace.counts["frames_looked_at"] + trace.counts["frames_skipped"] == trace.counts["frames"]
    assert not trace.impacts.flags.writeable
