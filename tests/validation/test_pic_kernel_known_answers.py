"""The event-driven kernel against answers that no code of Carom made, and its invariants for any input."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.cases import each
from tests.random_scenes import draw_jittered_discs
from tests.scene_builders import disc_at, staged, wall_at
from tests.unit.solvers.run_kinds import all_pairs
from tests.validation import known_scenes
from tests.validation.known_scenes import build_galperin_scene, measure_galperin_error

from carom import Outcome, Scene, Trace, solve_pic, solve_pic_framewise
from carom.model.disc_arrays import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.studies.bench.gas import build_hard_disc_gas


@pytest.mark.release
@each("k, count", [(6, 3141592), (7, 31415926)])
def test_galperin_impact_count_gives_the_digits_of_pi(k: int, count: int) -> None:
    """The number of impacts is floor(10^k pi), and the last velocity is that of the unfolded billiard."""
    # In the coordinates (10^k V, v) each two impacts turn the velocity by 2 theta, tan(theta) = 10^-k (Galperin 2003).
    # The roundings of that many impacts, 2^-53 of the greatest speed 10^k each, add up as their square root. Up to k =
    # 5 each impact is compared with its own answer, below.
    run = EventDrivenRun(build_galperin_scene(k), record="none")
    assert run.advance_to(1e9) is Outcome.COMPLETED
    assert run.impacts == count
    theta = math.atan(10.0**-k)
    angle = (count + count % 2) * theta
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


@pytest.mark.release
def test_inelastic_collapse_of_a_gas_ends_with_an_outcome() -> None:
    """Inelastic collapse ends at a standstill or the impact limit; with a contact duration the run completes."""
    # The contact duration is that of the TC model (Luding & McNamara 1998).
    gas = draw_jittered_discs(np.random.default_rng(2), 100, spread=1.2, restitution=0.3)
    for contact_duration_s, expected in ((0.0, {Outcome.STANDSTILL, Outcome.MAX_IMPACTS}), (1e-4, {Outcome.COMPLETED})):
        run = EventDrivenRun(gas, record="none", contact_duration_s=contact_duration_s)
        assert run.advance_to(100.0, 2_000_000) in expected


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


def test_simultaneous_impacts_are_ordered_by_body_numbers() -> None:
    """Three impacts at 0.5 s are ordered by their body numbers, also if the queue lists disc 2 first."""
    discs = disc_at(6.0, 6.0, -1.0, 1.0), disc_at(0.0, 2.0, 1.0), disc_at(4.0, 6.0, 1.0, 1.0)
    box = [wall_at(-1, 0, 1, 0), wall_at(0, -1, 0, 1), wall_at(7, 0, -1, 0), wall_at(0, 7, 0, -1)]
    impacts = solve_pic(staged("tie", *discs, *box, duration_s=1.0)).impacts
    assert impacts["time_s"].tolist() == [0.5, 0.5, 0.5]
    assert impacts[["first", "second"]].tolist() == [(0, -4), (0, 2), (2, -4)]


# Invariants of PIC for any input: conservation, no overlap, time that only advances, a named end ------------

IMPACTS = 100_000


@each("scene", [known_scenes.build_collapse_scene(), known_scenes.build_touching_scene()])
def test_collapse_and_touching_start_end_with_an_outcome(scene: Scene) -> None:
    """An inelastic collapse, and a start in which all discs touch, end within a hundred thousand impacts."""
    outcome = EventDrivenRun(scene, record="none").advance_to(scene.duration_s, IMPACTS)
    assert outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}


@pytest.mark.long
@each("k", range(6))
def test_every_galperin_impact_matches_its_closed_form(k: int) -> None:
    """Times and velocities of up to 314159 impacts are within the bound of roundings of the closed form."""
    assert measure_galperin_error(build_galperin_scene(k)) <= 1.0


@each("e, solve", [*((e, solve_pic) for e in (0.0, 0.01, 0.0625, 0.07)), (0.01, solve_pic_framewise)])
def test_collapse_with_vanishing_velocities_ends(e: float, solve: Callable[[Scene], Trace]) -> None:
    """A collapse whose centre of mass is at rest ends with all speeds at most 1e-12 m/s."""
    # On the way two discs a contact distance apart close so slowly that they would need longer than the largest float.
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-0.75, 1.0), (0.0, 0.0), (0.75, -1.0))]
    trace = solve(staged("collapse", *discs, restitution=e, duration_s=2.0))
    assert trace.outcome in {Outcome.COMPLETED, Outcome.STANDSTILL}
    assert abs(trace.final_velocity_m_s).max() <= 1e-12
