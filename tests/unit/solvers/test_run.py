"""Every kind of run fulfils the protocol `carom.solvers.run.Run`."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom.model.damping import Damping
from carom.model.scene import Scene
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE, Outcome
from carom.solvers.damped import DampedRun
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.rows import Rows
from carom.solvers.run import Run
from carom.solvers.units import RunInUnits, choose_units

from .run_kinds import RUNS, start_frame_run

#: Disc 0 meets disc 1 after 2 s, which passes its motion on to disc 2 after 4 s. That meets the wall after 6 s, so no
#: frame of 1/64 s is late. A frame at the instant itself does not include what comes later.
ROW = staged("row", disc_at(0, 0, 1, 0), disc_at(3, 0), disc_at(6, 0), wall_at(8.5, 0, -1, 0), duration_s=7)
ROUGH = ROW.model_copy(update={"friction": 0.5, "tangential_restitution": 0.0})


@pytest.fixture(params=[*RUNS, "in units", "damped", "on a table"])
def run_factory(request: pytest.FixtureRequest) -> Callable[[Scene], Run]:
    name = request.param

    def in_units(scene: Scene) -> Any:
        return RunInUnits(start_frame_run(scene), choose_units(scene))

    def on_a_table(scene: Scene) -> Run:  # whose deceleration changes no impact's time in floats
        return EventDrivenRun(scene.model_copy(update={"table_deceleration_m_s2": 1e-30}))

    others = {"in units": in_units, "damped": lambda scene: DampedRun(EventDrivenRun(scene), Damping(0.0))}
    return {**RUNS, **others, "on a table": on_a_table}[name]


@each("scene", [ROW, ROUGH])
def test_every_run_returns_the_promised_values(run_factory: Callable[[Scene], Run], scene: Scene) -> None:
    """Every kind of run returns times, outcomes, logs, counts and arrays of the promised types and shapes."""
    run, discs, turns = run_factory(scene), len(scene.discs), scene.arrays.turns
    for time_s, impacts in ((1.0, 0), (5.0, 2)):
        assert run.advance_to(time_s) is Outcome.COMPLETED
        assert run.time_s == time_s
        assert len(run.log) == len(run.log.array()) == impacts
        assert run.log.array().dtype == IMPACT_DTYPE
        assert not run.log.array().flags.writeable
        assert run.log.ambiguous() == ()
        spins, now = run.log.spins(), run.spins()
        assert (spins is None) == (now is None) == (not turns)
        if spins is not None and now is not None:
            assert spins.dtype == SPIN_DTYPE
            assert (len(spins), now.shape) == (impacts, (discs,))
        assert run.positions().shape == run.velocities().shape == (discs, 2)
        assert np.isfinite(run.positions()).all()
        assert run.impacts_per_disc().dtype == np.int64
        assert run.impacts_per_disc().tolist() == ([0, 0, 0] if impacts == 0 else [1, 2, 1])
        assert all(isinstance(value, int) for value in run.counts.values())
        assert all(isinstance(note, str) for note in run.notes)
    assert run.advance_to(7.0) is Outcome.COMPLETED
    assert run.impacts_per_disc().tolist() == [1, 2, 2]


def test_every_run_stops_at_an_impact_limit_and_continues(run_factory: Callable[[Scene], Run]) -> None:
    """Every kind of run stops at an impact limit within two frames of that impact, and can be continued."""
    run = run_factory(ROW)
    assert run.advance_to(7.0, 1) is Outcome.MAX_IMPACTS
    assert len(run.log) == 1
    assert 2.0 <= run.time_s <= 2.0 + 2.0 / ROW.frame_rate_hz
    assert run.advance_to(7.0, 3) in (Outcome.COMPLETED, Outcome.MAX_IMPACTS)
    assert len(run.log) == 3
    assert run.advance_to(7.0) is Outcome.COMPLETED
    assert not math.isnan(float(run.velocities().sum()))


# Rows grow, and arrays that were returned earlier do not change -------------------------------------------------------


@given(st.lists(st.integers(0, 9), max_size=30))
def test_rows_keep_earlier_arrays_unchanged(sizes: list[int]) -> None:
    """Rows returns all added rows in order and read-only; arrays that it returned earlier do not change."""
    rows, numbers, given_out = Rows(SPIN_DTYPE), np.arange(4.0 * sum(sizes)).view(SPIN_DTYPE), []
    at = 0
    for size in sizes:
        rows.add(numbers[at : at + size].copy())
        at += size
        assert len(rows) == at
        given_out.append(rows.array())
        assert not given_out[-1].flags.writeable
    for found in given_out:
        assert found.tobytes() == numbers[: len(found)].tobytes()
