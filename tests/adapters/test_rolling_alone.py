"""Rolling resistance in MuJoCo alone, nothing of Carom: why its adapter declares none. From eight starts each."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.long

RATE_HZ, RADIUS_M, G, STARTS = 240.0, 0.5, 10.0, 8
#: As shipped, and what makes its friction most exact.
EXACT = 'cone="elliptic" noslip_iterations="20" integrator="implicitfast"'
OPTIONS = {"shipped": "", "exact": EXACT}


def speed_of(options: str, friction: float, resists: float, seconds: float, *, tangent: float, speed: float) -> float:
    """Return how fast a disc (k = 1/2) is along a slope that begins rolling; `friction[2]` is in metres, c R."""
    engine: Any = importlib.import_module("mujoco")
    long, moment = math.hypot(1.0, tangent), 0.5 * RADIUS_M**2
    model = engine.MjModel.from_xml_string(f"""
<mujoco><option timestep="{1 / RATE_HZ}" gravity="{G * tangent / long} {-G / long} 0" {options}/><worldbody>
  <geom type="plane" size="0 0 1" zaxis="0 1 0" condim="6" friction="{friction} 0 {resists * RADIUS_M}" priority="1"
    solref="-1000 {-2 * math.sqrt(1000)}"/>
  <body pos="0 {RADIUS_M} 0"><inertial pos="0 0 0" mass="1" diaginertia="{moment} {moment} {moment}"/>
    <freejoint/><geom type="sphere" size="{RADIUS_M}"/></body></worldbody></mujoco>""")
    data = engine.MjData(model)
    data.qvel[0], data.qvel[5] = speed, -speed / RADIUS_M
    engine.mj_step(model, data, nstep=round(seconds * RATE_HZ))
    return float(data.qvel[0])


@pytest.mark.parametrize(("options", "least", "most"), [("shipped", 1.2, 5.6), ("exact", 0.15, 3.4)])
def test_what_friction_and_rolling_resistance_hold_together_slips(options: str, least: float, most: float) -> None:
    """On slopes of .3 to .79, with friction .8 and c a fiftieth above: by the law it rests, by one cone it does not."""
    for tangent in np.linspace(0.3, 0.79, STARTS).tolist():
        slipped = speed_of(OPTIONS[options], 0.8, 1.02 * tangent, 2.0, tangent=tangent, speed=0.0)
        assert least < slipped < most


@pytest.mark.parametrize(("options", "least", "most"), [("shipped", 0.70, 0.96), ("exact", 0.93, 1.001)])
def test_what_rolls_is_slowed_down_by_less_than_the_law_has_it(options: str, least: float, most: float) -> None:
    """With c of .01 to .15 and friction 1/2, of c g / (1 + k): the more of the cone is used up, the less."""
    parts = []
    for speed, resists in zip(
        np.linspace(1.5, 2.9, STARTS).tolist(), np.linspace(0.01, 0.15, STARTS).tolist(), strict=True
    ):
        left = speed_of(OPTIONS[options], 0.5, resists, 1.0, tangent=0.0, speed=speed)
        parts.append((speed - left) / (resists * G / 1.5))
    assert all(least < part < most for part in parts)
    assert parts[-1] < parts[0]
