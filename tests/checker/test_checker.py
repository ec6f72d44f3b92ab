"""The checker finds every kind of fault: each rule is broken in turn, in a record that is right otherwise."""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.campaign.gas_checks import build_run, check_run
from tests.campaign.gases import Gas, Kind, draw_gas
from tests.cases import each
from tests.checker import Report, Stretch, check, watch
from tests.checker.flights import build_flights
from tests.checker.passes import _closest, disc_overlaps
from tests.random_scenes import build_box, draw_jittered_discs
from tests.scene_builders import require_value
from tests.unit.solvers.run_kinds import all_pairs

from carom import DiscArrays
from carom.model.trace import IMPACT_DTYPE
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.run import Run

Break = Callable[[NDArray[np.void], int], None]

#: The impact that is tampered with.
ROW = 150


@cache
def build_correct_record() -> tuple[DiscArrays, Stretch]:
    """A gas with walls and immovable discs, and its first impacts."""
    start = draw_jittered_discs(np.random.default_rng(5), 30, immovable=4, spread=2.0, restitution=0.9)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


@cache
def build_rough_record() -> tuple[DiscArrays, Stretch]:
    """A gas of discs with friction and spin, and its first impacts."""
    smooth, _ = build_correct_record()
    spin = np.where(smooth.movable, np.random.default_rng(6).normal(size=len(smooth)), 0.0)
    start = replace(smooth, friction=0.3, wall_friction=0.3, spin_rad_s=spin)
    (stretch,) = watch(EventDrivenRun(start), start, 1e9, 300)
    return start, stretch


def check_record(start: DiscArrays, stretch: Stretch, contact_duration_s: float = 0.0) -> Report:
    report = Report()
    check(start, stretch, report, contact_duration_s=contact_duration_s)
    return report


def list_violated_rules(start: DiscArrays, stretch: Stretch, contact_duration_s: float = 0.0) -> set[str]:
    return {violation.rule for violation in check_record(start, stretch, contact_duration_s).violations}


@each("build", [build_correct_record, build_rough_record])
def test_correct_record_violates_no_rule(build: Callable[[], tuple[DiscArrays, Stretch]]) -> None:
    """The records that other tests change violate no rule in their 300 impacts."""
    report = check_record(*build())
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
    start, stretch = build_correct_record()
    impacts, on_wall = stretch.impacts.copy(), (what, change, rules) in ON_WALLS
    kind = ((impacts["second"] < 0) == on_wall) & np.isfinite(start.mass_kg[impacts["first"]])
    change(impacts, ROW + int(np.argmax(kind[ROW:])))
    broken = list_violated_rules(start, replace(stretch, impacts=impacts))
    assert set(rules.split()) <= broken
    assert broken == {rules} or (what, change, rules) not in ONLY


def test_wrong_count_or_state_is_found() -> None:
    """A missing impact violates "count"; a position off by 1e-12 m or a velocity off by one bit violates "state"."""
    start, stretch = build_correct_record()
    assert list_violated_rules(start, replace(stretch, impacts=np.delete(stretch.impacts, ROW))) == {"count"}
    position, velocity = stretch.position_m.copy(), stretch.velocity_m_s.copy()
    position[2, 7, 0] += 1e-12
    assert "state" in list_violated_rules(start, replace(stretch, position_m=position))
    velocity[2, 7, 0] = np.nextafter(velocity[2, 7, 0], math.inf)
    assert "state" in list_violated_rules(start, replace(stretch, velocity_m_s=velocity))


def fly_freely(place: Any, velocity: Any, time_s: float, **fields: Any) -> list[tuple[str, tuple[int, ...]]]:
    """Return what is found in a run of two discs that overlooks every impact."""
    start = DiscArrays(np.array(place), np.array(velocity), **{"mass_kg": np.ones(2), **fields})
    looks = np.array([start.position_m, start.position_m + start.velocity_m_s * time_s])
    same, never = np.array([start.velocity_m_s, start.velocity_m_s]), np.full(2, -math.inf)
    impacts = np.zeros(0, IMPACT_DTYPE)
    stretch = Stretch(0, impacts, np.array([0, 0]), np.array([0.0, time_s]), looks, same, never)
    return [(violation.rule, violation.bodies) for violation in check_record(start, stretch).violations]


@each(
    "y, size, passes",
    [(0.0, 0.5, True), (0.99, 0.5, True), (1.0 - 1e-11, 0.5, True), (1.0, 0.5, False), (0.0, 1e-6, True)],
)
def test_discs_that_pass_through_each_other_are_found(y: float, size: float, passes: bool) -> None:
    """Discs that overlap between two observed states, however briefly, violate "passed"; a touch does not."""
    radius = np.full(2, size)
    found = fly_freely([[-50.0, 0.0], [50.0, y]], [[10.0, 0.0], [-10.0, 0.0]], 10.0, radius_m=radius)
    assert [(rule, sorted(bodies)) for rule, bodies in found] == [("passed", [0, 1])] * passes


def test_movable_disc_beyond_a_wall_is_found() -> None:
    """A movable disc beyond a wall violates the rule "passed"; an immovable one does not."""
    fields = {"radius_m": np.full(2, 0.5), "mass_kg": np.array([1.0, math.inf]), "walls": build_box(9.0, 9.0)}
    assert fly_freely([[1.0, 1.0], [-5.0, 1.0]], [[-1.0, 0.0], [0.0, 0.0]], 2.0, **fields) == [("passed", (0, -1))]


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


# Friction and spin ----------------------------------------------------------------------------------------------------


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


def test_wrong_friction_coefficient_or_final_spin_is_found() -> None:
    """Friction of 0.30 instead of 0.31 violates only "law", and a final spin that is off by 1e-9 rad/s only "state"."""
    start, stretch = build_rough_record()
    # The same record, compared with a friction by which some of its impacts would slide differently, or stick.
    assert list_violated_rules(replace(start, friction=0.31, wall_friction=0.31), stretch) == {"law"}
    spins = require_value(stretch.spin_rad_s).copy()
    spins[-1, int(np.argmax(start.movable))] += 1e-9
    assert list_violated_rules(start, replace(stretch, spin_rad_s=spins)) == {"state"}


# The TC model ---------------------------------------------------------------------------------------------------------

#: Impacts that a run is followed over: past its first new epoch, which comes after 32 a disc.
IMPACTS = 500
CONTACT_S = 0.1


@cache
def build_contact_gas() -> Gas:
    """12 rough discs in a box, two of them immovable."""
    start = draw_jittered_discs(np.random.default_rng(5), 12, immovable=2, spread=1.5, restitution=0.98)
    rough = replace(start, wall_restitution=0.95, friction=0.01, wall_friction=0.01)
    return Gas(0, Kind.CONTACT, 0.0, rough, 10_000, CONTACT_S)


@each("run", [EventDrivenRun, all_pairs])
@each(
    "solved_s, checked_s", [(CONTACT_S, CONTACT_S), (0.0, CONTACT_S), (0.95 * CONTACT_S, CONTACT_S), (CONTACT_S, 0.105)]
)
def test_run_with_a_wrong_contact_duration_violates_the_law(
    run: Callable[..., Run], solved_s: float, checked_s: float
) -> None:
    """A run with the TC model violates no rule; one with a contact duration that is off by 5 % violates "law"."""
    start, report = build_contact_gas().start, Report()
    for stretch in watch(run(build_contact_gas().scene, contact_duration_s=solved_s), start, 1e6, IMPACTS):
        check(start, stretch, report, contact_duration_s=checked_s)
    rules = {violation.rule for violation in report.violations}
    assert rules == (set() if solved_s == checked_s else {"law"})
    assert report.impacts == IMPACTS
    assert 0.1 * IMPACTS < report.elastic < 0.9 * IMPACTS


@each("is_wrong", [False, True])
def test_run_resumed_with_wrong_last_impacts_is_found(is_wrong: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that is resumed from a state with wrong times of last impacts violates the rule "law"."""

    class Resumed(EventDrivenRun):
        def __init__(self, *arguments: Any, resume: Any = None, **options: Any) -> None:
            if resume is not None and is_wrong:
                last_s = resume.kernel["last_impacts"].view(np.float64)
                last_s[:] = np.roll(last_s, 1)
            super().__init__(*arguments, resume=resume, **options)

    watching = sys.modules[watch.__module__]
    monkeypatch.setattr(watching, "RENEWED_AFTER", IMPACTS // 10)
    monkeypatch.setattr(watching, "STRETCH_IMPACTS", IMPACTS // 20)
    monkeypatch.setattr("tests.campaign.gas_checks.EventDrivenRun", Resumed)
    found = check_run(build_contact_gas(), IMPACTS).violations
    assert {violation.rule for violation in found} == ({"law"} if is_wrong else set())


def test_impact_after_exactly_the_contact_duration_may_be_elastic() -> None:
    """An impact after exactly the contact duration may be elastic or not; any other velocity violates the law."""
    walls = ((0.0, 0.0, 1.0, 0.0), (4.0, 0.0, -1.0, 0.0))
    place, velocity, radius = np.array([[1.0, 0.0]]), np.array([[-1.0, 0.0]]), np.array([0.5])
    start = DiscArrays(place, velocity, radius, np.ones(1), walls, wall_restitution=0.5)
    (lossy,) = watch(EventDrivenRun(start), start, 100.0, 2)
    assert lossy.impacts["time_s"].tolist() == [0.5, 6.5]
    (elastic,) = watch(EventDrivenRun(start, contact_duration_s=7.0), start, 100.0, 2)
    for stretch, broken in ((lossy, [set(), set(), {"law"}]), (elastic, [{"law"}, set(), set()])):
        assert [list_violated_rules(start, stretch, t) for t in (5.0, 6.0, 7.0)] == broken
    slower = elastic.impacts.copy()
    slower["velocity_first_after"][1] *= 0.9
    assert "law" in list_violated_rules(start, replace(elastic, impacts=slower), 6.0)
