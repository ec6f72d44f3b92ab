"""Behaviour of Planck: event-driven runs, skins of walls, limits of motion, dumps, and the search for settings."""

import json
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.engines.impact_scenes import STARTS, build_oblique_scene, list_starts, velocities_after_oblique
from tests.scene_builders import Drive, Finish, Named, require_value
from tests.unit.studies.tune.hand_written_profiles import assert_as_good, compute_merits

import carom_adapters
from carom import Disc, Scene, Wall
from carom.catalogue import all_scenes
from carom.execution.scene_import import import_scene

#: Rounding of a velocity after an impact at speeds of some metres per second.
ROUNDING = 1e-12


@each("frames", [24, 30, 60])
def test_planck_can_be_made_event_driven(frames: int, named: Named, drive: Drive) -> None:
    """With bullets and a slop of 1e-14 m an oblique impact has its exact time and velocities, from any start."""
    planck = named("planck")
    starts = list_starts(build_oblique_scene().model_copy(update={"frame_rate_hz": float(frames)}))
    assert len(starts) == STARTS
    for scene in starts:
        seen = drive(planck, scene, 1 / frames, "event-driven")
        np.testing.assert_allclose(seen[-1].velocity_m_s, velocities_after_oblique(), atol=ROUNDING)
        (contact,) = [contact for look in seen for contact in look.contacts]
        assert contact.time_s == pytest.approx(-scene.discs[0].position_m[0] / 5.0, abs=ROUNDING)
        assert contact.normal == pytest.approx((0.8, 0.6), abs=ROUNDING)


def test_default_planck_reverses_discs_1_cm_before_walls(named: Named, drive: Drive) -> None:
    """With a fine step a disc reverses 1 cm before the wall, twice the slop of 5 mm; tuned at the wall."""
    disc = Disc(position_m=(1, 0), velocity_m_s=(-2, 0), radius_m=0.5)
    scene = Scene(name="wall", discs=[disc], walls=[Wall(point_m=(0, 0), normal=(1, 0))], duration_s=0.5)
    for profile, skin_m in (("default", 0.01), ("tuned", 0.0)):
        nearest = min(look.position_m[0, 0] for look in drive(named("planck"), scene, 1e-4, profile))
        assert nearest - 0.5 == pytest.approx(skin_m, abs=2e-4)


def test_default_planck_limits_motion_to_2_m_per_step(named: Named, finish: Finish) -> None:
    """A disc that should move more than 2 m a step is slowed down to that, with a warning; tuned it is not."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(100, 0), radius_m=0.5, mass_kg=1000)
    sling = Scene(name="sling", discs=[heavy, Disc(position_m=(6, 0), radius_m=0.5, mass_kg=1)], duration_s=0.2)
    law = 2 * 1000 * 100 / 1001
    caught = 0
    for scene in list_starts(sling):
        end = finish(named("planck"), scene, 1 / 60, "default")
        hit = finish(named("planck"), scene, 1 / 60, "tuned").velocity_m_s[1, 0]
        if hit == 0 and end.velocity_m_s[1, 0] == 0:
            continue  # 1.7 m a step: it is through in some starts
        caught += 1
        assert end.velocity_m_s[1, 0] == pytest.approx(120, abs=1e-9)
        assert "slowed down" in end.warning
        assert hit == pytest.approx(law, rel=ROUNDING)
    assert caught > STARTS // 4


def test_default_planck_limits_rotation_to_a_quarter_turn(named: Named, finish: Finish) -> None:
    """A disc that a grip should spin at 120 rad/s turns by pi / 2 a step, with a warning."""
    rough = all_scenes()["spin/grip"].scene
    (disc,) = rough.discs
    fast = disc.model_copy(update={"velocity_m_s": (60 * disc.velocity_m_s[0], disc.velocity_m_s[1])})
    scene = rough.model_copy(update={"discs": (fast,), "wall_friction": 100.0})
    end = finish(named("planck"), scene, 1 / 60, "default", maxTranslation=1e100)
    assert require_value(end.spin_rad_s)[0] == pytest.approx(-math.pi / 2 * 60, rel=1e-9)
    assert "rad a step" in end.warning


DUMP = Path(__file__).parents[1] / "unit" / "engines" / "importers" / "data" / "planck-1.5.0.json"
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


def test_imported_planck_dump_equals_plancks_own_loader() -> None:
    """Position, velocity, spin, radius, mass and inertia of imported discs are those of Planck's own loader."""
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


def test_tuning_planck_is_as_good_as_its_written_profiles(named: Named) -> None:
    """On `classics` tuned settings have no more wrong and no fewer good scenes than the written profiles."""
    named("planck")
    found, written = compute_merits("planck", ["tuned", "swept", "event-driven"], 60)
    assert_as_good(found, written)
