"""Lower bounds: compared with exact times, and with a new table."""

import itertools
import math

import pytest
from flint import arb, ctx
from tests.cases import each, release_after
from tests.scene_builders import disc_at, staged
from tests.unit.solvers.certified.adversarial_pairs import (
    KINDS,
    build_adversarial_pairs,
    is_after_impact_of_pair,
    is_after_impact_on_wall,
)
from tests.unit.solvers.certified.start_bounds import StartBounds

from carom import Scene, certify
from carom.catalogue import catalogue
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.bounds import LowerBounds
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.impacts import apply_meeting
from carom.solvers.certified.meeting_times import meet
from carom.solvers.certified.result import CertifiedTrace
from carom.studies.bench.gas import build_gas_scene

bounds = pytest.importorskip("carom.solvers.certified.bounds", reason="the compiled extension is not built")


def read_bounds(table: LowerBounds, bodies: BallBodies) -> dict[tuple[int, int], float]:
    """Return the bound of each pair of bodies; that of two discs is in one of two rows."""
    n, walls = len(bodies), len(bodies.scene.walls)
    found = {(row, body): bound for bound, row, body in table.up_to(math.inf)}
    pairs = {(i, j): min(found[i, j], found[j, i]) for i, j in itertools.combinations(range(n), 2)}
    return pairs | {(i, wall_body(k)): found[i, wall_body(k)] for i in range(n) for k in range(walls)}


def find_late_bounds(kind: str, seeds: range, length: float = 1.0, speed: float = 1.0) -> list[tuple[int, int, int]]:
    """Return seed and bodies of each bound that is above the time of impact of true states within the balls."""
    found = []
    for seed in seeds:
        with ctx.workprec(400):
            bodies, states = build_adversarial_pairs(kind, seed, length, speed)
            table = bounds.LowerBounds(bodies)
        for (i, body), bound in read_bounds(table, bodies).items():
            if body >= 0:
                wrong = is_after_impact_of_pair(bound, states[i], states[body])
            else:
                wall = bodies.scene.half_planes()[wall_index(body)]
                wrong = bodies.movable[i] and is_after_impact_on_wall(bound, states[i], wall)
            if wrong:
                found.append((seed, i, body))
    return found


@each("numbers", release_after(1, [range(1), range(1, 20)]))
@each("kind", KINDS)
def test_no_lower_bound_exceeds_the_time_of_impact(kind: str, numbers: range) -> None:
    """No lower bound exceeds the exact impact time of true states within their balls."""
    assert find_late_bounds(kind, numbers) == []


@pytest.mark.release
@each("kind", KINDS)
def test_no_lower_bound_in_any_unit_exceeds_the_time_of_impact(kind: str) -> None:
    """No lower bound exceeds the impact time in units of 2^-250 to 2^250 m and m/s, for 290,000 bounds."""
    powers = (-250, -166, 0, 125, 250)
    for number, (a, b) in enumerate(itertools.product(powers, powers)):
        begin = 1000 + 20 * number
        assert find_late_bounds(kind, range(begin, begin + 20), 2.0**a, 2.0**b) == []


@pytest.mark.release
def test_check_of_bounds_detects_slightly_late_bounds() -> None:
    """Over 90% of the bounds that are moved later by a factor of 1 + 1e-5 are found to be too late."""
    noticed = hits = 0
    for seed in range(60):
        bodies, states = build_adversarial_pairs("far", seed)
        for (i, j), bound in read_bounds(bounds.LowerBounds(bodies), bodies).items():
            if j >= 0 and is_after_impact_of_pair(math.inf, states[i], states[j]):
                hits += 1
                noticed += is_after_impact_of_pair(bound * (1 + 1e-5), states[i], states[j])
    assert hits > 100
    assert noticed > 0.9 * hits


@each("power", [-500, -300, -256, 0, 256, 300, 500])
def test_units_change_no_bit_of_a_lower_bound(power: int) -> None:
    """Lower bounds in any unit of length and speed are those in metres, scaled exactly by the unit of time."""
    for seed, kind in enumerate(("any", "graze", "old", "heavy")):
        plain, _ = build_adversarial_pairs(kind, seed)
        scaled, _ = build_adversarial_pairs(kind, seed, length=2.0**power, speed=2.0 ** (power // 2))
        expected = {pair: math.ldexp(bound, power - power // 2) for pair, bound in compute_bounds(plain).items()}
        assert compute_bounds(scaled) == expected


def compute_bounds(bodies: BallBodies) -> dict[tuple[int, int], float]:
    return read_bounds(bounds.LowerBounds(bodies), bodies)


def build_two_discs() -> BallBodies:
    return BallBodies(staged("two", *(disc_at(x, 0.0, 1.5 - x / 2, r=1.0) for x in (0.0, 5.0)), duration_s=9.0))


@each("ball", [arb("nan"), arb("inf"), arb("-inf"), arb(0, "inf"), arb(2) ** 5000, -(arb(2) ** 5000), arb(1, 1e300)])
@each("field", ["x", "y", "vx", "vy"])
def test_state_without_a_usable_value_has_the_start_as_bound(field: str, ball: arb) -> None:
    """A state that is not finite, too large or too uncertain gets the start of its path as lower bound."""
    bodies = build_two_discs()
    bodies.time = [0.25, 0.5]
    getattr(bodies, field)[1] = ball
    assert compute_bounds(bodies) == {(0, 1): 0.5}


def test_updated_bounds_equal_those_of_a_new_table() -> None:
    """After each of 200 impacts, with growing balls, the updated bounds equal those of a new table."""
    scene = build_gas_scene(9, 0.4)
    wide = False
    with ctx.workprec(110):
        bodies = BallBodies(scene)
        table = bounds.LowerBounds(bodies)
        for _ in range(200):
            at, row, body = table.earliest()
            assert at == min(read_bounds(table, bodies).values())
            assert table.up_to(at)[0] == (at, row, body)
            meeting = meet(bodies, row, body, at)
            if meeting is None or not meeting.decided:
                table.raise_to(row, body, math.inf)
                continue
            apply_meeting(bodies, meeting)
            raised = {pair: bound for pair, bound in read_bounds(table, bodies).items() if bound == math.inf}
            moved = [body for body in (meeting.first, meeting.second) if body >= 0]
            table.changed(*moved)
            followed, anew = read_bounds(table, bodies), compute_bounds(bodies)
            kept = [pair for pair in anew if pair not in raised or set(pair) & set(moved)]
            assert {pair: followed[pair] for pair in kept} == {pair: anew[pair] for pair in kept}
            wide = wide or bodies.worst_accuracy_bits() < 50
    assert wide


def test_wall_bound_under_gravity_is_the_start_of_the_path() -> None:
    """Under gravity pairs keep the bounds of straight motion, and walls have the start of the path as bound."""
    straight = build_gas_scene(9, 0.3, duration_s=10.0)
    falling = straight.model_copy(update={"gravity_m_s2": (0.5, -9.81)})
    one, other = (compute_bounds(BallBodies(scene)) for scene in (straight, falling))
    assert {pair: bound for pair, bound in other.items() if pair[1] >= 0} == {
        pair: bound for pair, bound in one.items() if pair[1] >= 0
    }
    assert {bound for pair, bound in other.items() if pair[1] < 0} == {0.0}


@each("until", [-math.inf, 0.5, 1.0, math.inf, math.nan])
def test_bounds_up_to_a_time_are_listed_row_by_row(until: float) -> None:
    """`up_to` lists the bounds that are not above a time, row by row, and all bounds for NaN."""
    table = bounds.LowerBounds(BallBodies(build_gas_scene(9, 0.4)))
    every = table.up_to(math.inf)
    assert [entry[1:] for entry in every] == [(i, body) for i in range(9) for body in (*range(9), -1, -2, -3, -4)]
    assert table.up_to(until) == [entry for entry in every if not entry[0] > until]


SCENES = [
    build_gas_scene(9, 0.4),
    build_gas_scene(6, 0.2, duration_s=3.0).model_copy(update={"gravity_m_s2": (0.5, -2.0)}),
    *(catalogue()[name].scene for name in ("classics/sorting", "classics/galperin-100", "classics/cradle-touching")),
]


def summarise_run(certified: CertifiedTrace) -> tuple[object, ...]:
    """Return the digits of a run, and how it ended."""
    trace, degeneracy = certified.trace, certified.degeneracy
    kind = degeneracy and (degeneracy.kind, degeneracy.bodies, degeneracy.proven)
    return certified.ending, certified.decimals, trace.impacts[["first", "second"]].tolist(), kind, certified.commuted


@each("scene", SCENES)
def test_certified_digits_do_not_depend_on_lower_bounds(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A certified run without lower bounds has the same impacts, digits and ending."""
    bounded = certify(scene, max_impacts=40, digits=20)
    monkeypatch.setattr(bounds, "LowerBounds", StartBounds)
    assert summarise_run(certify(scene, max_impacts=40, digits=20)) == summarise_run(bounded)
