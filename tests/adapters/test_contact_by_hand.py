"""What the report says of engines in contact, beside the engine alone and the law by hand: six cases, nothing of Carom.

Each bare run has the disc on the line y = 0, and a slope by turning gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from tests.adapters.bare_runs import ENGINES, Body, Stage
from tests.stage import Named, sure

import carom
from carom import compare, solve_pic, solve_pit
from carom.comparator.grades import Grade
from carom.runs.observe import observe_run

pytestmark = pytest.mark.long


DT_S, RADIUS_M, G = 1 / 240, 0.5, 10.0

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


def slides_to_roll(time_s: float) -> State:
    """By hand: friction takes 2 m/s^2 of the disc and gives 4 to its rim, until both are 2 m/s."""
    slid = min(time_s, 0.5)
    return 3 * slid - slid**2 + 2 * (time_s - slid), 0.0, 3 - 2 * slid, 0.0, -4 * slid


def comes_back(time_s: float) -> State:
    """By hand: 1 m/s and a rim of 5 the other way round, until both are 1 m/s backwards."""
    slid = min(time_s, 1.0)
    return slid - slid**2 - (time_s - slid), 0.0, 1 - 2 * slid, 0.0, 5 - 4 * slid


def stops(time_s: float) -> State:
    """By hand: 3 m/s, of which friction takes 3 in a second."""
    slid = min(time_s, 1.0)
    return 3 * slid - 1.5 * slid**2, 0.0, 3 - 3 * slid, 0.0, 0.0


def holds(_time_s: float) -> State:
    """By hand: nothing happens."""
    return 0.0, 0.0, 0.0, 0.0, 0.0


def slips(time_s: float) -> State:
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
    Case("stops", "pymunk", "tuned", Start(3, 0, 0.3, inertia=math.inf), stops, Grade.SAMPLED),
    Case("slide-to-roll", "pymunk", "default", Start(3, 0, 0.2), slides_to_roll, Grade.SAMPLED),
    Case("slide-to-roll", "box2d", "default", Start(3, 0, 0.2), slides_to_roll, Grade.SAMPLED),
    Case("comes-back", "pybullet", "default", Start(1, 5, 0.2), comes_back, Grade.SAMPLED),
    Case("incline-slips", "mujoco", "default", Start(0, 0, 0.2, fall=0.75), slips, Grade.INACCURATE),
    Case("holds", "mujoco", "default", Start(0, 0, 0.8, 0.75, math.inf), holds, Grade.INACCURATE),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.scene}-{case.engine}-{case.profile}")
def test_the_engine_alone_is_off_by_as_much_as_the_report_says(named: Named, case: Case) -> None:
    """Place, velocity, rim and angular momentum, at the instants that were looked at, to 32-bit roundings."""
    scene = carom.scene(f"contact/{case.scene}")
    trace = observe_run(named(case.engine), scene, case.profile, DT_S)
    score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=240.0))
    assert score.contact is not None
    steps = {round(time_s / DT_S) for time_s in sure(trace.looks).time_s.tolist()} - {0}
    states = ENGINES[case.engine](case.start.stage(), case.profile, DT_S, max(steps))[:, 0]
    states = (states - (0.0, RADIUS_M, 0.0, 0.0, 0.0)) * (1.0, 1.0, 1.0, 1.0, RADIUS_M)
    off = np.array([states[k] - case.law(k * DT_S) for k in sorted(steps)])
    assert score.contact.own.place_m == pytest.approx(np.hypot(off[:, 0], off[:, 1]).max(), rel=1e-3, abs=1e-6)
    assert score.contact.own.rim_m_s == pytest.approx(np.abs(off[:, 4]).max(), rel=1e-3, abs=1e-5)
    assert score.contact.own.velocity_m_s == pytest.approx(np.hypot(off[:, 2], off[:, 3]).max(), rel=1e-3, abs=1e-5)
    if not math.isnan(score.contact.momentum_m_s):
        momentum = np.abs(off[:, 2] - 0.5 * off[:, 4]).max()
        assert score.contact.momentum_m_s == pytest.approx(momentum, rel=1e-3, abs=1e-5)
    assert score.contact.grade is case.grade
