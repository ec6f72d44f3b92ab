"""What PIC must stand, whatever it is given: conservation, no overlap, time that only advances, a named end."""

from __future__ import annotations

import math

import pytest
from tests.forms import needs_extension
from tests.lengths import each
from tests.validation import own

from carom import Disc, Outcome, Scene, Trace, solve_pic, solve_pic_framewise
from carom.disc_arrays import DiscArrays
from carom.physics.pair_time import pair_time
from carom.registry import load_adapter
from carom.runs.observe import observe_run
from carom.runs.wire import CarriedTrace, Codec
from carom.solvers.event_driven.run import EventDrivenRun
from carom.studies.bench.gas import hard_disc_gas

#: Millions of impacts, which plain Python takes hours for.
pytestmark = needs_extension

IMPACTS = 100_000


@pytest.mark.long
@pytest.mark.parametrize(
    ("start", "impacts"), [(own.mixed_gas(), 1_000_000), (hard_disc_gas(500, 0.6), 10_000_000)], ids=["mixed", "500"]
)
def test_energy_momentum_and_distance_are_kept_over_millions_of_impacts(start: DiscArrays, impacts: int) -> None:
    """Energy and momentum stay to 1e-12, and no overlap is deeper than rounding of the instant and of places explains.

    Ten million roundings of 2^-53 add up as their square root to 4e-13.
    """
    run = EventDrivenRun(start, record="none")
    for until in range(impacts // 1000, impacts + 1, impacts // 1000):
        run.advance_to(math.inf, until)
        assert own.overlap(start, run) <= 1.0
        assert own.energy(start, run.velocities()) <= 1e-12
    assert own.momentum(start, impacts // 10) <= 1e-12


def test_time_only_advances_and_momentum_is_what_walls_give() -> None:
    """Over a hundred thousand impacts none comes before the one ahead of it, and momentum stays to 1e-12."""
    assert own.momentum(own.mixed_gas(), IMPACTS) <= 1e-12


@pytest.mark.parametrize("scene", [own.collapsing(), own.touching()], ids=lambda scene: scene.name)
def test_a_collapse_and_a_start_in_which_all_discs_touch_come_to_an_end(scene: Scene) -> None:
    """Within a hundred thousand impacts the run ends by itself, and its ending has a name."""
    outcome = EventDrivenRun(scene, record="none").advance_to(scene.duration_s, IMPACTS)
    assert outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}


@each("k", range(6))
def test_every_impact_of_galperins_billiard(k: int) -> None:
    """Up to 314159 impacts, each comes at its own instant with its own velocity, within what roundings explain."""
    assert own.galperin_error(own.galperin(k)) <= 1.0


def symmetric_collapse(e: float) -> Scene:
    """Stage two discs that close on a third at rest from both sides at one instant."""
    discs = [
        Disc(position_m=(x, 0.0), velocity_m_s=(v, 0.0), radius_m=0.25)
        for x, v in ((-0.75, 1.0), (0.0, 0.0), (0.75, -1.0))
    ]
    return Scene(name="collapse", discs=discs, restitution=e, duration_s=2.0)


@each("solve", [solve_pic, solve_pic_framewise])
@each("e", [0.0, 0.01, 0.0625, 0.07])
def test_a_collapse_whose_velocities_vanish_comes_to_an_end(e: float, solve: object) -> None:
    """With the centre of mass at rest the velocities fall below the least float; the run ends, all at rest.

    On the way two discs a contact distance apart close so slowly that they would need longer than the largest float.
    """
    assert callable(solve)
    trace = solve(symmetric_collapse(e))
    assert trace.outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}
    assert abs(trace.final_velocity_m_s).max() <= 1e-12


def test_a_wait_beyond_the_largest_float_is_for_ever() -> None:
    """Discs that approach by the least float a second meet after 2e323 s, which no float is: never."""
    assert pair_time(0.0, 0.0, 5e-324, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0, 0.25) == math.inf
    assert pair_time(0.0, 0.0, 1e-300, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0, 0.25) == pytest.approx(5e299, rel=1e-15)


def test_a_standstill_keeps_its_name_on_its_way_from_a_worker() -> None:
    """An inelastic collapse that ends at a standstill says so to the harness too, with the impacts that it ended in."""
    scene = own.collapsing()
    direct, codec = solve_pic(scene), Codec[Trace](CarriedTrace)
    observed = codec.loads(codec.dumps(observe_run(load_adapter("pic"), scene, "tuned", 1.0)))
    assert observed.outcome is direct.outcome
    assert len(observed.impacts) == len(direct.impacts)
