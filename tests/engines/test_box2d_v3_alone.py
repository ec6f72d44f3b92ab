"""Box2D v3 alone, nothing of Carom: its rolling resistance is the law's, its friction in a bounce is not.

So its adapter declares neither: what rolls has friction. From eight starts each.
"""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from carom_adapters import npm

PACKAGES = Path(npm.__file__).parent / "node_modules"
HERTZ, RADIUS_M, G, STARTS = 240, 0.5, 10.0, 8

End = tuple[float, float, float, float, float]


def ended(runs: list[dict[str, Any]]) -> list[End]:
    """Return place, velocity and spin of a disc after each run."""
    if not (PACKAGES / "box2d3-wasm").exists():
        pytest.skip("box2d3-wasm is not installed")
    usual = {
        "gravity": [0, -G], "radius": RADIUS_M, "height": 0, "velocity": [0, 0], "spin": 0, "friction": 0.5,
        "restitution": 0, "resists": 0, "turns": True, "steps": HERTZ, "hertz": HERTZ,
    }  # fmt: skip
    asked = json.dumps({"packages": str(PACKAGES), "runs": [usual | run for run in runs]})
    command = ["node", str(Path(__file__).parent / "bare_box2d3.mjs")]
    done = subprocess.run(command, input=asked, capture_output=True, text=True, check=True)
    found: list[End] = json.loads(done.stdout)
    return found


def test_what_rolls_is_slowed_down_by_the_law() -> None:
    """By c g t / (1 + k), with c of .01 to .15."""
    runs = [
        {"velocity": [speed, 0], "spin": -speed / RADIUS_M, "resists": resists}
        for speed, resists in zip(np.linspace(1.5, 2.9, STARTS), np.linspace(0.01, 0.15, STARTS), strict=True)
    ]
    for run, end in zip(runs, ended(runs), strict=True):
        assert end[2] == pytest.approx(run["velocity"][0] - run["resists"] * G / 1.5, abs=2e-4)


def test_what_it_resists_stays_on_a_slope() -> None:
    """With c a twentieth above the slope's tangent it moves by less than a tenth of a millimetre in two seconds."""
    runs = []
    for tangent in np.linspace(0.05, 0.19, STARTS).tolist():
        long = math.hypot(1.0, tangent)
        runs.append({"gravity": [G * tangent / long, -G / long], "resists": 1.05 * tangent, "steps": 2 * HERTZ})
    assert all(abs(end[0]) < 1e-4 for end in ended(runs))


def test_with_more_of_it_than_of_friction_a_disc_slides_without_turning() -> None:
    """As a block: after v^2/(2 f g) it stops, to v dt / 2."""
    speeds = np.linspace(1.0, 2.4, STARTS).tolist()
    runs = [{"velocity": [speed, 0], "friction": 0.2, "resists": 0.3, "steps": 2 * HERTZ} for speed in speeds]
    for speed, end in zip(speeds, ended(runs), strict=True):
        assert abs(end[4]) < 1e-6
        assert end[0] == pytest.approx(speed**2 / 4.0, abs=0.5 * speed / HERTZ)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_in_a_bounce_friction_takes_no_more_than_of_the_way_in(restitution: float) -> None:
    """Of f (1 + e) w at most f w: where e is 1, half of Coulomb's, and of some starts a tenth."""
    runs = [
        {
            "gravity": [0, 0], "velocity": [5.0, -into], "height": into * (4.1 + 0.1 * k) / HERTZ, "friction": 0.1,
            "restitution": restitution, "steps": 24,
        }
        for k, into in enumerate(np.linspace(2.0, 4.1, STARTS).tolist())
    ]  # fmt: skip
    taken = []
    for run, end in zip(runs, ended(runs), strict=True):
        into = -run["velocity"][1]
        assert end[3] == pytest.approx(restitution * into, abs=1e-5)
        taken.append((5.0 - end[2]) / (0.1 * (1.0 + restitution) * into))
    assert max(taken) == pytest.approx(1.0 / (1.0 + restitution), rel=1e-4)
    assert restitution == 0.0 or min(taken) < 0.5 * max(taken)
