"""Behaviour of engines from npm except Planck, compared with mechanics."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.engines.impact_scenes import STARTS, build_oblique_scene, list_starts, velocities_after_oblique
from tests.hazards.measures import build_head_on_scene
from tests.scene_builders import Drive, Finish, Named

from carom import Disc, Scene
from carom_adapters import npm

DT_S = 1 / 60
#: Velocities of some metres per second after an impact or two, in 32-bit floats.
SINGLE = 1e-5


@each("name, limit_m_s", [("box2d3", 400), ("jolt", 500), ("rapier2d", 400), ("rapier", 400)])
def test_default_engines_limit_speeds_with_a_warning(name: str, limit_m_s: float, named: Named, finish: Finish) -> None:
    """A disc that should leave at 600 m/s has the engine's speed limit, and the adapter warns; tuned has none."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(300.3, 0), radius_m=3, mass_kg=1000)
    light = Disc(position_m=(10, 0), radius_m=3, mass_kg=1)
    for scene in list_starts(Scene(name="sling", discs=[heavy, light], duration_s=0.1, frame_rate_hz=240)):
        end = finish(named(name), scene, 1 / 240, "default")
        assert end.velocity_m_s[1, 0] == pytest.approx(limit_m_s, rel=1e-5)
        assert f"{limit_m_s:g} m/s" in end.warning
        tuned = finish(named(name), scene, 1 / 240, "tuned")
        assert tuned.velocity_m_s[1, 0] == pytest.approx(2 * 1000 * 300.3 / 1001, rel=1e-5)


#: Discs of 1 kg, one at 5 m/s and one at rest, in Box2D v3 as shipped: the greatest reported impulse of any step, by
#: start.
BARE_BOX2D = """
import create from "box2d3-wasm";
const b2 = await create({ pthreadCount: 0 });
const [toldOf, givenOf] = [[], []];
for (let start = 0; start < 16; start++) {
  const def = b2.b2DefaultWorldDef();
  def.gravity.Set(0, 0);
  const world = b2.b2CreateWorld(def);
  const discs = [[(-start * 5) / 60 / 16, 5], [2, 0]].map(([x, v]) => {
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
  toldOf.push(told);
  givenOf.push(b2.b2Body_GetLinearVelocity(discs[1]).x);
  b2.b2DestroyWorld(world);
}
console.log(JSON.stringify({ told: toldOf, given: givenOf }));
"""


def test_box2d_v3_reports_impulses_above_the_change_of_momentum(named: Named) -> None:
    """For a change of 5 N s `totalNormalImpulse` is 5.6 to 8.4 N s, by start, so the adapter reports none."""
    named("box2d3")
    command = ["node", "--input-type=module", "-e", BARE_BOX2D]
    folder = Path(npm.__file__).parent
    found = json.loads(subprocess.run(command, cwd=folder, capture_output=True, check=True, text=True).stdout)
    assert found["given"] == pytest.approx([5] * STARTS, rel=SINGLE)
    assert min(found["told"]) == pytest.approx(5.6, abs=0.05)
    assert max(found["told"]) == pytest.approx(8.4, abs=0.05)


def test_jolt_cast_gives_right_velocities_and_loses_its_step(named: Named, finish: Finish) -> None:
    """After an oblique impact velocities are right to 0.1 %, but the rest of the step is lost and discs lag."""
    for scene in list_starts(build_oblique_scene()):
        end = finish(named("jolt"), scene, DT_S, "swept")
        np.testing.assert_allclose(end.velocity_m_s, velocities_after_oblique(), atol=5e-3)
        before_s = -scene.discs[0].position_m[0] / 5.0
        flight_s = scene.step_count(DT_S) * DT_S - before_s
        lag_m = np.array(velocities_after_oblique()) * flight_s + [[0, 0], [0.8, 0.6]] - end.position_m
        late_s = float((lag_m[1] * velocities_after_oblique()[1]).sum()) / 4.0**2
        assert -1e-5 < late_s < DT_S


def test_cannon_warns_of_a_limited_impulse(named: Named, drive: Drive) -> None:
    """An impulse above cannon's maximum of 1e6 N s is reported as a warning; a smaller one is not."""

    def warned(mass_kg: float) -> bool:
        looks = drive(named("cannon"), build_head_on_scene(5.0, mass_kg=mass_kg), DT_S, "tuned")
        return any("an impulse was cut" in look.warning for look in looks)

    assert warned(1e6)
    assert not warned(1e4)
