"""A run by the kernel beside the same by all pairs: every bit that they say."""

from __future__ import annotations

from typing import Any

from carom import Outcome, Scene
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain.run import AllPairsRun

#: Enough for several epochs of a disc or two, and for the corners and the chains of impacts of more.
MOST = 120


def bits(run: AllPairsRun | EventDrivenRun, outcome: Outcome) -> tuple[Any, ...]:
    """Return all that a run says, as bytes where it is numbers."""
    spins, edges = run.spins(), run.log.edges()
    told = [run.log.array(), run.positions(), run.velocities(), *[rows for rows in (spins, edges) if rows is not None]]
    counts = [run.counts[name] for name in ("impacts", "wall_impacts", "predictions", "epochs")]
    return (*[rows.tobytes() for rows in told], run.log.ambiguous(), outcome, run.notes, run.time_s, counts)


def assert_same(scene: Scene, most: int = MOST, *, contact_s: float = 0.0, cells: float = 1.0) -> AllPairsRun:
    """Run a scene by both forms, the kernel in two pieces, and compare all; return the all-pairs run."""
    plain, compiled = (
        AllPairsRun(scene, contact_duration_s=contact_s),
        EventDrivenRun(scene, contact_duration_s=contact_s, cell_factor=cells),
    )
    expected = bits(plain, plain.advance_to(scene.duration_s, most))
    compiled.advance_to(scene.duration_s / 7, most)
    found = bits(compiled, compiled.advance_to(scene.duration_s, most))
    assert found == expected
    return plain
