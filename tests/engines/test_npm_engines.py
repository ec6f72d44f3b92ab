"""What engines from npm except Planck do by themselves, each beside what mechanics says."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.engines.staged import (
    PHASES,
    STARTS,
    Drive,
    Finish,
    Named,
    after_oblique,
    at_starts,
    energy_part,
    head_on,
    oblique,
)
from tests.hazards.measures import passing

from carom import Disc, Scene
from carom.adapter import Adapter, Setting
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
    for phase in PHASES:
        scene = head_on(speed_m_s, phase=phase)
        assert speeds(named(name), scene, finish, "default") == pytest.approx(shipped, abs=tolerance)
        assert speeds(named(name), scene, finish, "tuned") == pytest.approx(law, abs=SINGLE)


@pytest.mark.parametrize(
    ("pixels_a_second", "free", "locked"),
    [(60, 0.095, -1.0), (110, 0.095, -1.0), (130, 0.985, 1.0), (1200, 0.985, 1.0)],
)
def test_matter_does_not_give_back_a_slow_elastic_impact(
    pixels_a_second: float, free: float, locked: float, named: Named, finish: Finish
) -> None:
    """Below 120 pixels a second discs as shipped part at a tenth of their speed; locked ones, as if they never met.

    Above it free ones lose 1.5 % of it, to the turning of polygons; with an odd number of iterations none is undone.
    """
    matter, speed = named("matter"), pixels_a_second / 128

    def parted(scene: Scene, profile: str, **changes: Setting) -> float:
        first, second = finish(matter, scene, DT_S, profile, **changes).velocity_m_s[:, 0]
        return float(second - first) / speed

    for phase in PHASES:
        scene = head_on(speed, phase=phase).model_copy(update={"duration_s": 1.0})  # polygons meet later than circles
        assert parted(scene, "default") == pytest.approx(free, abs=0.001)
        assert parted(scene, "default", locked=True) == pytest.approx(locked, abs=1e-9)
        assert parted(scene, "default", locked=True, velocityIterations=5) == pytest.approx(1, abs=1e-9)
        assert parted(scene, "tuned") == pytest.approx(1, abs=1e-9)


def changed_by_a_miss(adapter: Adapter, profile: str, finish: Finish) -> list[float]:
    """How far velocities change, in m/s, of discs that pass each other without touching, at each start: 0 is right."""
    found = []
    for scene in at_starts(all_scenes()["classics/miss"].scene):
        end = finish(adapter, scene, DT_S, profile)
        found.append(float(np.abs(end.velocity_m_s - [disc.velocity_m_s for disc in scene.discs]).max()))
    assert len(found) == STARTS
    return found


@pytest.mark.parametrize(("name", "share"), [("box2d3", 12), ("jolt", 12), ("rapier2d", 16)])
def test_margins_as_shipped_invent_an_impact(name: str, share: int, named: Named, finish: Finish) -> None:
    """Discs that pass keep their velocities: as shipped, with margins of 2 cm, they don't in most of 16 starts."""
    assert sum(change > 0.01 for change in changed_by_a_miss(named(name), "default", finish)) >= share
    assert max(changed_by_a_miss(named(name), "tuned", finish)) < SINGLE


@pytest.mark.parametrize("name", ["planck", "matter"])
def test_engines_without_a_margin_let_discs_pass(name: str, named: Named, finish: Finish) -> None:
    """Discs that pass keep their velocities."""
    assert max(changed_by_a_miss(named(name), "default", finish)) < 1e-12


@pytest.mark.parametrize(("name", "limit_m_s"), [("box2d3", 400), ("jolt", 500), ("rapier2d", 400)])
def test_speeds_end_at_a_limit_as_shipped(name: str, limit_m_s: float, named: Named, finish: Finish) -> None:
    """A light disc sent off at 600 m/s by a heavy one moves as fast as the engine lets it; the adapter warns."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(300.3, 0), radius_m=3, mass_kg=1000)
    light = Disc(position_m=(10, 0), radius_m=3, mass_kg=1)
    for scene in at_starts(Scene(name="sling", discs=[heavy, light], duration_s=0.1, frame_rate_hz=240)):
        end = finish(named(name), scene, 1 / 240, "default")
        assert end.velocity_m_s[1, 0] == pytest.approx(limit_m_s, rel=1e-5)
        assert "slowed down" in end.warning
        tuned = finish(named(name), scene, 1 / 240, "tuned")
        assert tuned.velocity_m_s[1, 0] == pytest.approx(2 * 1000 * 300.3 / 1001, rel=1e-5)


def hits(adapter: Adapter, speed_m_s: float, finish: Finish, profile: str, both: bool = False) -> int:
    """In how many of 16 starts a disc of 5 cm sends off another, which is at rest or comes to meet it."""
    found = 0
    for phase in PHASES:
        scene = head_on(speed_m_s, 0.05, phase + 0.5 / STARTS)
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
    """At 100 m/s a disc of 5 cm hits one at rest in each of 16 starts where it is swept, and in two at most else."""
    assert hits(named(name), 100, finish, "default") <= 2
    assert hits(named(name), 100, finish, "swept") == STARTS


@pytest.mark.parametrize(
    ("name", "least", "most"), [("box2d3", 0, 2), ("jolt", 4, 12), ("planck", 16, 16), ("rapier2d", 16, 16)]
)
def test_two_discs_that_are_both_swept(name: str, least: int, most: int, named: Named, finish: Finish) -> None:
    """Closing at 100 m/s from both sides: Box2D v3 lets most of 16 starts pass, Jolt some, the others none."""
    assert least <= hits(named(name), 100, finish, "swept", both=True) <= most


def test_rapiers_continuous_detection_ignores_moving_bodies(named: Named, finish: Finish) -> None:
    """With `ccd` on, a disc of 5 cm at 100 m/s passes others that can move in most of 16 starts, as without."""
    assert hits(named("rapier2d"), 100, finish, "ccd") <= 2


#: Discs of 1 kg, one at 5 m/s and one at rest, in Box2D v3 as shipped: the greatest impulse told of any step, by start.
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


def test_impulses_told_by_box2d_v3_are_no_change_of_momentum(named: Named) -> None:
    """The disc at rest is given 5 N s, and `totalNormalImpulse` tells 5.6 to 8.4, by start: the adapter tells none."""
    named("box2d3")
    command = ["node", "--input-type=module", "-e", BARE_BOX2D]
    folder = Path(npm.__file__).parent
    found = json.loads(subprocess.run(command, cwd=folder, capture_output=True, check=True, text=True).stdout)
    assert found["given"] == pytest.approx([5] * STARTS, rel=SINGLE)
    assert min(found["told"]) == pytest.approx(5.6, abs=0.05)
    assert max(found["told"]) == pytest.approx(8.4, abs=0.05)


def test_a_cast_of_jolt_turns_the_path_rightly_and_late(named: Named, finish: Finish) -> None:
    """An oblique impact at 3, 4, 5 has its velocities to 1e-3, and the rest of its step is lost: discs lag behind."""
    for scene in at_starts(oblique()):
        end = finish(named("jolt"), scene, DT_S, "swept")
        np.testing.assert_allclose(end.velocity_m_s, after_oblique(), atol=5e-3)
        before_s = -scene.discs[0].position_m[0] / 5.0
        flight_s = scene.step_count(DT_S) * DT_S - before_s
        lag_m = np.array(after_oblique()) * flight_s + [[0, 0], [0.8, 0.6]] - end.position_m
        late_s = float((lag_m[1] * after_oblique()[1]).sum()) / 4.0**2
        assert -1e-5 < late_s < DT_S


@pytest.mark.parametrize(("name", "left"), [("box2d3", 0.1), ("jolt", 0.6), ("matter", 0.3), ("rapier2d", 0.95)])
def test_a_gas_cools_as_shipped(name: str, left: float, named: Named, finish: Finish) -> None:
    """25 elastic discs in a box lose energy in 20 s as shipped, in each of 16 starts, and this part in most of them."""
    parts = [
        energy_part(scene, finish(named(name), scene, DT_S, "default"))
        for scene in at_starts(all_scenes()["engines/gas-of-25"].scene)
    ]
    assert max(parts) < 1
    assert sorted(parts)[STARTS // 2] < left


def given_back(adapter: Adapter, finish: Finish, profile: str, mass_kg: float = 1.0, dt_s: float = DT_S) -> list[float]:
    """What part of the closing speed equal elastic discs part with, at each of 16 starts."""
    found = []
    for phase in PHASES:
        scene = head_on(5.0, phase=phase + 0.5 / STARTS, dt_s=dt_s)
        heavy = scene.model_copy(
            update={"discs": tuple(disc.model_copy(update={"mass_kg": mass_kg}) for disc in scene.discs)}
        )
        first, second = finish(adapter, heavy, dt_s, profile).velocity_m_s[:, 0]
        found.append(float(second - first) / 5.0)
    return found


def test_cannon_as_shipped_gives_back_what_a_stage_of_the_overlap_makes_of_it(named: Named, finish: Finish) -> None:
    """Of a relaxation of 3 steps: 12/13 of the impulse, and 4/13 of the overlap pushed apart, so 11/13 to 15/13.

    By the formula of the SPOOK stepper (Lacoursiere 2007) a = 4 / (h (1 + 4 d)), b = 4 d / (1 + 4 d) with d = 3; its
    softness, 4 / (h^2 k (1 + 4 d)) with k = 1e7, takes less than a thousandth of it from discs of 1 kg.
    """
    found = given_back(named("cannon"), finish, "default")
    middles = [11 / 13 + 4 / 13 * (k + 0.5) / STARTS for k in range(STARTS)]
    assert sorted(found) == pytest.approx(middles, abs=1e-3)
    assert given_back(named("cannon"), finish, "tuned") == pytest.approx([1.0] * STARTS, abs=1e-12)


def test_cannon_gives_heavy_discs_less(named: Named, finish: Finish) -> None:
    """Its springs are as stiff whatever the mass, and no impulse is above 1e6 N s: discs of 1000 t get a part back."""
    assert max(given_back(named("cannon"), finish, "default", 1e4)) < 0.4
    assert given_back(named("cannon"), finish, "tuned", 1e4) == pytest.approx([1.0] * STARTS, abs=1e-12)
    assert max(given_back(named("cannon"), finish, "tuned", 1e6)) < 0.5


def test_cannon_warns_of_an_impulse_that_it_cuts(named: Named, drive: Drive) -> None:
    """An impulse of 1e6 N s, the most that it gives, is told of; a lesser one is not."""

    def warned(mass_kg: float) -> bool:
        scene = head_on(5.0)
        discs = tuple(disc.model_copy(update={"mass_kg": mass_kg}) for disc in scene.discs)
        looks = drive(named("cannon"), scene.model_copy(update={"discs": discs}), DT_S, "tuned")
        return any("an impulse was cut" in look.warning for look in looks)

    assert warned(1e6)
    assert not warned(1e4)


@pytest.mark.parametrize(("rate_hz", "mass_kg"), [(60, 1.0), (240, 1.0), (960, 1.0), (60, 100.0)])
def test_p2_as_shipped_gives_less_back_of_a_finer_step_and_of_a_heavier_disc(
    rate_hz: int, mass_kg: float, named: Named, finish: Finish
) -> None:
    """Of the law's impulse it gives 1 / (1 + e / (2 / m)), e = 4 / (h^2 k (1 + 4 d)), k = 1e6, d = 4 (Lacoursiere)."""
    softness = 4 * rate_hz**2 / (1e6 * (1 + 4 * 4))
    given = 1 / (1 + softness / (2 / mass_kg))
    p2, dt_s = named("p2"), 1 / rate_hz
    assert given_back(p2, finish, "default", mass_kg, dt_s) == pytest.approx([2 * given - 1] * STARTS, abs=1e-3)
    assert given_back(p2, finish, "tuned", mass_kg, dt_s) == pytest.approx([1.0] * STARTS, abs=SINGLE)


@pytest.mark.parametrize(("name", "other"), [("p2", "default"), ("physx", "tuned")])
def test_some_stop_fast_discs_where_they_are_swept(name: str, other: str, named: Named, finish: Finish) -> None:
    """At 100 m/s a disc of 5 cm hits another head-on in all 16 starts where it is swept, and in two at most else."""
    for both in (False, True):
        assert hits(named(name), 100, finish, "swept", both=both) == STARTS
        assert hits(named(name), 100, finish, other, both=both) <= 2


@pytest.mark.parametrize(
    ("profile", "rate_hz", "units_per_m"),
    [("default", 30, 1), ("default", 60, 1), ("tuned", 30, 16), ("tuned", 60, 16), ("tuned", 240, 16)],
)
def test_havok_takes_a_fall_of_a_step_off_each_bounce(
    profile: str, rate_hz: int, units_per_m: int, named: Named, finish: Finish
) -> None:
    """Without gravity a disc leaves an immovable one with 9.81 units/s2 times the step less, at any speed and start."""
    lost = 9.81 / rate_hz / units_per_m
    for speed in (5.0, 20.0):
        for phase in PHASES:
            scene = head_on(speed, phase=phase + 0.5 / STARTS, dt_s=1 / rate_hz)
            held = scene.discs[1].model_copy(update={"mass_kg": math.inf})
            at_held = scene.model_copy(update={"discs": (scene.discs[0], held)})
            left = -finish(named("havok"), at_held, 1 / rate_hz, profile).velocity_m_s[0, 0]
            assert speed - left == pytest.approx(lost, abs=speed * SINGLE)


def test_havok_as_shipped_loses_bounces_at_fine_steps(named: Named, finish: Finish) -> None:
    """At 960 steps a second discs that close at 5 m/s leave together, unless its adjustment to the step is off."""
    for phase in PHASES:
        scene = head_on(5.0, phase=phase + 0.5 / STARTS, dt_s=1 / 960)
        ends = [
            finish(named("havok"), scene, 1 / 960, "default", **changes).velocity_m_s[:, 0]
            for changes in ({}, {"idealStepTime": 0.0})
        ]
        parted = [(second - first) / 5.0 for first, second in ends]
        assert parted[0] < 0.1
        assert parted[1] > 0.9


def test_havok_turns_discs_aside_that_pass_within_a_millimetre(named: Named, finish: Finish) -> None:
    """As shipped, at each of 16 starts, discs that pass at 1 mm change their velocities; none of discs 5 mm apart."""

    def turned(gap_m: float) -> list[float]:
        found = []
        for scene in at_starts(passing(gap_m)):
            end = finish(named("havok"), scene, DT_S, "default").velocity_m_s
            found.append(float(np.abs(end - [disc.velocity_m_s for disc in scene.discs]).max()))
        return found

    assert min(turned(0.001)) > 0.01
    assert max(turned(0.005)) < SINGLE


def test_physx_as_shipped_bounces_from_two_metres_a_second_on(named: Named, finish: Finish) -> None:
    """Elastic discs that close at less leave together, at each of 16 starts; `tuned` lets them exchange velocities."""
    for speed, bounces in ((1.99, False), (2.01, True)):
        for phase in PHASES:
            scene = head_on(speed, phase=phase + 0.5 / STARTS)
            law = [0, speed]
            shipped = law if bounces else [speed / 2, speed / 2]
            assert speeds(named("physx"), scene, finish, "default") == pytest.approx(shipped, abs=SINGLE)
            assert speeds(named("physx"), scene, finish, "tuned") == pytest.approx(law, abs=SINGLE)
