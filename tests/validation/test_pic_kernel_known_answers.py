"""The event-driven kernel against answers that no code of Carom made: Galperin, pressure, reversal and collapse."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at
from tests.unit.solvers.run_kinds import all_pairs

from carom import Outcome, Scene, Trace, solve_pic, solve_pic_framewise
from carom.model.disc_arrays import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.studies.bench.gas import build_hard_disc_gas


@pytest.mark.release
@each("k, count", [(6, 3141592), (7, 31415926)])
def test_galperin_impact_count_gives_the_digits_of_pi(k: int, count: int) -> None:
    """The number of impacts is floor(10^k pi), and the last velocity is that of the unfolded billiard."""
    # In the coordinates (10^k V, v) each two impacts turn the velocity by 2 theta, tan(theta) = 10^-k (Galperin 2003).
    # The roundings of that many impacts, 2^-53 of the greatest speed 10^k each, add up as their square root.
    bodies = disc_at(3.0, 0.0), disc_at(6.0, 0.0, -1.0, 0.0, m=100.0**k), wall_at(0.0, 0.0, 1.0, 0.0)
    run = EventDrivenRun(staged("galperin", *bodies, duration_s=25.0), record="none")
    assert run.advance_to(1e9) is Outcome.COMPLETED
    assert run.impacts == count
    angle = (count + count % 2) * math.atan(10.0**-k)
    light = abs(10.0**k * math.sin(angle))
    assert abs(abs(run.velocities()[0, 0]) - light) <= 4 * math.sqrt(count) * 2.0**-53 * 10.0**k + 1e-14


def measure_pressure(packing: float, discs: int, impacts_per_disc: int) -> float:
    """Return Z = p V / (N k T) from the virial of the disc-disc impacts, in the bulk volume of the centres."""
    start = build_hard_disc_gas(discs, packing)
    melted = EventDrivenRun(start, record="none")
    melted.advance_to(math.inf, 20 * discs)
    run = EventDrivenRun(start, resume=melted.state())
    run.advance_to(math.inf, (20 + impacts_per_disc) * discs)
    impacts = run.log.array()
    pairs = impacts[impacts["second"] >= 0]
    first, second = pairs["first"], pairs["second"]
    change = pairs["velocity_second_after"] - pairs["velocity_second_before"]
    impulse = start.mass_kg[second] * np.sum(change * pairs["normal"], axis=1)
    virial = np.sum(impulse * (start.radius_m[first] + start.radius_m[second]))
    return float(1 + virial / (2 * discs * (run.time_s - melted.time_s)))


@pytest.mark.release
@each("packing, expected", [(0.3, 2.0632), (0.6, 6.45)])
def test_hard_disc_gas_has_the_known_pressure(packing: float, expected: float) -> None:
    """Z extrapolated in 1/sqrt(N) is that of the virial series (0.3) and of the literature (0.6), within 1.5 %."""
    # The share of the walls falls as 1/sqrt(N), so two sizes give the limit.
    small, large = measure_pressure(packing, 400, 1000), measure_pressure(packing, 3600, 150)
    limit = large + (large - small) / (3.0 - 1.0)  # sqrt(3600 / 400) = 3
    assert abs(limit / expected - 1) < 0.015


@each("impacts_per_disc", [1, 4])
def test_reversing_all_velocities_retraces_the_run(impacts_per_disc: int) -> None:
    """Reversing all velocities of 1000 discs after a few impacts each brings them back to the start."""
    # Chaos multiplies rounding by some 3 an impact a disc: 4e-14 m after one impact a disc, so below 1e-10 m after
    # four.
    start = build_hard_disc_gas(1000, 0.3)
    there = EventDrivenRun(start, record="none")
    there.advance_to(math.inf, 500 * impacts_per_disc)
    time_s = there.time_s
    back = EventDrivenRun(
        DiscArrays(there.positions(), -there.velocities(), start.radius_m, start.mass_kg, start.walls), record="none"
    )
    back.advance_to(time_s)
    assert np.max(np.abs(back.positions() - start.position_m)) < (1e-12 if impacts_per_disc == 1 else 1e-10)
    # Discs of the lattice touch the walls at the start: which way they go at that very instant is rounding's choice.
    speeds = np.hypot(*back.velocities().T) - np.hypot(*start.velocity_m_s.T)
    assert np.max(np.abs(speeds)) < (1e-12 if impacts_per_disc == 1 else 1e-10)


def test_long_run_stays_as_exact_as_at_its_start() -> None:
    """After 1e9 s the discs of a slow gas overlap each other and the walls by less than 1e-13 m."""
    gas = build_hard_disc_gas(30, 0.5)
    start = DiscArrays(gas.position_m, gas.velocity_m_s * 1e-6, gas.radius_m, gas.mass_kg, gas.walls)
    run = EventDrivenRun(start, record="none")
    run.advance_to(1e9)
    assert run.counts["epochs"] > 10
    place, (first, second) = run.positions(), np.triu_indices(30, 1)
    assert np.hypot(*(place[first] - place[second]).T).min() > 1.0 - 1e-13
    gaps = [(place - wall[:2]) @ wall[2:] for wall in map(np.array, start.half_planes())]
    assert np.min(gaps) > 0.5 - 1e-13


@each("contact_duration_s, left", [(1.0, -0.5), (math.nextafter(1.0, 2.0), -1.0)])
def test_impact_a_full_contact_duration_after_the_last_loses_energy(contact_duration_s: float, left: float) -> None:
    """In the TC model an impact exactly one contact duration after the last loses energy."""
    # One float of duration more makes both one contact, and the second impact is elastic. The walls have restitution
    # 1/2.
    walls = wall_at(1.5, 0.0, -1.0, 0.0), wall_at(0.0, 2.5, 0.0, -1.0)
    scene = staged("corner", disc_at(0.0, 0.0, 1.0, 1.0), *walls, wall_restitution=0.5, duration_s=2.5)
    for run in (
        EventDrivenRun(scene, contact_duration_s=contact_duration_s),
        all_pairs(scene, contact_duration_s=contact_duration_s),
    ):
        run.advance_to(2.5)
        assert run.velocities().tolist() == [[-0.5, left]]


# Collapse -------------------------------------------------------------------------------------------------------------


def build_collapse_scene() -> Scene:
    """Return three discs between two walls that lose nearly all at each impact."""
    discs = disc_at(0.5, 0.0, 1.0), disc_at(2.5, 0.0), disc_at(4.5, 0.0, -1.0)
    walls = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(5.0, 0.0, -1.0, 0.0)
    return staged("collapse", *discs, *walls, restitution=0.02, duration_s=20.0)


def build_touching_scene() -> Scene:
    """Return a start in which every disc touches its neighbours: a triangle of ten, struck at its tip."""
    radius, apex = 0.25, math.sqrt(3) / 2
    triangle = [(2 * radius * (k - row / 2), 2 * radius * apex * row) for row in range(4) for k in range(row + 1)]
    discs = disc_at(0.0, -0.5, 0.0, 1.0, r=radius), *(disc_at(x, y, r=radius) for x, y in triangle)
    return staged("touching", *discs, duration_s=1.0)


@each("scene", [build_collapse_scene(), build_touching_scene()])
def test_collapse_and_touching_start_end_with_an_outcome(scene: Scene) -> None:
    """An inelastic collapse, and a start in which all discs touch, end within a hundred thousand impacts."""
    outcome = EventDrivenRun(scene, record="none").advance_to(scene.duration_s, 100_000)
    assert outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}


@each("e, solve", [*((e, solve_pic) for e in (0.0, 0.01, 0.0625, 0.07)), (0.01, solve_pic_framewise)])
def test_collapse_with_vanishing_velocities_ends(e: float, solve: Callable[[Scene], Trace]) -> None:
    """A collapse whose centre of mass is at rest ends with all speeds at most 1e-12 m/s."""
    # On the way two discs a contact distance apart close so slowly that they would need longer than the largest float.
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-0.75, 1.0), (0.0, 0.0), (0.75, -1.0))]
    trace = solve(staged("collapse", *discs, restitution=e, duration_s=2.0))
    assert trace.outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}
    assert abs(trace.final_velocity_m_s).max() <= 1e-12
