"""What matter.js, Box2D v3, Jolt and Rapier 2D do by themselves, each beside what mechanics says."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.engines.staged import Finish, Named, after_oblique, energy_part, head_on, oblique

from carom import Disc, Scene
from carom.adapter import Adapter
from carom.scenes import all_scenes
from carom_adapters import npm

DT_S = 1 / 60
#: Velocities of some metres a second after an impact or two, in 32-bit floats.
SINGLE = 1e-5


def speeds(adapter: Adapter, scene: Scene, finish: Finish, profile: str) -> list[float]:
    """Velocities along x at the end."""
    found: list[float] = finish(adapter, scene, DT_S, profile).velocity_m_s[:, 0].tolist()
    return found


@pytest.mark.parametrize("name", ["box2d3", "jolt"])
@pytest.mark.parametrize(("speed_m_s", "bounces"), [(0.97, False), (1.03, True)])
def test_contacts_below_a_metre_a_second_are_inelastic_as_shipped(
    name: str, speed_m_s: float, bounces: bool, named: Named, finish: Finish
) -> None:
    """Elastic discs that close at less than 1 m/s leave together; `tuned` lets them exchange velocities."""
    law = [0, speed_m_s]
    shipped = law if bounces else [speed_m_s / 2, speed_m_s / 2]
    # Box2D's soft contact takes more than a step to make two velocities one.
    tolerance = 0.02 if name == "box2d3" and not bounces else SINGLE
    assert speeds(named(name), head_on(speed_m_s), finish, "default") == pytest.approx(shipped, abs=tolerance)
    assert speeds(named(name), head_on(speed_m_s), finish, "tuned") == pytest.approx(law, abs=SINGLE)


@pytest.mark.parametrize(("pixels_a_second", "bounces"), [(110, False), (130, True)])
def test_matter_undoes_a_slow_elastic_impact(
    pixels_a_second: float, bounces: bool, named: Named, finish: Finish
) -> None:
    """Below 120 pixels a second its second iteration takes back what the first did: velocities stay as they were."""
    matter = named("matter")
    speed = pixels_a_second / 128
    shipped = [0, speed] if bounces else [speed, 0]
    assert speeds(matter, head_on(speed), finish, "default") == pytest.approx(shipped, abs=1e-9)
    odd = finish(matter, head_on(speed), DT_S, "default", velocityIterations=5)
    assert odd.velocity_m_s[:, 0] == pytest.approx([0, speed], abs=1e-9)
    assert speeds(matter, head_on(speed), finish, "tuned") == pytest.approx([0, speed], abs=1e-9)


def changed_by_a_miss(adapter: Adapter, profile: str, finish: Finish) -> float:
    """How far velocities change, in m/s, where discs pass each other without touching: mechanics says 0."""
    scene = all_scenes()["classics/miss"].scene
    end = finish(adapter, scene, DT_S, profile)
    return float(np.abs(end.velocity_m_s - [disc.velocity_m_s for disc in scene.discs]).max())


@pytest.mark.parametrize("name", ["box2d3", "jolt", "rapier2d"])
def test_margins_as_shipped_invent_an_impact(name: str, named: Named, finish: Finish) -> None:
    """Discs that pass keep their velocities: as shipped, with margins of 2 cm, they don't, and without they do."""
    assert changed_by_a_miss(named(name), "default", finish) > 0.01
    assert changed_by_a_miss(named(name), "tuned", finish) < SINGLE


@pytest.mark.parametrize("name", ["planck", "matter"])
def test_engines_without_a_margin_let_discs_pass(name: str, named: Named, finish: Finish) -> None:
    """Discs that pass keep their velocities."""
    assert changed_by_a_miss(named(name), "default", finish) < 1e-12


@pytest.mark.parametrize(("name", "limit_m_s"), [("box2d3", 400), ("jolt", 500), ("rapier2d", 400)])
def test_speeds_end_at_a_limit_as_shipped(name: str, limit_m_s: float, named: Named, finish: Finish) -> None:
    """A light disc sent off at 600 m/s by a heavy one moves as fast as the engine lets it; the adapter warns."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(300.3, 0), radius_m=3, mass_kg=1000)
    scene = Scene(name="sling", discs=[heavy, Disc(position_m=(10, 0), radius_m=3, mass_kg=1)], duration_s=0.1)
    end = finish(named(name), scene, 1 / 240, "default")
    assert end.velocity_m_s[1, 0] == pytest.approx(limit_m_s, rel=1e-5)
    assert "slowed down" in end.warning
    tuned = finish(named(name), scene, 1 / 240, "tuned")
    assert tuned.velocity_m_s[1, 0] == pytest.approx(2 * 1000 * 300.3 / 1001, rel=1e-5)


def hits(adapter: Adapter, speed_m_s: float, finish: Finish, profile: str, both: bool = False) -> int:
    """In how many of eight phases of a step a disc of 5 cm sends off another, which is at rest or comes to meet it."""
    found = 0
    for phase in range(8):
        scene = head_on(speed_m_s, 0.05, (phase + 0.5) / 8)
        if both:  # seen from the middle of the two, at the same closing speed
            half = speed_m_s / 2
            discs = [
                disc.model_copy(update={"velocity_m_s": (disc.velocity_m_s[0] - half, 0.0)}) for disc in scene.discs
            ]
            scene = scene.model_copy(update={"discs": tuple(discs)})
        first, second = finish(adapter, scene, DT_S, profile).velocity_m_s[:, 0]
        found += bool(second > first)
    return found


@pytest.mark.parametrize("name", ["box2d3", "jolt", "rapier2d"])
def test_fast_discs_pass_each_other_unless_swept(name: str, named: Named, finish: Finish) -> None:
    """At 100 m/s a disc of 5 cm hits another at rest in each of eight phases of a step only where it is swept."""
    assert hits(named(name), 100, finish, "default") < 8
    assert hits(named(name), 100, finish, "swept") == 8


@pytest.mark.parametrize(
    ("name", "stopped"), [("box2d3", False), ("jolt", False), ("planck", True), ("rapier2d", True)]
)
def test_two_discs_that_are_both_swept(name: str, stopped: bool, named: Named, finish: Finish) -> None:
    """Closing at 100 m/s from both sides, as swept discs at rest are hit: Box2D v3 and Jolt let some of eight pass."""
    assert (hits(named(name), 100, finish, "swept", both=True) == 8) == stopped


def test_rapiers_continuous_detection_ignores_moving_bodies(named: Named, finish: Finish) -> None:
    """With `ccd` on, a disc of 5 cm at 100 m/s passes most others that can move, as without."""
    assert hits(named("rapier2d"), 100, finish, "ccd") < 8


#: Discs of 1 kg, one at 5 m/s and one at rest, in Box2D v3 itself as shipped; the greatest impulse told of any step.
BARE_BOX2D = """
import create from "box2d3-wasm";
const b2 = await create({ pthreadCount: 0 });
const def = b2.b2DefaultWorldDef();
def.gravity.Set(0, 0);
const world = b2.b2CreateWorld(def);
const discs = [[0, 5], [2, 0]].map(([x, v]) => {
  const body = b2.b2DefaultBodyDef();
  body.type = b2.b2BodyType.b2_dynamicBody;
  body.position.Set(x, 0);
  body.linearVelocity.Set(v, 0);
  const id = b2.b2CreateBody(world, body);
  const shape = b2.b2DefaultShapeDef();
  shape.material.restitution = 1;
  shape.density = 1 / (Math.PI / 4);
  const circle = new b2.b2Circle();
  circle.radius = 0.5;
  b2.b2CreateCircleShape(id, shape, circle);
  return id;
});
let told = 0;
for (let step = 0; step < 30; step++) {
  b2.b2World_Step(world, 1 / 60, 4);
  for (const { manifold } of b2.b2Body_GetContactData(discs[0], 4))
    for (let k = 0; k < manifold.pointCount; k++) told = Math.max(told, manifold.GetPoint(k).totalNormalImpulse);
}
console.log(JSON.stringify({ told, given: b2.b2Body_GetLinearVelocity(discs[1]).x }));
"""


def test_impulses_told_by_box2d_v3_are_no_change_of_momentum(named: Named) -> None:
    """The disc at rest is given 5 N s, and `totalNormalImpulse` tells half as much again: the adapter tells none."""
    named("box2d3")
    command = ["node", "--input-type=module", "-e", BARE_BOX2D]
    folder = Path(npm.__file__).parent
    found = json.loads(subprocess.run(command, cwd=folder, capture_output=True, check=True, text=True).stdout)
    assert found["given"] == pytest.approx(5, rel=SINGLE)
    assert found["told"] == pytest.approx(7.5, rel=1e-3)


def test_a_cast_of_jolt_turns_the_path_rightly_and_late(named: Named, finish: Finish) -> None:
    """An oblique impact at 3, 4, 5 has its velocities to 1e-3, and the rest of its step is lost: discs lag behind."""
    end = finish(named("jolt"), oblique(), DT_S, "swept")
    np.testing.assert_allclose(end.velocity_m_s, after_oblique(), atol=5e-3)
    flight_s = 0.75 - 0.377
    lag_m = np.array(after_oblique()) * flight_s + [[0, 0], [0.8, 0.6]] - end.position_m
    late_s = float((lag_m[1] * after_oblique()[1]).sum()) / 4.0**2
    assert 0 < late_s < DT_S


@pytest.mark.parametrize("name", ["box2d3", "jolt", "matter", "rapier2d"])
def test_a_gas_cools_as_shipped(name: str, named: Named, finish: Finish) -> None:
    """25 elastic discs in a box lose a twentieth of their energy in 20 s, or more, as shipped."""
    scene = all_scenes()["engines/gas-of-25"].scene
    assert energy_part(scene, finish(named(name), scene, DT_S, "default")) < 0.95
