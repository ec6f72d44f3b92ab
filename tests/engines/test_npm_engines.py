"""Behaviour of engines from npm except Planck by themselves, compared with mechanics."""

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.engines.impact_scenes import (
    PHASES,
    STARTS,
    build_head_on_scene,
    build_oblique_scene,
    list_starts,
    velocities_after_oblique,
)
from tests.scene_builders import Drive, Finish, Named, with_discs

from carom import Disc, Scene
from carom.engines.api import Adapter
from carom_adapters import npm

DT_S = 1 / 60
HERE, NPM = Path(__file__).parent, Path(npm.__file__).parent
#: Velocities of some metres per second after an impact or two, in 32-bit floats.
SINGLE = 1e-5


@each("name, limit_m_s", [("box2d3", 400), ("jolt", 500), ("rapier2d", 400)])
def test_default_engines_limit_speeds_with_a_warning(name: str, limit_m_s: float, named: Named, finish: Finish) -> None:
    """A disc that should leave at 600 m/s has the engine's speed limit, and the adapter warns; tuned has none."""
    heavy = Disc(position_m=(0, 0), velocity_m_s=(300.3, 0), radius_m=3, mass_kg=1000)
    light = Disc(position_m=(10, 0), radius_m=3, mass_kg=1)
    for scene in list_starts(Scene(name="sling", discs=[heavy, light], duration_s=0.1, frame_rate_hz=240)):
        end = finish(named(name), scene, 1 / 240, "default")
        assert end.velocity_m_s[1, 0] == pytest.approx(limit_m_s, rel=1e-5)
        assert "slowed down" in end.warning
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


def measure_restitution(
    adapter: Adapter, finish: Finish, profile: str, mass_kg: float = 1.0, dt_s: float = DT_S
) -> list[float]:
    """What part of the closing speed equal elastic discs part with, at each of 16 starts."""
    found = []
    for phase in PHASES:
        scene = build_head_on_scene(5.0, phase=phase + 0.5 / STARTS, dt_s=dt_s)
        heavy = with_discs(scene, mass_kg=mass_kg)
        first, second = finish(adapter, heavy, dt_s, profile).velocity_m_s[:, 0]
        found.append(float(second - first) / 5.0)
    return found


def test_default_cannon_restitution_depends_on_the_overlap(named: Named, finish: Finish) -> None:
    r"""Default cannon returns 11/13 to 15/13 of the speed, by the depth of the overlap; tuned it returns all.

    By the formula of the SPOOK stepper (Lacoursiere 2007) a = 4 / (h (1 + 4 d)), b = 4 d / (1 + 4 d) with d = 3
    steps: 12/13 of the impulse, and 4/13 of the overlap. Its softness, 4 / (h^2 k (1 + 4 d)) with k = 1e7, takes
    less than a thousandth from discs of 1 kg.
    """
    found = measure_restitution(named("cannon"), finish, "default")
    middles = [11 / 13 + 4 / 13 * (k + 0.5) / STARTS for k in range(STARTS)]
    assert sorted(found) == pytest.approx(middles, abs=1e-3)
    assert measure_restitution(named("cannon"), finish, "tuned") == pytest.approx([1.0] * STARTS, abs=1e-12)


def test_cannon_warns_of_a_limited_impulse(named: Named, drive: Drive) -> None:
    """An impulse above cannon's maximum of 1e6 N s is reported as a warning; a smaller one is not."""

    def warned(mass_kg: float) -> bool:
        scene = build_head_on_scene(5.0)
        looks = drive(named("cannon"), with_discs(scene, mass_kg=mass_kg), DT_S, "tuned")
        return any("an impulse was cut" in look.warning for look in looks)

    assert warned(1e6)
    assert not warned(1e4)


@each("rate_hz, mass_kg", [(60, 1.0), (240, 1.0), (960, 1.0), (60, 100.0)])
def test_default_p2_restitution_falls_with_rate_and_mass(
    rate_hz: int, mass_kg: float, named: Named, finish: Finish
) -> None:
    """Default p2 gives 1 / (1 + e / (2 / m)) of the impulse, e = 4 / (h^2 k (1 + 4 d)); tuned, all speed."""
    softness = 4 * rate_hz**2 / (1e6 * (1 + 4 * 4))
    given = 1 / (1 + softness / (2 / mass_kg))
    p2, dt_s = named("p2"), 1 / rate_hz
    assert measure_restitution(p2, finish, "default", mass_kg, dt_s) == pytest.approx(
        [2 * given - 1] * STARTS, abs=1e-3
    )
    assert measure_restitution(p2, finish, "tuned", mass_kg, dt_s) == pytest.approx([1.0] * STARTS, abs=SINGLE)


@each(
    "profile, rate_hz, units_per_m",
    [("default", 30, 1), ("default", 60, 1), ("tuned", 30, 16), ("tuned", 60, 16), ("tuned", 240, 16)],
)
def test_havok_loses_a_step_of_gravity_per_bounce(
    profile: str, rate_hz: int, units_per_m: int, named: Named, finish: Finish
) -> None:
    """Without gravity a disc loses 9.81 units/s^2 times the step per bounce, at any speed and start."""
    lost = 9.81 / rate_hz / units_per_m
    for speed in (5.0, 20.0):
        for phase in PHASES:
            scene = build_head_on_scene(speed, phase=phase + 0.5 / STARTS, dt_s=1 / rate_hz)
            held = scene.discs[1].model_copy(update={"mass_kg": math.inf})
            at_held = scene.model_copy(update={"discs": (scene.discs[0], held)})
            left = -finish(named("havok"), at_held, 1 / rate_hz, profile).velocity_m_s[0, 0]
            assert speed - left == pytest.approx(lost, abs=speed * SINGLE)


def test_default_havok_loses_bounces_at_fine_steps(named: Named, finish: Finish) -> None:
    """At 960 steps per second discs do not rebound, unless the adjustment `idealStepTime` is 0."""
    for phase in PHASES:
        scene = build_head_on_scene(5.0, phase=phase + 0.5 / STARTS, dt_s=1 / 960)
        ends = [
            finish(named("havok"), scene, 1 / 960, "default", **changes).velocity_m_s[:, 0]
            for changes in ({}, {"idealStepTime": 0.0})
        ]
        parted = [(second - first) / 5.0 for first, second in ends]
        assert parted[0] < 0.1
        assert parted[1] > 0.9


@each("package", ["planck", "box2d3-wasm", "@dimforge/rapier2d-compat"])
def test_teleported_paddle_acts_like_a_wall_at_rest(package: str) -> None:
    """A paddle moved by its position at -1 m/s sends a disc of 2 m/s back at -2 m/s instead of -4 m/s."""
    if not (NPM / "node_modules" / package).is_dir():
        pytest.skip(f"{package} is not installed: make engines")
    program = (HERE / "put.mjs").read_text(encoding="utf-8")
    command = ["node", "--input-type=module", "--eval", program, package]
    done = subprocess.run(command, cwd=NPM, capture_output=True, text=True, check=True)
    np.testing.assert_allclose(json.loads(done.stdout), [-2.0] * 16, rtol=1e-6)


PACKAGES = Path(npm.__file__).parent / "node_modules"
HERTZ, ALONE_RADIUS_M, G, ALONE_STARTS = 240, 0.5, 10.0, 8

End = tuple[float, float, float, float, float]


def run_bare_box2d3(runs: list[dict[str, Any]]) -> list[End]:
    """Return place, velocity and spin of a disc after each run."""
    if not (PACKAGES / "box2d3-wasm").exists():
        pytest.skip("box2d3-wasm is not installed")
    usual = {
        "gravity": [0, -G], "radius": ALONE_RADIUS_M, "height": 0, "velocity": [0, 0], "spin": 0, "friction": 0.5,
        "restitution": 0, "resists": 0, "turns": True, "steps": HERTZ, "hertz": HERTZ,
    }  # fmt: skip
    asked = json.dumps({"packages": str(PACKAGES), "runs": [usual | run for run in runs]})
    command = ["node", str(Path(__file__).parent / "bare_box2d3.mjs")]
    done = subprocess.run(command, input=asked, capture_output=True, text=True, check=True)
    found: list[End] = json.loads(done.stdout)
    return found


def test_bare_box2d_v3_rolling_resistance_follows_the_law() -> None:
    """Rolling resistance of 0.01 to 0.15 slows a disc by c g t / (1 + k) in bare Box2D v3."""
    runs = [
        {"velocity": [speed, 0], "spin": -speed / ALONE_RADIUS_M, "resists": resists}
        for speed, resists in zip(
            np.linspace(1.5, 2.9, ALONE_STARTS), np.linspace(0.01, 0.15, ALONE_STARTS), strict=True
        )
    ]
    for run, end in zip(runs, run_bare_box2d3(runs), strict=True):
        assert end[2] == pytest.approx(run["velocity"][0] - run["resists"] * G / 1.5, abs=2e-4)


def test_bare_box2d_v3_rolling_resistance_holds_on_a_slope() -> None:
    """With c 5 % above the slope's tangent a disc moves by less than 0.1 mm in 2 s in bare Box2D v3."""
    runs = []
    for tangent in np.linspace(0.05, 0.19, ALONE_STARTS).tolist():
        long = math.hypot(1.0, tangent)
        runs.append({"gravity": [G * tangent / long, -G / long], "resists": 1.05 * tangent, "steps": 2 * HERTZ})
    assert all(abs(end[0]) < 1e-4 for end in run_bare_box2d3(runs))


def test_bare_box2d_v3_disc_slides_if_resistance_exceeds_friction() -> None:
    """With more rolling resistance than friction a disc slides v^2/(2 f g) without turning, to v dt / 2."""
    speeds = np.linspace(1.0, 2.4, ALONE_STARTS).tolist()
    runs = [{"velocity": [speed, 0], "friction": 0.2, "resists": 0.3, "steps": 2 * HERTZ} for speed in speeds]
    for speed, end in zip(speeds, run_bare_box2d3(runs), strict=True):
        assert abs(end[4]) < 1e-6
        assert end[0] == pytest.approx(speed**2 / 4.0, abs=0.5 * speed / HERTZ)


@each("restitution", [0.0, 0.5, 1.0])
def test_bare_box2d_v3_friction_in_a_bounce_is_too_weak(restitution: float) -> None:
    """Instead of f (1 + e) w friction takes at most f w in a bounce; with e > 0 from some starts less than half."""
    runs = [
        {
            "gravity": [0, 0], "velocity": [5.0, -into], "height": into * (4.1 + 0.1 * k) / HERTZ, "friction": 0.1,
            "restitution": restitution, "steps": 24,
        }
        for k, into in enumerate(np.linspace(2.0, 4.1, ALONE_STARTS).tolist())
    ]  # fmt: skip
    taken = []
    for run, end in zip(runs, run_bare_box2d3(runs), strict=True):
        into = -run["velocity"][1]
        assert end[3] == pytest.approx(restitution * into, abs=1e-5)
        taken.append((5.0 - end[2]) / (0.1 * (1.0 + restitution) * into))
    assert max(taken) == pytest.approx(1.0 / (1.0 + restitution), rel=1e-4)
    assert restitution == 0.0 or min(taken) < 0.5 * max(taken)
