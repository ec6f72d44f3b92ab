"""The checker finds every kind of fault: each rule is broken in turn, in a record that is right otherwise."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.campaign.gas_checks import build_run
from tests.campaign.gases import Kind, draw_gas
from tests.cases import each
from tests.checker import RULES, Report, Stretch, check, watch
from tests.checker.flights import build_flights, spans
from tests.checker.passes import _closest, disc_overlaps
from tests.random_scenes import build_box, draw_jittered_discs
from tests.scene_builders import require_value

from carom import DiscArrays
from carom.model.trace import IMPACT_DTYPE
from carom.solvers.event_driven.run import EventDrivenRun

Break = Callable[[NDArray[np.void], int], None]

#: The impact that is tampered with.
ROW = 150


@cache
def build_correct_record() -> tuple[DiscArrays, Stretch]:
    """A gas with walls and immovable discs, and its first impacts."""
    start = draw_jittered_discs(np.random.default_rng(5), 30, immovable=4, spread=2.0, restitution=0.9)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


def check_record(start: DiscArrays, stretch: Stretch) -> Report:
    report = Report()
    check(start, stretch, report)
    return report


def list_violated_rules(start: DiscArrays, stretch: Stretch) -> set[str]:
    return {violation.rule for violation in check_record(start, stretch).violations}


def violated_after_change(change: Break, *, on_wall: bool) -> set[str]:
    """Return the rules that are broken once a row, of two discs or of one and a wall, has been changed."""
    start, stretch = build_correct_record()
    impacts = stretch.impacts.copy()
    kind = ((impacts["second"] < 0) == on_wall) & np.isfinite(start.mass_kg[impacts["first"]])
    change(impacts, ROW + int(np.argmax(kind[ROW:])))
    return list_violated_rules(start, replace(stretch, impacts=impacts))


def test_correct_record_violates_no_rule() -> None:
    """The record that other tests change violates no rule in its 300 impacts."""
    report = check_record(*build_correct_record())
    assert (report.violations, report.impacts) == ([], 300)
    assert 0.0 < report.worst_gap < 1.0
    assert 0.0 < report.worst_overlap < 1.0


def set_fields(**fields: Any) -> Break:
    """Return the change that gives fields of a row other values, or what functions make of theirs."""

    def change(impacts: NDArray[np.void], row: int) -> None:
        for name, value in fields.items():
            impacts[name][row] = value(impacts[name][row].copy()) if callable(value) else value

    return change


def swap_impacts(impacts: NDArray[np.void], row: int) -> None:
    """Exchange an impact and the next."""
    impacts[[row, row + 1]] = impacts[[row + 1, row]]


def reverse_impact(impacts: NDArray[np.void], row: int) -> None:
    """Play an impact backwards, which pulls two discs together that move apart."""
    for body in ("first", "second"):
        before, after = impacts[f"velocity_{body}_before"], impacts[f"velocity_{body}_after"]
        before[row], after[row] = after[row].copy(), before[row].copy()


def move_impact_earlier(impacts: NDArray[np.void], row: int, off: float) -> None:
    """Let an impact be off by so much, and still after the one before."""
    impacts["time_s"][row] -= min(off, (impacts["time_s"][row] - impacts["time_s"][row - 1]) / 2)


def next_up(velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a velocity of which one component is a unit in the last place more."""
    return np.array([np.nextafter(velocity[0], math.inf), velocity[1]])


NAMES = [name for name in IMPACT_DTYPE.names or () if name not in {"first", "second"}]
MEET = [(3, 3), (5, 4), (-1, 7), (0, 30), (4, -5), (30, 31), (0, 1), (1, -2)]
BEFORE, AFTER = ([f"velocity_{body}_{when}" for body in ("first", "second")] for when in ("before", "after"))
#: What breaks a rule, and no other: indices beyond the arrays, a disc with itself, bodies that never move, numbers that
#: are not finite, impacts out of order, and a unit in the last place of a velocity before.
ONLY: list[tuple[str, Break, str]] = [
    *((f"{first} meets {second}", set_fields(first=first, second=second), "row") for first, second in MEET),
    *((f"{name} is {value}", set_fields(**{name: value}), "row") for name in NAMES for value in (math.nan, math.inf)),
    *[("swapped", swap_impacts, "order"), ("after its look", set_fields(time_s=lambda time_s: time_s + 1e3), "order")],
    *((f"{name} off", set_fields(**{name: next_up}), "history") for name in BEFORE),
]
#: Changes that break these rules and perhaps others. They are an earlier impact, one played backwards, a normal
#: slightly off the line of centres, velocities of another law, and an additional common velocity of two discs.
AMONG: list[tuple[str, Break, str]] = [
    *((f"{off} s earlier", partial(move_impact_earlier, off=off), "contact state") for off in (1e-12, 1e-9, 1e-6)),
    ("backwards", reverse_impact, "approach law history"),
    ("turned", set_fields(normal=lambda n: n + 1e-12 * np.array([-n[1], n[0]])), "normal"),
    *(
        (f"{name} {factor} times", set_fields(**{name: lambda v, factor=factor: v * factor}), "law")
        for name in AFTER
        for factor in (1 + 1e-13, 1 - 1e-13, 1.01, -1.0)
    ),
    ("carried along", set_fields(**dict.fromkeys(AFTER, lambda v: v + 1e-12)), "law"),
]


#: The same of an impact on a wall: it does not move, and its normal turned round is not its own.
ON_WALLS: list[tuple[str, Break, str]] = [
    *((f"{name} of a wall", set_fields(**{name: (0.0, 5e-324)}), "history") for name in (BEFORE[1], AFTER[1])),
    ("a wall's normal turned round", set_fields(normal=lambda n: -n), "normal approach"),
]


@each("what, change, rules", [*ONLY, *AMONG, *ON_WALLS])
def test_changed_record_violates_the_expected_rules(what: str, change: Break, rules: str) -> None:
    """Each change of the record violates the expected rules; the changes of `ONLY` violate no other rule."""
    broken = violated_after_change(change, on_wall=(what, change, rules) in ON_WALLS)
    assert set(rules.split()) <= broken
    assert broken == {rules} or (what, change, rules) not in ONLY


def test_missing_impact_violates_the_count() -> None:
    """A record with fewer impacts than the run counted violates the rule "count"."""
    start, stretch = build_correct_record()
    assert list_violated_rules(start, replace(stretch, impacts=np.delete(stretch.impacts, ROW))) == {"count"}


def test_impact_of_distant_discs_violates_contact() -> None:
    """An impact of discs 3 m apart, otherwise by the law, violates only the rule "contact"."""
    start = two_discs([[0.0, 0.0], [9.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]])
    (stretch,) = watch(EventDrivenRun(start), start, 20.0)
    impacts = stretch.impacts.copy()
    impacts["time_s"] = 5.0
    position = np.array([stretch.position_m[0], [[5.0, 0.0], [9.0 + 15.0, 0.0]]])
    (violation,) = check_record(start, replace(stretch, impacts=impacts, position_m=position)).violations
    assert (violation.rule, violation.size, violation.bodies) == ("contact", 3.0, (0, 1))


def two_discs(places: list[list[float]], velocities: list[list[float]], **fields: Any) -> DiscArrays:
    """Return two discs of 0.5 m and 1 kg, or other fields."""
    standard = {"radius_m": np.full(2, 0.5), "mass_kg": np.ones(2)}
    return DiscArrays(np.array(places), np.array(velocities), **standard | fields)


def free_flight(start: DiscArrays, time_s: float) -> Stretch:
    """What a run looks like that overlooks every impact."""
    impacts = build_correct_record()[1].impacts[:0]
    place = np.array([start.position_m, start.position_m + start.velocity_m_s * time_s])
    velocity, never = np.array([start.velocity_m_s, start.velocity_m_s]), np.full(len(start), -math.inf)
    return Stretch(0, impacts, np.array([0, 0]), np.array([0.0, time_s]), place, velocity, never)


@each(
    "y, size, passes",
    [(0.0, 0.5, True), (0.99, 0.5, True), (1.0 - 1e-11, 0.5, True), (1.0, 0.5, False), (0.0, 1e-6, True)],
)
def test_discs_that_pass_through_each_other_are_found(y: float, size: float, passes: bool) -> None:
    """Discs that overlap between two observed states, however briefly, violate "passed"; a touch does not."""
    start = two_discs([[-50.0, 0.0], [50.0, y]], [[10.0, 0.0], [-10.0, 0.0]], radius_m=np.full(2, size))
    violations = check_record(start, free_flight(start, 10.0)).violations
    assert [v.rule for v in violations] == ["passed"] * passes
    assert [v.bodies for v in violations] in ([], [(0, 1)], [(1, 0)])


def test_movable_disc_beyond_a_wall_is_found() -> None:
    """A movable disc beyond a wall violates the rule "passed"; an immovable one does not."""
    one_moves = {"mass_kg": np.array([1.0, math.inf]), "walls": build_box(9.0, 9.0)}
    start = two_discs([[1.0, 1.0], [-5.0, 1.0]], [[-1.0, 0.0], [0.0, 0.0]], **one_moves)
    violations = check_record(start, free_flight(start, 2.0)).violations
    assert [(v.rule, v.bodies) for v in violations] == [("passed", (0, -1))]


def test_missed_impacts_of_a_gas_are_found() -> None:
    """A disc that the run ignores violates only "passed", more than ten times."""
    start = draw_jittered_discs(np.random.default_rng(6), 40, spread=1.5)
    names = ("position_m", "velocity_m_s", "radius_m", "mass_kg")
    seen = DiscArrays(walls=start.walls, **{name: getattr(start, name)[:-1] for name in names})
    mass, velocity = start.mass_kg.copy(), start.velocity_m_s.copy()
    mass[39], velocity[39] = math.inf, 0.0
    ghost = replace(start, mass_kg=mass, velocity_m_s=velocity)
    encounters = 0
    for stretch in watch(EventDrivenRun(seen), seen, 1e9, 3000):
        looks = len(stretch.looks)
        with_ghost = replace(
            stretch,
            position_m=np.concatenate([stretch.position_m, np.tile(ghost.position_m[39:], (looks, 1, 1))], axis=1),
            velocity_m_s=np.concatenate([stretch.velocity_m_s, np.zeros((looks, 1, 2))], axis=1),
        )
        violations = check_record(ghost, with_ghost).violations
        assert {v.rule for v in violations} == {"passed"}
        assert all(39 in v.bodies for v in violations)
        encounters += len(violations)
    assert encounters > 10


def test_wrong_state_of_a_run_is_found() -> None:
    """A position off by 1e-12 m, or a velocity off by one bit, at an observed state violates the rule "state"."""
    start, stretch = build_correct_record()
    position, velocity = stretch.position_m.copy(), stretch.velocity_m_s.copy()
    position[2, 7, 0] += 1e-12
    assert "state" in list_violated_rules(start, replace(stretch, position_m=position))
    velocity[2, 7, 0] = np.nextafter(velocity[2, 7, 0], math.inf)
    assert "state" in list_violated_rules(start, replace(stretch, velocity_m_s=velocity))


@pytest.mark.long
@each("kind", list(Kind))
def test_overlap_search_finds_every_overlapping_pair(kind: Kind) -> None:
    """Cells and time windows find the same overlaps of slightly enlarged discs as a test of all pairs."""
    gas = draw_gas(3, kind, most_discs=64)
    larger = replace(gas.start, radius_m=gas.start.radius_m * 1.02)
    movable = np.isfinite(gas.start.mass_kg)
    for stretch in watch(build_run(gas), gas.start, 1e6, 400):
        flights = build_flights(gas.start, stretch, gas.gravity_m_s2)
        overlap = disc_overlaps(larger, stretch, flights)
        expected: set[tuple[int, ...]] = set()
        for begin, end in pairwise([*flights.first[:, 0].tolist(), len(flights.x)]):
            a, b = np.stack(np.triu_indices(end - begin, 1)) + begin
            i, j = flights.disc[a], flights.disc[b]
            begin_s = np.maximum(flights.begin_s[a], flights.begin_s[b])
            together = begin_s <= np.minimum(flights.end_s[a], flights.end_s[b])
            meet = (i != j) & (movable[i] | movable[j]) & together
            bodies, time_s, *_ = _closest(larger, flights, a[meet], b[meet])
            expected |= build_overlap_keys(bodies, time_s)
        assert build_overlap_keys(overlap.bodies, overlap.time_s) == expected
        assert expected


def build_overlap_keys(bodies: NDArray[np.intp], time_s: NDArray[np.float64]) -> set[tuple[int, ...]]:
    """Return the two discs in order, and the time in its bits."""
    low, high = np.sort(bodies, axis=1).T.tolist()
    return set(zip(low, high, time_s.view(np.int64).tolist(), strict=True))


def test_spans_concatenates_ranges() -> None:
    """Ranges from 5, 9 and 2 with 3, 0 and 2 members are listed one after another with their owners."""
    owner, member = spans(np.array([5, 9, 2]), np.array([3, 0, 2]))
    assert owner.tolist() == [0, 0, 0, 2, 2]
    assert member.tolist() == [5, 6, 7, 2, 3]


def test_violation_states_rule_bodies_and_size() -> None:
    """The text of a violation states its rule, its bodies and the size of the error."""
    start, stretch = build_correct_record()
    position = stretch.position_m.copy()
    position[-1, 7, 0] += 1.0
    (violation,) = check_record(start, replace(stretch, position_m=position)).violations
    assert RULES[violation.rule] in str(violation)
    assert "bodies 7" in str(violation)
    assert "off by 1" in str(violation)


@cache
def build_rough_record() -> tuple[DiscArrays, Stretch]:
    """A gas of discs that rub and spin, and its first impacts."""
    smooth, _ = build_correct_record()
    spin = np.where(smooth.movable, np.random.default_rng(6).normal(size=len(smooth)), 0.0)
    start = replace(smooth, friction=0.3, wall_friction=0.3, spin_rad_s=spin)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


def test_correct_rough_record_violates_no_rule() -> None:
    """The record of rough discs that other tests change violates no rule in its 300 impacts."""
    start, stretch = build_rough_record()
    report = check_record(start, stretch)
    assert (report.violations, report.impacts) == ([], 300)
    assert len(np.unique(require_value(stretch.spins)["first_after"])) > 100


@each("kind", ["a unit in the last place", "a billionth", "turned round", "left out"])
@each("side", ["first", "second"])
def test_wrong_spin_after_an_impact_is_found(kind: str, side: str) -> None:
    """A wrong spin violates the rule "law"; one off by a rounding only violates the history or the state."""
    start, stretch = build_rough_record()
    spins = require_value(stretch.spins).copy()
    turned = (stretch.impacts["second"] >= 0) & (spins[f"{side}_before"] != spins[f"{side}_after"])
    row = 50 + int(np.argmax(turned[50:]))
    now = spins[f"{side}_after"][row]
    spins[f"{side}_after"][row] = {
        "a unit in the last place": np.nextafter(now, math.inf),
        "a billionth": now * (1 + 1e-9),
        "turned round": -now,
        "left out": spins[f"{side}_before"][row],
    }[kind]
    rules = list_violated_rules(start, replace(stretch, spins=spins))
    assert rules & {"history", "state"}
    assert ("law" in rules) == (kind != "a unit in the last place")


def test_wrong_friction_coefficient_violates_the_law() -> None:
    """Impacts by a friction of 0.30 instead of 0.31 violate only the rule "law"."""
    start, stretch = build_rough_record()
    assert stretch.spins is not None
    # The same record, compared with a friction by which some of its impacts would slide differently, or stick.
    assert list_violated_rules(replace(start, friction=0.31, wall_friction=0.31), stretch) == {"law"}


def test_wrong_spin_of_the_final_state_is_found() -> None:
    """A spin of the run's last state that is off by 1e-9 rad/s violates the rule "state"."""
    start, stretch = build_rough_record()
    spins = require_value(stretch.spin_rad_s).copy()
    spins[-1, int(np.argmax(start.movable))] += 1e-9
    assert list_violated_rules(start, replace(stretch, spin_rad_s=spins)) == {"state"}
