"""Event-driven runs: options, resuming, limits, and the loop over all pairs."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each, long_until, release_after
from tests.random_scenes import build_scene, draw_jittered_discs
from tests.scene_builders import build_line_scene, disc_at, require_value, staged, wall_at
from tests.unit.solvers.run_kinds import all_pairs

from carom import Outcome, Scene, solve_pic
from carom.errors import InputError
from carom.model.disc_arrays import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run
from carom.studies.bench.gas import build_hard_disc_gas


def collect_outcome(run: EventDrivenRun) -> tuple[bytes, bytes, bytes]:
    return run.log.array().tobytes(), run.positions().tobytes(), run.velocities().tobytes()


def run_for(start: DiscArrays, impacts: int, **options: Any) -> EventDrivenRun:
    run = EventDrivenRun(start, **options)
    run.advance_to(math.inf, impacts)
    return run


STARTS = {
    "inelastic": draw_jittered_discs(np.random.default_rng(11), 25, restitution=0.8, wall_restitution=0.7),
    "tilted": draw_jittered_discs(np.random.default_rng(11), 30, tilt=0.3),
    "immovable": draw_jittered_discs(np.random.default_rng(11), 30, immovable=6),
    "polydisperse": draw_jittered_discs(np.random.default_rng(11), 60, spread=100.0),
    "unbounded": draw_jittered_discs(np.random.default_rng(11), 40, walls=False),
    "large": build_hard_disc_gas(1000, 0.6),
}


@each("name", long_until(2, STARTS))
def test_cells_and_resuming_change_no_bit_of_a_long_run(name: str) -> None:
    """Wider cells, or resuming from a state in the middle of an epoch, change no bit of 20,000 impacts or more."""
    start, (impacts, wide) = STARTS[name], (100_000, 3.0) if name == "large" else (20_000, math.inf)
    narrow, wider, first = (
        run_for(start, n, cell_factor=factor)
        for n, factor in ((impacts, 1.0), (impacts, wide), (impacts // 2 + 16 * len(start) + 7, 1.0))
    )
    assert collect_outcome(narrow) == collect_outcome(wider)
    second = EventDrivenRun(start, resume=first.state())
    second.advance_to(math.inf, impacts)
    log, *state = collect_outcome(second)
    assert (first.log.array().tobytes() + log, *state) == collect_outcome(narrow)


@each("room", [1.0, 8.0])
@each("sides", release_after(1, [8, 3, 60]))
def test_cells_in_polygons_match_all_pairs_to_the_bit(sides: int, room: float) -> None:
    """Discs in polygons of 3 to 60 half-planes, tight or wide, have the bits of all pairs over 300 impacts."""
    rng = np.random.default_rng(sides)
    start = draw_jittered_discs(rng, 12, walls=False)
    middle = start.position_m.mean(axis=0)
    reach = room * float(np.max(np.hypot(*(start.position_m - middle).T) + start.radius_m)) + 0.25
    angles = 2 * np.pi * (np.arange(sides) + rng.uniform()) / sides
    normals = -np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rows = np.hstack([middle - reach * normals, normals])
    walls = tuple((float(x), float(y), float(nx), float(ny)) for x, y, nx, ny in rows)
    scene = build_scene(replace(start, walls=walls, wall_restitution=0.9), 100.0)
    kernel, plain = EventDrivenRun(scene), all_pairs(scene)
    for run in (kernel, plain):
        run.advance_to(math.inf, 300)
    assert kernel.counts["wall_impacts"] > 50
    assert kernel.log.array().tobytes() == plain.log.array().tobytes()
    assert kernel.positions().tobytes() == plain.positions().tobytes()


def test_recording_options_change_only_the_recorded_impacts() -> None:
    """Recording a window of impacts, or none, changes only the log, not the positions and the counts."""
    start = draw_jittered_discs(np.random.default_rng(11), 40)
    whole, none = EventDrivenRun(start), EventDrivenRun(start, record="none")
    window = EventDrivenRun(start, window_s=(2.0, 3.0))
    for run in (whole, window, none):
        assert run.advance_to(5.0) is Outcome.COMPLETED
    impacts = whole.log.array()
    times, bodies = impacts["time_s"], np.concatenate([impacts["first"], impacts["second"]])
    assert window.log.array().tobytes() == impacts[(times >= 2.0) & (times <= 3.0)].tobytes()
    assert (len(none.log), none.impacts) == (0, len(impacts))
    assert none.positions().tobytes() == whole.positions().tobytes()
    assert none.impacts_per_disc().tolist() == np.bincount(bodies[bodies >= 0], minlength=40).tolist()


@each("gravity", [(0.0, 0.0), (0.0, -1.0)])
@each("discs", [2, 5])
def test_impacts_per_disc_do_not_depend_on_recording(gravity: tuple[float, float], discs: int) -> None:
    """A trace counts each disc's impacts, by every solver, also if it records no impact."""
    scene = build_scene(draw_jittered_discs(np.random.default_rng(5), discs, walls=discs > 2), 3.0)
    scene = scene.model_copy(update={"gravity_m_s2": gravity})
    kept = solve_pic(scene)
    bodies = np.concatenate([kept.impacts["first"], kept.impacts["second"]])
    expected = np.bincount(bodies[bodies >= 0], minlength=discs)
    for trace in (kept, solve_pic(scene, record="none")):
        assert require_value(trace.impacts_per_disc).tolist() == expected.tolist()


def test_run_reports_progress_samples_positions_and_stops() -> None:
    """Progress is reported, positions are sampled only on request, and a run stops at a given time or count."""
    scene = build_scene(draw_jittered_discs(np.random.default_rng(11), 40), 4.0)
    seen: list[tuple[int, float]] = []
    trace = solve_pic(scene, sample_times_s=[0.0, 1.0, 2.0], progress=lambda count, time: seen.append((count, time)))
    assert require_value(trace.samples).position_m.shape == (3, 40, 2)
    assert seen
    assert seen[-1][0] == len(trace.impacts)
    assert solve_pic(scene).samples is None
    short = solve_pic(scene, until_s=1.0)
    assert short.end_time_s == 1.0
    assert short.final_position_m.tobytes() == require_value(trace.samples).position_m[1].tobytes()
    stopped = solve_pic(scene, max_impacts=7)
    assert stopped.outcome is Outcome.MAX_IMPACTS
    assert stopped.impacts.tobytes() == trace.impacts[:7].tobytes()


@each("form", [EventDrivenRun, all_pairs])
def test_impact_without_a_representable_distance_is_an_error(form: Callable[[Scene], EventDrivenRun]) -> None:
    """Discs that meet after 1.8e16 m, where floats are 2 m apart, raise an InputError on their distance."""
    run = form(staged("far", disc_at(0.0, 0.0, 1.0), disc_at(3.0, 0.0, 1.0 - 2.0**-53), duration_s=1e17))
    with pytest.raises(InputError, match="cannot represent the distance"):
        run.advance_to(1e17)


@each("start", [all_pairs, start_pic_run])
def test_run_to_infinity_ends_at_the_last_impact(start: Callable[[Scene], Run]) -> None:
    """A run that is advanced to infinity ends at its last impact, with finite positions."""
    run = start(build_line_scene(0.0, 3.0, velocities=(1.0, 0.0)))
    run.advance_to(math.inf)
    assert run.time_s == 2.0
    np.testing.assert_array_equal(run.positions(), [[2.0, 0.0], [3.0, 0.0]])


def test_wall_that_is_reached_after_1e300_s_is_never_met() -> None:
    """A disc that moves at 1e-300 m/s towards a wall 4.5 m away has no impact, even if advanced to infinity."""
    discs = (disc_at(5, 0, -1e-300, 0), disc_at(9, 9, 1, 0))
    run = all_pairs(staged("creep", *discs, wall_at(0, 0, 1, 0), duration_s=1))
    assert run.advance_to(1.0) is Outcome.COMPLETED
    assert run.advance_to(math.inf) is Outcome.COMPLETED
    assert run.impacts == 0
