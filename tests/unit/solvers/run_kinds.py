"""Runs of every kind by name, to which the same tests apply, and a comparison of the event loop with all pairs."""

from collections.abc import Callable
from typing import Any

import numpy as np

from carom import Outcome, Scene
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import FrameRun, start_pit_run
from carom.solvers.run import Run


def all_pairs(scene: Scene, **options: Any) -> EventDrivenRun:
    """Return a run that computes all pairs at each event: the oracle of cells and queue."""
    return EventDrivenRun(scene, all_pairs=True, **options)


def start_frame_run(scene: Scene) -> Run:
    run = start_pit_run(scene, FrameClock(rate_hz=scene.frame_rate_hz))
    assert isinstance(run, FrameRun)  # and not one in units of its own
    return run


#: That each is a `Run` is what mypy holds them to here: a member that is missing, or of another type, is an error.
RUNS: dict[str, Callable[[Scene], Run]] = {
    "event-driven": EventDrivenRun,
    "all pairs": all_pairs,
    "frames": start_frame_run,
}


#: Enough for several epochs of a disc or two, and for the corners and the chains of impacts of more.
MOST = 120


def collect_run_bits(run: Run, outcome: Outcome) -> dict[str, object]:
    """Return all that a run has found, arrays as bytes."""
    arrays = {
        "impacts": run.log.array(),
        "spins": run.log.spins(),
        "edges": run.log.edges(),
        "modes": run.log.modes(),
        "final positions": run.positions(),
        "final velocities": run.velocities(),
        "final spins": run.spins(),
        "impacts per disc": run.impacts_per_disc(),
    }
    found: dict[str, object] = {
        name: None if array is None else np.ascontiguousarray(array).tobytes() for name, array in arrays.items()
    }
    return found | {"ambiguous": run.log.ambiguous(), "end": run.time_s, "outcome": outcome, "notes": run.notes}


def assert_same(scene: Scene, most: int = MOST, *, contact_s: float = 0.0, cells: float = 1.0) -> EventDrivenRun:
    """Run a scene by all pairs, and by the event loop in two pieces; compare both and return the all-pairs run."""
    plain, compiled = (
        all_pairs(scene, contact_duration_s=contact_s),
        EventDrivenRun(scene, contact_duration_s=contact_s, cell_factor=cells),
    )
    expected = collect_run_bits(plain, plain.advance_to(scene.duration_s, most))
    compiled.advance_to(scene.duration_s / 7, most)
    assert collect_run_bits(compiled, compiled.advance_to(scene.duration_s, most)) == expected
    for name in ("impacts", "wall_impacts", "predictions", "epochs"):
        assert compiled.counts[name] == plain.counts[name], name
    return plain
