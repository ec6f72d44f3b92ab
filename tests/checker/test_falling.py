"""The checker knows gravity: what falls rightly breaks no rule, and each wrong way to fall, meet or rest breaks one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from tests.campaign import run as campaign_run
from tests.campaign.gases import Gas, Kind
from tests.campaign.run import checked
from tests.checker import Report, Stretch, check
from tests.checker.passes import _lowest
from tests.drawn import jittered
from tests.lengths import each, long_after

from carom import DiscArrays
from carom.physics.pair_time import pair_time
from carom.solvers.falling import run as falling
from carom.solvers.falling.bodies import FallingBodies
from carom.solvers.falling.run import FallingRun
from carom.solvers.plain.instants import NEVER, Instant, after, between
from carom.trace import Outcome

#: Impacts that a run is followed over.
IMPACTS = 300
#: The floor of `gas`, among its walls.
FLOOR = 2
#: What a fault changes by a little changes by this fraction.
SLIGHTLY = 1.0 + 1e-9


@cache
def gas() -> Gas:
    """Twelve rough discs on a slope between walls, three of them immovable."""
    start = jittered(np.random.default_rng(8), 12, immovable=3, spread=2.0, restitution=0.98)
    assert start.walls[FLOOR] == (0.0, 0.0, 0.0, 1.0)
    rough = replace(start, wall_restitution=0.95, friction=0.1, wall_friction=0.1)
    return Gas(0, Kind.FALLING, 0.0, rough, 10_000, gravity_m_s2=(1.0, -9.8))


def rules(report: Report) -> set[str]:
    return {violation.rule for violation in report.violations}


def test_a_right_run_breaks_no_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is done wrong below is right before: discs meet discs that fall, discs that don't, and the floor."""
    run = campaign_run.run_of(gas())
    monkeypatch.setattr(campaign_run, "run_of", lambda _: run)
    report = checked(gas(), IMPACTS)
    assert report.violations == []
    assert report.impacts == IMPACTS
    assert 0.0 < report.worst_gap < 1.0
    first, second = run.log.array()["first"], run.log.array()["second"]
    fixed = ~gas().start.movable
    assert np.sum(second == -1 - FLOOR) > 20
    assert np.sum((second >= 0) & (fixed[first] | fixed[np.maximum(second, 0)])) > 20
    assert np.sum((second >= 0) & ~fixed[first] & ~fixed[np.maximum(second, 0)]) > 20


#: What a method gives of a faulty solver, from what the right one makes of any arguments.
Fault = Callable[..., Any]


def straight_to_walls(bodies: FallingBodies, right: Fault, i: int, k: int) -> Instant:
    """Meet walls when a straight flight would."""
    pull, bodies.pull = bodies.pull, [(0.0, 0.0)] * len(bodies.walls)
    instant: Instant = right(i, k)
    bodies.pull = pull
    return instant


def straight_to_fixed(bodies: FallingBodies, _: Fault, i: int, fixed: int) -> Instant:
    """Meet immovable discs when a straight flight would."""
    if bodies.inverse_mass[i] == 0.0 or bodies.last_partner[i] == fixed:
        return NEVER
    disc = (*bodies.state_at(i, bodies.instant[i]), bodies.radius[i])
    wait = pair_time(*disc, bodies.x[fixed], bodies.y[fixed], 0.0, 0.0, bodies.radius[fixed])
    return after(bodies.instant[i], wait)


def other_gravity(bodies: FallingBodies, right: Fault, start: Any) -> None:
    """Fall a billionth too fast."""
    right(start)
    bodies.gravity = (bodies.gravity[0] * SLIGHTLY, bodies.gravity[1] * SLIGHTLY)
    bodies.acceleration = [bodies.gravity if mass else (0.0, 0.0) for mass in bodies.inverse_mass]


def falls_by_euler(bodies: FallingBodies, right: Fault, i: int, instant: Instant) -> tuple[float, ...]:
    """Take discs forward by the velocity before, and by none of the fall."""
    wait, (_, _, vx, vy) = between(bodies.instant[i], instant), right(i, instant)
    if bodies.inverse_mass[i] == 0.0:
        return bodies.x[i], bodies.y[i], 0.0, 0.0
    return bodies.x[i] + wait * bodies.vx[i], bodies.y[i] + wait * bodies.vy[i], vx, vy


def fixed_fall(bodies: FallingBodies, right: Fault, i: int, instant: Instant) -> tuple[float, ...]:
    """Let immovable discs fall, too."""
    state: tuple[float, ...] = right(i, instant)
    dropped = 0.5 * bodies.gravity[1] * instant[0] ** 2
    return state if bodies.inverse_mass[i] > 0.0 else (bodies.x[i], bodies.y[i] + dropped, 0.0, 0.0)


def turns_in_flight(bodies: FallingBodies, right: Fault, i: int, instant: Instant) -> None:
    """Let a disc's spin slow down as it flies."""
    right(i, instant)
    bodies.spin[i] /= SLIGHTLY


def late(bodies: FallingBodies, right: Fault, i: int, k: int) -> Instant:
    """Meet walls a billionth of a flight too late."""
    instant: Instant = right(i, k)
    begun = bodies.instant[i]
    return instant if instant == NEVER else after(begun, between(begun, instant) * SLIGHTLY)


#: The method that is wrong, what it gives, and the rule that speaks of it: also of what does not see the floor under
#: every second disc, that two discs meet, or an immovable one; takes discs down and leaves their velocities, leaves
#: walls a billionth too fast, or rubs as if an impact pressed a billionth less.
FAULTS: dict[str, tuple[str, Fault, str]] = {
    "late on walls": ("next_wall_impact", late, "contact"),
    "other gravity": ("__init__", other_gravity, "history"),
    "bounces too fast": ("bounce", lambda _, right, i, k, approach: right(i, k, approach * SLIGHTLY), "law"),
    "no floor": ("next_wall_impact", lambda _, right, i, k: NEVER if i % 2 and k == FLOOR else right(i, k), "passed"),
    "straight to walls": ("next_wall_impact", straight_to_walls, "passed"),
    "no pair": ("next_pair_impact", lambda _, right, i, j: NEVER if i >= 3 and j == 7 else right(i, j), "passed"),
    "no fixed": ("earliest_of_pair", lambda _, right, i, j: NEVER if i == 1 else right(i, j), "passed"),
    "straight to fixed": ("_next_impact_on_fixed", straight_to_fixed, "contact"),
    "keeps its velocity": ("state_at", lambda it, right, i, t: (*right(i, t)[:2], it.vx[i], it.vy[i]), "history"),
    "falls by Euler": ("state_at", falls_by_euler, "contact"),
    "fixed fall": ("state_at", fixed_fall, "state"),
    "rubs too little": ("slide_on_wall", lambda _, right, i, k, v, pressed: right(i, k, v, pressed / SLIGHTLY), "law"),
    "turns in flight": ("bring_to", turns_in_flight, "history"),
}


@pytest.mark.parametrize("name", long_after(3, FAULTS))
def test_each_wrong_way_to_fall_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a solver gets wrong about falling discs breaks the rule that speaks of it."""
    method, fault, broken = FAULTS[name]
    right = getattr(FallingBodies, method)
    wrong = {method: lambda self, *arguments: fault(self, partial(right, self), *arguments)}
    monkeypatch.setattr(falling, "FallingBodies", type("Wrong", (FallingBodies,), wrong))
    assert broken in rules(checked(gas(), IMPACTS))


class RestsTooSoon(campaign_run.FlightAlone):
    """Takes a slow impact for rest."""

    def _is_at_rest(self, approach: float, pull: float, gap_m: float, last: Instant | None) -> bool:
        return (pull < 0.0 and approach < 0.5) or super()._is_at_rest(approach, pull, gap_m, last)


class RestsInTheAir(campaign_run.FlightAlone):
    """Ends at rest at its hundredth impact, wherever that is."""

    def _carry_out(self, first: int, second: int, instant: Instant) -> None:
        super()._carry_out(first, second, instant)
        if self.impacts == 100:
            self._ended = Outcome.AT_REST


@pytest.mark.parametrize("run", [RestsTooSoon, RestsInTheAir])
def test_a_rest_that_is_none_is_found(run: Callable[..., FallingRun], monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that ends at rest although each of its discs moves on, or touches nothing, breaks the rule of ends."""
    monkeypatch.setattr(campaign_run, "FlightAlone", run)
    assert "end" in rules(checked(gas(), IMPACTS))


@each("restitution", [0.0, 0.5])
@each("gravity", [(0.0, -9.8), (1.0, -9.8)])
def test_a_rest_that_is_one_breaks_no_rule(restitution: float, gravity: tuple[float, float]) -> None:
    """Discs that fall on a floor, or on a disc that stands on it, come to rest there after their last impact."""
    walls = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0), (9.0, 0.0, -1.0, 0.0))
    for place in ([[3.0, 2.0]], [[3.0, 2.0], [3.0, 0.5]]):
        mass = np.array([1.0, math.inf][: len(place)])
        size = np.full(len(place), 0.5)
        start = DiscArrays(np.array(place), np.zeros((len(place), 2)), size, mass, walls, restitution, restitution)
        case = Gas(0, Kind.FALLING, 0.0, start, 10_000, gravity_m_s2=gravity)
        run = campaign_run.FlightAlone(case)
        assert run.advance_to(1e6) is Outcome.AT_REST
        report = checked(case)
        assert report.violations == []
        assert report.impacts == run.impacts > 0


@pytest.mark.parametrize("over", [1e-11, -1e-11])
def test_a_flight_that_reaches_into_a_wall_or_a_disc_and_back_is_found(over: float) -> None:
    """A disc thrown up turns in a ceiling, or before it, and beside an immovable disc above it, likewise."""
    height = 0.5 * 3.0**2 / 10.0  # of a throw at 3 m/s, 10 m/s^2
    for fixed in (False, True):
        place = [[0.0, 0.0]] + [[0.0, height + 1.0 - over]] * fixed
        ceiling = () if fixed else ((0.0, height + 0.5 - over, 0.0, -1.0),)
        count = len(place)
        mass = np.array([1.0, math.inf][:count])
        velocity = np.array([[0.0, 3.0], [0.0, 0.0]][:count])
        start = DiscArrays(np.array(place), velocity, np.full(count, 0.5), mass, ceiling)
        back = np.array([[0.0, -3.0], [0.0, 0.0]][:count])
        stretch = Stretch(
            0,
            FallingRun(gas()).log.array(),
            np.array([0, 0]),
            np.array([0.0, 0.6]),
            np.array([place, place]),
            np.array([velocity, back]),
            np.full(count, -math.inf),
        )
        report = Report()
        check(start, stretch, report, gravity_m_s2=(0.0, -10.0))
        assert rules(report) == ({"passed"} if over > 0.0 else set())


def test_the_nearest_point_of_a_parabola_is_found() -> None:
    """The least distance within a span of time is that at the real roots of the cubic, or at the ends."""
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
