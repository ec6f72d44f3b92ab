"""Resting height, rolling, slopes and edges of discs in each engine, from eight starts each."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from tests.adapters.bare_runs import ENGINES, Body, Stage
from tests.adapters.falling_balls import RADIUS_M, STARTS, G, build_floor_scene, count_take_offs, measure_speeds_at_rest
from tests.cases import each
from tests.scene_builders import Finish, Named, require_value, staged

import carom
from carom import Chain, Disc, compare, solve_pic, solve_pit
from carom.comparator.grades import Grade
from carom.engines.api import Adapter, Setting
from carom.execution.observation.engine_run import observe_run

pytestmark = pytest.mark.long


RATE_HZ = 240.0


class Rows(NamedTuple):
    """What an engine does at 240 steps per second, as the least and the most of eight starts.

    Attributes:
        gap_mm: Height above its floor of a ball at rest after its bounces.
        kept: What is left after 10 s of a speed of about 2 m/s at which a disc rolls.
        held: By how much a disc that rolls down a slope is off in a second, m/s; of slopes up to tan .57.
        slipped: The same where it slips, of slopes up to tan 1.
        edge: How far a disc that rolls off an edge at about 3 m/s is too high a second later, over ``g dt t / 2``, the
            error of an integrator that falls by steps. The error is largest for a disc that leaves with a step.
    """

    gap_mm: tuple[float, float]
    kept: tuple[float, float]
    held: tuple[float, float]
    slipped: tuple[float, float]
    edge: tuple[float, float]


EXACT = (1.0 - 1e-12, 1.0 + 1e-12)
NONE = (-1e-12, 1e-12)
ROWS = {
    ("pymunk", "default"): Rows((-0.2, 0.0), EXACT, NONE, NONE, (0.2, 1.05)),
    ("pymunk", "tuned"): Rows((-0.2, 0.0), EXACT, NONE, NONE, (0.2, 1.05)),
    ("box2d", "default"): Rows((7.5, 10.0), (0.998, 0.9985), (-0.012, -0.01), (-2e-5, 2e-5), (0.6, 1.6)),
    ("box2d", "resting"): Rows((-0.2, 0.2), (1 - 1e-6, 1 + 1e-6), (-2e-5, 2e-5), (-2e-5, 2e-5), (-0.6, 1.05)),
    ("pybullet", "default"): Rows((-0.02, 0.0), EXACT, NONE, NONE, (0.2, 1.05)),
    ("pybullet", "tuned"): Rows((-0.2, 0.0), EXACT, NONE, NONE, (-0.6, 1.05)),
    ("mujoco", "default"): Rows((-0.7, -0.6), (0.9999, 1.0), (0.0015, 0.002), (-0.008, 0.012), (0.9, 2.1)),
    ("mujoco", "tuned"): Rows((-0.2, 0.0), (0.9999, 1.0), (-0.0004, -0.0003), (0.0, 2e-6), (-0.6, 1.05)),
}


def _spread_starts(least: float, most: float) -> list[float]:
    return [float(start) for start in np.linspace(least, most, STARTS)]


def _measure_slope_error(finish: Finish, engine: Adapter, profile: str, tangent: float, friction: float) -> float:
    """Return by how much the speed is off, a second after a disc is let go on a slope."""
    long = math.hypot(1.0, tangent)
    law = G * tangent / long / 1.5 if tangent <= 3.0 * friction else G * (tangent - friction) / long
    scene = build_floor_scene(Disc(position_m=(0, RADIUS_M), radius_m=RADIUS_M), 1.0, fall=tangent, friction=friction)
    return float(finish(engine, scene, 1 / RATE_HZ, profile).velocity_m_s[0, 0]) - law


def _measure_edge_error(finish: Finish, engine: Adapter, profile: str, speed: float) -> float:
    edge, laws = Chain(points_m=((-5.0, 0.0), (1.0, 0.0))), {"wall_friction": 0.5, "wall_restitution": 0.0}
    scene = staged("edge", _build_rolling_disc(speed), edge, gravity_m_s2=(0.0, -G), **laws, duration_s=1.0)
    flown = 1.0 - 1.0 / speed
    height = float(finish(engine, scene, 1 / RATE_HZ, profile).position_m[0, 1])
    return (height - (RADIUS_M - 0.5 * G * flown**2)) / (0.5 * G * flown / RATE_HZ)


def _build_rolling_disc(speed: float) -> Disc:
    return Disc(position_m=(0, RADIUS_M), velocity_m_s=(speed, 0), radius_m=RADIUS_M, spin_rad_s=-speed / RADIUS_M)


@each("name, profile", ROWS)
def test_contact_errors_of_engines_are_within_their_bounds(
    named: Named, finish: Finish, name: str, profile: str
) -> None:
    """Gap, rolling, slope and edge errors at 240 steps per second are within the listed bounds from 8 starts."""
    engine, row, dt_s = named(name), ROWS[name, profile], 1 / RATE_HZ
    found: dict[str, list[float]] = {field: [] for field in Rows._fields}
    for up in _spread_starts(1.0, 1.03):
        ball = build_floor_scene(Disc(position_m=(0, RADIUS_M + up), radius_m=RADIUS_M), 4.0, e=0.5)
        found["gap_mm"].append(1e3 * (finish(engine, ball, dt_s, profile).position_m[0, 1] - RADIUS_M))
    for speed in _spread_starts(1.75, 2.25):
        end = finish(engine, build_floor_scene(_build_rolling_disc(speed), 10.0, friction=0.5), dt_s, profile)
        found["kept"].append(end.velocity_m_s[0, 0] / speed)
    for tangent in _spread_starts(0.54, 0.57):
        found["held"].append(_measure_slope_error(finish, engine, profile, tangent, 0.2))
    for tangent in _spread_starts(0.96, 1.0):
        found["slipped"].append(_measure_slope_error(finish, engine, profile, tangent, 0.3))
    for speed in _spread_starts(2.8, 3.2):
        found["edge"].append(_measure_edge_error(finish, engine, profile, speed))
    for field, (least, most) in row._asdict().items():
        assert least <= min(found[field]), (field, found[field])
        assert max(found[field]) <= most, (field, found[field])


@each("name, profile", ROWS)
def test_resting_ball_does_not_take_off_again(named: Named, name: str, profile: str) -> None:
    """No ball leaves its floor again after it should be at rest, unlike those of tuned Box2D, which is no row."""
    speeds = measure_speeds_at_rest(named(name), profile, RATE_HZ)
    assert [count_take_offs(of_start, RATE_HZ) for of_start in speeds] == [0] * STARTS


def _measure_struck_speed(finish: Finish, engine: Adapter, profile: str, speed: float, **changes: Setting) -> float:
    """Return how fast a disc at rest ends that one has rolled into, over that one's speed: by the law 2/3."""
    discs = [_build_rolling_disc(speed), Disc(position_m=(2.0, RADIUS_M), radius_m=RADIUS_M)]
    scene = build_floor_scene(discs[0], 3.0, friction=0.2).model_copy(update={"discs": tuple(discs)})
    return float(finish(engine, scene, 1 / RATE_HZ, profile, **changes).velocity_m_s[1, 0]) / speed


def test_default_pybullet_makes_struck_discs_up_to_5_percent_too_fast(named: Named, finish: Finish) -> None:
    """PyBullet's default `contactERP` makes a struck disc up to 3.5 to 5 % too fast; at 0, or tuned, 0.1 to 0.4 %."""

    def errors(profile: str, **changes: Setting) -> list[float]:
        starts = _spread_starts(3.0, 3.42)
        return [1.5 * _measure_struck_speed(finish, named("pybullet"), profile, v, **changes) - 1.0 for v in starts]

    shipped, without, tuned = errors("default"), errors("default", contactERP=0.0), errors("tuned")
    assert min(shipped) > 0.003
    assert 0.035 < max(shipped) < 0.05
    assert all(0.001 < off < 0.004 for off in (*without, *tuned))


DT_S = 1 / 240

#: Of one instant: how far along the floor and off it, how fast along and off it, and how fast the rim is.
State = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Start:
    """A disc of 1 kg on a floor: how fast it and its rim are, its friction, the slope's tangent, its inertia factor."""

    along: float
    rim: float
    friction: float
    fall: float = 0.0
    inertia: float = 0.5

    def stage(self) -> Stage:
        """Return what is to be run, with gravity along the floor and off it."""
        long = math.hypot(1.0, self.fall)
        spin, moment = self.rim / RADIUS_M, self.inertia * RADIUS_M**2
        disc = Body((0.0, RADIUS_M), (self.along, 0.0), RADIUS_M, 1.0, spin, moment)
        return Stage((disc,), (((0.0, 0.0), (0.0, 1.0)),), 1.0, 0.0, (G * self.fall / long, -G / long), self.friction)


def slide_to_roll_law(time_s: float) -> State:
    """By hand: friction takes 2 m/s^2 of the disc and gives 4 to its rim, until both are 2 m/s."""
    slid = min(time_s, 0.5)
    return 3 * slid - slid**2 + 2 * (time_s - slid), 0.0, 3 - 2 * slid, 0.0, -4 * slid


def come_back_law(time_s: float) -> State:
    """By hand: 1 m/s and a rim of 5 the other way round, until both are 1 m/s backwards."""
    slid = min(time_s, 1.0)
    return slid - slid**2 - (time_s - slid), 0.0, 1 - 2 * slid, 0.0, 5 - 4 * slid


def stop_law(time_s: float) -> State:
    """By hand: 3 m/s, of which friction takes 3 in a second."""
    slid = min(time_s, 1.0)
    return 3 * slid - 1.5 * slid**2, 0.0, 3 - 3 * slid, 0.0, 0.0


def hold_law(_time_s: float) -> State:
    """By hand: nothing happens."""
    return 0.0, 0.0, 0.0, 0.0, 0.0


def slip_law(time_s: float) -> State:
    """By hand: of 6 m/s^2 friction leaves 4.4, and turns the rim by 3.2."""
    return 2.2 * time_s**2, 0.0, 4.4 * time_s, 0.0, -3.2 * time_s


@dataclass(frozen=True)
class Case:
    """A scene, an engine's profile, its start in the engine alone, the law by hand, and the grade."""

    scene: str
    engine: str
    profile: str
    start: Start
    law: Callable[[float], State]
    grade: Grade


CASES = [
    Case("stops", "pymunk", "tuned", Start(3, 0, 0.3, inertia=math.inf), stop_law, Grade.SAMPLED),
    Case("slide-to-roll", "pymunk", "default", Start(3, 0, 0.2), slide_to_roll_law, Grade.SAMPLED),
    Case("slide-to-roll", "box2d", "default", Start(3, 0, 0.2), slide_to_roll_law, Grade.SAMPLED),
    Case("comes-back", "pybullet", "default", Start(1, 5, 0.2), come_back_law, Grade.SAMPLED),
    Case("incline-slips", "mujoco", "default", Start(0, 0, 0.2, fall=0.75), slip_law, Grade.INACCURATE),
    Case("holds", "mujoco", "default", Start(0, 0, 0.8, 0.75, math.inf), hold_law, Grade.INACCURATE),
]


@each("case", CASES)
def test_contact_errors_of_bare_engines_match_the_score(named: Named, case: Case) -> None:
    """The score's errors are those of the bare engine's run at the observed instants, to 0.1 %."""
    scene = carom.scene(f"contact/{case.scene}")
    trace = observe_run(named(case.engine), scene, case.profile, DT_S)
    score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=240.0))
    assert score.contact is not None
    steps = {round(time_s / DT_S) for time_s in require_value(trace.observed_states).time_s.tolist()} - {0}
    states = ENGINES[case.engine](case.start.stage(), case.profile, DT_S, max(steps))[:, 0]
    states = (states - (0.0, RADIUS_M, 0.0, 0.0, 0.0)) * (1.0, 1.0, 1.0, 1.0, RADIUS_M)
    off = np.array([states[k] - case.law(k * DT_S) for k in sorted(steps)])
    errors = score.contact.errors
    assert errors.place_m == pytest.approx(np.hypot(off[:, 0], off[:, 1]).max(), rel=1e-3, abs=1e-6)
    assert errors.rim_m_s == pytest.approx(np.abs(off[:, 4]).max(), rel=1e-3, abs=1e-5)
    assert errors.velocity_m_s == pytest.approx(np.hypot(off[:, 2], off[:, 3]).max(), rel=1e-3, abs=1e-5)
    if not math.isnan(score.contact.momentum_m_s):
        momentum = np.abs(off[:, 2] - 0.5 * off[:, 4]).max()
        assert score.contact.momentum_m_s == pytest.approx(momentum, rel=1e-3, abs=1e-5)
    assert score.contact.grade is case.grade
