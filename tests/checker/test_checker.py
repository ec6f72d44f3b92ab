"""The checker finds every kind of fault: each rule is broken in turn, in a record that is right otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.campaign.gases import Kind, draw
from tests.campaign.run import run_of
from tests.checker import RULES, Report, Stretch, check, watch
from tests.checker.flights import flights_of, spans
from tests.checker.passes import _closest, disc_overlaps
from tests.drawn import box, jittered
from tests.lengths import each
from tests.stage import sure

from carom import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.trace import IMPACT_DTYPE

Break = Callable[[NDArray[np.void], int], None]

#: The impact that is tampered with.
ROW = 150


@cache
def right() -> tuple[DiscArrays, Stretch]:
    """A gas with walls and immovable discs, and its first impacts."""
    start = jittered(np.random.default_rng(5), 30, immovable=4, spread=2.0, restitution=0.9)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


def found(start: DiscArrays, stretch: Stretch) -> Report:
    report = Report()
    check(start, stretch, report)
    return report


def broken(start: DiscArrays, stretch: Stretch) -> set[str]:
    return {violation.rule for violation in found(start, stretch).violations}


def tampered(change: Break, row: int = ROW) -> set[str]:
    """Return the rules that are broken once a row, of two discs, has been changed."""
    start, stretch = right()
    impacts = stretch.impacts.copy()
    row += int(np.argmax((impacts["second"][row:] >= 0) & np.isfinite(start.mass_kg[impacts["first"][row:]])))
    change(impacts, row)
    return broken(start, replace(stretch, impacts=impacts))


def test_a_right_record_breaks_no_rule() -> None:
    """What is tampered with below is right before."""
    report = found(*right())
    assert report.violations == []
    assert report.impacts == 300
    assert 0.0 < report.worst_gap < 1.0
    assert 0.0 < report.worst_overlap < 1.0


@each(("first", "second"), [(3, 3), (5, 4), (-1, 7), (0, 30), (4, -5), (30, 31), (0, 1), (1, -2)])
def test_bodies_that_can_not_meet_are_found(first: int, second: int) -> None:
    """Indices beyond the arrays, a disc with itself, and two bodies that never move are no impact."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        impacts["first"][row], impacts["second"][row] = first, second

    assert tampered(change) == {"row"}


@each("name", [n for n in IMPACT_DTYPE.names or () if n not in {"first", "second"}])
@each("value", [math.nan, math.inf])
def test_what_is_not_finite_is_found(name: str, value: float) -> None:
    """NaN or infinity in any field breaks a rule."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        impacts[name][row] = value

    assert tampered(change) == {"row"}


def test_a_missing_row_is_found() -> None:
    """A record that is shorter than the run's own count is no record of it."""
    start, stretch = right()
    assert broken(start, replace(stretch, impacts=np.delete(stretch.impacts, ROW))) == {"count"}


def test_impacts_out_of_order_are_found() -> None:
    """An impact before the one before it, or after its look, breaks the order by time."""

    def swap(impacts: NDArray[np.void], row: int) -> None:
        impacts[[row, row + 1]] = impacts[[row + 1, row]]

    def late(impacts: NDArray[np.void], row: int) -> None:
        impacts["time_s"][row] += 1e3

    assert tampered(swap) == {"order"}
    assert tampered(late) == {"order"}


@pytest.mark.parametrize("name", ["velocity_first_before", "velocity_second_before"])
def test_a_velocity_before_is_held_to_its_last_bit(name: str) -> None:
    """One unit in the last place of a velocity before breaks the history, and nothing else."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        impacts[name][row, 0] = np.nextafter(impacts[name][row, 0], math.inf)

    assert tampered(change) == {"history"}


def test_a_wall_does_not_move() -> None:
    """A velocity of a wall breaks the history."""
    start, stretch = right()
    for name in ("velocity_second_before", "velocity_second_after"):
        impacts = stretch.impacts.copy()
        impacts[name][np.argmax(impacts["second"] < 0)] = (0.0, 5e-324)
        assert "history" in broken(start, replace(stretch, impacts=impacts))


@pytest.mark.parametrize("off", [1e-12, 1e-9, 1e-6])
def test_an_impact_at_another_time_is_found(off: float) -> None:
    """A time that is off by more than rounding leaves a gap, and discs elsewhere than where the run has them."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        room = impacts["time_s"][row] - impacts["time_s"][row - 1]
        impacts["time_s"][row] -= min(off, room / 2)

    assert {"contact", "state"} <= tampered(change)


def test_an_impact_of_discs_apart_is_found() -> None:
    """A phantom: discs far from each other exchange momentum by the law, and all that follows is as recorded."""
    start = DiscArrays(
        np.array([[0.0, 0.0], [9.0, 0.0]]), np.array([[1.0, 0.0], [0.0, 0.0]]), np.full(2, 0.5), np.ones(2)
    )
    (stretch,) = watch(EventDrivenRun(start), start, 20.0)
    impacts = stretch.impacts.copy()
    impacts["time_s"] = 5.0
    place = np.array([[5.0, 0.0], [9.0 + 15.0, 0.0]])
    position = np.array([stretch.position_m[0], place])
    report = found(start, replace(stretch, impacts=impacts, position_m=position))
    assert [violation.rule for violation in report.violations] == ["contact"]
    assert report.violations[0].size == 3.0
    assert report.violations[0].bodies == (0, 1)


def test_an_impact_of_separating_discs_is_found() -> None:
    """An impact played backwards, which pulls two discs together that move apart, breaks approach and law."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        for body in ("first", "second"):
            before, after = impacts[f"velocity_{body}_before"], impacts[f"velocity_{body}_after"]
            before[row], after[row] = after[row].copy(), before[row].copy()

    assert {"approach", "law", "history"} <= tampered(change)


def test_a_normal_off_the_line_of_centres_is_found() -> None:
    """A normal turned by a millionth of a millionth is not the line of centres, and the impulse not along it."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        x, y = impacts["normal"][row]
        impacts["normal"][row] = (x - 1e-12 * y, y + 1e-12 * x)

    assert "normal" in tampered(change)

    start, stretch = right()
    impacts = stretch.impacts.copy()
    impacts["normal"][np.argmax(impacts["second"] < 0)] *= -1.0
    assert {"normal", "approach"} <= broken(start, replace(stretch, impacts=impacts))


@each("factor", [1 + 1e-13, 1 - 1e-13, 1.01, -1.0])
@each("name", ["velocity_first_after", "velocity_second_after"])
def test_velocities_after_are_held_to_the_law(name: str, factor: float) -> None:
    """A velocity after an impact that differs by more than rounding breaks the law of restitution."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        impacts[name][row] *= factor

    assert "law" in tampered(change)


def test_momentum_that_is_not_conserved_is_found() -> None:
    """Two discs that get the right relative velocity, but a common one too, break the law."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        for body in ("first", "second"):
            impacts[f"velocity_{body}_after"][row] += 1e-12

    assert "law" in tampered(change)


def free_flight(start: DiscArrays, time_s: float) -> Stretch:
    """What a run looks like that overlooks every impact."""
    impacts = right()[1].impacts[:0]
    place = np.array([start.position_m, start.position_m + start.velocity_m_s * time_s])
    velocity = np.array([start.velocity_m_s, start.velocity_m_s])
    return Stretch(
        0, impacts, np.array([0, 0]), np.array([0.0, time_s]), place, velocity, np.full(len(start), -math.inf)
    )


@each(
    ("y", "size", "passes"),
    [(0.0, 0.5, True), (0.99, 0.5, True), (1.0 - 1e-11, 0.5, True), (1.0, 0.5, False), (0.0, 1e-6, True)],
)
def test_two_discs_that_pass_through_each_other_are_found(y: float, size: float, passes: bool) -> None:
    """Discs that overlap on the way, however short or shallow, and are apart at either look, have passed unseen."""
    start = DiscArrays(
        np.array([[-50.0, 0.0], [50.0, y]]), np.array([[10.0, 0.0], [-10.0, 0.0]]), np.full(2, size), np.ones(2)
    )
    violations = found(start, free_flight(start, 10.0)).violations
    assert [v.rule for v in violations] == ["passed"] * passes
    assert [v.bodies for v in violations] in ([], [(0, 1)], [(1, 0)])


def test_a_disc_that_goes_through_a_wall_is_found() -> None:
    """A disc beyond a wall at a look has passed it; an immovable one may stand there."""
    start = DiscArrays(
        np.array([[1.0, 1.0], [-5.0, 1.0]]),
        np.array([[-1.0, 0.0], [0.0, 0.0]]),
        np.full(2, 0.5),
        np.array([1.0, math.inf]),
        box(9.0, 9.0),
    )
    violations = found(start, free_flight(start, 2.0)).violations
    assert [(v.rule, v.bodies) for v in violations] == [("passed", (0, -1))]


def test_an_overlooked_impact_of_a_gas_is_found() -> None:
    """A disc that nobody sees is passed through again and again, and no other rule is broken."""
    start = jittered(np.random.default_rng(6), 40, spread=1.5)
    seen = DiscArrays(
        start.position_m[:-1], start.velocity_m_s[:-1], start.radius_m[:-1], start.mass_kg[:-1], start.walls
    )
    still = np.arange(40) == 39
    ghost = replace(
        start,
        mass_kg=np.where(still, math.inf, start.mass_kg),
        velocity_m_s=np.where(still[:, None], 0.0, start.velocity_m_s),
    )
    encounters = 0
    for stretch in watch(EventDrivenRun(seen), seen, 1e9, 3000):
        looks = len(stretch.looks)
        with_ghost = replace(
            stretch,
            position_m=np.concatenate([stretch.position_m, np.tile(ghost.position_m[39:], (looks, 1, 1))], axis=1),
            velocity_m_s=np.concatenate([stretch.velocity_m_s, np.zeros((looks, 1, 2))], axis=1),
        )
        violations = found(ghost, with_ghost).violations
        assert {v.rule for v in violations} == {"passed"}
        assert all(39 in v.bodies for v in violations)
        encounters += len(violations)
    assert encounters > 10


def test_a_run_elsewhere_than_its_impacts_lead_is_found() -> None:
    """A state at a look that is off by more than rounding, in one place or one bit of a velocity, is found."""
    start, stretch = right()
    position, velocity = stretch.position_m.copy(), stretch.velocity_m_s.copy()
    position[2, 7, 0] += 1e-12
    assert "state" in broken(start, replace(stretch, position_m=position))
    velocity[2, 7, 0] = np.nextafter(velocity[2, 7, 0], math.inf)
    assert "state" in broken(start, replace(stretch, velocity_m_s=velocity))


@each("kind", list(Kind))
def test_every_pair_of_flights_that_overlaps_is_looked_at(kind: Kind) -> None:
    """Cells and windows leave out no pair: of discs a little larger than they are, all pairs have the same overlaps."""
    gas = draw(3, kind, most_discs=64)
    larger = replace(gas.start, radius_m=gas.start.radius_m * 1.02)
    movable = np.isfinite(gas.start.mass_kg)
    for stretch in watch(run_of(gas), gas.start, 1e6, 400):
        flights = flights_of(gas.start, stretch, gas.gravity_m_s2)
        overlap = disc_overlaps(larger, stretch, flights)
        expected: set[tuple[int, ...]] = set()
        for begin, end in pairwise([*flights.first[:, 0].tolist(), len(flights.x)]):
            a, b = np.stack(np.triu_indices(end - begin, 1)) + begin
            i, j = flights.disc[a], flights.disc[b]
            together = np.maximum(flights.begin_s[a], flights.begin_s[b]) <= np.minimum(
                flights.end_s[a], flights.end_s[b]
            )
            meet = (i != j) & (movable[i] | movable[j]) & together
            bodies, time_s, *_ = _closest(larger, flights, a[meet], b[meet])
            expected |= exact(bodies, time_s)
        assert exact(overlap.bodies, overlap.time_s) == expected
        assert expected


def exact(bodies: NDArray[np.intp], time_s: NDArray[np.float64]) -> set[tuple[int, ...]]:
    """Return the two discs in order, and the time in its bits."""
    low, high = np.sort(bodies, axis=1).T.tolist()
    return set(zip(low, high, time_s.view(np.int64).tolist(), strict=True))


def test_spans_are_ranges_one_after_another() -> None:
    """Ranges from 5 and 2, of 3, 0 and 2 members."""
    owner, member = spans(np.array([5, 9, 2]), np.array([3, 0, 2]))
    assert owner.tolist() == [0, 0, 0, 2, 2]
    assert member.tolist() == [5, 6, 7, 2, 3]


def test_every_rule_is_described() -> None:
    """A violation says what must hold, where, and by how much it does not."""
    start, stretch = right()
    position = stretch.position_m.copy()
    position[-1, 7, 0] += 1.0
    (violation,) = found(start, replace(stretch, position_m=position)).violations
    assert RULES[violation.rule] in str(violation)
    assert "bodies 7" in str(violation)
    assert "off by 1" in str(violation)


@cache
def rough() -> tuple[DiscArrays, Stretch]:
    """A gas of discs that rub and spin, and its first impacts."""
    smooth, _ = right()
    spin = np.where(smooth.movable, np.random.default_rng(6).normal(size=len(smooth)), 0.0)
    start = replace(smooth, friction=0.3, wall_friction=0.3, spin_rad_s=spin)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


def test_a_right_rough_record_breaks_no_rule() -> None:
    """What is tampered with below is right before, and has impacts that stick, and some that slide."""
    start, stretch = rough()
    report = found(start, stretch)
    assert report.violations == []
    assert report.impacts == 300
    assert len(np.unique(sure(stretch.spins)["first_after"])) > 100


@each("kind", ["a unit in the last place", "a billionth", "turned round", "left out"])
@each("side", ["first", "second"])
def test_a_wrong_spin_after_an_impact_breaks_the_law(kind: str, side: str) -> None:
    """A spin that the law does not give is found; what is within rounding of it breaks the history that follows."""
    start, stretch = rough()
    spins = sure(stretch.spins).copy()
    turned = (stretch.impacts["second"] >= 0) & (spins[f"{side}_before"] != spins[f"{side}_after"])
    row = 50 + int(np.argmax(turned[50:]))
    now = spins[f"{side}_after"][row]
    spins[f"{side}_after"][row] = {
        "a unit in the last place": np.nextafter(now, math.inf),
        "a billionth": now * (1 + 1e-9),
        "turned round": -now,
        "left out": spins[f"{side}_before"][row],
    }[kind]
    rules = broken(start, replace(stretch, spins=spins))
    assert rules & {"history", "state"}
    assert ("law" in rules) == (kind != "a unit in the last place")


def test_sliding_where_friction_holds_breaks_the_law() -> None:
    """An impact by the other branch of friction keeps momentum and angular momentum, and is found all the same."""
    start, stretch = rough()
    assert stretch.spins is not None
    # The same record, held against a friction that would have made some of its impacts slide otherwise, or stick.
    assert broken(replace(start, friction=0.31, wall_friction=0.31), stretch) == {"law"}


def test_a_spin_of_the_run_that_its_impacts_do_not_lead_to_is_found() -> None:
    """The spins of the run's own state are held against its impacts to the last bit."""
    start, stretch = rough()
    spins = sure(stretch.spin_rad_s).copy()
    spins[-1, int(np.argmax(start.movable))] += 1e-9
    assert broken(start, replace(stretch, spin_rad_s=spins)) == {"state"}
