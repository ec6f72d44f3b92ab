"""What is driven in engines beyond the four of the extras: a disc leaves it at twice its velocity less its own."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.adapters.staged import assert_begun_late, at_a_belt, at_a_paddle, with_a_late_leg
from tests.engines.staged import PHASES, Finish, Named

import carom_adapters.npm
from carom import Chain, Wall

HERE, NPM = Path(__file__).parent, Path(carom_adapters.npm.__file__).parent

#: Of engines and profiles, what of a velocity of 4 m/s is rounding.
ROUNDING_M_S = {
    ("planck", "default"): 1e-14,
    ("planck", "tuned"): 1e-14,
    ("box2d3", "default"): 2e-6,
    ("box2d3", "tuned"): 2e-6,
    ("rapier2d", "default"): 2e-6,
    ("rapier2d", "tuned"): 2e-6,
    ("rapier", "default"): 2e-6,
    ("rapier", "tuned"): 2e-6,
    ("jolt", "default"): 2e-6,
    ("jolt", "tuned"): 2e-6,
    ("physx", "default"): 2e-6,
    ("physx", "tuned"): 2e-6,
    ("havok", "tuned"): 2e-2,  # a bounce loses 9.81 m/s^2 times the step, in units of 1/16 m
    ("p2", "tuned"): 2e-6,
    ("cannon", "tuned"): 1e-14,
    ("matter", "tuned"): 1e-13,
}


@pytest.mark.parametrize("disc", [False, True])
@pytest.mark.parametrize(("name", "profile"), ROUNDING_M_S)
def test_what_is_driven_returns_a_disc_at_twice_its_velocity(
    name: str, profile: str, named: Named, finish: Finish, *, disc: bool
) -> None:
    """An edge and a disc at -1 m/s send a disc of 2 m/s back at -4 m/s, 2 V - v, at each of sixteen starts."""
    for phase in PHASES:
        seen = finish(named(name), at_a_paddle(phase, disc=disc), 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-4.0, 0.0), rtol=0, atol=ROUNDING_M_S[name, profile])


@pytest.mark.parametrize("name", dict.fromkeys(name for name, _ in ROUNDING_M_S))
def test_a_leg_begins_at_the_step_at_or_after_its_instant(name: str, named: Named, finish: Finish) -> None:
    """Sixteen instants within a step are waited for, so that what is driven is behind by its speed times that."""
    for phase in PHASES:
        seen = finish(named(name), with_a_late_leg(phase, 1 / 64), 1 / 64, "tuned")
        assert_begun_late(seen, phase > 0, 1 / 64, rounding=2e-6)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_a_belt_pushes_a_disc_that_slips_on_it(profile: str, side: int, named: Named, finish: Finish) -> None:
    """Planck pushes it by f (1 + e) v, up from the right of an edge and down from the left, and off a half-plane."""
    edge = Chain(points_m=((0.0, -5.0), (0.0, 5.0)), surface_speed_m_s=9.0)
    plane = Wall(point_m=(0.0, 0.0), normal=(side, 0.0), surface_speed_m_s=9.0)
    for wall in (edge, plane):
        for phase in PHASES:
            seen = finish(named("planck"), at_a_belt(phase, wall, side), 1 / 64, profile)
            np.testing.assert_allclose(seen.velocity_m_s[0], (3.0 * side, 1.5 * side), rtol=0, atol=1e-9)


@pytest.mark.parametrize("package", ["planck", "box2d3-wasm", "@dimforge/rapier2d-compat"])
def test_a_paddle_that_is_put_from_place_to_place_is_at_rest_for_contacts(package: str) -> None:
    """So put at -1 m/s it sends a disc of 2 m/s back at -2 m/s, at each of sixteen starts, and not at -4."""
    if not (NPM / "node_modules" / package).is_dir():
        pytest.skip(f"{package} is not installed: make engines")
    program = (HERE / "put.mjs").read_text(encoding="utf-8")
    command = ["node", "--input-type=module", "--eval", program, package]
    done = subprocess.run(command, cwd=NPM, capture_output=True, text=True, check=True)
    np.testing.assert_allclose(json.loads(done.stdout), [-2.0] * 16, rtol=1e-6)
