"""The checker knows gravity: what falls rightly breaks no rule, and each wrong way to fall, meet or rest breaks one."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.campaign import gas_checks
from tests.campaign.gas_checks import check_run
from tests.campaign.gases import Gas, Kind
from tests.cases import each, release_after
from tests.checker import Report, Stretch, check
from tests.checker.passes import _lowest
from tests.random_scenes import draw_jittered_discs

from carom import DiscArrays
from carom.model.trace import IMPACT_DTYPE, Outcome
from carom.solvers.run import Progress

#: Impacts that a run is followed over.
IMPACTS = 300
#: The floor of `gas`, among its walls.
FLOOR = 2
#: What a fault changes by a little changes by this fraction.
SLIGHTLY = 1.0 + 1e-9


@cache
def build_gas() -> Gas:
    """Twelve rough discs on a slope between walls, three of them immovable."""
    start = draw_jittered_discs(np.random.default_rng(8), 12, immovable=3, spread=2.0, restitution=0.98)
    assert start.walls[FLOOR] == (0.0, 0.0, 0.0, 1.0)
    rough = replace(start, wall_restitution=0.95, friction=0.1, wall_friction=0.1)
    return Gas(0, Kind.FALLING, 0.0, rough, 10_000, gravity_m_s2=(1.0, -9.8))


def list_rules(report: Report) -> set[str]:
    return {violation.rule for violation in report.violations}


def test_correct_run_violates_no_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    """A correct run under gravity, with over 20 impacts of each kind, violates no rule."""
    run = gas_checks.build_run(build_gas())
    monkeypatch.setattr(gas_checks, "build_run", lambda _: run)
    report = check_run(build_gas(), IMPACTS)
    assert (report.violations, report.impacts) == ([], IMPACTS)
    assert 0.0 < report.worst_gap < 1.0
    first, second = run.log.array()["first"], run.log.array()["second"]
    fixed = ~build_gas().start.movable
    assert np.sum(second == -1 - FLOOR) > 20
    assert np.sum((second >= 0) & (fixed[first] | fixed[np.maximum(second, 0)])) > 20
    assert np.sum((second >= 0) & ~fixed[first] & ~fixed[np.maximum(second, 0)]) > 20


def with_start(**fields: Any) -> Gas:
    return replace(build_gas(), start=replace(build_gas().start, **fields))


def move_floor(by: float) -> Gas:
    """Return the gas with its floor higher."""
    walls = list(build_gas().start.walls)
    walls[FLOOR] = (0.0, by, 0.0, 1.0)
    return with_start(walls=tuple(walls))


def shrink_discs(discs: slice) -> Gas:
    """Return the gas with some discs so small that they all but miss the others."""
    radius = build_gas().start.radius_m.copy()
    radius[discs] /= 8.0
    return with_start(radius_m=radius)


#: What a run is of instead of the gas that it is checked against, and the rule that is broken.
FAULTS: dict[str, tuple[Callable[[], Gas], str]] = {
    "late on the floor": (lambda: move_floor(-1e-9), "contact"),
    "early on the floor": (lambda: move_floor(1e-9), "contact"),
    "no floor": (lambda: move_floor(-50.0), "passed"),
    "other gravity": (lambda: replace(build_gas(), gravity_m_s2=(1.0 * SLIGHTLY, -9.8 * SLIGHTLY)), "history"),
    "no gravity": (lambda: replace(build_gas(), gravity_m_s2=(0.0, -1e-30)), "history"),
    "bounces too fast": (lambda: with_start(wall_restitution=0.95 * SLIGHTLY), "law"),
    "strikes too fast": (lambda: with_start(restitution=0.98 * SLIGHTLY), "law"),
    "rubs too little": (lambda: with_start(wall_friction=0.1 / SLIGHTLY), "law"),
    "heavier": (lambda: with_start(mass_kg=build_gas().start.mass_kg * np.linspace(1.0, SLIGHTLY, 12)), "law"),
    "no fixed": (lambda: shrink_discs(slice(0, 3)), "passed"),
    "thinner": (lambda: shrink_discs(slice(7, 8)), "contact"),
}


@each("name", release_after(3, FAULTS))
def test_wrong_fall_violates_its_rule(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run of a gas with a small difference violates the rule for that difference."""
    make, broken = FAULTS[name]
    monkeypatch.setattr(gas_checks, "build_run", lambda _: gas_checks.FlightAlone(make()))
    assert broken in list_rules(check_run(build_gas(), IMPACTS))


class RestsInTheAir(gas_checks.FlightAlone):
    """Ends at rest at its hundredth impact, wherever that is."""

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        outcome = super().advance_to(time_s, max_impacts, progress)
        return Outcome.AT_REST if self.impacts >= 100 else outcome


def test_wrong_end_at_rest_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that ends at rest although no disc rests violates the rule "end"."""
    monkeypatch.setattr(gas_checks, "FlightAlone", RestsInTheAir)
    assert "end" in list_rules(check_run(build_gas(), IMPACTS))


@each("restitution", [0.0, 0.5])
@each("gravity", [(0.0, -9.8), (1.0, -9.8)])
def test_correct_end_at_rest_violates_no_rule(restitution: float, gravity: tuple[float, float]) -> None:
    """Discs that come to rest on a floor or on an immovable disc violate no rule."""
    walls = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0), (9.0, 0.0, -1.0, 0.0))
    for place in ([[3.0, 2.0]], [[3.0, 2.0], [3.0, 0.5]]):
        mass = np.array([1.0, math.inf][: len(place)])
        size = np.full(len(place), 0.5)
        start = DiscArrays(np.array(place), np.zeros((len(place), 2)), size, mass, walls, restitution, restitution)
        case = Gas(0, Kind.FALLING, 0.0, start, 10_000, gravity_m_s2=gravity)
        run = gas_checks.FlightAlone(case)
        assert run.advance_to(1e6) is Outcome.AT_REST
        report = check_run(case)
        assert report.violations == []
        assert report.impacts == run.impacts > 0


@each("over", [1e-11, -1e-11])
@each("fixed", [False, True])
def test_flight_that_enters_a_body_and_returns_is_found(fixed: bool, over: float) -> None:
    """A flight that enters a ceiling or fixed disc by 1e-11 m violates "passed"; one that far away does not."""
    height = 0.5 * 3.0**2 / 10.0  # of a throw at 3 m/s, 10 m/s^2
    place = np.array([[0.0, 0.0], (0.0, height + 1.0 - over) if fixed else (9.0, 9.0)])
    ceiling = () if fixed else ((0.0, height + 0.5 - over, 0.0, -1.0),)
    velocity = np.array([[0.0, 3.0], [0.0, 0.0]])
    start = DiscArrays(place, velocity, np.full(2, 0.5), np.array([1.0, math.inf]), ceiling)
    looks, never = np.array([0.0, 0.6]), np.full(2, -math.inf)
    impacts, velocities = np.zeros(0, IMPACT_DTYPE), np.array([velocity, 0.0 - velocity])
    stretch = Stretch(0, impacts, np.array([0, 0]), looks, np.array([place, place]), velocities, never)
    report = Report()
    check(start, stretch, report, gravity_m_s2=(0.0, -10.0))
    assert list_rules(report) == ({"passed"} if over > 0.0 else set())


def test_closest_point_of_a_parabola_is_found() -> None:
    """The least distance of a fall from a point is at a real root of the cubic or at an end of the interval."""
    rng = np.random.default_rng(1)
    p, v, g = rng.normal(size=(3, 2, 500)) * np.array([1.0, 2.0, 3.0])[:, None, None]
    span = np.exp(rng.uniform(-3.0, 2.0, 500))
    when, distance2 = _lowest((p[0], p[1]), (v[0], v[1]), (g[0], g[1]), span)
    for k in range(500):
        a, b, c = p[:, k], v[:, k], 0.5 * g[:, k]
        roots = np.roots([2 * c @ c, 3 * b @ c, b @ b + 2 * a @ c, a @ b])
        real = roots.real[np.abs(roots.imag) < 1e-6]
        t = np.concatenate([[0.0, span[k]], real[(real > 0.0) & (real < span[k])]])
        expected = np.min(np.sum((a + np.outer(t, b) + np.outer(t * t, c)) ** 2, axis=1))
        assert distance2[k] == pytest.approx(expected, rel=1e-9, abs=1e-12)
        assert 0.0 <= when[k] <= span[k]
