"""Lower bounds, compared with exact times and with a run that has none."""

import itertools
import math

import pytest
from flint import arb, ctx
from tests.cases import each, release_after
from tests.scene_builders import disc_at, staged
from tests.unit.solvers.certified.adversarial_pairs import (
    draw_adversarial_pairs,
    is_after_impact_of_pair,
    is_after_impact_on_wall,
)
from tests.unit.solvers.certified.start_bounds import StartBounds

from carom import Scene, certify
from carom.catalogue import catalogue
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.result import CertifiedTrace
from carom.studies.bench.gas import build_gas_scene

bounds = pytest.importorskip("carom.solvers.certified.bounds", reason="the compiled extension is not built")


def compute_bounds(bodies: BallBodies) -> dict[tuple[int, int], float]:
    """Return the bound of each pair of bodies; that of two discs is in one of two rows."""
    n, walls = len(bodies), len(bodies.scene.walls)
    found = {(row, body): bound for bound, row, body in bounds.LowerBounds(bodies).up_to(math.inf)}
    pairs = {(i, j): min(found[i, j], found[j, i]) for i, j in itertools.combinations(range(n), 2)}
    return pairs | {(i, wall_body(k)): found[i, wall_body(k)] for i in range(n) for k in range(walls)}


@each("seeds", release_after(1, [range(20), range(20, 400)]))
def test_no_lower_bound_exceeds_the_time_of_impact(seeds: range) -> None:
    """No lower bound exceeds the exact impact time of true states within their balls."""
    meetings = useful = 0
    for seed in seeds:
        with ctx.workprec(400):
            bodies, states = draw_adversarial_pairs(seed)
            found = compute_bounds(bodies)
        for (i, body), bound in found.items():
            if body >= 0:
                assert not is_after_impact_of_pair(bound, states[i], states[body]), (seed, i, body)
                meetings += is_after_impact_of_pair(math.inf, states[i], states[body])
                useful += max(states[i].time, states[body].time) < bound < math.inf
            elif bodies.movable[i]:
                wall = bodies.scene.half_planes()[wall_index(body)]
                assert not is_after_impact_on_wall(bound, states[i], wall), (seed, i, body)
    assert meetings > len(seeds)
    assert useful > meetings / 4


@each("power", [-300, 256])
def test_units_change_no_bit_of_a_lower_bound(power: int) -> None:
    """Lower bounds in any unit of length and speed are those in metres, scaled exactly by the unit of time."""
    for seed in range(4):
        plain, _ = draw_adversarial_pairs(seed)
        scaled, _ = draw_adversarial_pairs(seed, length=2.0**power, speed=2.0 ** (power // 2))
        expected = {pair: math.ldexp(bound, power - power // 2) for pair, bound in compute_bounds(plain).items()}
        assert compute_bounds(scaled) == expected


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
