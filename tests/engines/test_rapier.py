"""What Rapier does that a user would not expect, asked of Rapier; the right answers are laws of mechanics."""

import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import Drive, Finish, Named, disc_at, staged

from carom import Disc, Scene
from carom.catalogue import find_scenes
from carom.engines.api import Adapter, Observation, Setting

#: Relative rounding of a 32-bit float.
ROUNDING = 2.0**-23


def _scene(*discs: Disc, duration_s: float = 1.0) -> Scene:
    return staged("hazard", *discs, duration_s=duration_s)


def _build_bullet_scene(phase: float, mass_kg: float) -> Scene:
    """Stage a disc of 5 cm at 100 m/s, 3 m and a part of 1/60 s before another one."""
    start = -3.0 - phase * 100 / 60
    return _scene(disc_at(start, 0, 100, r=0.05), disc_at(0, 0, r=0.05, m=mass_kg), duration_s=0.2)


def test_default_rapier_clamps_speeds_to_400_m_per_s(rapier: Adapter, finish: Finish) -> None:
    """A free body of 600 m/s is clamped to 400 m/s with a warning; tuned it keeps its speed."""
    scene = _scene(disc_at(0, 0, 600))
    shipped, tuned = (finish(rapier, scene, 1 / 64, profile) for profile in ("default", "tuned"))
    assert shipped.velocity_m_s[0, 0] == 400
    assert "400 m/s at most" in shipped.warning
    assert tuned.velocity_m_s[0, 0] == 600
    assert not tuned.warning


def test_rapier_moves_bodies_before_it_applies_restitution(rapier: Adapter, drive: Drive) -> None:
    """In the step of a bounce both discs first move with half the speed, as if e were 0, then exchange velocities."""
    dt_s = 1 / 64
    for phase in range(16):
        seen = drive(rapier, _scene(disc_at(-2 - phase / 16 * 4 * dt_s, 0, 4), disc_at(0, 0)), dt_s)
        hit = next(k for k, one in enumerate(seen) if one.contacts)
        moved = seen[hit].position_m - seen[hit - 1].position_m
        assert moved[:, 0] == pytest.approx([4 / 2 * dt_s] * 2, abs=4 * ROUNDING)
        assert seen[hit].velocity_m_s[:, 0] == pytest.approx([0, 4], abs=4 * 4 * ROUNDING)


def test_located_rapier_shortens_the_step_of_the_bounce(rapier: Adapter) -> None:
    """The step of the bounce is split, so that positions after two steps are those of an exact exchange."""
    scene = _scene(disc_at(-1, 0, 4), disc_at(0, 0))
    dt_s = 1 / 64
    world = rapier.prepare(scene, rapier.profiles["located"].settings(dt_s))
    try:
        world.advance(2)
        # The first step ends in an overlap, where the first disc stops and the second one sets off.
        assert world.observe().position_m[:, 0] == pytest.approx([-1 + 4 * dt_s, 4 * dt_s], abs=8 * ROUNDING)
    finally:
        world.close()


@pytest.mark.parametrize("phase", [k / 16 for k in range(16)])
@pytest.mark.usefixtures("rapier")
def test_rapier_ccd_stops_at_fixed_bodies(phase: float) -> None:
    """With CCD a disc that hits an immovable one returns with its speed, in each of 16 phases of a step."""
    velocity, _ = _run_with_ccd(_build_bullet_scene(phase, math.inf))
    assert velocity == pytest.approx(-100, rel=1e-5)


@pytest.mark.usefixtures("rapier")
def test_rapier_ccd_does_not_stop_at_dynamic_bodies() -> None:
    """With CCD equal discs still pass through each other in at least 12 of 16 phases."""
    ends = (_run_with_ccd(_build_bullet_scene(k / 16, 1.0)) for k in range(16))
    assert sum(velocity == 100 and other == 0 for velocity, other in ends) >= 12


def _run_with_ccd(scene: Scene) -> tuple[float, float]:
    """Run a scene in Rapier itself, with `ccd_enabled` and four substeps; return both velocities along x."""
    import rapier3d

    world: Any = rapier3d.PhysicsWorld()
    world.integration_parameters.dt = 1 / 60
    world.integration_parameters.max_ccd_substeps = 4
    bodies = []
    for disc in scene.discs:
        body = rapier3d.RigidBody.fixed() if disc.immovable else rapier3d.RigidBody.dynamic().ccd_enabled(True)
        body = body.translation((*disc.position_m, 0)).linvel((*disc.velocity_m_s, 0)).can_sleep(False)
        ball = rapier3d.Collider.ball(disc.radius_m).restitution(1.0).friction(0.0)
        bodies.append(world.add_body(body, [ball]))
    for _ in range(scene.step_count(1 / 60)):
        world.step()
    first, second = (float(world.rigid_bodies[body].linvel.x) for body in bodies)
    return first, second


def test_rapier_soft_ccd_has_wrong_directions(rapier: Adapter, finish: Finish) -> None:
    """After an oblique impact with soft CCD velocities are off by more than 5 % in at least 8 of 16 phases."""
    # Along the line of centres at the impact, (0.8, -0.6), the second disc takes 16 m/s away.
    right = np.array([16 * 0.8, 16 * -0.6])
    errors = []
    for phase in range(16):
        scene = _scene(disc_at(-3 - phase / 16 * 20 / 24, 0.6, 20), disc_at(0, 0))
        errors.append(math.dist(finish(rapier, scene, 1 / 24, "swept").velocity_m_s[1], right) / 20)
    assert sum(error > 0.05 for error in errors) >= 8
    assert max(errors) < 0.4


@pytest.mark.usefixtures("rapier")
def test_rapier_panics_if_contacts_are_detected_between_steps(capfd: pytest.CaptureFixture[str]) -> None:
    """After `detect_collisions()` between steps, Rapier's next step panics with an index out of bounds."""
    import rapier3d

    world: Any = rapier3d.PhysicsWorld()
    for x, speed in ((-2, 1), (0, 0), (2, -1)):
        body = rapier3d.RigidBody.dynamic().translation((x, 0, 0)).linvel((speed, 0, 0)).can_sleep(False)
        world.add_body(body, [rapier3d.Collider.ball(0.25).restitution(1.0).friction(0.0)])

    def step_and_ask() -> None:
        for _ in range(130):
            world.step()
            world.detect_collisions()

    with pytest.raises(BaseException, match="index out of bounds"):  # a panic is no `Exception`
        step_and_ask()
    assert "panicked" in capfd.readouterr().err


@pytest.mark.usefixtures("rapier")
def test_rapier_bodies_freeze_if_contacts_are_detected_first() -> None:
    """After `detect_collisions()` before the first step a free body never moves."""
    import rapier3d

    world: Any = rapier3d.PhysicsWorld()
    body = world.add_body(rapier3d.RigidBody.dynamic().linvel((1, 0, 0)), [rapier3d.Collider.ball(0.5)])
    world.detect_collisions()
    for _ in range(10):
        world.step()
    assert world.rigid_bodies[body].translation.x == 0


DT_S = 1 / 60
SCENES = [entry.scene for entry in find_scenes(["paper", "classics", "gravity", "engines"])]
#: What the package from npm leaves as it is shipped, and how it lifts the limit of speeds.
AS_NPM: dict[str, Setting] = {
    "static_contact_natural_frequency": 60.0,
    "length_unit": 1024.0,
    "normalized_max_linear_velocity": 400.0,
}


def list_contacts(look: Observation) -> set[tuple[object, ...]]:
    """Reported contacts of a step, in no order; normals are made unit vectors by two libraries' square roots."""
    return {
        (
            contact.first,
            contact.second,
            contact.time_s,
            contact.impulse_n_s,
            *np.asarray(contact.normal, np.float32).tolist(),
        )
        for contact in look.contacts
    }


@each("scene", SCENES)
@each("profile, changes", [("default", {}), ("tuned", AS_NPM), ("swept", AS_NPM)])
def test_rapier_wheel_and_npm_package_are_bit_identical(
    scene: Scene, profile: str, changes: dict[str, Setting], named: Named, drive: Drive
) -> None:
    """Positions, velocities and contacts of both builds are equal after every step, with equal settings."""
    plane = drive(named("rapier2d"), scene, DT_S, profile)
    space = drive(named("rapier"), scene, DT_S, profile, **changes)
    for one, other in zip(plane, space, strict=True):
        np.testing.assert_array_equal(one.position_m, other.position_m)
        np.testing.assert_array_equal(one.velocity_m_s, other.velocity_m_s)
        assert list_contacts(one) == list_contacts(other)


@each("name, same", [("paper/multiple", True), ("classics/slanted-wall", False)])
def test_tuned_rapier_builds_differ_only_with_walls(name: str, same: bool, named: Named, drive: Drive) -> None:
    """The wheel can ignore overlaps with walls and npm's build cannot; without walls both are equal."""
    (scene,) = (scene for scene in SCENES if scene.name == name)
    changes = {setting: value for setting, value in AS_NPM.items() if setting != "static_contact_natural_frequency"}
    plane = drive(named("rapier2d"), scene, DT_S, "tuned")
    space = drive(named("rapier"), scene, DT_S, "tuned", **changes)
    assert same == all((one.position_m == other.position_m).all() for one, other in zip(plane, space, strict=True))
