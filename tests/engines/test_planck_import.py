"""A dump of Planck's is read as Planck's own loader reads it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

import carom_adapters
from carom.runs.imported import import_scene

DUMP = Path(__file__).parents[1] / "unit" / "runs" / "data" / "planck-1.5.0.json"
NPM = Path(carom_adapters.__file__).parent / "npm"

#: Prints place, velocity, spin, mass and inertia of each body with a circle alone, as Planck's own loader has it.
LOADED = """
import { Serializer } from "planck";
import { readFileSync } from "node:fs";
const world = Serializer.fromJson(JSON.parse(readFileSync(process.argv[1], "utf8")));
const found = [];
for (let body = world.getBodyList(); body; body = body.getNext()) {
  if (body.getFixtureList().getType() !== "circle") continue;
  const [p, v] = [body.getWorldCenter(), body.getLinearVelocity()];
  const radius = body.getFixtureList().getShape().getRadius();
  found.push([p.x, p.y, v.x, v.y, body.getAngularVelocity(), radius, body.getMass(), body.getInertia()]);
}
console.log(JSON.stringify(found));
"""


def test_what_is_imported_is_what_planck_loads() -> None:
    """Place, velocity, spin, radius, mass and moment of inertia of each disc are those of Planck's own loader."""
    if not (NPM / "node_modules" / "planck").is_dir():
        pytest.skip("planck is not installed: make engines")
    command = ["node", "--input-type=module", "-e", LOADED, str(DUMP)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=NPM)
    loaded = sorted(json.loads(done.stdout))
    discs = sorted(import_scene(DUMP).scene.discs, key=lambda disc: disc.position_m)
    assert len(loaded) == len(discs) == 2
    for (x, y, vx, vy, spin, radius, mass, inertia), disc in zip(loaded, discs, strict=True):
        assert (disc.position_m, disc.velocity_m_s, disc.spin_rad_s) == ((x, y), (vx, vy), spin)
        assert disc.radius_m == radius
        if disc.immovable:
            assert mass == 0.0  # how Planck spells it
        else:  # a product of three, and one of two more
            assert disc.mass_kg == pytest.approx(mass, rel=2**-50)
            assert disc.inertia_factor * disc.mass_kg * radius**2 == pytest.approx(inertia, rel=2**-50)
